//! `octofold paper`: the experiments of the papers, repeated beside their published figures.

mod chart;
mod dohi;
mod folder;
mod fujimura;
mod nishio;
mod table;
mod wakatsuki;

use crate::job::{Job, Outcome};
use anyhow::Result;

/// As typed.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    paper: Paper,
}

/// The papers whose experiments can be repeated.
#[derive(Debug, clap::Subcommand)]
enum Paper {
    /// Octree to boundary representation: Nishio, Kobori and Kutsuwa 1997, experiments 1 to 3
    Nishio(nishio::Args),
    /// Broken models to single sheets to paper: Dohi, Mitani, Nishihara and Fukui
    Dohi(dohi::Args),
    /// The network model and its compression beside the octree: Fujimura, Kobori and Kutsuwa
    Fujimura(fujimura::Args),
    /// Multi-scale patches: Wakatsuki, Ishii, Takahashi, Imai and Makino 2003, Figs. 2 and 10 to 13
    Wakatsuki(wakatsuki::Args),
}

impl Args {
    /// Repeats the experiments of one paper.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        match self.paper {
            Paper::Nishio(args) => args.run(job),
            Paper::Dohi(args) => args.run(job),
            Paper::Fujimura(args) => args.run(job),
            Paper::Wakatsuki(args) => args.run(job),
        }
    }
}

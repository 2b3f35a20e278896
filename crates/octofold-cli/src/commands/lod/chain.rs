//! `octofold lod chain`: meshes of several levels of detail in one file.

use crate::job::{Account, Job, Outcome};
use anyhow::{Result, ensure};
use octofold::Soup;
use octofold::lod::{Cut, Diagonal, Lod, Mode, drawn, settled};
use octofold::report::{Answer, ExtractFacts, LodFacts};
use octofold_io::{Format, gltf, save};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// File to read, `.oflod`
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write, `.glb`
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Meshes: the finest first, each with at most a quarter of the octants of the one before
    #[arg(long, value_name = "N", default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=16))]
    count: u32,
    /// Which edges have patches: those that are crossed; those that are crossed an odd number of times;
    /// the same with a vertex for each sheet
    #[arg(long, value_name = "MODE", default_value = "any")]
    mode: ModeArg,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum ModeArg {
    Any,
    Parity,
    Manifold,
}

const AFTER_HELP: &str = "\
The meshes stand for each other by the glTF extension MSFT_lod, with hints down to which share of a screen
of 1920 by 1080 pixels each is to be shown so that its error stays below a pixel.

Example:
  octofold lod chain bunny.oflod bunny.glb --count 5";

/// Pixels of the screen that the hints are for.
const SCREEN: [f64; 2] = [1920.0, 1080.0];

impl Args {
    /// Chooses, draws and writes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let mode = match self.mode {
            ModeArg::Any => Mode::Any,
            ModeArg::Parity => Mode::Parity,
            ModeArg::Manifold => Mode::Manifold,
        };
        let is_glb = Format::of_name(&self.output.to_string_lossy()) == Some(Format::Glb);
        ensure!(is_glb, "{}: a chain is written as .glb", self.output.display());
        let (lod, bytes) = super::open(&self.input, job)?;
        let leaves = lod.nodes().iter().filter(|node| node.children() == 0).count();
        let mut chain: Vec<(Soup, f64)> = Vec::new();
        let mut links: Vec<ExtractFacts> = Vec::new();
        for link in 0..self.count {
            let chosen = Cut::of_at_most(&lod, leaves >> (2 * link));
            let settled = settled(&lod, chosen, mode, &job.run)?;
            let (cut, found) = (&settled.cut, &settled.patches);
            let octants = cut.len() as u64;
            // Small models end before the count does.
            if found.is_empty() || links.last().is_some_and(|last| last.octants <= octants) {
                break;
            }
            let error = super::extract::largest_error(&lod, cut);
            let drawn = drawn(&lod, cut, found, mode, Diagonal::Flatter, &job.run)?;
            if let Some((finer, share)) = chain.last_mut() {
                *share = shown(finer, error);
            }
            chain.push((drawn.mesh.into(), 0.0));
            links.push(ExtractFacts {
                mode,
                octants,
                octants_by_level: cut.census(),
                patches: found.len() as u64,
                divided: settled.divided,
                missing: settled.missing,
                error,
            });
        }
        ensure!(!chain.is_empty(), "{}: it has no patches", self.input.display());
        save(&self.output, |sink| gltf::write_chain(&chain, sink, &job.run))?;
        for link in &links {
            let ExtractFacts { octants, patches, error, .. } = link;
            job.terminal.say(&format!("{octants} octants, {patches} patches, error {error:.3e}"));
        }
        let facts = facts(&lod, bytes, links);
        let answer = Some(Answer::Lod(Box::new(facts)));
        job.finish(Account { answer, ..Account::default() })?;
        Ok(Outcome::Holds)
    }
}

fn facts(lod: &Lod, bytes: u64, chain: Vec<ExtractFacts>) -> LodFacts {
    LodFacts { chain: Some(chain), ..LodFacts::of(lod, Some(bytes)) }
}

/// The share of the screen that a ball round the shape takes where an error is one pixel.
fn shown(shape: &Soup, error: f64) -> f64 {
    let [mut low, mut high] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for p in shape.points() {
        for a in 0..3 {
            (low[a], high[a]) = (low[a].min(p[a]), high[a].max(p[a]));
        }
    }
    let radius = (0..3).map(|a| (high[a] - low[a]).powi(2)).sum::<f64>().sqrt() / 2.0;
    let pixels = radius / error.max(f64::MIN_POSITIVE);
    (std::f64::consts::PI * pixels * pixels / (SCREEN[0] * SCREEN[1])).min(1.0)
}

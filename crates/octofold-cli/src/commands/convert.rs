//! `octofold convert`: the same shape in another format.

use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::Result;
use octofold::Step;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Cut polygons into triangles
    #[arg(long)]
    triangulate: bool,
}

const AFTER_HELP: &str = "\
Meshes become meshes and volumes become volumes; order, n-gons, duplicates, colours and materials
stay where the other format can hold them.

Examples:
  octofold convert scan.ply scan.glb
  octofold convert brain.nii.gz brain.nrrd
  octofold convert head.bin head.npy --dims 256x256x113 --dtype u16 --big-endian
  curl -s https://example.org/a.stl | octofold convert - a.obj --from stl";

impl Args {
    /// Converts.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let steps = if self.triangulate { vec![Step::Triangulate] } else { Vec::new() };
        job.convert(&self.input.check()?, steps, &self.output.check()?)
    }
}

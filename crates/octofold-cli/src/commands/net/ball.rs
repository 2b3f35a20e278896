//! `octofold net dilate` and `octofold net erode`: a solid grown or shrunk by a ball.

use super::LayoutArgs;
use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::Result;
use octofold::Step;
use octofold::network::ball::Ball;
use octofold::pipeline::BallOptions;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    layout: LayoutArgs,
    /// Radius of the ball, in units of the world
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    radius: f64,
}

const AFTER_HELP: &str = "\
`dilate` fills every voxel whose centre is no further than the radius from that of a filled one, and
widens the grid; `erode` keeps a voxel where all voxels so near are filled, those beyond the grid being
empty. Voxels need not be cubes.

Examples:
  octofold net dilate part.ofn wider.ofn --radius 2.5
  octofold net erode part.ofn core.ofn --radius 2.5";

impl Args {
    /// Grows or shrinks, and writes.
    pub fn run(self, ball: fn(f64) -> Ball, job: &Job) -> Result<Outcome> {
        let step = Step::Ball(BallOptions { ball: ball(self.radius) });
        let output = self.output.check()?.in_layout(self.layout.into())?;
        job.convert(&self.input.check()?, vec![step], &output)
    }
}

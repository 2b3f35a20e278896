//! `octofold simplify`: fewer faces, with guarantees.

use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use octofold::simplify::SimplifyOptions;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Triangles that are to be left
    #[arg(long, value_name = "N", conflicts_with = "ratio", required_unless_present_any = ["ratio", "error"])]
    faces: Option<u64>,
    /// Share of the triangles that is to be left, between 0 and 1
    #[arg(long, value_name = "R")]
    ratio: Option<f64>,
    /// Largest distance of any point of the result from the input, and of the input from the
    /// result, in the model's own unit
    #[arg(long, value_name = "E")]
    error: Option<f64>,
}

const AFTER_HELP: &str = "\
Edges become points, the ones first that change the shape least. Whatever the input, its topology
stays: what is closed stays closed, borders and junctions keep their shape, and no edge gets more
triangles than it had. No triangle turns over or folds onto another, and none meets another that
it did not meet before. With --error both distances are proved at each step, and again from the
written file; exit code 1 where the file's format has spoilt that. With --json the report tells
under `simplify` why it ended, what was refused and why, and both distances.

Examples:
  octofold simplify scan.ply model.ply --faces 1000
  octofold simplify scan.ply model.ply --error 0.1
  octofold simplify scan.ply model.ply --ratio 0.1 --error 0.1";

impl Args {
    /// Validates and simplifies.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        ensure!(
            self.ratio.is_none_or(|r| (0.0..=1.0).contains(&r)),
            "--ratio must be between 0 and 1"
        );
        ensure!(
            self.error.is_none_or(|e| e.is_finite() && e >= 0.0),
            "--error must not be negative"
        );
        let options = SimplifyOptions { faces: self.faces, ratio: self.ratio, error: self.error };
        let (input, output) = (self.input.check()?, self.output.check()?);
        job.simplify(&input, options, &output)
    }
}

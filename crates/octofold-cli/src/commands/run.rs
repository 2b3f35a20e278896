//! `octofold run`: the steps of a file.

use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Context, Result};
use octofold::Step;
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// JSON file with a list of steps
    #[arg(value_name = "STEPS.json")]
    steps: PathBuf,
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
}

const AFTER_HELP: &str = r#"Steps are objects with the name of the step and its options, as under `steps` in any --json report;
options that are left out have their defaults.

Example: steps.json holds
  [
    { "step": "voxelize", "size": { "resolution": 256 }, "fill": "solid" },
    { "step": "surface", "method": "mc", "normals": true }
  ]
and is run by
  octofold run steps.json scan.ply closed.stl"#;

impl Args {
    /// Reads the list and runs it.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let path = self.steps.display();
        let text = std::fs::read_to_string(&self.steps).with_context(|| path.to_string())?;
        let steps: Vec<Step> = serde_json::from_str(&text).with_context(|| {
            format!("{path}: not a list of steps (steps are {})", Step::ALL.join(", "))
        })?;
        job.convert(&self.input.check()?, steps, &self.output.check()?)
    }
}

//! `octofold lod info`: how large a model is, and how exact.

use crate::commands::info::table;
use crate::job::{Account, Job, Outcome};
use anyhow::Result;
use octofold::report::{Answer, LodFacts};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// File to read, `.oflod`
    #[arg(value_name = "IN")]
    input: PathBuf,
}

const AFTER_HELP: &str = "\
For each level the mean and the largest bound of the distance between the surface and the patches
of that level are told, in the model's own unit.

Example:
  octofold lod info bunny.oflod --json";

impl Args {
    /// Opens and tells.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let (lod, bytes) = super::open(&self.input, job)?;
        let facts = LodFacts::of(&lod, Some(bytes));
        if !job.json {
            job.answer(&table(&serde_json::to_value(&facts)?))?;
        }
        let answer = Some(Answer::Lod(Box::new(facts)));
        job.finish(Account { answer, ..Account::default() })?;
        Ok(Outcome::Holds)
    }
}

//! `octofold compare`: how far two meshes are apart.

use crate::commands::info::table;
use crate::files::ReadingArgs;
use crate::job::{Account, Job, Outcome};
use anyhow::Result;
use octofold::Shape;
use octofold::measure::compare;
use octofold::report::{Answer, ShapeMeasures};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// The first mesh
    a: PathBuf,
    /// The second mesh
    b: PathBuf,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Points that are spread over each mesh by area, beside all its vertices
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    samples: usize,
}

const AFTER_HELP: &str = "\
Distances run from the vertices of one mesh, and from points spread evenly over it, to the exact
nearest point of the other.

Example:
  octofold compare bunny.ply bunny-again.stl --json";

impl Args {
    /// Reads both and compares.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let (a, b) = (self.reading.of(&self.a)?, self.reading.of(&self.b)?);
        let a = a.open()?.read_mesh(&job.run)?;
        let b = b.open()?.read_mesh(&job.run)?;
        let comparison = compare(&a.triangulate(), &b.triangulate(), self.samples, &job.run)?;
        let mut account = Account::default();
        if job.json {
            account.input = Some(ShapeMeasures::of(&Shape::Soup(a), &job.run)?);
            account.output = Some(ShapeMeasures::of(&Shape::Soup(b), &job.run)?);
        } else {
            job.answer(&table(&serde_json::to_value(&comparison)?))?;
        }
        account.answer = Some(Answer::Comparison(comparison));
        job.finish(account)?;
        Ok(Outcome::Holds)
    }
}

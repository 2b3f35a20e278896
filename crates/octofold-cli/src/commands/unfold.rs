//! `octofold unfold`: a mesh into sheets of paper.

use crate::files::InputArgs;
use crate::job::{Account, Job, Outcome};
use crate::sheets::{SheetArgs, SheetOutputArgs, parse_length};
use anyhow::Result;
use octofold::pipeline::Shape;
use octofold::report::UnfoldReport;
use octofold::unfold::{self, UnfoldOptions, Unfolded};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: SheetOutputArgs,
    #[command(flatten)]
    sheets: SheetArgs,
    /// How far points may move so that triangles become one flat face
    #[arg(long, value_name = "LENGTH", default_value = "0.01mm", value_parser = parse_length)]
    flatness: f64,
}

const AFTER_HELP: &str = "\
Every face is printed once and in its true size. Solid lines are cut, dashed red ones folded away
from the printed side, dash-dotted blue ones towards it; equal numbers are glued together. Tabs
meet neither a face nor another tab; a seam that has no room for one gets a loose strip. Lengths
are in millimetres, or with a unit: 180mm, 18cm, 7in. An SVG has one file for each page, and the
model that it folds into beside it as OBJ.

Examples:
  octofold unfold spot.obj spot.svg
  octofold unfold house.glb house.svg --height 180mm --page a3";

impl Args {
    /// Validates and unfolds.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let input = self.input.check()?;
        let output = self.output.check(&input)?;
        let opened = input.open()?;
        let options = UnfoldOptions {
            flatness: self.flatness,
            ..self.sheets.options(opened.stands_along_y(), UnfoldOptions::default().effort)
        };
        let soup = opened.read_mesh(&job.run)?;
        let input = job.measures(&Shape::Soup(soup.clone()))?;
        let model = soup.triangulate();
        let Unfolded { pattern, account } = unfold::unfold(&model, &options, &job.run)?;
        output.write(&pattern, &model, options.up, &job.run)?;
        let line = output.line(&account, job.terminal.seconds());
        let unfold = Some(UnfoldReport { options, account });
        job.finish(Account { input, unfold, ..Account::default() })?;
        job.terminal.say(&line);
        Ok(Outcome::Holds)
    }
}

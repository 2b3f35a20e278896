//! `octofold craft`: any polygons into sheets of paper, with nothing to do by hand.

use crate::files::InputArgs;
use crate::job::{Account, Job, Outcome};
use crate::sheets::{SheetArgs, SheetOutputArgs, parse_length};
use anyhow::Result;
use octofold::craft::{self, CraftOptions, Crafted};
use octofold::pipeline::Shape;
use octofold::report::{CraftReport, UnfoldReport};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: SheetOutputArgs,
    /// The most flat faces; one or two hundred are fun to build
    #[arg(long, value_name = "N", default_value_t = 200,
        value_parser = clap::value_parser!(u64).range(4..=4000))]
    faces: u64,
    /// Cells along the longest side of the model's box, where it must be repaired [default: by its
    /// size on paper]
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(8..=2048))]
    resolution: Option<u32>,
    /// How far points may move so that faces become flat
    #[arg(long, value_name = "LENGTH", default_value = "0.5mm", value_parser = parse_length)]
    flatness: f64,
    /// Parts shorter than this are left out
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = parse_length)]
    smallest: f64,
    #[command(flatten)]
    sheets: SheetArgs,
}

const AFTER_HELP: &str = "\
Any model will do: with holes, gaps, parts that cut through each other, inner faces, sheets without
thickness. What cannot be built as it is is repaired first; then the model is reduced to as many flat
faces as asked for, unfolded, and laid out as `octofold unfold` does. Where no size is named the
model is 150 mm long, or smaller where a face would not fit a page. The same input, options and seed
give the same bytes. With --json the report tells under `craft` why the model was repaired, what was
tried and what was left out, and under `steps` what makes the unfolded mesh.

Examples:
  octofold craft house.glb house.pdf
  octofold craft house.glb house.pdf --faces 100 --height 180mm --page letter";

impl Args {
    /// Validates and makes sheets.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let input = self.input.check()?;
        let output = self.output.check(&input)?;
        let opened = input.open()?;
        let options = CraftOptions {
            faces: self.faces,
            resolution: self.resolution,
            flatness: self.flatness,
            smallest: self.smallest,
            shrink: self.sheets.is_free(),
            sheets: self.sheets.options(opened.stands_along_y(), craft::EFFORT),
        };
        let soup = opened.read_mesh(&job.run)?;
        let input = job.measures(&Shape::Soup(soup.clone()))?;
        let model = soup.triangulate();
        let Crafted { mesh, steps, account, unfolded } = craft::craft(&model, &options, &job.run)?;
        output.write(&unfolded.pattern, &model, options.sheets.up, &job.run)?;
        let measures = job.measures(&Shape::Soup(mesh.into()))?;
        let line = output.line(&unfolded.account, job.terminal.seconds());
        let unfold = Some(UnfoldReport { options: options.sheets, account: unfolded.account });
        let craft = Some(CraftReport { options, account });
        job.finish(Account {
            steps,
            input,
            output: measures,
            craft,
            unfold,
            ..Account::default()
        })?;
        job.terminal.say(&line);
        Ok(Outcome::Holds)
    }
}

//! `octofold paper dohi`: from broken models to paper, after Dohi, Mitani, Nishihara and Fukui.
//!
//! The paper shows one house whose chimney pierces the roof, and gives no figures; here it stands
//! beside other models with planted defects. Each is repaired to a closed mesh, and to single sheets
//! by the rule as published and by ours; then it is reduced, unfolded, and folded again from what is
//! on paper. A folder gets tables, pictures, sheets, all figures as JSON and CSV, and a page to look at.

mod models;
mod tables;

use super::folder::{self, Folder, figure, paragraph};
use super::table::Table;
use crate::job::{Job, Outcome};
use crate::{page, picture};
use anyhow::{Context, Result};
use models::Model;
use octofold::craft::{self, CraftAccount, CraftOptions, Crafted};
use octofold::measure::{self, Measures, Weld};
use octofold::picture::{Paint, Shading, Style, View};
use octofold::pipeline::{self, Shape, Step};
use octofold::repair::{RepairAccount, RepairOptions, SheetOptions, SheetRule};
use octofold::unfold::{UnfoldAccount, Unfolded};
use octofold::voxelize::Size;
use octofold::{Mesh, Run};
use octofold_io::{Dress, ModelColours, SheetFormat, write_sheets};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// Folder for tables, pictures, sheets and the page
    #[arg(value_name = "OUTDIR")]
    folder: PathBuf,
    /// Cells along the longest side of a model
    #[arg(long, value_name = "N", default_value_t = 96,
        value_parser = clap::value_parser!(u32).range(16..=1024))]
    resolution: u32,
    /// The most flat faces of a paper model
    #[arg(long, value_name = "N", default_value_t = 100,
        value_parser = clap::value_parser!(u64).range(4..=4000))]
    faces: u64,
}

const AFTER_HELP: &str = "\
Open index.html in OUTDIR with any browser.

Example:
  octofold paper dohi dohi";

/// What a model is made into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Mode {
    /// A closed mesh.
    Closed,
    /// Single sheets by the published rule.
    Dohi,
    /// Single sheets by ours.
    Sheets,
}

impl Mode {
    const ALL: [Self; 3] = [Self::Closed, Self::Dohi, Self::Sheets];

    fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::Dohi => "dohi",
            Self::Sheets => "sheets",
        }
    }

    fn step(self, resolution: u32) -> Step {
        let repair = RepairOptions { size: Size::Resolution(resolution), ..Default::default() };
        let sheets = |rule| Step::Sheets(SheetOptions { repair, rule, ..Default::default() });
        match self {
            Self::Closed => Step::Repair(repair),
            Self::Dohi => sheets(SheetRule::Dohi),
            Self::Sheets => sheets(SheetRule::Collapse),
        }
    }
}

/// One repair of one model.
#[derive(Debug, Clone, Serialize)]
struct Repaired {
    mode: Mode,
    seconds: f64,
    /// Area as a share of that of the sheets that the model stands for.
    area: Option<f64>,
    measures: Measures,
    account: RepairAccount,
}

/// A model on paper.
#[derive(Debug, Clone, Serialize)]
struct OnPaper {
    seconds: f64,
    /// Area on paper as a share of that of the sheets that the model stands for.
    area: Option<f64>,
    /// Furthest that a corner is off when the sheets are folded again, in millimetres.
    refolded: f64,
    craft: CraftAccount,
    unfold: UnfoldAccount,
}

/// All that was done with a model.
#[derive(Debug, Clone, Serialize)]
struct Trial {
    model: &'static str,
    about: &'static str,
    input: Measures,
    repaired: Vec<Repaired>,
    paper: OnPaper,
}

/// The folder.
struct Desk {
    folder: Folder,
    /// Stops with the job; findings of single trials stay out of its report.
    run: Run,
    resolution: u32,
    faces: u64,
}

impl Args {
    /// Runs the trials and writes the folder.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let Self { folder, resolution, faces } = self;
        let folder = Folder::create(folder)?;
        let run = Run { cancel: job.run.cancel.clone(), ..Run::default() };
        let desk = Desk { folder, run, resolution, faces };
        let models = models::all();
        job.run.stage("experiments");
        let mut trials = Vec::new();
        for model in &models {
            job.run.check()?;
            let trial = desk.trial(model).with_context(|| model.name.to_string())?;
            trials.push(trial);
            job.run.progress(trials.len() as u64, models.len() as u64);
        }
        let tables = tables::all(&trials);
        let (results, csv) = (desk.results(&trials), tables::csv(&trials));
        let body = desk.body(&trials, &tables);
        desk.folder.finish(job, "Dohi, Mitani, Nishihara and Fukui", &tables, &results, &csv, &body)
    }
}

impl Desk {
    fn trial(&self, model: &Model) -> Result<Trial> {
        self.draw(&model.mesh, &format!("{}-input.png", model.name), Paint::Own)?;
        let input = measure::measure(&model.mesh, Weld::Exact, &self.run)?;
        let repaired =
            Mode::ALL.into_iter().map(|mode| self.repaired(model, mode)).collect::<Result<_>>()?;
        let paper = self.paper(model)?;
        Ok(Trial { model: model.name, about: model.about, input, repaired, paper })
    }

    fn repaired(&self, model: &Model, mode: Mode) -> Result<Repaired> {
        let begin = Instant::now();
        let step = [mode.step(self.resolution)];
        let made = pipeline::pipeline(Shape::Soup(model.mesh.clone().into()), &step, &self.run)?;
        let seconds = begin.elapsed().as_secs_f64();
        let Shape::Soup(soup) = made.shape else { anyhow::bail!("a repair gives a mesh") };
        let mesh = soup.triangulate();
        self.draw(&mesh, &format!("{}-{}.png", model.name, mode.name()), Paint::Own)?;
        let measures = measure::measure(&mesh, Weld::Exact, &self.run)?;
        Ok(Repaired {
            mode,
            seconds,
            area: model.sheet.map(|sheet| measures.area / sheet),
            measures,
            account: made.repair.context("a repair tells of itself")?,
        })
    }

    fn paper(&self, model: &Model) -> Result<OnPaper> {
        let options = CraftOptions {
            faces: self.faces,
            resolution: Some(self.resolution),
            ..CraftOptions::default()
        };
        let begin = Instant::now();
        let Crafted { mesh, account, unfolded, .. } =
            craft::craft(&model.mesh, &options, &self.run)?;
        let seconds = begin.elapsed().as_secs_f64();
        let area = measure::Extent::of(&mesh, &self.run)?.area;
        self.draw(&mesh, &format!("{}-reduced.png", model.name), Paint::Own)?;
        let Unfolded { pattern, account: unfold } = unfolded;
        let dress = Dress { colours: ModelColours::new(&model.mesh), ..Dress::default() };
        for format in [SheetFormat::Svg, SheetFormat::Pdf] {
            let name = format!("{}-sheets.{}", model.name, format.name());
            let path = self.folder.path(&name);
            write_sheets(&pattern, &dress, &path, format, &self.run)?;
        }
        let folded = pattern.folded();
        self.draw(&folded.mesh, &format!("{}-folded.png", model.name), Paint::Labels)?;
        Ok(OnPaper {
            seconds,
            area: model.sheet.map(|sheet| area / sheet),
            refolded: folded.error,
            craft: account,
            unfold,
        })
    }

    fn draw(&self, mesh: &Mesh, name: &str, paint: Paint) -> Result<()> {
        let style = Style {
            shading: Shading::Flat,
            wireframe: (mesh.triangles.len() < MOST_LINES).then_some(Style::INK),
            boundary: Some(Style::RED),
            paint,
            // Sheets show both sides.
            back: None,
            ..Style::default()
        };
        let view = View::default().sized(560, 480);
        picture::draw_mesh(mesh, &view, &style, &self.folder.path(name), &self.run)
    }

    fn results<'a>(&self, trials: &'a [Trial]) -> impl Serialize + use<'a> {
        #[derive(Serialize)]
        struct Results<'a> {
            version: &'static str,
            paper: &'static str,
            resolution: u32,
            faces: u64,
            trials: &'a [Trial],
        }
        Results {
            version: env!("CARGO_PKG_VERSION"),
            paper: "Dohi, Mitani, Nishihara, Fukui",
            resolution: self.resolution,
            faces: self.faces,
            trials,
        }
    }

    fn body(&self, trials: &[Trial], tables: &[Table]) -> String {
        let scenes: String = trials.iter().map(scene).collect();
        format!(
            "<h1>From broken models to paper</h1>\n{}{}{scenes}{}",
            paragraph(
                "After Dohi, Mitani, Nishihara and Fukui, who took one house with a chimney through \
                 its roof from a broken model to paper, with half an hour of work by hand. Here \
                 nothing is done by hand."
            ),
            paragraph(&format!(
                "Each model is repaired at {} cells to a closed mesh, to single sheets by the \
                 published rule, and to single sheets by ours; then reduced to {} flat faces at \
                 most, unfolded at 150 mm, and folded again from what stands on the sheets. Edges with \
                 a single face are red.",
                self.resolution, self.faces
            )),
            folder::tables(tables),
        )
    }
}

/// Pictures of meshes with more triangles show no lines.
const MOST_LINES: usize = 2000;

/// What a page shows of a model.
fn scene(trial: &Trial) -> String {
    let name = trial.model;
    let stage = |stage: &str, caption: &str| figure(&format!("{name}-{stage}.png"), caption);
    let pages = trial.paper.unfold.pages;
    let sheets = (1..=pages).map(|page| {
        let number = if pages > 1 { format!("-{page}") } else { String::new() };
        figure(&format!("{name}-sheets{number}.svg"), &format!("sheet {page} of {pages}"))
    });
    format!(
        "<h2>{name}</h2>\n<p>{}</p>\n<div class=\"grid\">\n{}{}{}{}{}{}</div>\n\
         <div class=\"grid\">\n{}</div>\n<p><a href=\"{name}-sheets.pdf\">{name}-sheets.pdf</a></p>\n",
        page::escape(trial.about),
        stage("input", "as it came"),
        stage("closed", "closed"),
        stage("dohi", "sheets, as published"),
        stage("sheets", "sheets"),
        stage("reduced", "reduced and flattened"),
        stage("folded", "folded again, a colour for each piece"),
        sheets.collect::<String>(),
    )
}

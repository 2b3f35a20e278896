//! `octofold paper nishio`: experiments 1 to 3 of Nishio, Kobori and Kutsuwa 1997.
//!
//! The shapes of the paper are published without dimensions; built-in shapes stand in for them.
//! Every method converts the same samples; a folder gets tables, charts, pictures, all figures as
//! JSON and CSV, and a page to look at.

mod published;
mod tables;

use super::chart::{Axes, Series, chart};
use super::folder::{self, Folder, figure, gallery, paragraph};
use super::table::Table;
use crate::job::{Job, Outcome};
use crate::picture;
use anyhow::{Context, Result, ensure};
use octofold::measure::{self, Extent, Measures, Weld};
use octofold::picture::{Shading, Style, View};
use octofold::samples::Sample;
use octofold::surface::{
    Certificate, Inside, Method, OctreeAccount, Surface, SurfaceAccount, SurfaceOptions, surface,
};
use octofold::volume::{DenseVolume, Region};
use octofold::{Mesh, Run, Volume};
use serde::Serialize;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Instant;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// Folder for tables, charts, pictures and the page
    #[arg(value_name = "OUTDIR")]
    folder: PathBuf,
    /// Levels to convert: N, or A..B with both ends; level L has 2^L cells along an axis
    #[arg(long, value_name = "A..B", default_value = "4..8", value_parser = parse_levels)]
    levels: RangeInclusive<u32>,
}

const AFTER_HELP: &str = "\
Open index.html in OUTDIR with any browser. Levels 4 to 8 are those of the paper; each level above
takes about five times as long as the one below.

Examples:
  octofold paper nishio nishio
  octofold paper nishio nishio --levels 4..10";

/// Levels that can be asked for.
const LEVELS: RangeInclusive<u32> = 2..=11;
/// The last level whose samples are held in memory; above it every method reads the shape itself.
const MOST_HELD: u32 = 9;
/// Wireframes of finer levels are but ink.
const PICTURED: u32 = 7;
/// A conversion is repeated, and the least time taken, until it took so long in all.
const TIMED_SECONDS: f64 = 0.2;
const MOST_TIMED: usize = 5;

/// Stand-ins for the part of Fig. 11.
const PARTS: [Sample; 5] =
    [Sample::PartA, Sample::PartB, Sample::PartC, Sample::PartD, Sample::PartE];
/// Stand-ins for the products of Fig. 12 to 14.
const PRODUCTS: [Sample; 3] = [Sample::HairDryer, Sample::Kettle, Sample::TapeCutter];

fn parse_levels(text: &str) -> Result<RangeInclusive<u32>> {
    let number = |text: &str| text.parse().with_context(|| format!("`{text}` is no level"));
    let levels = match text.split_once("..") {
        Some((first, last)) => number(first)?..=number(last.trim_start_matches('='))?,
        None => number(text)?..=number(text)?,
    };
    ensure!(!levels.is_empty(), "the first level is above the last");
    let (least, most) = (LEVELS.start(), LEVELS.end());
    let fits = LEVELS.contains(levels.start()) && LEVELS.contains(levels.end());
    ensure!(fits, "levels are {least} to {most}");
    Ok(levels)
}

/// One conversion of one shape at one level by one method.
#[derive(Debug, Clone, Serialize)]
struct Trial {
    #[serde(serialize_with = "as_name")]
    shape: Sample,
    level: u32,
    method: Method,
    /// Time of the conversion from samples to mesh.
    seconds: f64,
    /// Volume inside, summed over the triangles whether they are closed or not.
    volume: f64,
    /// How far that is from marching cubes' volume, in percent of it.
    volume_error: Option<f64>,
    /// The same before the collapse, of certified TEL.
    octant_volume_error: Option<f64>,
    /// What the method tells of itself.
    account: Option<SurfaceAccount>,
    measures: Measures,
}

fn as_name<S: serde::Serializer>(sample: &Sample, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(sample.name())
}

impl Trial {
    fn octree(&self) -> Option<&OctreeAccount> {
        self.account.as_ref().and_then(SurfaceAccount::octree)
    }

    fn certificate(&self) -> Option<&Certificate> {
        self.account.as_ref().and_then(SurfaceAccount::certificate)
    }

    /// Triangles as the paper counted them: before cracks are filled.
    fn triangles(&self) -> usize {
        self.octree().map_or(self.measures.triangles, |o| o.raw.triangles)
    }

    /// Triangles before the collapse, of certified TEL.
    fn octant_triangles(&self) -> Option<u64> {
        self.certificate().map(|c| c.octant_triangles)
    }

    fn octants(&self) -> Option<u64> {
        let certified = || self.certificate().map(|c| c.octants.iter().sum());
        self.octree().map(|o| o.octants).or_else(certified)
    }
}

/// The folder and its figures.
struct Desk<'a> {
    folder: Folder,
    job: &'a Job,
    /// Stops with the job; findings of single conversions stay out of its report.
    run: Run,
    levels: RangeInclusive<u32>,
}

impl Args {
    /// Runs the experiments and writes the folder.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let Self { folder, levels } = self;
        let folder = Folder::create(folder)?;
        let run = Run { cancel: job.run.cancel.clone(), ..Run::default() };
        let desk = Desk { folder, job, run, levels };
        let trials = desk.trials()?;
        let tables = tables::all(&trials);
        let charts = desk.charts(&trials)?;
        let (results, csv) = (desk.results(&trials), tables::csv(&trials));
        let body = desk.body(&tables, &charts);
        desk.folder.finish(job, "Nishio, Kobori and Kutsuwa 1997", &tables, &results, &csv, &body)
    }
}

impl Desk<'_> {
    fn trials(&self) -> Result<Vec<Trial>> {
        let shapes = PARTS.iter().chain(&PRODUCTS);
        let total = shapes.clone().count() * self.levels.clone().count() * Method::ALL.len();
        self.job.run.stage("experiments");
        let mut trials = Vec::new();
        for &shape in shapes {
            for level in self.levels.clone() {
                let samples = samples(shape, level)?;
                let first = trials.len();
                for method in Method::ALL {
                    self.job.run.check()?;
                    trials.push(self.trial(shape, level, method, samples.as_ref())?);
                    self.job.run.progress(trials.len() as u64, total as u64);
                }
                let same = &mut trials[first..];
                let cubes = same.iter().find(|t| t.method == Method::Cubes).map(|t| t.volume);
                for trial in same {
                    trial.volume_error = cubes.map(|c| 100.0 * (trial.volume / c - 1.0));
                }
            }
        }
        Ok(trials)
    }

    fn trial(
        &self,
        shape: Sample,
        level: u32,
        method: Method,
        samples: &dyn Volume,
    ) -> Result<Trial> {
        let options = SurfaceOptions {
            method,
            iso: Some(0.0),
            inside: Inside::Below,
            ..SurfaceOptions::default()
        };
        let (mut seconds, mut spent, mut times) = (f64::INFINITY, 0.0, 0);
        let Surface { mesh, account } = loop {
            let begin = Instant::now();
            let made = surface(samples, &options, &self.run)?;
            let took = begin.elapsed().as_secs_f64();
            (seconds, spent, times) = (seconds.min(took), spent + took, times + 1);
            if spent > TIMED_SECONDS || times == MOST_TIMED {
                break made;
            }
        };
        if level == self.pictured() {
            self.draw(&mesh, &picture_name(shape, method))?;
        }
        let certificate = account.as_ref().and_then(SurfaceAccount::certificate);
        let volumes = certificate.and_then(|c| c.octant_volume.zip(c.reference_volume));
        Ok(Trial {
            octant_volume_error: volumes.map(|(octants, cubes)| 100.0 * (octants / cubes - 1.0)),
            shape,
            level,
            method,
            seconds,
            volume: Extent::of(&mesh, &self.run)?.volume,
            volume_error: None,
            account,
            measures: measure::measure(&mesh, Weld::Off, &self.run)?,
        })
    }

    /// The level that pictures show.
    fn pictured(&self) -> u32 {
        PICTURED.clamp(*self.levels.start(), *self.levels.end())
    }

    fn draw(&self, mesh: &Mesh, name: &str) -> Result<()> {
        let style = Style {
            shading: Shading::Flat,
            wireframe: Some(Style::INK),
            boundary: Some(Style::RED),
            ..Style::default()
        };
        let view = View::default().sized(640, 560);
        picture::draw_mesh(mesh, &view, &style, &self.folder.path(name), &self.run)
    }

    /// Writes the charts; titles and file names.
    fn charts(&self, trials: &[Trial]) -> Result<Vec<String>> {
        let mut names = Vec::new();
        for shape in [Sample::PartE, Sample::PartA] {
            for (what, title) in tables::CURVES {
                let series = curves(trials, shape, what);
                let title = format!("{title}, {}", shape.name());
                if let Some(svg) = chart(&title, Axes::Levels, &series)? {
                    let name = format!("{}-{}.svg", shape.name(), what.name());
                    self.folder.write(&name, svg.as_bytes())?;
                    names.push(name);
                }
            }
        }
        Ok(names)
    }

    fn results<'a>(&self, trials: &'a [Trial]) -> impl Serialize + use<'a> {
        #[derive(Serialize)]
        struct Results<'a> {
            version: &'static str,
            paper: &'static str,
            published_part: [(u32, published::Row, published::Row); 4],
            published_products: Vec<(&'static str, published::Row)>,
            published_volume_errors: Vec<(&'static str, [f64; 2])>,
            trials: &'a [Trial],
        }
        let products = published::PRODUCTS.iter().map(|(s, row)| (s.name(), *row));
        let volumes = published::VOLUMES.iter().map(|(s, amc, tel)| (s.name(), [*amc, *tel]));
        Results {
            version: env!("CARGO_PKG_VERSION"),
            paper: "Nishio, Kobori, Kutsuwa 1997",
            published_part: published::PART,
            published_products: products.collect(),
            published_volume_errors: volumes.collect(),
            trials,
        }
    }

    fn body(&self, tables: &[Table], charts: &[String]) -> String {
        let images: String = charts.iter().map(|name| figure(name, "")).collect();
        let figures: String = PARTS.iter().chain(&PRODUCTS).map(|&s| self.figures(s)).collect();
        format!(
            "<h1>Octree to boundary representation</h1>\n{}{}<h2>Figures over levels</h2>\n{}{}\
             <h2>Wireframes at level {}</h2>\n{}{figures}",
            paragraph(
                "Experiments 1 to 3 of Nishio, Kobori and Kutsuwa 1997, repeated beside the \
                 published figures. The paper gives no dimensions for its shapes; built-in shapes \
                 stand in for them, sampled at the corners of 2^level cells along an axis. \
                 Published times are those of an SGI Indy (R4400, 150 MHz)."
            ),
            paragraph(
                "mc is marching cubes, amc adaptive marching cubes, tel the method of the paper as \
                 published. As in the paper, triangles of amc and tel are counted before cracks \
                 are filled; the last table tells what filling leaves open. Raw figures of ctel are \
                 those before the collapse."
            ),
            gallery(&images),
            folder::tables(tables),
            self.pictured(),
            paragraph("Edges of a single triangle, which filling left open, are red."),
        )
    }

    fn figures(&self, shape: Sample) -> String {
        let of = |method: Method| figure(&picture_name(shape, method), method.name());
        let figures: String = Method::ALL.into_iter().map(of).collect();
        format!("<h3>{}</h3>\n{}", shape.name(), gallery(&figures))
    }
}

fn picture_name(shape: Sample, method: Method) -> String {
    format!("{}-{}.png", shape.name(), method.name())
}

/// The samples of a shape, in memory where there is room for them.
fn samples(shape: Sample, level: u32) -> Result<Box<dyn Volume>> {
    let field = shape.volume(1 << level).context("the shape is a solid")?;
    if level > MOST_HELD {
        return Ok(Box::new(field));
    }
    let block = field.read(Region::all(field.dims()))?;
    let values = (0..block.len()).map(|i| block.value(i) as f32).collect();
    let dense = DenseVolume::new(field.dims(), values, field.placement());
    Ok(Box::new(dense.context("the block is whole")?))
}

/// One line for each method, and the published ones.
fn curves(trials: &[Trial], shape: Sample, what: tables::Curve) -> Vec<Series> {
    let published = [(Method::Adaptive, 0), (Method::Tel, 1)].map(|(method, column)| Series {
        name: format!("{} as published", method.name()),
        colour: colour(method),
        published: true,
        points: published::PART
            .iter()
            .map(|&(level, amc, tel)| (level.into(), what.published([amc, tel][column])))
            .collect(),
    });
    let ours = Method::ALL.map(|method| Series {
        name: method.name().into(),
        colour: colour(method),
        published: false,
        points: trials
            .iter()
            .filter(|t| t.shape == shape && t.method == method)
            .filter_map(|t| Some((t.level.into(), what.value(t)?)))
            .collect(),
    });
    let drawn = |s: &Series| !s.points.is_empty();
    published.into_iter().chain(ours).filter(drawn).collect()
}

fn colour(method: Method) -> [u8; 3] {
    match method {
        Method::Certified => [176, 42, 88],
        Method::Cubes => [120, 128, 138],
        Method::Adaptive => [214, 122, 32],
        Method::Tel => [38, 102, 190],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_one_or_a_range() {
        assert_eq!(parse_levels("7").unwrap(), 7..=7);
        assert_eq!(parse_levels("4..11").unwrap(), 4..=11);
        for wrong in ["", "4..", "8..4", "1..4", "4..12", "four"] {
            assert!(parse_levels(wrong).is_err(), "{wrong}");
        }
    }
}

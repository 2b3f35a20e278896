//! `octofold paper fujimura`: the experiment of Fujimura, Kobori and Kutsuwa.
//!
//! Six primitives, eight products and six combinations as networks and as octrees, from the same
//! voxels: how many data, how many bytes, how much time, and how both grow. The paper draws its
//! shapes without dimensions; built-in shapes stand in for them, off the grid by a part of a voxel,
//! and once more turned, since axis-parallel planes are what the published compression lives on. A
//! folder gets tables, charts, all figures as JSON and CSV, and a page to look at.

mod tables;
mod trial;

use super::chart::{Axes, Series, chart};
use super::folder::{self, Folder, figure, gallery, paragraph};
use super::table::Table;
use crate::job::{Job, Outcome};
use anyhow::{Context, Result, ensure};
use octofold::Run;
use octofold::network::compress::Reading;
use octofold::samples::Sample;
use serde::Serialize;
use std::path::PathBuf;
use trial::{Position, Trial};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// Folder for tables, charts and the page
    #[arg(value_name = "OUTDIR")]
    folder: PathBuf,
    /// Voxels along an axis of the coarsest grid; each next one has twice as many
    #[arg(long, value_name = "N", default_value_t = 32)]
    from: usize,
    /// Voxels along an axis of the finest grid
    #[arg(long, value_name = "N", default_value_t = 512)]
    to: usize,
    /// Only these shapes, with commas between them
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    shapes: Vec<String>,
}

const AFTER_HELP: &str = "\
Open index.html in OUTDIR with any browser. Grids of 32 to 512 voxels along an axis are those of the
paper; beyond them a grid takes four times as long as the one before.

Examples:
  octofold paper fujimura fujimura
  octofold paper fujimura fujimura --from 1024 --to 4096 --shapes bracket";

/// Voxels along an axis that can be asked for.
const LEAST: usize = 16;
const MOST: usize = 4096;

/// Primitives, products and combinations, as in the paper.
const SHAPES: [Sample; 20] = [
    Sample::Sphere,
    Sample::Cube,
    Sample::Cylinder,
    Sample::Cone,
    Sample::Tetrahedron,
    Sample::Prism,
    Sample::HairDryer,
    Sample::Kettle,
    Sample::TapeCutter,
    Sample::Camera,
    Sample::Computer,
    Sample::Telephone,
    Sample::Bracket,
    Sample::Gear,
    Sample::Csg1,
    Sample::Csg2,
    Sample::Csg3,
    Sample::Csg4,
    Sample::Csg5,
    Sample::Csg6,
];

/// What the paper tells: the data of a compressed network as a share of the octree's.
const PUBLISHED: [f64; 2] = [0.11, 0.17];

/// The folder.
struct Desk<'a> {
    folder: Folder,
    job: &'a Job,
    /// Stops with the job; findings of single trials stay out of its report.
    run: Run,
    shapes: Vec<Sample>,
    resolutions: Vec<usize>,
}

impl Args {
    /// Runs the experiment and writes the folder.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let resolutions = self.resolutions()?;
        let shapes = self.shapes()?;
        let folder = Folder::create(self.folder)?;
        let run = Run { cancel: job.run.cancel.clone(), ..Run::default() };
        let desk = Desk { folder, job, run, shapes, resolutions };
        let trials = desk.trials()?;
        let tables = tables::all(&trials);
        let charts = desk.charts(&trials)?;
        let (results, csv) = (desk.results(&trials), tables::csv(&trials));
        let body = desk.body(&tables, &charts);
        desk.folder.finish(job, "Fujimura, Kobori and Kutsuwa", &tables, &results, &csv, &body)
    }

    fn resolutions(&self) -> Result<Vec<usize>> {
        let Self { from, to, .. } = *self;
        let fits = |n: usize| (LEAST..=MOST).contains(&n);
        ensure!(fits(from) && fits(to), "--from and --to are {LEAST} to {MOST} voxels");
        ensure!(from <= to, "--from is above --to");
        Ok(std::iter::successors(Some(from), |n| Some(2 * n)).take_while(|&n| n <= to).collect())
    }

    fn shapes(&self) -> Result<Vec<Sample>> {
        if self.shapes.is_empty() {
            return Ok(SHAPES.to_vec());
        }
        let shape = |name: &String| {
            let found = SHAPES.into_iter().find(|s| s.name() == name);
            found.with_context(|| {
                let names = SHAPES.map(Sample::name).join(", ");
                format!("`{name}` is none of the shapes of the experiment: {names}")
            })
        };
        self.shapes.iter().map(shape).collect()
    }
}

impl Desk<'_> {
    fn trials(&self) -> Result<Vec<Trial>> {
        let total = self.shapes.len() * Position::ALL.len() * self.resolutions.len();
        self.job.run.stage("experiments");
        let mut trials = Vec::new();
        for &shape in &self.shapes {
            for position in Position::ALL {
                for &resolution in &self.resolutions {
                    self.job.run.check()?;
                    trials.push(Trial::new(shape, position, resolution, &self.run)?);
                    self.job.run.progress(trials.len() as u64, total as u64);
                }
            }
        }
        Ok(trials)
    }

    /// Writes the charts; their file names.
    fn charts(&self, trials: &[Trial]) -> Result<Vec<String>> {
        let mut names = Vec::new();
        let mut add = |name: &str, title: &str, series: &[Series]| -> Result<()> {
            if let Some(svg) = chart(title, Axes::Levels, series)? {
                self.folder.write(name, svg.as_bytes())?;
                names.push(name.to_string());
            }
            Ok(())
        };
        for position in Position::ALL {
            let name = position.name();
            let data = self.shares(trials, position);
            add(
                &format!("data-{name}.svg"),
                &format!("Data in percent of the octree's, {name}"),
                &data,
            )?;
            let times = self.times(trials, position);
            add(&format!("seconds-{name}.svg"), &format!("Seconds on the mean, {name}"), &times)?;
        }
        Ok(names)
    }

    /// Means over the shapes as a line over levels.
    fn line(
        &self,
        name: String,
        colour: [u8; 3],
        trials: &[Trial],
        position: Position,
        value: impl Fn(&Trial) -> Option<f64>,
    ) -> Series {
        let point =
            |&n: &usize| Some((f64::from(n.ilog2()), tables::mean(trials, position, n, &value)?));
        let points = self.resolutions.iter().filter_map(point).collect();
        Series { name, colour, published: false, points }
    }

    fn shares(&self, trials: &[Trial], position: Position) -> Vec<Series> {
        let level = |n: &usize| f64::from(n.ilog2());
        let published = PUBLISHED.map(|share| Series {
            name: format!("published, {:.0} %", 100.0 * share),
            colour: [120, 128, 138],
            published: true,
            points: self.resolutions.iter().map(|n| (level(n), 100.0 * share)).collect(),
        });
        let ours = Reading::ALL.iter().zip(COLOURS).map(|(&reading, colour)| {
            let value = move |t: &Trial| Some(100.0 * t.compression(reading)?.of_octree_nodes);
            self.line(reading.name().into(), colour, trials, position, value)
        });
        published.into_iter().chain(ours).collect()
    }

    fn times(&self, trials: &[Trial], position: Position) -> Vec<Series> {
        tables::TIMES
            .iter()
            .zip(COLOURS)
            .map(|(&(name, value), colour)| {
                self.line(name.into(), colour, trials, position, |t| value(&t.seconds))
            })
            .filter(|s| !s.points.is_empty())
            .collect()
    }

    fn results<'a>(&self, trials: &'a [Trial]) -> impl Serialize + use<'a> {
        #[derive(Serialize)]
        struct Results<'a> {
            version: &'static str,
            paper: &'static str,
            published_share_of_octree: [f64; 2],
            means: Vec<tables::Mean>,
            growth: Vec<tables::Growth>,
            trials: &'a [Trial],
        }
        Results {
            version: env!("CARGO_PKG_VERSION"),
            paper: "Fujimura, Kobori, Kutsuwa",
            published_share_of_octree: PUBLISHED,
            means: tables::means(trials),
            growth: tables::growth(trials),
            trials,
        }
    }

    fn body(&self, tables: &[Table], charts: &[String]) -> String {
        let images: String = charts.iter().map(|name| figure(name, "")).collect();
        format!(
            "<h1>The network model beside the octree</h1>\n{}{}{}{}",
            paragraph(
                "The experiment of Fujimura, Kobori and Kutsuwa, repeated on built-in shapes: six \
                 primitives, eight products, six combinations, off the grid by a part of a voxel, \
                 and once more turned. The paper tells that a compressed network has 11 to 17 % of \
                 the data of an octree."
            ),
            paragraph(
                "The paper does not say what a datum is, so three counts stand together: nodes \
                 (planes, edges and voxels, beside all nodes of the octree), items (with loops and \
                 their chains in words of 32 bits, beside its mixed nodes), and bytes in plain \
                 records beside an octree without pointers. Levels are powers of two: 2^level voxels \
                 along an axis."
            ),
            gallery(&images),
            folder::tables(tables),
        )
    }
}

const COLOURS: [[u8; 3]; 5] =
    [[176, 42, 88], [38, 102, 190], [214, 122, 32], [58, 140, 92], [110, 84, 170]];

#[cfg(test)]
mod tests {
    use super::*;

    fn args(from: usize, to: usize, shapes: &[&str]) -> Args {
        let shapes = shapes.iter().map(ToString::to_string).collect();
        Args { folder: PathBuf::new(), from, to, shapes }
    }

    #[test]
    fn grids_double_and_shapes_are_known() {
        assert_eq!(args(32, 512, &[]).resolutions().unwrap(), [32, 64, 128, 256, 512]);
        assert_eq!(args(48, 100, &[]).resolutions().unwrap(), [48, 96]);
        for (from, to) in [(64, 32), (8, 64), (32, 8192)] {
            assert!(args(from, to, &[]).resolutions().is_err());
        }
        assert_eq!(args(32, 64, &[]).shapes().unwrap().len(), 20);
        assert_eq!(args(32, 64, &["gear"]).shapes().unwrap(), [Sample::Gear]);
        assert!(args(32, 64, &["house"]).shapes().is_err());
    }
}

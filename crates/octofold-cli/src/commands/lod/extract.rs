//! `octofold lod extract`: a mesh of any detail from a model.

use crate::commands::net::numbers;
use crate::files::OutputArgs;
use crate::job::{Account, Job, Outcome};
use anyhow::{Result, ensure};
use octofold::lod::{Criterion, Cut, Diagonal, Eye, Lod, Mode, Morphs, drawn, patches, settled};
use octofold::report::{Answer, ExtractFacts, LodFacts};
use octofold::{Kind, Shape};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// File to read, `.oflod`
    #[arg(value_name = "IN")]
    input: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    /// Which edges have patches: those that are crossed, as published or facing as the surface does;
    /// those that are crossed an odd number of times, which is closed for closed surfaces; the same with
    /// a vertex for each sheet, which is manifold
    #[arg(long, value_name = "MODE", default_value = "any")]
    mode: ModeArg,
    /// How octants are chosen for an eye: by a bound of the error in pixels, or as published
    #[arg(long, value_name = "NAME", default_value = "error", requires = "eye")]
    criterion: CriterionArg,
    /// Where the eye is, in the model's own coordinates
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, allow_hyphen_values = true,
        group = "what")]
    eye: Option<[f64; 3]>,
    /// Angle from the lower to the upper border of the picture, in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0, requires = "eye")]
    fov: f64,
    /// Pixels from the lower to the upper border of the picture
    #[arg(long, value_name = "PIXELS", default_value_t = 1080.0, requires = "eye")]
    height: f64,
    /// Largest error in the picture; as published, the wanted length of an edge
    #[arg(long, value_name = "PIXELS", default_value_t = 1.0, requires = "eye")]
    pixels: f64,
    /// All octants of one level, or above it where there are none [default: the last level]
    #[arg(long, value_name = "L", group = "what")]
    level: Option<u32>,
    /// Largest error, in the model's own unit
    #[arg(long, value_name = "E", group = "what")]
    tolerance: Option<f64>,
    /// Take octants as chosen, even where a patch does not cross its edge
    #[arg(long)]
    as_chosen: bool,
    /// Add the vertex, normal, colour and error that each point goes over to, and cut quads so that
    /// nothing jumps (PLY, GLB)
    #[arg(long)]
    morph: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum ModeArg {
    Paper,
    Any,
    Parity,
    Manifold,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum CriterionArg {
    Error,
    Wakatsuki2003,
}

const AFTER_HELP: &str = "\
Octants of any levels fit together without cracks. Where a patch would not cross the edge that it
stands on, its largest octant is divided.

Examples:
  octofold lod extract bunny.oflod near.glb --eye 0,0.1,0.4 --pixels 1 --morph
  octofold lod extract bunny.oflod far.ply --eye 0,0.1,9 --criterion wakatsuki2003 --pixels 6
  octofold lod extract bunny.oflod print.stl --tolerance 0.001 --mode manifold";

impl Args {
    /// Validates, chooses, draws and writes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let criterion = self.criterion()?;
        let mode = match self.mode {
            ModeArg::Paper => Mode::Paper,
            ModeArg::Any => Mode::Any,
            ModeArg::Parity => Mode::Parity,
            ModeArg::Manifold => Mode::Manifold,
        };
        let output = self.output.check()?;
        ensure!(
            output.kind() == Kind::Mesh,
            "{} holds a volume, and a mesh is to be written",
            output.name()
        );
        ensure!(
            !(job.json && output.is_pipe()),
            "--json and the output `-` would mix on standard output: name a file"
        );
        let (lod, bytes) = super::open(&self.input, job)?;
        let criterion = criterion.unwrap_or(Criterion::Level(lod.levels()));
        let chosen = Cut::select(&lod, &criterion, &job.run)?;
        let (cut, found, divided, missing) = if self.as_chosen {
            let found = patches(&lod, &chosen, mode, &job.run)?;
            let missing = found.iter().filter(|p| octofold::lod::misses(&lod, &chosen, p)).count();
            (chosen, found, 0, missing as u64)
        } else {
            let settled = settled(&lod, chosen, mode, &job.run)?;
            (settled.cut, settled.patches, settled.divided, settled.missing)
        };
        let diagonal = if self.morph { Diagonal::Fixed } else { Diagonal::Flatter };
        let mut drawn = drawn(&lod, &cut, &found, mode, diagonal, &job.run)?;
        if self.morph {
            let columns = Morphs::of(&lod, &cut, &drawn.places).columns();
            drawn.mesh.attributes.point_columns = columns;
        }
        let shape = Shape::Soup(drawn.mesh.into());
        let measures = job.measures(&shape)?;
        output.write(&shape, &job.run)?;
        let extract = ExtractFacts {
            mode,
            octants: cut.len() as u64,
            octants_by_level: cut.census(),
            patches: found.len() as u64,
            divided,
            missing,
            error: largest_error(&lod, &cut),
        };
        job.terminal.say(&format!(
            "{}: {} octants, {} patches, {:.2} s",
            output.name(),
            extract.octants,
            extract.patches,
            job.terminal.seconds()
        ));
        let facts = LodFacts { extract: Some(extract), ..LodFacts::of(&lod, Some(bytes)) };
        let answer = Some(Answer::Lod(Box::new(facts)));
        job.finish(Account { answer, output: measures, ..Account::default() })?;
        Ok(Outcome::Holds)
    }

    /// What octants are taken, where that was told.
    fn criterion(&self) -> Result<Option<Criterion>> {
        if let Some(level) = self.level {
            return Ok(Some(Criterion::Level(level)));
        }
        if let Some(tolerance) = self.tolerance {
            let sound = tolerance.is_finite() && tolerance >= 0.0;
            ensure!(sound, "--tolerance must not be negative");
            return Ok(Some(Criterion::Tolerance(tolerance)));
        }
        let Some(position) = self.eye else { return Ok(None) };
        let Self { fov, height, pixels, .. } = *self;
        ensure!(fov > 0.0 && fov < 180.0, "--fov must be above 0 and below 180");
        ensure!(height.is_finite() && height > 0.0, "--height must be above 0");
        ensure!(pixels.is_finite() && pixels > 0.0, "--pixels must be above 0");
        let fov = fov.to_radians();
        Ok(Some(match self.criterion {
            CriterionArg::Error => Criterion::Pixels(Eye { position, fov, height, pixels }),
            CriterionArg::Wakatsuki2003 => {
                let share = pixels * 2.0 * (fov / 2.0).tan() / height;
                Criterion::Wakatsuki { eye: position, share }
            }
        }))
    }
}

/// The largest bound of the chosen octants.
pub(super) fn largest_error(lod: &Lod, cut: &Cut) -> f64 {
    let front = cut.places().filter(|&place| cut.is_front(place));
    let errors = front.map(|place| lod.error(cut.octant(place).node) * lod.stretch());
    errors.fold(0.0, f64::max)
}

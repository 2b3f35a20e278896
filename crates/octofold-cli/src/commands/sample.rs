//! `octofold sample`: built-in shapes.

use crate::files::Output;
use crate::job::{Job, Outcome};
use anyhow::{Context, Result, ensure};
use octofold::samples::Sample;
use octofold::{Kind, Run, Shape};
use octofold_io::Format;
use std::path::PathBuf;
use std::sync::Arc;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// Name of the shape
    #[arg(required_unless_present = "list")]
    name: Option<String>,
    /// File to write, a mesh or a volume by its ending; `-` writes standard output
    #[arg(value_name = "OUT", required_unless_present = "list")]
    output: Option<PathBuf>,
    /// Format of the output, where its name does not tell
    #[arg(long, value_name = "FORMAT", value_parser = crate::files::parse_format)]
    to: Option<Format>,
    /// Cells along each axis; for primitives as meshes, segments around curved faces
    #[arg(long, value_name = "N", default_value_t = 64)]
    resolution: usize,
    /// Volumes: gray values, negative inside, instead of 0 and 1
    #[arg(long)]
    gray: bool,
    /// List the shapes
    #[arg(long, conflicts_with_all = ["name", "output"])]
    list: bool,
}

const AFTER_HELP: &str = "\
All shapes lie in the unit cube.

Examples:
  octofold sample --list
  octofold sample torus torus.obj --resolution 128
  octofold sample kettle kettle.nrrd --resolution 256";

/// Finest lattice that a sample is made on: a dense file of it already holds 2^36 samples.
const FINEST: usize = 4096;

/// As validated.
pub enum Wish {
    /// The names of all shapes.
    List,
    /// One shape in a file.
    Make(Order),
}

/// A shape to make.
pub struct Order {
    sample: Sample,
    output: Output,
    resolution: usize,
    gray: bool,
}

impl Args {
    /// What to make, or why it makes no sense.
    pub fn check(self) -> Result<Wish> {
        let Some((name, path)) = self.name.zip(self.output) else { return Ok(Wish::List) };
        let sample = Sample::from_name(&name)
            .with_context(|| format!("no shape `{name}`: see `octofold sample --list`"))?;
        let output = Output::new(path, self.to)?;
        let (resolution, gray) = (self.resolution, self.gray);
        ensure!((1..=FINEST).contains(&resolution), "--resolution must be 1 to {FINEST}");
        ensure!(!gray || output.kind() == Kind::Volume, "--gray is for volumes");
        Ok(Wish::Make(Order { sample, output, resolution, gray }))
    }
}

impl Wish {
    /// Lists or makes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        match self {
            Self::List => {
                let lines: Vec<_> =
                    Sample::ALL.iter().map(|s| format!("{:<14} {}", s.name(), s.about())).collect();
                job.answer(&lines.join("\n"))?;
                Ok(Outcome::Holds)
            }
            Self::Make(order) => job.write(&order.make(&job.run)?, &order.output),
        }
    }
}

impl Order {
    fn make(&self, run: &Run) -> Result<Shape> {
        let Self { sample, resolution, .. } = *self;
        run.stage("sample");
        let volume = || -> Result<Option<Shape>> {
            let gray = sample.volume(resolution).filter(|_| self.gray);
            if let Some(samples) = gray {
                return Ok(Some(Shape::Volume(Arc::new(samples))));
            }
            let solid = sample.voxels(resolution).map(|mask| mask.spans(run)).transpose()?;
            Ok(solid.map(|solid| Shape::Volume(Arc::new(solid))))
        };
        match self.output.kind() {
            Kind::Mesh => Ok(sample.mesh(resolution, run)?.into()),
            Kind::Volume => volume()?.with_context(|| {
                format!("`{}` is made of open sheets: it has no volume", sample.name())
            }),
        }
    }
}

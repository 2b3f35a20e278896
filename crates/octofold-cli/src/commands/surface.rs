//! `octofold surface`: a volume into the mesh of its surface.

use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use clap::builder::PossibleValuesParser;
use clap::builder::TypedValueParser;
use octofold::Step;
use octofold::surface::{Inside, Method, SurfaceOptions};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// How the surface is made: mc, marching cubes
    #[arg(long, default_value = Method::default().name(), value_parser = methods())]
    method: Method,
    #[command(flatten)]
    which: SurfaceArgs,
    /// Add vertex normals
    #[arg(long)]
    normals: bool,
}

/// Which surface of a volume is meant, as typed.
#[derive(Debug, Clone, Copy, Default, PartialEq, clap::Args)]
pub struct SurfaceArgs {
    /// Value at which the surface runs [default: 0.5 for binary volumes, else Otsu's threshold,
    /// which is told]
    #[arg(long, value_name = "V", conflicts_with = "labels", allow_negative_numbers = true)]
    iso: Option<f64>,
    /// Values below the iso value are inside, as in signed distances
    #[arg(long, conflicts_with = "labels")]
    below: bool,
    /// Take the samples for labels: one part per label, in one pass
    #[arg(long)]
    labels: bool,
    /// Leave the surface open where it meets the border of the volume
    #[arg(long, conflicts_with = "labels")]
    open: bool,
}

const AFTER_HELP: &str = "\
The mesh lies where the volume's file says, in its unit. It is closed and manifold for any input,
unless --open leaves it open at the border.

Examples:
  octofold surface brain.nii.gz brain.glb
  octofold surface ct.nrrd bone.ply --iso 300 --normals
  octofold surface atlas.nii.gz parts.glb --labels
  octofold surface bonsai.raw bonsai.stl --dims 256x256x256 --dtype u8";

fn methods() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(Method::ALL.map(Method::name)).map(|name| {
        let method = Method::ALL.into_iter().find(|m| m.name() == name);
        method.unwrap_or_default()
    })
}

impl SurfaceArgs {
    /// The options that say which surface is meant, and none of those that say how it is made.
    pub fn check(&self) -> Result<SurfaceOptions> {
        ensure!(self.iso.is_none_or(f64::is_finite), "--iso must be a finite number");
        Ok(SurfaceOptions {
            iso: self.iso,
            inside: if self.below { Inside::Below } else { Inside::Above },
            labels: self.labels,
            open: self.open,
            ..SurfaceOptions::default()
        })
    }
}

impl Args {
    /// Validates and finds the surface.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let options =
            SurfaceOptions { method: self.method, normals: self.normals, ..self.which.check()? };
        let (input, output) = (self.input.check()?, self.output.check()?);
        job.convert(&input, vec![Step::Surface(options)], &output)
    }
}

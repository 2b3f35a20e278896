//! `octofold surface`: a volume into the mesh of its surface.

use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use clap::builder::PossibleValuesParser;
use clap::builder::TypedValueParser;
use octofold::Step;
use octofold::surface::{Inside, LEAST_TOLERANCE, Method, SurfaceOptions};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// How the surface is made: ctel, certified TEL, few triangles within a tolerance of marching
    /// cubes; mc, marching cubes; amc, adaptive marching cubes; tel, the method of Nishio et al.
    /// 1997 as published. amc and tel are for comparison: edges may stay open
    #[arg(long, default_value = Method::default().name(), value_parser = methods())]
    method: Method,
    /// With ctel, the largest distance between the mesh and the surface of marching cubes, in
    /// samples [default: 1]
    #[arg(long, value_name = "T", conflicts_with = "labels")]
    tolerance: Option<f64>,
    /// With ctel, keep the patches of the octants as they are: more triangles, sooner
    #[arg(long, conflicts_with = "labels")]
    no_collapse: bool,
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
The mesh lies where the volume's file says, in its unit. With ctel and mc it is closed and manifold
for any input, unless --open leaves it open at the border; with ctel no two triangles meet. With
--json the report tells under `surface` what is proved of the mesh, or how amc and tel divided the
volume and what they left open. `octofold check MESH --within VOLUME` proves the distance again.

Examples:
  octofold surface brain.nii.gz brain.glb
  octofold surface ct.nrrd bone.ply --iso 300 --tolerance 0.5
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
        let tolerance = self.tolerance.unwrap_or(1.0);
        ensure!(
            tolerance.is_finite() && tolerance >= LEAST_TOLERANCE,
            "--tolerance must be at least {LEAST_TOLERANCE}; take --method mc for the surface itself"
        );
        ensure!(
            self.method == Method::Certified || (self.tolerance.is_none() && !self.no_collapse),
            "--tolerance and --no-collapse go with --method ctel"
        );
        let options = SurfaceOptions {
            method: self.method,
            normals: self.normals,
            tolerance,
            collapse: !self.no_collapse,
            ..self.which.check()?
        };
        let (input, output) = (self.input.check()?, self.output.check()?);
        job.convert(&input, vec![Step::Surface(options)], &output)
    }
}

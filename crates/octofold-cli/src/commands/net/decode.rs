//! `octofold net decode`: a network file, or a box of it, into a volume or a mesh.

use super::numbers;
use crate::files::{InputArgs, OutputArgs};
use crate::job::{Account, Job, Outcome};
use anyhow::{Context, Result, ensure};
use octofold::network::palette::Labelled;
use octofold::surface::SurfaceOptions;
use octofold::volume::Region;
use octofold::{Kind, Shape, Step};
use std::sync::Arc;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Only these voxels: the first along x, y and z, and one past the last
    #[arg(long = "box", value_name = "X,Y,Z,X,Y,Z", value_parser = numbers::<6>)]
    part: Option<[f64; 6]>,
    /// With a mesh: the faces of the voxels as they are, joined to polygons
    #[arg(long)]
    exact: bool,
    /// With a volume: the labels that surface voxels carry, and inside that of the voxel before
    #[arg(long)]
    labels: bool,
}

const AFTER_HELP: &str = "\
Of a file in bricks only those that the box touches are read. A mesh is that of `octofold surface`, or with
--exact the boundary of the voxels: closed, 2-manifold and of exactly their volume, in no more memory than
the surface takes; voxels that only touch are parted, by points at the same place. Colours and labels
that the file carries go to meshes and to .vox (of 255 colours at most) by themselves, and labels to
other volumes with --labels.

Examples:
  octofold net decode bunny.ofn bunny.npy
  octofold net decode bunny.ofn ear.vox --box 0,0,400,256,256,512
  octofold net decode bunny.ofn bunny.stl --exact";

impl Args {
    /// Validates, reads and writes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let output = self.output.check()?;
        ensure!(!self.exact || output.kind() == Kind::Mesh, "--exact is for meshes");
        let opened = self.input.check()?.open()?;
        let file = opened.expect_network(&job.run)?;
        let region = match self.part {
            None => Region::all(file.dims()),
            Some(part) => region(part, file.dims())?,
        };
        let whole = region == Region::all(file.dims());
        let painted = || {
            job.run.stage("decode");
            if whole { file.painted(&job.run) } else { file.painted_region(region, &job.run) }
        };
        if self.labels {
            ensure!(
                output.kind() == Kind::Volume,
                "--labels is for volumes: meshes get them anyway"
            );
            let painted = painted()?.filter(|p| p.payload().kinds().labels);
            let painted = painted.context("the file carries no labels")?;
            output.write_volume(&Labelled::by_label(&painted), &job.run)?;
            job.finish(Account::default())?;
            return Ok(Outcome::Holds);
        }
        let read = || {
            if let Some(painted) = painted()? {
                return Ok(Shape::Volume(Arc::new(painted)));
            }
            let solid = if whole { file.solid(&job.run)? } else { file.region(region, &job.run)? };
            Ok(Shape::Volume(Arc::new(solid)))
        };
        let steps = match output.kind() {
            Kind::Mesh if self.exact => vec![Step::Boundary],
            Kind::Mesh => vec![Step::Surface(SurfaceOptions::default())],
            Kind::Volume => Vec::new(),
        };
        job.convert_read(Kind::Volume, read, steps, &output)
    }
}

/// The box of voxels that was typed.
fn region(part: [f64; 6], dims: [usize; 3]) -> Result<Region> {
    let ends: [[f64; 2]; 3] = std::array::from_fn(|a| [part[a], part[a + 3]]);
    let fits = |(&[start, end], &n): (&[f64; 2], &usize)| {
        start.fract() == 0.0 && end.fract() == 0.0 && 0.0 <= start && start < end && end <= n as f64
    };
    let [x, y, z] = dims;
    ensure!(
        ends.iter().zip(&dims).all(fits),
        "--box must be whole numbers in the {x} x {y} x {z} voxels of the file, the lower first"
    );
    Ok(Region {
        start: ends.map(|[start, _]| start as usize),
        end: ends.map(|[_, end]| end as usize),
    })
}

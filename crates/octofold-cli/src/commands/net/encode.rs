//! `octofold net encode`: a mesh or a volume into a network file.

use super::LayoutArgs;
use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use octofold::pipeline::SolidOptions;
use octofold::voxelize::{Fill, Size, VoxelizeOptions};
use octofold::{Kind, Step};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    layout: LayoutArgs,
    /// Meshes: voxels along the longest side of the box
    #[arg(long, value_name = "N", conflicts_with = "pitch")]
    resolution: Option<u32>,
    /// Meshes: side of a voxel, in the mesh's own unit
    #[arg(long, value_name = "P")]
    pitch: Option<f64>,
    /// Volumes: the least value inside; Otsu's threshold of gray values unless told
    #[arg(long, value_name = "V", allow_negative_numbers = true)]
    iso: Option<f64>,
}

/// Voxels along the longest side of a mesh's box, unless told.
const RESOLUTION: u32 = 256;

const AFTER_HELP: &str = "\
A mesh is voxelized row by row, its inside is never visited. A mesh takes 256 voxels along its
longest side unless told otherwise.

Examples:
  octofold net encode bunny.ply bunny.ofn --resolution 512 --archive
  octofold net encode brain.nii.gz brain.ofn --iso 90 --bricks";

impl Args {
    /// Validates, finds the solid and writes it.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let output = self.output.check()?.in_layout(self.layout.into())?;
        let opened = self.input.check()?.open()?;
        let kind = opened.kind();
        let sized = self.resolution.is_some() || self.pitch.is_some();
        let step = if kind == Kind::Mesh {
            ensure!(self.iso.is_none(), "--iso is for volumes, and this is a mesh");
            let size = match (self.resolution, self.pitch) {
                (_, Some(pitch)) => {
                    ensure!(pitch.is_finite() && pitch > 0.0, "--pitch must be above 0");
                    Size::Pitch(pitch)
                }
                (resolution, None) => Size::Resolution(resolution.unwrap_or(RESOLUTION)),
            };
            ensure!(size != Size::Resolution(0), "--resolution must be above 0");
            Step::Voxelize(VoxelizeOptions { size, fill: Fill::Solid })
        } else {
            ensure!(!sized, "--resolution and --pitch are for meshes, and this is a volume");
            Step::Solid(SolidOptions { iso: self.iso })
        };
        job.convert_read(kind, || opened.read(&job.run), vec![step], &output)
    }
}

//! `octofold voxelize`: a mesh into voxels.

use crate::files::{InputArgs, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use octofold::Step;
use octofold::voxelize::{Fill, Size, VoxelizeOptions};

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
#[command(group = clap::ArgGroup::new("size").required(true))]
pub struct Args {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Voxels along the longest side of the mesh's box
    #[arg(long, value_name = "N", group = "size")]
    resolution: Option<u32>,
    /// Side of a voxel, in the mesh's own unit
    #[arg(long, value_name = "P", group = "size")]
    pitch: Option<f64>,
    /// Which voxels are set
    #[arg(long, value_enum, default_value = "solid")]
    fill: FillArg,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum FillArg {
    /// What is inside; a mesh with holes is filled by its winding number
    Solid,
    /// Every voxel that a triangle touches
    Surface,
    /// A thin surface that no path across corners, edges and faces can pass
    Thin26,
    /// A thinner surface that no path across faces can pass
    Thin6,
}

impl From<FillArg> for Fill {
    fn from(fill: FillArg) -> Self {
        match fill {
            FillArg::Solid => Self::Solid,
            FillArg::Surface => Self::Surface,
            FillArg::Thin26 => Self::ThinSurface26,
            FillArg::Thin6 => Self::ThinSurface6,
        }
    }
}

const AFTER_HELP: &str = "\
Voxels lie in the box of the mesh; the output keeps its place in the world where the format can
(nrrd, nii, nii.gz, binvox; npy, raw and vox hold the samples alone). Memory and time grow with the
surface, not with the box, until a dense format is written.

Examples:
  octofold voxelize bunny.ply bunny.nrrd --resolution 512
  octofold voxelize house.glb house.vox --resolution 96 --fill surface
  octofold voxelize part.stl part.nii.gz --pitch 0.2";

impl Args {
    /// Validates and voxelizes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let options = VoxelizeOptions { size: self.size()?, fill: self.fill.into() };
        let (input, output) = (self.input.check()?, self.output.check()?);
        job.convert(&input, vec![Step::Voxelize(options)], &output)
    }

    fn size(&self) -> Result<Size> {
        Ok(match (self.resolution, self.pitch) {
            (_, Some(pitch)) => {
                ensure!(pitch.is_finite() && pitch > 0.0, "--pitch must be above 0");
                Size::Pitch(pitch)
            }
            (resolution, None) => {
                let n = resolution.unwrap_or_default();
                ensure!(n > 0, "--resolution must be above 0");
                Size::Resolution(n)
            }
        })
    }
}

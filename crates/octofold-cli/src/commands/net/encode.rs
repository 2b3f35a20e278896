//! `octofold net encode`: a mesh or a volume into a network file.

use super::LayoutArgs;
use crate::files::{InputArgs, Opened, OutputArgs};
use crate::job::{Job, Outcome};
use anyhow::{Result, bail, ensure};
use octofold::network::paint::{paint_mesh, paint_volume};
use octofold::payload::Kinds;
use octofold::pipeline::SolidOptions;
use octofold::voxelize::{Fill, Size, VoxelizeOptions, voxelize};
use octofold::{Kind, Shape, Step};
use octofold_io::images;
use std::sync::Arc;

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
    /// Surface voxels carry labels: of the nearest faces (or their materials, from 1), or the samples
    /// of a volume of labels
    #[arg(long)]
    labels: bool,
    /// Surface voxels carry colours: of the nearest faces with their images, or of a volume's labels
    #[arg(long)]
    colours: bool,
}

/// Voxels along the longest side of a mesh's box, unless told.
const RESOLUTION: u32 = 256;

const AFTER_HELP: &str = "\
A mesh is voxelized row by row, its inside is never visited. A mesh takes 256 voxels along its
longest side unless told otherwise. With --labels or --colours the solid of a volume is all that has a
label; its inside carries nothing.

Examples:
  octofold net encode bunny.ply bunny.ofn --resolution 512 --archive
  octofold net encode brain.nii.gz brain.ofn --iso 90 --bricks
  octofold net encode globe.glb globe.ofn --colours";

impl Args {
    /// Validates, finds the solid and writes it.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let output = self.output.check()?.in_layout(self.layout.into())?;
        let opened = self.input.check()?.open()?;
        let kind = opened.kind();
        let kinds = Kinds { labels: self.labels, colours: self.colours };
        ensure!(
            kinds.is_none() || self.iso.is_none(),
            "--iso is for gray values, and --labels and --colours are for labels"
        );
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
            let options = VoxelizeOptions { size, fill: Fill::Solid };
            if !kinds.is_none() {
                let read = || painted_mesh(&opened, options, kinds, job);
                return job.convert_read(Kind::Volume, read, Vec::new(), &output);
            }
            Step::Voxelize(options)
        } else {
            ensure!(!sized, "--resolution and --pitch are for meshes, and this is a volume");
            if !kinds.is_none() {
                let read = || painted_volume(&opened, kinds, job);
                return job.convert_read(Kind::Volume, read, Vec::new(), &output);
            }
            Step::Solid(SolidOptions { iso: self.iso })
        };
        job.convert_read(kind, || opened.read(&job.run), vec![step], &output)
    }
}

/// A mesh as a solid that carries what its faces have.
fn painted_mesh(
    opened: &Opened,
    options: VoxelizeOptions,
    kinds: Kinds,
    job: &Job,
) -> Result<Shape> {
    let mesh = opened.read_mesh(&job.run)?.triangulate();
    let images = if kinds.colours { images(&mesh.attributes, &job.run) } else { Vec::new() };
    let solid = voxelize(&mesh, &options, &job.run)?;
    let painted = paint_mesh(solid, &mesh, &images, kinds, &job.run)?;
    let found = painted.payload().kinds();
    ensure!(found.labels || !kinds.labels, "the mesh has no labels: neither parts nor materials");
    ensure!(found.colours || !kinds.colours, "the mesh has no colours");
    Ok(Shape::Volume(Arc::new(painted)))
}

/// A volume of labels as a solid that carries them.
fn painted_volume(opened: &Opened, kinds: Kinds, job: &Job) -> Result<Shape> {
    let Shape::Volume(volume) = opened.read(&job.run)? else { bail!("this is no volume") };
    if volume.payload().is_some() {
        return Ok(Shape::Volume(volume));
    }
    Ok(Shape::Volume(Arc::new(paint_volume(volume.as_ref(), kinds, &job.run)?)))
}

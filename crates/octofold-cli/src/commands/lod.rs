//! `octofold lod`: models of many levels of detail.

mod build;
mod chain;
mod extract;
mod info;
mod tiles;

use crate::job::{Job, Outcome};
use anyhow::{Result, ensure};
use octofold::lod::Lod;
use octofold_io::{Source, oflod};
use std::path::Path;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

/// What can be done with such models.
#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Turn a mesh or a volume into an .oflod file
    Build(build::Args),
    /// Take a mesh of any detail from an .oflod file
    Extract(extract::Args),
    /// Write meshes of several levels of detail into one GLB file
    Chain(chain::Args),
    /// Write an .oflod file as 3D Tiles, for viewers that stream
    Tiles(tiles::Args),
    /// Tell how large a model is, and how exact each of its levels
    Info(info::Args),
}

const AFTER_HELP: &str = "\
An .oflod file is an octree of the surface. Whatever octants are taken from it, of whatever levels,
their patches fit together without cracks.

Examples:
  octofold lod build bunny.ply bunny.oflod --level 9
  octofold lod info bunny.oflod
  octofold lod extract bunny.oflod near.glb --eye 0,0.1,0.4 --pixels 1
  octofold lod extract bunny.oflod print.stl --tolerance 0.001 --mode parity
  octofold lod chain bunny.oflod bunny.glb --count 5
  octofold lod tiles bunny.oflod bunny-tiles --up y";

impl Args {
    /// Does one of them.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        match self.command {
            Command::Build(args) => args.run(job),
            Command::Extract(args) => args.run(job),
            Command::Chain(args) => args.run(job),
            Command::Tiles(args) => args.run(job),
            Command::Info(args) => args.run(job),
        }
    }
}

/// Opens a model, and tells how many bytes it has.
fn open(path: &Path, job: &Job) -> Result<(Lod, u64)> {
    let source = Source::open(path)?;
    ensure!(
        source.bytes.starts_with(b"OFL"),
        "{}: this is no .oflod file: `octofold lod build` makes one",
        path.display()
    );
    Ok((oflod::read(&source, &job.run)?, source.bytes.len() as u64))
}

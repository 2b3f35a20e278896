//! The commands, one file each: arguments as typed, their validation, and the work.

mod check;
mod compare;
mod completions;
mod convert;
mod craft;
mod demo;
mod info;
mod lod;
mod net;
mod paper;
mod repair;
mod run;
mod sample;
mod simplify;
mod surface;
mod unfold;
mod voxelize;

use crate::job::{Job, Outcome};
use anyhow::Result;

/// Every command with its arguments as typed.
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// Tell what a file holds: kind, counts, bounds, defects
    Info(info::Args),
    /// Check claims about a mesh; exit code 1 where one does not hold
    Check(check::Args),
    /// Measure how far two meshes are apart
    Compare(compare::Args),
    /// Write the same shape in another format
    Convert(convert::Args),
    /// Make a built-in shape
    Sample(sample::Args),
    /// Turn a mesh into voxels
    Voxelize(voxelize::Args),
    /// Turn a volume into the mesh of its surface
    Surface(surface::Args),
    /// Turn any polygons into a closed mesh that does not meet itself
    Repair(repair::Args),
    /// Reduce a mesh to fewer triangles that keep its topology and do not meet
    Simplify(simplify::Args),
    /// Solids as linked surface voxels: small files that can still be computed with
    Net(net::Args),
    /// Models of many levels of detail: build one, and take any level from it without cracks
    Lod(lod::Args),
    /// Turn a mesh into sheets of paper to cut, fold and glue
    Unfold(unfold::Args),
    /// Turn any polygons into sheets of paper: repair, reduce, flatten and unfold in one go
    Craft(craft::Args),
    /// Take built-in shapes through every main path and make a page to look at
    Demo(demo::Args),
    /// Repeat a paper's experiments beside its published figures
    Paper(paper::Args),
    /// Run the steps of a file
    Run(run::Args),
    /// Print a completion script for a shell
    Completions(completions::Args),
}

impl Command {
    /// Its name, as typed.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Info(_) => "info",
            Self::Check(_) => "check",
            Self::Compare(_) => "compare",
            Self::Convert(_) => "convert",
            Self::Sample(_) => "sample",
            Self::Voxelize(_) => "voxelize",
            Self::Surface(_) => "surface",
            Self::Repair(_) => "repair",
            Self::Simplify(_) => "simplify",
            Self::Net(_) => "net",
            Self::Lod(_) => "lod",
            Self::Unfold(_) => "unfold",
            Self::Craft(_) => "craft",
            Self::Demo(_) => "demo",
            Self::Paper(_) => "paper",
            Self::Run(_) => "run",
            Self::Completions(_) => "completions",
        }
    }
}

/// Runs a command to its end.
pub fn run(command: Command, job: &Job) -> Result<Outcome> {
    match command {
        Command::Info(args) => args.run(job),
        Command::Check(args) => args.check()?.run(job),
        Command::Compare(args) => args.run(job),
        Command::Convert(args) => args.run(job),
        Command::Sample(args) => args.check()?.run(job),
        Command::Voxelize(args) => args.run(job),
        Command::Surface(args) => args.run(job),
        Command::Repair(args) => args.run(job),
        Command::Simplify(args) => args.run(job),
        Command::Net(args) => args.run(job),
        Command::Lod(args) => args.run(job),
        Command::Unfold(args) => args.run(job),
        Command::Craft(args) => args.run(job),
        Command::Demo(args) => args.run(job),
        Command::Paper(args) => args.run(job),
        Command::Run(args) => args.run(job),
        Command::Completions(args) => args.run(),
    }
}

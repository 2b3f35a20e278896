//! The command line as typed. Each command validates its own part before any work.

use crate::commands::Command;

/// Turns a 3D shape from any form into any other useful form, through the octree.
#[derive(Debug, clap::Parser)]
#[command(name = "octofold", version, max_term_width = 100, after_help = AFTER_HELP)]
pub struct Cli {
    /// Flags of every command.
    #[command(flatten)]
    pub common: Common,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Flags that every command takes.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Common options")]
pub struct Common {
    /// Print a report to standard output as JSON: steps, times, memory, measures, findings
    #[arg(long, global = true)]
    pub json: bool,
    /// Say nothing but errors
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say how long each stage took
    #[arg(long, short, global = true)]
    pub verbose: bool,
    /// Threads to work with; 0 takes one per core. Results do not depend on it
    #[arg(long, global = true, value_name = "N", default_value_t = 0,
        value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub threads: u16,
}

const AFTER_HELP: &str = "\
Examples:
  octofold info bunny.ply                             what it is, and what is wrong with it
  octofold voxelize bunny.ply bunny.nrrd --resolution 512
  octofold surface brain.nii.gz brain.glb             the surface, in the file's own millimetres
  octofold check part.stl --closed --manifold         exit code 1 where that does not hold
  octofold demo                                       all of it on built-in shapes, as pictures

IN and OUT may be `-` for a pipe, with --from and --to for the formats.
Exit codes: 0 done; 1 what was asked to hold does not; 2 usage, input or output; 130 interrupted.";

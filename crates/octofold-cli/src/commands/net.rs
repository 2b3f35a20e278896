//! `octofold net`: solids as networks, in files and out of them.

mod ball;
mod combine;
mod contains;
mod decode;
mod encode;
mod info;
mod motion;

use crate::job::{Job, Outcome};
use anyhow::Result;
use octofold::network::ball::Ball;
use octofold::network::code::Mode;
use octofold::network::combine::Operation;
use octofold_io::ofn::Layout;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

/// What can be done with networks.
#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Turn a mesh or a volume into an .ofn file
    Encode(encode::Args),
    /// Turn an .ofn file, or a box of it, into a volume or a mesh
    Decode(decode::Args),
    /// Tell how large a network is, and how many data it has beside an octree
    Info(info::Args),
    /// What is in any of several solids
    Union(combine::Args),
    /// What is in all of several solids
    Intersection(combine::Args),
    /// What is in the first of several solids and in no other
    Difference(combine::Args),
    /// What is in an odd number of several solids
    Xor(combine::Args),
    /// Turn, scale and shift a solid, exactly resampled
    Move(motion::Args),
    /// Grow a solid by a ball
    Dilate(ball::Args),
    /// Shrink a solid by a ball
    Erode(ball::Args),
    /// Tell whether voxels are in a solid; exit code 1 where one is not
    Contains(contains::Args),
}

const AFTER_HELP: &str = "\
An .ofn file is the boundary of a solid, coded without loss. Set operations and motions take any
binary volume; `octofold surface` and every other command read .ofn as a volume.

Examples:
  octofold net encode bunny.ply bunny.ofn --resolution 512
  octofold net info bunny.ofn
  octofold net move bunny.ofn turned.ofn --rotate z=30
  octofold net difference bunny.ofn turned.ofn rest.ofn
  octofold surface rest.ofn rest.ply";

impl Args {
    /// Does one of them.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        match self.command {
            Command::Encode(args) => args.run(job),
            Command::Decode(args) => args.run(job),
            Command::Info(args) => args.run(job),
            Command::Union(args) => args.run(Operation::Union, job),
            Command::Intersection(args) => args.run(Operation::Intersection, job),
            Command::Difference(args) => args.run(Operation::Difference, job),
            Command::Xor(args) => args.run(Operation::SymmetricDifference, job),
            Command::Move(args) => args.run(job),
            Command::Dilate(args) => args.run(Ball::Dilate, job),
            Command::Erode(args) => args.run(Ball::Erode, job),
            Command::Contains(args) => args.run(job),
        }
    }
}

/// How .ofn files are written, as typed.
#[derive(Debug, Clone, Copy, clap::Args)]
struct LayoutArgs {
    /// Half the bytes of an .ofn file in ten times the time
    #[arg(long, conflicts_with = "bricks")]
    archive: bool,
    /// An .ofn file of which any part can be read without the rest
    #[arg(long)]
    bricks: bool,
}

impl From<LayoutArgs> for Layout {
    fn from(LayoutArgs { archive, bricks }: LayoutArgs) -> Self {
        Self { mode: if archive { Mode::Archive } else { Mode::Fast }, bricks }
    }
}

/// Numbers with commas between them.
pub(super) fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    let numbers = numbers.ok().filter(|n| n.iter().all(|v| v.is_finite()));
    let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
    numbers.ok_or_else(|| format!("{N} numbers with commas between them are asked for"))
}

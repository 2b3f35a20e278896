//! `octofold lod tiles`: a model as 3D Tiles.

use crate::job::{Account, Job, Outcome};
use anyhow::Result;
use octofold::lod::Mode;
use octofold::report::{Answer, LodFacts, TilesFacts};
use octofold_io::tiles::{self, TilesOptions, TilesWritten, Up};
use std::path::PathBuf;

/// As typed.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    /// File to read, `.oflod`
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Folder to write: new, empty, or with tiles that were written here before
    #[arg(value_name = "OUTDIR")]
    folder: PathBuf,
    /// Cells along an edge of a tile
    #[arg(long, value_name = "N", default_value = "64")]
    cells: CellsArg,
    /// The axis of the model that points up: `z` leaves coordinates as they are, `y` turns them
    #[arg(long, value_name = "AXIS", default_value = "z")]
    up: UpArg,
    /// Which edges have patches: those that are crossed, or crossed an odd number of times
    #[arg(long, value_name = "MODE", default_value = "any")]
    mode: ModeArg,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum CellsArg {
    #[value(name = "16")]
    Sixteen,
    #[value(name = "32")]
    ThirtyTwo,
    #[value(name = "64")]
    SixtyFour,
    #[value(name = "128")]
    HundredTwentyEight,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum UpArg {
    Y,
    Z,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum ModeArg {
    Any,
    Parity,
}

const AFTER_HELP: &str = "\
The tileset is 3D Tiles 1.1: an implicit octree, contents as GLB, with the error and the box of each tile
in its subtrees. Any web server can hand the folder out.

Example:
  octofold lod build bunny.ply bunny.oflod --level 9
  octofold lod tiles bunny.oflod bunny-tiles --up y";

impl Args {
    /// Reads, divides and writes.
    pub fn run(self, job: &Job) -> Result<Outcome> {
        let options = TilesOptions {
            span: match self.cells {
                CellsArg::Sixteen => 4,
                CellsArg::ThirtyTwo => 5,
                CellsArg::SixtyFour => 6,
                CellsArg::HundredTwentyEight => 7,
            },
            mode: match self.mode {
                ModeArg::Any => Mode::Any,
                ModeArg::Parity => Mode::Parity,
            },
            up: match self.up {
                UpArg::Y => Up::Y,
                UpArg::Z => Up::Z,
            },
        };
        let (lod, bytes) = super::open(&self.input, job)?;
        let written = tiles::write(&lod, &options, &self.folder, &job.run)?;
        let TilesWritten { tiles, triangles, bytes: contents } = written;
        job.terminal.say(&format!(
            "{}: {} tiles in {} levels, {} triangles at the finest, {:.2} s",
            self.folder.display(),
            tiles.iter().sum::<u64>(),
            tiles.len(),
            triangles.last().copied().unwrap_or(0),
            job.terminal.seconds()
        ));
        let tiles =
            TilesFacts { tiles_by_level: tiles, triangles_by_level: triangles, bytes: contents };
        let facts = LodFacts { tiles: Some(tiles), ..LodFacts::of(&lod, Some(bytes)) };
        let answer = Some(Answer::Lod(Box::new(facts)));
        job.finish(Account { answer, ..Account::default() })?;
        Ok(Outcome::Holds)
    }
}

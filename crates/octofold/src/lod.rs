//! Multi-scale patches: one octree, any level of detail, no cracks.
//!
//! A surface becomes an octree whose octants carry a vertex, a normal, a colour and a flag for each
//! of their edges that the surface crosses. A [`Cut`] chooses octants of any levels that tile the
//! surface; each edge of the cut that no octant beside it divides, and that is crossed, gives one
//! patch on the vertices of the three or four octants round it. With the flags of [`Mode::Parity`]
//! no cut of a closed surface ever has a crack.
//! Source: Wakatsuki, Ishii, Takahashi, Imai, Makino 2003, sections 2 and 3; patches as in Ju,
//! Losasso, Schaefer, Warren 2002.

mod bounds;
mod build;
mod code;
mod column;
mod cracks;
mod crossings;
mod cubes;
mod cut;
mod direction;
mod drawn;
mod edges;
mod field;
mod front;
mod leaves;
mod patches;
mod pyramid;
mod rim;
mod settled;
mod sheets;
mod spread;
mod stitching;
mod sums;
#[cfg(test)]
mod tests;
mod tiling;
mod tree;

pub use crate::tint::Images;
pub use build::{BuildOptions, VertexRule, build, build_painted, build_volume, build_with_cubes};
pub use column::Column;
pub use cubes::Cubes;
pub use cut::{Criterion, Cut, Eye, Octant};
pub use drawn::{Diagonal, Drawn, Morphs, drawn};
pub use front::{Change, Front};
pub use patches::{Mode, Patch, Patches, Patchwork, patches};
pub use settled::{Settled, misses, settled};
pub use stitching::{Gaps, Marched, Marching, Seams};
pub use tiling::{Content, Tile, Tiling};
pub use tree::{Crossed, Lod, Node, Parts, Traits};

use crate::lattice::LatticeError;
use crate::run::Cancelled;
use crate::volume::VolumeError;

/// The deepest level that a model can have.
pub const MOST_LEVELS: u32 = 16;

/// Why there is no level-of-detail model.
#[derive(Debug, thiserror::Error)]
pub enum LodError {
    /// The level is not one of those that are built.
    #[error("level {0}: choose between 1 and {MOST_LEVELS}")]
    Level(u32),
    /// The input has no surface.
    #[error("there is no surface: nothing crosses an edge of the grid at level {0}")]
    NoSurface(u32),
    /// The octants are more than can be numbered.
    #[error("the model has {0} octants, more than can be numbered: choose a lower level")]
    TooMany(u64),
    /// The mesh cannot be put on a lattice.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// The volume could not be read.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The columns of a model contradict each other.
    #[error("the model is damaged: {0}")]
    Damaged(&'static str),
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

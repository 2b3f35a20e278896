//! The network model: a solid as the voxels of its surface, linked with one another.
//!
//! Only voxels with an exposed face are kept, each with a mask of the directions in which it is
//! exposed. Links need not be stored: the neighbours of a face follow from the masks ([`links`]).
//! Everything costs what the surface costs, and nothing is lost: a network and [`Spans`] are two
//! forms of one solid.
//!
//! - [`combine`]: set operations row by row. [`patches`]: the same on links, as published.
//!   [`frame`]: one grid for solids on several.
//! - [`motion`]: rotation and scaling by exact resampling. [`ball`]: growing and shrinking.
//! - [`boundary`](mod@boundary): the faces of its voxels as a mesh.
//! - [`compress`]: the two steps of compression, by planes and by ridges, and back. [`census`]: data
//!   beside the octree's.
//! - [`painted`]: solids whose nodes carry labels or colours; [`paint`]: where these come from;
//!   [`carry`]: what becomes of them; [`palette`]: as few as a format can hold.
//! - [`code`]: solids as bytes.
//!
//! Source: Fujimura, Kobori and Kutsuwa, "Shape compression of spatial partitioning models using
//! the network model"; specification of the network model (A1 to A5).

pub mod ball;
pub mod boundary;
mod bricks;
pub mod carry;
pub mod census;
pub mod code;
pub mod combine;
pub mod compress;
pub mod frame;
pub mod links;
pub mod motion;
mod nearest;
mod numbered;
mod oblique;
pub mod paint;
pub mod painted;
pub mod palette;
pub mod patches;
mod planes;
mod ridges;
mod slopes;

pub use oblique::ObliqueNode;
pub use planes::{Loop, PlaneNode, Turn};
pub use ridges::EdgeNode;

use crate::par;
use crate::rows::Rows;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Volume};

/// Slices that one unit of work takes.
const BLOCK: usize = 8;

/// The most voxels along an axis.
pub const MOST_VOXELS: usize = 1 << 16;

/// Why a solid has no network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// Nodes could not be named.
    #[error("{voxels} voxels along an axis: a network has at most {MOST_VOXELS}")]
    TooLong {
        /// How many there are.
        voxels: usize,
    },
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A face's direction: axis `d / 2`, downwards where `d` is even.
pub type Direction = u8;

/// Exposed directions as bits: bit `d` for [`Direction`] `d`.
pub type Mask = u8;

/// A voxel of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Node {
    /// Place along z, y and x, the order in which nodes are kept.
    pub zyx: [u16; 3],
    /// Where it is exposed; never 0.
    pub mask: Mask,
}

impl Node {
    /// Its place as x, y, z.
    pub fn at(self) -> [u32; 3] {
        let [z, y, x] = self.zyx.map(u32::from);
        [x, y, z]
    }
}

/// Neighbouring nodes of one row with one mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// First voxel along x.
    pub start: u32,
    /// One past the last.
    pub end: u32,
    /// Where they are exposed.
    pub mask: Mask,
}

/// Where a voxel lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Outside of the solid.
    Outside,
    /// On its surface.
    Surface(Mask),
    /// Inside, with no exposed face.
    Inside,
}

/// A solid by its surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    dims: [usize; 3],
    /// Where voxel centres lie in the world.
    pub placement: Placement,
    rows: Rows<Stretch>,
}

impl Network {
    /// The network of a solid.
    pub fn new(solid: &Spans, run: &Run) -> Result<Self, NetworkError> {
        let dims = solid.dims();
        if let Some(voxels) = dims.into_iter().find(|&n| n > MOST_VOXELS) {
            return Err(NetworkError::TooLong { voxels });
        }
        run.stage("network");
        let parts = par::blocks(run, dims[2], BLOCK, |slices| {
            let mut rows = Rows::default();
            for z in slices {
                expose_slice(&mut rows, solid, z);
            }
            rows
        })?;
        let mut rows = Rows::default();
        parts.into_iter().for_each(|part| rows.append(part));
        Ok(Self { dims, placement: solid.placement, rows })
    }

    /// Voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The nodes of a row, from low to high x.
    pub fn row(&self, y: u32, z: u32) -> &[Stretch] {
        self.rows.row(y as usize, z as usize).1
    }

    /// Calls `visit` with row `[y, z]` and its stretches, in order, for every row with nodes.
    pub fn for_each_row(&self, mut visit: impl FnMut([u32; 2], &[Stretch])) {
        for z in 0..self.dims[2] {
            self.rows.of_slice(z, 0).for_each(|(y, row)| visit([y, z as u32], row));
        }
    }

    /// All nodes, in order of z, y and x.
    pub fn nodes(&self) -> Vec<Node> {
        let mut nodes = Vec::with_capacity(self.count() as usize);
        self.for_each_row(|[y, z], stretches| {
            for s in stretches {
                let node = |x: u32| Node { zyx: [z, y, x].map(|i| i as u16), mask: s.mask };
                nodes.extend((s.start..s.end).map(node));
            }
        });
        nodes
    }

    /// The network of nodes in order.
    pub(crate) fn from_nodes(
        dims: [usize; 3],
        placement: Placement,
        nodes: impl IntoIterator<Item = Node>,
    ) -> Self {
        let stretches = nodes.into_iter().map(|node| {
            let [x, y, z] = node.at();
            ([y, z], Stretch { start: x, end: x + 1, mask: node.mask })
        });
        let rows = Rows::collect(dims[2], stretches, |last, next| {
            let goes_on = last.end == next.start && last.mask == next.mask;
            if goes_on {
                last.end = next.end;
            }
            goes_on
        });
        Self { dims, placement, rows }
    }

    /// How many nodes there are.
    pub fn count(&self) -> u64 {
        self.rows.items().iter().map(|s| u64::from(s.end - s.start)).sum()
    }

    /// How many faces are exposed.
    pub fn faces(&self) -> u64 {
        let faces = |s: &Stretch| u64::from(s.end - s.start) * u64::from(s.mask.count_ones());
        self.rows.items().iter().map(faces).sum()
    }

    /// Where a voxel lies: the node before it in its row tells (A5). Voxels beyond the grid are
    /// outside.
    pub fn side(&self, [x, y, z]: [u32; 3]) -> Side {
        let row = self.row(y, z);
        let after = row.partition_point(|s| s.start <= x);
        match after.checked_sub(1).map(|before| row[before]) {
            None => Side::Outside,
            Some(s) if x < s.end => Side::Surface(s.mask),
            // Between two nodes of a row nothing changes.
            Some(s) if s.mask & links::HIGH_X == 0 => Side::Inside,
            Some(_) => Side::Outside,
        }
    }

    /// Whether a voxel is in the solid.
    pub fn contains(&self, at: [u32; 3]) -> bool {
        self.side(at) != Side::Outside
    }

    /// The solid as runs of voxels.
    pub fn spans(&self) -> Spans {
        let mut runs = Vec::new();
        self.for_each_row(|row, stretches| {
            let mut start = None;
            for s in stretches {
                let first = *start.get_or_insert(s.start);
                // Every run of the solid ends in a node that is exposed upwards along x.
                if s.mask & links::HIGH_X != 0 {
                    runs.push((row, [first, s.end]));
                    start = None;
                }
            }
        });
        Spans::from_runs(self.dims, self.placement, runs)
    }
}

/// Adds the nodes of a slice.
fn expose_slice(nodes: &mut Rows<Stretch>, solid: &Spans, z: usize) {
    let [_, height, depth] = solid.dims();
    let row = |y: Option<usize>, z: Option<usize>| match (y, z) {
        (Some(y), Some(z)) if y < height && z < depth => solid.row(y, z),
        _ => &[],
    };
    for (y, runs) in solid.of_slice(z) {
        let at = y as usize;
        let beside = [
            row(at.checked_sub(1), Some(z)),
            row(Some(at + 1), Some(z)),
            row(Some(at), z.checked_sub(1)),
            row(Some(at), Some(z + 1)),
        ];
        expose(nodes, runs, beside);
        nodes.end_row(y);
    }
    nodes.end_slice();
}

/// Adds the nodes of a row; `beside` are its neighbours down and up along y, down and up along z.
fn expose(nodes: &mut Rows<Stretch>, runs: &[[u32; 2]], beside: [&[[u32; 2]]; 4]) {
    let mut next = [0; 4];
    for &[start, end] in runs {
        let mut x = start;
        while x < end {
            // How far nothing changes from here on.
            let mut until = end;
            let mut mask = 0;
            for (i, row) in beside.iter().enumerate() {
                while row.get(next[i]).is_some_and(|run| run[1] <= x) {
                    next[i] += 1;
                }
                match row.get(next[i]) {
                    Some(run) if run[0] <= x => until = until.min(run[1]),
                    Some(run) => {
                        until = until.min(run[0]);
                        mask |= 4 << i;
                    }
                    None => mask |= 4 << i,
                }
            }
            if x == start {
                mask |= links::LOW_X;
                until = until.min(x + 1);
            }
            if x + 1 == end {
                mask |= links::HIGH_X;
            } else {
                until = until.min(end - 1);
            }
            if mask != 0 {
                match nodes.last_mut() {
                    Some(last) if last.end == x && last.mask == mask => last.end = until,
                    _ => nodes.push(Stretch { start: x, end: until, mask }),
                }
            }
            x = until;
        }
    }
}

#[cfg(test)]
mod tests;

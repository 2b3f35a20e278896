//! How many data a network has, beside the octree of the same solid.
//!
//! The paper does not say what a datum is, so three definitions are always told together: nodes,
//! items, and bytes. The octree is the region octree of the solid: a node is empty, full, or mixed
//! and has eight children. Source: specification (A12).

use super::compress::{CompressOptions, Compressed, DataCount, Reading, compress};
use super::{Network, NetworkError};
use crate::par;
use crate::run::Run;
use crate::spans::Spans;
use crate::volume::{Region, Volume};
use serde::Serialize;

/// What a network is made of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Census {
    /// Voxels of the solid.
    pub voxels: u64,
    /// Voxels with an exposed face: nodes of the network.
    pub surface_voxels: u64,
    /// Exposed faces.
    pub faces: u64,
    /// The octree of the same solid.
    pub octree: OctreeCount,
    /// Data after compression, by what counts as a link.
    pub compressed: Vec<Compression>,
}

/// The nodes of an octree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct OctreeCount {
    /// Mixed nodes.
    pub mixed: u64,
    /// All nodes: mixed, empty and full.
    pub nodes: u64,
    /// Bytes without pointers: two bits for each child, one where children are voxels.
    pub bytes: u64,
}

/// Data of a compressed network.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Compression {
    /// What counts as a link.
    pub reading: Reading,
    /// The data.
    pub data: DataCount,
    /// Planes, edges and voxels.
    pub nodes: u64,
    /// These, as a share of all nodes of the octree.
    pub of_octree_nodes: f64,
    /// Planes, edges, voxels, loops, and their chains in words.
    pub items: u64,
    /// These, as a share of the octree's mixed nodes.
    pub of_octree_items: f64,
    /// Bytes in plain records.
    pub bytes: u64,
    /// These, as a share of the octree's bytes.
    pub of_octree_bytes: f64,
}

impl Compression {
    /// The data of a compressed network beside the octree of the same solid.
    pub fn new(reading: Reading, compressed: &Compressed, octree: &OctreeCount) -> Self {
        let longest = compressed.dims.into_iter().max().unwrap_or(1) as u64;
        let share = |a: u64, b: u64| if b == 0 { 0.0 } else { a as f64 / b as f64 };
        let data = compressed.count();
        let bytes = plain_bytes(&data, longest);
        Self {
            reading,
            data,
            nodes: data.nodes(),
            of_octree_nodes: share(data.nodes(), octree.nodes),
            items: data.items(),
            of_octree_items: share(data.items(), octree.mixed),
            bytes,
            of_octree_bytes: share(bytes, octree.bytes),
        }
    }
}

/// Counts everything.
pub fn census(solid: &Spans, run: &Run) -> Result<Census, NetworkError> {
    let network = Network::new(solid, run)?;
    run.stage("octree");
    let octree = octree(solid);
    run.check()?;
    run.stage("compress");
    let compressed = Reading::ALL.map(|reading| {
        let options = CompressOptions { reading, ..CompressOptions::default() };
        Compression::new(reading, &compress(&network, &options), &octree)
    });
    Ok(Census {
        voxels: solid.count(),
        surface_voxels: network.count(),
        faces: network.faces(),
        octree,
        compressed: compressed.to_vec(),
    })
}

/// Bytes of data in records of fixed size, for grids of so many voxels along the longest axis.
fn plain_bytes(data: &DataCount, longest: u64) -> u64 {
    let place = u64::from(u64::BITS - (longest - 1).leading_zeros());
    // A normal has an axis with its sign and two slopes of 22 bits; its offset goes with a place.
    let bits = data.planes * (3 + place)
        + data.oblique * (3 + 2 * 22 + 22 + place)
        + data.loops * 3 * place
        + data.chain * 3
        + data.edges * (4 * place + 5)
        + data.voxels * (3 * place + 6);
    bits.div_ceil(8)
}

/// Counts the octree of a solid.
pub fn octree(solid: &Spans) -> OctreeCount {
    let longest = solid.dims().into_iter().max().unwrap_or(1);
    let side = longest.next_power_of_two();
    // Enough parts for all threads, however the solid lies in them.
    let mut tops = vec![[0; 3]];
    let (mut part, mut upper) = (side, 0);
    while part > (side / 8).max(2) {
        let mixed: Vec<[usize; 3]> =
            tops.iter().copied().filter(|&at| is_mixed(solid, at, part)).collect();
        upper += mixed.len() as u64;
        part /= 2;
        tops = mixed.iter().flat_map(|&at| children(at, part)).collect();
    }
    let below = par::map(&tops, |&at| mixed_below(solid, at, part));
    let [mixed, last] = below.iter().fold([upper, 0], |all, n| [all[0] + n[0], all[1] + n[1]]);
    let bits = 16 * (mixed - last) + 8 * last;
    OctreeCount { mixed, nodes: 1 + 8 * mixed, bytes: bits.div_ceil(8) }
}

fn children(at: [usize; 3], side: usize) -> [[usize; 3]; 8] {
    std::array::from_fn(|i| std::array::from_fn(|a| at[a] + side * (i >> a & 1)))
}

/// Mixed nodes at and below one, and how many of them have voxels for children.
fn mixed_below(solid: &Spans, at: [usize; 3], side: usize) -> [u64; 2] {
    if side < 2 || !is_mixed(solid, at, side) {
        return [0; 2];
    }
    let own = [1, u64::from(side == 2)];
    let below = children(at, side / 2).map(|at| mixed_below(solid, at, side / 2));
    below.iter().fold(own, |all, n| [all[0] + n[0], all[1] + n[1]])
}

/// Whether a node is neither empty nor full; beyond the grid all is empty.
fn is_mixed(solid: &Spans, at: [usize; 3], side: usize) -> bool {
    let dims = solid.dims();
    let start: [usize; 3] = std::array::from_fn(|a| at[a].min(dims[a]));
    let end: [usize; 3] = std::array::from_fn(|a| (at[a] + side).min(dims[a]));
    let region = Region { start, end };
    match solid.bounds(region) {
        None | Some([_, 0.0]) => false,
        Some([1.0, _]) => region.len() < side.pow(3),
        Some(_) => true,
    }
}

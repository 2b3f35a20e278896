//! A network in the form that the paper compresses it to, and back.
//!
//! Planes, then ridges, then the nodes that are left; nothing is lost. Source: specification (A8 to
//! A10, A12).

use super::numbered::Numbered;
use super::planes::{PlaneNode, Planes};
use super::ridges::{EdgeNode, ridges};
use super::{Network, Node};
use crate::par;
use crate::volume::Placement;

pub use super::planes::Reading;

/// How a network is compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CompressOptions {
    /// What counts as a link.
    pub reading: Reading,
    /// Planes of fewer voxels are not made.
    pub least_area: u32,
}

impl Default for CompressOptions {
    fn default() -> Self {
        Self { reading: Reading::Faces, least_area: 1 }
    }
}

/// A network as planes, edges and single voxels.
#[derive(Debug, Clone, PartialEq)]
pub struct Compressed {
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// Where voxel centres lie in the world.
    pub placement: Placement,
    /// Regions of planes.
    pub planes: Vec<PlaneNode>,
    /// Straight ridges between their loops.
    pub edges: Vec<EdgeNode>,
    /// All other voxels of the surface.
    pub rest: Vec<Node>,
}

/// How many data a compressed network has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct DataCount {
    /// Plane nodes.
    pub planes: u64,
    /// Edge nodes.
    pub edges: u64,
    /// Single voxels.
    pub voxels: u64,
    /// Loops of all planes.
    pub loops: u64,
    /// Steps of their chains.
    pub chain: u64,
}

impl DataCount {
    /// Planes, edges and voxels: most probably what the paper counts.
    pub fn nodes(&self) -> u64 {
        self.planes + self.edges + self.voxels
    }

    /// With the loops, and with their chains at three bits a step in words of 32 bits.
    pub fn items(&self) -> u64 {
        self.nodes() + self.loops + (3 * self.chain).div_ceil(32)
    }
}

/// Compresses a network in the paper's two steps.
pub fn compress(network: &Network, options: &CompressOptions) -> Compressed {
    let numbered = Numbered::new(network);
    let planes = Planes::new(&numbered, options.reading, options.least_area);
    let (edges, rest) = ridges(&numbered, &planes, options.reading);
    Compressed {
        dims: network.dims(),
        placement: network.placement,
        planes: planes.nodes,
        edges,
        rest,
    }
}

impl Compressed {
    /// The network that it was made from, bit for bit.
    pub fn decompress(&self) -> Network {
        let mut nodes = self.rest.clone();
        nodes.extend(self.edges.iter().flat_map(EdgeNode::nodes));
        nodes.extend(par::map(&self.planes, PlaneNode::nodes).into_iter().flatten());
        par::sort(&mut nodes);
        Network::from_nodes(self.dims, self.placement, nodes)
    }

    /// How many data it has.
    pub fn count(&self) -> DataCount {
        let loops = || self.planes.iter().flat_map(|p| &p.loops);
        DataCount {
            planes: self.planes.len() as u64,
            edges: self.edges.len() as u64,
            voxels: self.rest.len() as u64,
            loops: loops().count() as u64,
            chain: loops().map(|l| l.chain() as u64).sum(),
        }
    }
}

//! A network in the form that the paper compresses it to, and back.
//!
//! Planes, then ridges, then the nodes that are left; nothing is lost. Source: specification (A8 to
//! A10, A12); beyond the paper, planes of any direction (D3.6).

use super::numbered::Numbered;
use super::oblique::{ObliqueNode, oblique};
use super::planes::{PlaneNode, Planes};
use super::ridges::{EdgeNode, ridges};
use super::{Network, Node};
use crate::par;
use crate::volume::Placement;

pub use super::planes::Reading;

/// Planes along the axes of fewer voxels are left to those of any direction.
const LEAST_TERRACE: u32 = 512;

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
    /// Regions of planes of any direction, where these were asked for.
    pub oblique: Vec<ObliqueNode>,
    /// Straight ridges between the loops of planes.
    pub edges: Vec<EdgeNode>,
    /// All other voxels of the surface.
    pub rest: Vec<Node>,
}

/// How many data a compressed network has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct DataCount {
    /// Plane nodes along the axes.
    pub planes: u64,
    /// Plane nodes of any other direction.
    pub oblique: u64,
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
    /// Planes of all kinds, edges and voxels: most probably what the paper counts.
    pub fn nodes(&self) -> u64 {
        self.planes + self.oblique + self.edges + self.voxels
    }

    /// With the loops, and with their chains at three bits a step in words of 32 bits.
    pub fn items(&self) -> u64 {
        self.nodes() + self.loops + (3 * self.chain).div_ceil(32)
    }
}

/// Compresses a network in the paper's two steps.
pub fn compress(network: &Network, options: &CompressOptions) -> Compressed {
    let numbered = Numbered::new(network);
    let mut cracks = vec![0; numbered.nodes.len()];
    let is_oblique = options.reading == Reading::Oblique;
    // Terraces of a slope are better kept as parts of the slope.
    let least = options.least_area.max(if is_oblique { LEAST_TERRACE } else { 1 });
    let mut planes = Planes::new(&numbered, options.reading, least, &mut cracks);
    let first = planes.nodes.len() as u32;
    let slopes = if is_oblique {
        oblique(&numbered, &mut planes.of, &mut cracks, first)
    } else {
        Vec::new()
    };
    let (edges, rest) = ridges(&numbered, &planes, options.reading);
    Compressed {
        dims: network.dims(),
        placement: network.placement,
        planes: planes.nodes,
        oblique: slopes,
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
        nodes.extend(par::map(&self.oblique, ObliqueNode::nodes).into_iter().flatten());
        par::sort(&mut nodes);
        Network::from_nodes(self.dims, self.placement, nodes)
    }

    /// How many data it has.
    pub fn count(&self) -> DataCount {
        let oblique = self.oblique.iter().flat_map(|p| &p.loops);
        let loops = || self.planes.iter().flat_map(|p| &p.loops).chain(oblique.clone());
        DataCount {
            planes: self.planes.len() as u64,
            oblique: self.oblique.len() as u64,
            edges: self.edges.len() as u64,
            voxels: self.rest.len() as u64,
            loops: loops().count() as u64,
            chain: loops().map(|l| l.chain() as u64).sum(),
        }
    }
}

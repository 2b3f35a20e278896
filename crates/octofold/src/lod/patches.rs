//! Patches: one on every crossed edge of a cut that no octant beside it divides.
//!
//! Neighbours of all octants are handed down from their parents', level by level; then each octant
//! looks at its own crossed edges. An edge belongs to the first in the ring, beginning with both high
//! sides, of the deepest octants round it, and its flag is theirs. That makes each patch once, as the
//! recursion over cells, faces and edges of Ju et al. does, in a few steps for each octant and without
//! any search. Source: section 3.3 of the paper, (A) to (D).

use super::cut::{Cut, NONE};
use super::edges::{LOCAL, Local};
use super::tree::Lod;
use super::{LodError, Node};
use crate::par;
use crate::run::Run;
use glam::DVec3;

/// Octants of one block of work.
const BLOCK: usize = 1 << 13;

/// Which edges have patches, and how these are wound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// As published: every crossed edge; patches face as the normals of their octants do.
    Paper,
    /// Every crossed edge; patches face as the surface crosses the edge, and as the normals do where it
    /// crosses there and back. Thin parts stay visible.
    #[default]
    Any,
    /// Edges that are crossed an odd number of times: closed for every closed surface and any cut.
    Parity,
    /// The same, with a vertex for each sheet in an octant: no edge has more than two patches.
    Manifold,
}

impl Mode {
    /// Every mode.
    pub const ALL: [Self; 4] = [Self::Paper, Self::Any, Self::Parity, Self::Manifold];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Any => "any",
            Self::Parity => "parity",
            Self::Manifold => "manifold",
        }
    }

    fn edges(self, node: Node) -> u16 {
        match self {
            Self::Paper | Self::Any => node.any(),
            Self::Parity | Self::Manifold => node.odd(),
        }
    }
}

/// One patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patch {
    /// Places in the cut of the octants round the edge, counter-clockwise seen from outside, the first
    /// on the low side along both other axes. One that takes two places is named twice.
    pub ring: [u32; 4],
    /// Place of the octant that the edge belongs to.
    pub owner: u32,
    /// The edge's number in that octant.
    pub edge: u8,
    /// It faces along the edge's axis, and not against it.
    pub along: bool,
}

impl Patch {
    /// The distinct octants: three or four.
    pub fn corners(&self) -> impl Iterator<Item = u32> {
        let ring = self.ring;
        (0..4).filter(move |&i| ring[i] != ring[(i + 3) % 4]).map(move |i| ring[i])
    }
}

/// The patches of a cut, in the order of their owners.
pub type Patches = Vec<Patch>;

/// The patches of a cut.
///
/// # Errors
/// Where the work is interrupted.
pub fn patches(lod: &Lod, cut: &Cut, mode: Mode, run: &Run) -> Result<Patches, LodError> {
    run.stage("patches");
    let rings = Rings::new(cut);
    let parts = par::blocks(run, cut.entries.len(), BLOCK, |block| {
        let mut part = Vec::with_capacity(block.len());
        let mut level = cut.level_of(block.start as u32) as usize;
        for place in block {
            while place as u32 >= cut.starts[level + 1] {
                level += 1;
            }
            rings.of_octant(lod, place as u32, cut.starts[level], mode, &mut part);
        }
        part
    })?;
    Ok(match <[Patches; 1]>::try_from(parts) {
        Ok([only]) => only,
        Err(parts) => parts.concat(),
    })
}

/// Neighbours of a cut's octants: of the same size, larger ones of the cut, or none.
struct Rings<'a> {
    cut: &'a Cut,
    /// By way `2 axis + side`.
    neighbours: Vec<[u32; 6]>,
}

impl<'a> Rings<'a> {
    fn new(cut: &'a Cut) -> Self {
        let mut neighbours = Vec::with_capacity(cut.entries.len());
        neighbours.push([NONE; 6]);
        for i in 0..cut.entries.len() {
            let entry = cut.entries[i];
            if entry.first == NONE {
                continue;
            }
            let around = neighbours[i];
            let beside = around.map(|n| {
                // Children of a neighbour that is in the cut are that neighbour itself.
                let Some(entry) = cut.entries.get(n as usize) else { return (NONE, 0, 0) };
                if entry.first == NONE { (n, 0xff, 0) } else { (entry.first, entry.mask, u32::MAX) }
            });
            let child = |(first, mask, step): (u32, u8, u32), octant: u32| {
                let before = (u32::from(mask) & ((1 << octant) - 1)).count_ones();
                if mask >> octant & 1 == 0 { NONE } else { first + (before & step) }
            };
            let own = (entry.first, entry.mask, u32::MAX);
            let mut rest = entry.mask;
            while rest != 0 {
                let octant = rest.trailing_zeros();
                rest &= rest - 1;
                let mut of_child = [NONE; 6];
                for axis in 0..3 {
                    let other = octant ^ (1 << axis);
                    let side = (octant >> axis & 1) as usize;
                    of_child[2 * axis + side] = child(beside[2 * axis + side], other);
                    of_child[2 * axis + (side ^ 1)] = child(own, other);
                }
                neighbours.push(of_child);
            }
        }
        Self { cut, neighbours }
    }

    /// Adds the patches on the edges that belong to an octant; octants of its level begin at `level`.
    #[inline]
    fn of_octant(&self, lod: &Lod, place: u32, level: u32, mode: Mode, patches: &mut Patches) {
        let entry = &self.cut.entries[place as usize];
        if entry.first != NONE {
            return;
        }
        let node = lod.nodes()[entry.node as usize];
        let mut edges = mode.edges(node);
        while edges != 0 {
            let edge = edges.trailing_zeros() as usize;
            edges &= edges - 1;
            if let Some(mut ring) = self.ring(place, level, &LOCAL[edge]) {
                let along = self.faces_along(lod, node, edge, &ring, mode);
                if !along {
                    ring.swap(1, 3);
                }
                patches.push(Patch { ring, owner: place, edge: edge as u8, along });
            }
        }
    }

    /// The octants round an edge of an octant, where the edge belongs to it and none of them divides
    /// the edge.
    #[inline]
    fn ring(&self, place: u32, level: u32, local: &Local) -> Option<[u32; 4]> {
        let around = &self.neighbours[place as usize];
        let [first, second] = local.ways.map(|way| around[way]);
        if first == NONE || second == NONE {
            return None;
        }
        let front = |n: u32| self.cut.entries[n as usize].first == NONE;
        // Larger neighbours stand before the level, and are in the cut.
        let (beside_first, beside_second) = (first >= level, second >= level);
        let high = local.sides[0] == 1;
        if high && beside_first || local.sides[1] == 1 && beside_second {
            return None;
        }
        let third = if beside_first {
            self.neighbours[first as usize][local.ways[1]]
        } else if beside_second {
            self.neighbours[second as usize][local.ways[0]]
        } else {
            self.across(place, first, second, local)
        };
        if third == NONE || high && third >= level {
            return None;
        }
        if !(front(first) && front(second) && front(third)) {
            return None;
        }
        let mut ring = [place; 4];
        ring[local.places[1]] = first;
        ring[local.places[2]] = second;
        ring[local.places[3]] = third;
        Some(ring)
    }

    /// The octant across both sides of an edge, where those across one side are larger.
    #[cold]
    fn across(&self, place: u32, first: u32, second: u32, local: &Local) -> u32 {
        let own = self.cut.octant(place);
        let axes = local.ways.map(|way| way / 2);
        let at = |i: usize| own.corner[axes[i]] + local.sides[i] * own.size;
        // The edge may lie within a face of a larger one, which then is on both sides.
        let spans = |n: u32, i: usize| {
            let other = self.cut.octant(n);
            other.corner[axes[i]] < at(i) && at(i) < other.corner[axes[i]] + other.size
        };
        if spans(first, 1) {
            return first;
        }
        if spans(second, 0) {
            return second;
        }
        let mut found = self.neighbours[first as usize][local.ways[1]];
        while let Some(entry) = self.cut.entries.get(found as usize)
            && entry.first != NONE
        {
            let octant = self.cut.octant(found);
            if octant.size <= own.size {
                break;
            }
            // Towards the edge, which lies on one of its own edges.
            let half = octant.size / 2;
            let mut child = 0;
            for (i, axis) in axes.into_iter().enumerate() {
                child |= u32::from(at(i) > octant.corner[axis]) << axis;
            }
            let along = own.corner[local.axis] >= octant.corner[local.axis] + half;
            child |= u32::from(along) << local.axis;
            if entry.mask >> child & 1 == 0 {
                return NONE;
            }
            let before = (u32::from(entry.mask) & ((1 << child) - 1)).count_ones();
            found = entry.first + before;
        }
        found
    }

    /// Whether a patch on an edge faces along the edge's axis.
    #[inline]
    fn faces_along(&self, lod: &Lod, node: Node, edge: usize, ring: &[u32; 4], mode: Mode) -> bool {
        if mode != Mode::Paper && node.odd() >> edge & 1 == 1 {
            return node.negative() >> edge & 1 == 0;
        }
        let normal = |&n: &u32| lod.normal(self.cut.entries[n as usize].node);
        let sum: DVec3 = ring.iter().map(normal).sum();
        lod.along(LOCAL[edge].axis).dot(sum) >= 0.0
    }
}

//! Patches: one on every crossed edge of a cut that no octant beside it divides.
//!
//! Neighbours of all octants are handed down from their parents', level by level; then each octant
//! looks at its own crossed edges. An edge belongs to the first in the ring, beginning with both high
//! sides, of the deepest octants round it, and its flag is theirs. That makes each patch once, as the
//! recursion over cells, faces and edges of Ju et al. does, in a few steps for each octant and without
//! any search. Source: section 3.3 of the paper, (A) to (D).

use super::cut::{Cut, Entry, NONE, Octant};
use super::edges::{LOCAL, Local};
use super::tree::Lod;
use super::{LodError, Node};
use crate::par;
use crate::run::Run;
use glam::DVec3;
use std::ops::Range;

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
    let mut neighbours = Vec::new();
    neighbours_of(cut, &mut neighbours);
    let rings = Rings { lod, around: CutAround { cut, neighbours: &neighbours }, mode };
    let parts = par::blocks(run, cut.entries.len(), BLOCK, |block| {
        let mut part = Vec::with_capacity(block.len());
        rings.of_octants(block, &mut part);
        part
    })?;
    Ok(parts.concat())
}

/// Patches that are made again and again, frame after frame, in the same memory and on one thread.
#[derive(Debug, Clone, Default)]
pub struct Patchwork {
    neighbours: Vec<[u32; 6]>,
    patches: Patches,
}

impl Patchwork {
    /// Makes the patches of a cut: those of [`patches`].
    pub fn make(&mut self, lod: &Lod, cut: &Cut, mode: Mode) -> &[Patch] {
        neighbours_of(cut, &mut self.neighbours);
        self.patches.clear();
        let rings = Rings { lod, around: CutAround { cut, neighbours: &self.neighbours }, mode };
        rings.of_octants(0..cut.entries.len(), &mut self.patches);
        &self.patches
    }
}

/// Neighbours of a cut's octants, by way `2 axis + side`: of the same size, larger ones of the cut, or
/// none.
pub(super) fn neighbours_of(cut: &Cut, neighbours: &mut Vec<[u32; 6]>) {
    let entries = cut.entries.as_slice();
    neighbours.clear();
    neighbours.reserve(entries.len());
    neighbours.push([NONE; 6]);
    for (i, entry) in entries.iter().enumerate() {
        if entry.first == NONE {
            continue;
        }
        let around = neighbours[i];
        let beside =
            around.map(|n| entries.get(n as usize).map_or(Family::NOBODY, |e| Family::of(n, e)));
        let own = Family::of(i as u32, entry);
        let mut rest = entry.mask;
        while rest != 0 {
            let octant = rest.trailing_zeros();
            rest &= rest - 1;
            let mut of_child = [NONE; 6];
            for axis in 0..3 {
                let other = octant ^ (1 << axis);
                let side = (octant >> axis & 1) as usize;
                of_child[2 * axis + side] = beside[2 * axis + side].child(other);
                of_child[2 * axis + (side ^ 1)] = own.child(other);
            }
            neighbours.push(of_child);
        }
    }
}

/// Children of an octant; an octant of the cut stands for all of its own.
#[derive(Debug, Clone, Copy)]
struct Family {
    first: u32,
    mask: u32,
    step: u32,
}

impl Family {
    const NOBODY: Self = Self { first: NONE, mask: 0, step: 0 };

    #[inline]
    fn of(place: u32, entry: &Entry) -> Self {
        if entry.first == NONE {
            return Self { first: place, mask: 0xff, step: 0 };
        }
        Self { first: entry.first, mask: u32::from(entry.mask), step: u32::MAX }
    }

    #[inline]
    fn child(self, octant: u32) -> u32 {
        let before = count(self.mask & ((1 << octant) - 1)) & self.step;
        if self.mask >> octant & 1 == 0 { NONE } else { self.first + before }
    }
}

/// Bits of a byte that are set. Not every processor that this runs on has an instruction for it.
#[inline]
fn count(byte: u32) -> u32 {
    const COUNTS: [u8; 256] = {
        let mut counts = [0; 256];
        let mut byte = 0;
        while byte < 256 {
            counts[byte] = (byte as u32).count_ones() as u8;
            byte += 1;
        }
        counts
    };
    u32::from(COUNTS[(byte & 0xff) as usize])
}

/// Octants of a cut, and what is round them. Places are in the order of levels.
pub(super) trait Around {
    /// The octant across a side, by way `2 axis + side`: of the same size, or a larger one of the cut;
    /// [`NONE`] where there is none.
    fn beside(&self, place: u32, way: usize) -> u32;

    /// Whether an octant is one of those that the cut is made of.
    fn is_front(&self, place: u32) -> bool;

    /// Where an octant is, and its node.
    fn octant(&self, place: u32) -> Octant;

    /// A child of an octant above the cut; [`NONE`] where there is none.
    fn child(&self, place: u32, octant: u32) -> u32;

    /// An octant's node.
    fn node(&self, place: u32) -> u32;
}

struct CutAround<'a> {
    cut: &'a Cut,
    neighbours: &'a [[u32; 6]],
}

impl Around for CutAround<'_> {
    #[inline]
    fn beside(&self, place: u32, way: usize) -> u32 {
        self.neighbours[place as usize][way]
    }

    #[inline]
    fn is_front(&self, place: u32) -> bool {
        self.cut.entries[place as usize].first == NONE
    }

    fn octant(&self, place: u32) -> Octant {
        self.cut.octant(place)
    }

    fn child(&self, place: u32, octant: u32) -> u32 {
        Family::of(place, &self.cut.entries[place as usize]).child(octant)
    }

    #[inline]
    fn node(&self, place: u32) -> u32 {
        self.cut.entries[place as usize].node
    }
}

/// Patches on the edges of octants.
pub(super) struct Rings<'a, A> {
    pub lod: &'a Lod,
    pub around: A,
    pub mode: Mode,
}

impl Rings<'_, CutAround<'_>> {
    fn of_octants(&self, places: Range<usize>, patches: &mut Patches) {
        let starts = &self.around.cut.starts;
        let mut level = self.around.cut.level_of(places.start as u32) as usize;
        for place in places {
            while place as u32 >= starts[level + 1] {
                level += 1;
            }
            if self.around.is_front(place as u32) {
                self.of_octant(place as u32, starts[level], |patch| patches.push(patch));
            }
        }
    }
}

impl<A: Around> Rings<'_, A> {
    /// Adds the patches on the edges that belong to an octant; octants of its level begin at `level`.
    #[inline]
    pub(super) fn of_octant(&self, place: u32, level: u32, mut push: impl FnMut(Patch)) {
        let node = self.lod.nodes()[self.around.node(place) as usize];
        let mut edges = self.mode.edges(node);
        while edges != 0 {
            let edge = edges.trailing_zeros() as usize;
            edges &= edges - 1;
            if let Some(mut ring) = self.ring(place, level, &LOCAL[edge]) {
                let along = self.faces_along(node, edge, &ring);
                if !along {
                    ring.swap(1, 3);
                }
                push(Patch { ring, owner: place, edge: edge as u8, along });
            }
        }
    }

    /// The octants round an edge of an octant, where the edge belongs to it and none of them divides
    /// the edge.
    #[inline]
    fn ring(&self, place: u32, level: u32, local: &Local) -> Option<[u32; 4]> {
        let [first, second] = local.ways.map(|way| self.around.beside(place, way));
        if first == NONE || second == NONE {
            return None;
        }
        let front = |n: u32| self.around.is_front(n);
        // Larger neighbours stand before the level, and are in the cut.
        let (beside_first, beside_second) = (first >= level, second >= level);
        let high = local.sides[0] == 1;
        if high && beside_first || local.sides[1] == 1 && beside_second {
            return None;
        }
        let third = if beside_first {
            self.around.beside(first, local.ways[1])
        } else if beside_second {
            self.around.beside(second, local.ways[0])
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
        let own = self.around.octant(place);
        let axes = local.ways.map(|way| way / 2);
        let at = |i: usize| own.corner[axes[i]] + local.sides[i] * own.size;
        // The edge may lie within a face of a larger one, which then is on both sides.
        let spans = |n: u32, i: usize| {
            let other = self.around.octant(n);
            other.corner[axes[i]] < at(i) && at(i) < other.corner[axes[i]] + other.size
        };
        if spans(first, 1) {
            return first;
        }
        if spans(second, 0) {
            return second;
        }
        let mut found = self.around.beside(first, local.ways[1]);
        while found != NONE && !self.around.is_front(found) {
            let octant = self.around.octant(found);
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
            found = self.around.child(found, child);
        }
        found
    }

    /// Whether a patch on an edge faces along the edge's axis.
    #[inline]
    fn faces_along(&self, node: Node, edge: usize, ring: &[u32; 4]) -> bool {
        if self.mode != Mode::Paper && node.odd() >> edge & 1 == 1 {
            return node.negative() >> edge & 1 == 0;
        }
        let normal = |&n: &u32| self.lod.normal(self.around.node(n));
        let sum: DVec3 = ring.iter().map(normal).sum();
        self.lod.along(LOCAL[edge].axis).dot(sum) >= 0.0
    }
}

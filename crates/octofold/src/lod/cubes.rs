//! What marching cubes must know of each octant: where the surface crosses its edges.
//!
//! An edge that is crossed an odd number of times has exactly one such half, and so on down to an edge
//! of the finest grid: its crossing is that of all larger edges that it is part of. So octants of all
//! levels share their vertices. The sides of an octant's corners follow from its edges.
//! Source: Lorensen and Cline 1987, on octants as in section 1 of the paper.

use super::crossings::Crossings;
use super::direction;
use super::edges::HALVES;
use super::leaves::{Found, Leaves};
use super::pyramid::{Level, firsts};
use super::tree::{Lod, Node};
use crate::surface::cell::{NO_EDGE, ONWARD, RINGS, crossed, edge_corner};
use std::sync::LazyLock;

/// Stands for no vertex.
const NONE: u32 = u32::MAX;

/// The crossings of the edges of a model's octants.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cubes {
    /// First crossing of each octant, and one past the last.
    firsts: Vec<u32>,
    /// The vertices on an octant's edges that are crossed an odd number of times, in the order of edges.
    crossings: Vec<u32>,
    /// Where the vertices are, in finest cells.
    pub(super) places: Vec<[f32; 3]>,
    /// Their normals in the world, as points of an unfolded octahedron.
    pub(super) normals: Vec<[u8; 2]>,
}

impl Cubes {
    /// The crossings of the octants of `lod`, which was made of all the rest: of a mesh, so that normals
    /// are the same in the grid and in the world.
    pub(super) fn of(lod: &Lod, levels: &[Level], leaves: &Leaves, found: &Crossings) -> Self {
        let mut cubes = Self { firsts: vec![0], ..Self::default() };
        let mut numbers = Vec::with_capacity(found.edges.len());
        for (i, edge) in found.edges.iter().enumerate() {
            let mut samples: Vec<usize> = found.of(i).collect();
            if samples.len().is_multiple_of(2) {
                numbers.push(NONE);
                continue;
            }
            samples.sort_by(|&a, &b| found.samples[a].along.total_cmp(&found.samples[b].along));
            let sample = &found.samples[samples[samples.len() / 2]];
            numbers.push(cubes.places.len() as u32);
            cubes.places.push(edge.at(sample).as_vec3().to_array());
            cubes.normals.push(direction::packed(sample.normal.as_dvec3()));
        }
        let of_leaf = |i: usize| {
            let mut own = [NONE; 12];
            for what in leaves.found(i) {
                if let Found::Edge(edge, local) = what {
                    own[local] = numbers[edge];
                }
            }
            own
        };
        let mut all = vec![(0..leaves.codes.len()).map(of_leaf).collect::<Vec<_>>()];
        for level in levels.iter().rev().skip(1) {
            let above = all.last().map(|below| of_parents(level, below)).unwrap_or_default();
            all.push(above);
        }
        all.reverse();
        // Places in the full tree of the octants that the model kept.
        let mut kept = vec![0];
        for (depth, own) in all.iter().enumerate() {
            let children = firsts(&levels[depth]);
            let mut below = Vec::new();
            for (node, &i) in lod.level(depth as u32).zip(&kept) {
                cubes.crossings.extend(own[i].iter().filter(|&&v| v != NONE));
                cubes.firsts.push(cubes.crossings.len() as u32);
                let count = lod.nodes()[node as usize].children().count_ones() as usize;
                let first = children[i] as usize;
                below.extend(first..first + count);
            }
            kept = below;
        }
        cubes
    }

    /// The vertices of an octant, in the order of its edges that are crossed an odd number of times.
    #[inline]
    pub(super) fn vertices(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.crossings[self.firsts[node] as usize..self.firsts[node + 1] as usize]
    }

    /// The vertex on an edge of an octant, where that is crossed an odd number of times.
    #[inline]
    pub(super) fn vertex(&self, lod: &Lod, node: u32, edge: usize) -> Option<u32> {
        let odd = lod.nodes()[node as usize].odd();
        let before = (odd & ((1 << edge) - 1)).count_ones() as usize;
        (odd >> edge & 1 == 1).then(|| self.vertices(node)[before])
    }

    /// Crossings over all octants: an edge counts for each octant that it belongs to.
    pub fn crossings(&self) -> usize {
        self.crossings.len()
    }

    /// Bytes that it takes in memory.
    pub fn bytes(&self) -> usize {
        4 * (self.firsts.len() + self.crossings.len())
            + 12 * self.places.len()
            + 2 * self.normals.len()
    }
}

/// The vertices of the octants of a level from those of their children.
fn of_parents(level: &Level, below: &[[u32; 12]]) -> Vec<[u32; 12]> {
    let mut children = below.iter();
    let of = |&mask: &u8| {
        let mut own = [NONE; 12];
        for octant in (0..8).filter(|o| mask >> o & 1 == 1) {
            let Some(child) = children.next() else { break };
            for edge in (0..12).filter(|e| HALVES[octant] >> e & 1 == 1 && child[*e] != NONE) {
                own[edge] = if own[edge] == NONE { child[edge] } else { NONE };
            }
        }
        own
    };
    level.masks.iter().map(of).collect()
}

/// The surface in a cell, by its corners: vertices are counted in the order of the cell's crossed edges
/// in the numbers of this module.
#[derive(Debug, Clone, Default)]
pub(super) struct Piece {
    pub triangles: Vec<[u8; 3]>,
    /// The first triangle of each loop.
    pub loops: Vec<u8>,
    /// On each face the segments that triangles have there, in their direction.
    pub segments: [Vec<[u8; 2]>; 6],
}

/// The pieces of all cells, and which cell has which edges.
pub(super) struct Cells {
    pieces: Vec<Piece>,
    /// The corners that are inside by the crossed edges, with corner 0 outside.
    masks: Vec<u16>,
}

/// Stands for edges that no cell has.
const NO_MASK: u16 = u16::MAX;

impl Cells {
    /// The piece in an octant; none where nothing crosses its edges oddly, or the surface is not closed
    /// there.
    #[inline]
    pub(super) fn piece(&self, node: Node) -> Option<&Piece> {
        let odd = node.odd();
        let mask = self.masks[odd as usize];
        if odd == 0 || mask == NO_MASK {
            return None;
        }
        let edge = odd.trailing_zeros() as usize;
        let low_is_inside = node.negative() >> edge & 1 == 0;
        let is_inside = mask >> edge_corner(turned(edge)) & 1 == 1;
        let mask = if low_is_inside == is_inside { mask } else { !mask & 0xff };
        Some(&self.pieces[mask as usize])
    }
}

/// The number that an edge has in the cell of marching cubes; and back.
fn turned(edge: usize) -> usize {
    // There sides are in the order of axes, here they begin with the axis after.
    if edge / 4 == 1 { 4 + (edge >> 1 & 1 | (edge & 1) << 1) } else { edge }
}

pub(super) static CELLS: LazyLock<Cells> = LazyLock::new(|| {
    let odd =
        |mask: usize| (0..12).fold(0u16, |odd, e| odd | (crossed(mask) >> turned(e) & 1) << e);
    let mut masks = vec![NO_MASK; 1 << 12];
    // With corner 0 outside; the other half has the same edges.
    for mask in (0..256).step_by(2) {
        masks[odd(mask) as usize] = mask as u16;
    }
    let pieces = (0..256).map(|mask| {
        let own = odd(mask);
        let rank = |e: u8| (own & ((1 << turned(e.into())) - 1)).count_ones() as u8;
        let mut piece = Piece::default();
        for ring in &RINGS[mask] {
            piece.loops.push(piece.triangles.len() as u8);
            let corner = |place: u32| rank(ring.edges[place as usize]);
            piece.triangles.extend(ring.triangles.iter().map(|t| t.map(corner)));
        }
        for (face, segments) in piece.segments.iter_mut().enumerate() {
            let onward = &ONWARD[mask][face];
            let ends = (0..12u8).map(|from| [from, onward[from as usize]]);
            segments.extend(ends.filter(|[_, to]| *to != NO_EDGE).map(|ends| ends.map(rank)));
        }
        piece
    });
    Cells { pieces: pieces.collect(), masks }
});

#[cfg(test)]
mod tests {
    use super::super::edges::LOCAL;
    use super::*;

    #[test]
    fn edges_have_the_same_ends_in_both_numbers() {
        for (edge, local) in LOCAL.iter().enumerate() {
            let low = edge_corner(turned(edge));
            let [b, c] = super::super::edges::across(local.axis);
            let expected = local.sides[0] << b | local.sides[1] << c;
            assert_eq!((low as u32, turned(edge) / 4), (expected, local.axis));
            assert_eq!(turned(turned(edge)), edge);
        }
    }

    #[test]
    fn edges_tell_the_corners() {
        let known = CELLS.masks.iter().filter(|&&m| m != NO_MASK).count();
        assert_eq!(known, 128);
        for (odd, &mask) in CELLS.masks.iter().enumerate().filter(|(_, m)| **m != NO_MASK) {
            let edges = (0..12).filter(|&e| crossed(mask.into()) >> turned(e) & 1 == 1);
            assert_eq!(edges.fold(0, |odd, e| odd | 1 << e), odd);
        }
    }
}

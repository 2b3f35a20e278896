//! What lies open between a face of an octant and the smaller octants on its other side.
//!
//! The segments on a face and those on its four quarters, together with the ways along its edges where
//! only the halves are crossed, make closed loops: the outlines of cracks. Where quarters are divided
//! again, so are their cracks, level by level. What is added along edges cancels out over the faces
//! round each, so that filling all loops closes any cut of a closed surface.
//! Source: Shu, Zhou, Kankanhalli 1995, "patching the cracks using polygons of the same shape"; by
//! chains instead of a table of cases.

use super::cubes::{CELLS, Cubes};
use super::cut::{Cut, NONE};
use super::tree::Lod;

/// The edges of an octant on its side `way`: those on the low and high sides along the next axis, then
/// along the one after.
pub(super) const fn on_face(way: usize) -> [usize; 4] {
    let (axis, side) = (way / 2, way % 2);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    [4 * v + side, 4 * v + side + 2, 4 * u + 2 * side, 4 * u + 2 * side + 1]
}

/// The child on side `way` of an octant, on these sides along the next axis and the one after.
pub(super) const fn quarter(way: usize, u: usize, v: usize) -> u32 {
    let axis = way / 2;
    ((way % 2) << axis | u << ((axis + 1) % 3) | v << ((axis + 2) % 3)) as u32
}

/// Where cracks are looked for.
pub(super) struct Cracks<'a> {
    pub lod: &'a Lod,
    pub cubes: &'a Cubes,
    pub cut: &'a Cut,
}

impl Cracks<'_> {
    /// The place of a child of an octant above the cut; [`NONE`] where there is none.
    #[inline]
    pub(super) fn child(&self, place: u32, octant: u32) -> u32 {
        let entry = &self.cut.entries[place as usize];
        let before = (u32::from(entry.mask) & ((1 << octant) - 1)).count_ones();
        if entry.mask >> octant & 1 == 0 { NONE } else { entry.first + before }
    }

    /// The segments of an octant's triangles on its side `way`: no more than two.
    pub(super) fn segments(
        &self,
        node: u32,
        way: usize,
    ) -> impl Iterator<Item = [u32; 2]> + Clone + use<'_> {
        let piece = CELLS.piece(self.lod.nodes()[node as usize]);
        let own = self.cubes.vertices(node);
        let segments = piece.map_or(&[][..], |piece| &piece.segments[way]);
        segments.iter().map(|ends| ends.map(|e| own[e as usize]))
    }

    /// The vertices on the edges of an octant's side `way`.
    pub(super) fn crossings(&self, node: u32, way: usize) -> [Option<u32>; 4] {
        on_face(way).map(|edge| self.cubes.vertex(self.lod, node, edge))
    }

    /// Visits the outlines of all cracks between the front octant `coarse` and the divided octant
    /// `beside` across its side `way`, each in the direction of the triangles beside it.
    pub(super) fn visit(
        &self,
        coarse: u32,
        way: usize,
        beside: u32,
        crack: &mut impl FnMut(&[u32]),
    ) {
        let node = self.cut.entries[coarse as usize].node;
        let (segments, crossings) = (self.segments(node, way), self.crossings(node, way));
        self.of_face(segments.collect(), crossings, beside, way ^ 1, crack);
    }

    /// The cracks between segments on a face, as triangles on one side have them, and the children of
    /// `divided`, which has that face as its side `way`.
    fn of_face(
        &self,
        mut segments: Vec<[u32; 2]>,
        crossings: [Option<u32>; 4],
        divided: u32,
        way: usize,
        crack: &mut impl FnMut(&[u32]),
    ) {
        let mut halves = [[None; 2]; 4];
        for (u, v) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let child = self.child(divided, quarter(way, u, v));
            if child == NONE {
                continue;
            }
            let node = self.cut.entries[child as usize].node;
            let own = self.segments(node, way);
            segments.extend(own.clone());
            let edges = self.crossings(node, way);
            halves[u][v] = edges[u];
            halves[2 + v][u] = edges[2 + v];
            if !self.cut.is_front(child) {
                let turned = own.map(|[from, to]| [to, from]).collect();
                self.of_face(turned, edges, child, way, crack);
            }
        }
        for (whole, halves) in crossings.iter().zip(halves) {
            let ([Some(first), Some(second)], None) = (halves, whole) else { continue };
            let arrives = segments.iter().any(|&[_, to]| to == first);
            segments.push(if arrives { [first, second] } else { [second, first] });
        }
        outlines(segments, crack);
    }
}

/// Joins segments to loops; those of two segments there and back are none.
fn outlines(mut segments: Vec<[u32; 2]>, crack: &mut impl FnMut(&[u32])) {
    while let Some([start, mut at]) = segments.pop() {
        let mut outline = vec![start];
        while at != start {
            outline.push(at);
            let Some(next) = segments.iter().position(|&[from, _]| from == at) else { break };
            at = segments.swap_remove(next)[1];
        }
        if at == start && outline.len() > 2 {
            crack(&outline);
        }
    }
}

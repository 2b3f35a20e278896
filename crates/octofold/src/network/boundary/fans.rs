//! The faces of voxels round a corner of the grid, as fans.
//!
//! Eight voxels meet at a corner. The exposed faces among them that touch it form rings, each linked to
//! the next across the edge that they share: one ring for each vertex that a 2-manifold needs there.
//! Links part voxels that touch along an edge only. Source: specification (A4).

use std::sync::LazyLock;

/// Which of the eight voxels are filled: bit `o` for octant `o`, whose bit `a` tells that it is the higher
/// along axis `a`.
pub type Filled = u8;

/// A face at a corner: of the voxel in an octant, towards the corner along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Octant of its voxel.
    pub octant: u8,
    /// The axis that it is square to.
    pub axis: u8,
}

/// Stands for a face that is not exposed.
const NONE: u8 = u8::MAX;

/// The fan of each face, by filled voxels.
static FANS: LazyLock<Vec<[u8; 24]>> = LazyLock::new(|| (0..=255).map(fans).collect());

impl Face {
    fn number(self) -> usize {
        usize::from(self.octant * 3 + self.axis)
    }

    fn is_exposed(self, filled: Filled) -> bool {
        filled >> self.octant & 1 == 1 && filled >> (self.octant ^ 1 << self.axis) & 1 == 0
    }

    /// The face across the edge along `edge`, and whether it goes on in the same plane.
    fn across(self, filled: Filled, edge: u8) -> (Self, bool) {
        let aside = 3 - self.axis - edge;
        let beside = self.octant ^ 1 << aside;
        let above = beside ^ 1 << self.axis;
        let is = |octant: u8| filled >> octant & 1 == 1;
        if is(beside) && is(above) {
            (Self { octant: above, axis: aside }, false)
        } else if is(beside) {
            (Self { octant: beside, axis: self.axis }, true)
        } else {
            (Self { octant: self.octant, axis: aside }, false)
        }
    }
}

/// The fan that an exposed face is of.
pub fn fan_of(filled: Filled, face: Face) -> u8 {
    FANS[filled as usize][face.number()]
}

/// Which fans need a vertex: bit `f` for fan `f`. None is needed where all faces of a fan are of one
/// polygon, or two polygons share a straight edge through the corner. `parted` tells of two faces side by
/// side in a plane whether they are of different polygons.
pub fn vertices(filled: Filled, mut parted: impl FnMut(Face, Face) -> bool) -> u8 {
    let mut needed = 0;
    let mut seen = 0u8;
    for start in faces(filled) {
        let fan = fan_of(filled, start);
        if seen >> fan & 1 == 1 {
            continue;
        }
        seen |= 1 << fan;
        let mut edges: Vec<(u8, u8)> = Vec::new();
        walk(filled, start, |from, to, edge, coplanar| {
            if !coplanar || parted(from, to) {
                edges.push((edge, from.octant >> edge & 1));
            }
        });
        let straight = match edges[..] {
            [] => true,
            [a, b] => a.0 == b.0 && a.1 != b.1,
            _ => false,
        };
        needed |= u8::from(!straight) << fan;
    }
    needed
}

/// All exposed faces.
fn faces(filled: Filled) -> impl Iterator<Item = Face> {
    let all = (0..24u8).map(|i| Face { octant: i / 3, axis: i % 3 });
    all.filter(move |f| f.is_exposed(filled))
}

/// Goes round a fan, across one edge after the other.
fn walk(filled: Filled, start: Face, mut visit: impl FnMut(Face, Face, u8, bool)) {
    let (mut face, mut edge) = (start, (start.axis + 1) % 3);
    loop {
        let (next, coplanar) = face.across(filled, edge);
        visit(face, next, edge, coplanar);
        if next == start {
            return;
        }
        edge = 3 - next.axis - edge;
        face = next;
    }
}

fn fans(filled: Filled) -> [u8; 24] {
    let mut fans = [NONE; 24];
    let mut next = 0;
    for start in faces(filled) {
        if fans[start.number()] == NONE {
            walk(filled, start, |face, _, _, _| fans[face.number()] = next);
            next += 1;
        }
    }
    fans
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_face_is_in_one_ring_and_rings_lead_both_ways() {
        for filled in 0..=255u8 {
            for face in faces(filled) {
                assert!(fan_of(filled, face) < 4);
                for edge in (0..3).filter(|&e| e != face.axis) {
                    let (other, coplanar) = face.across(filled, edge);
                    assert!(other.is_exposed(filled));
                    assert_eq!(other.across(filled, edge), (face, coplanar));
                    assert_eq!(fan_of(filled, other), fan_of(filled, face));
                }
            }
        }
    }

    #[test]
    fn corners_have_the_vertices_that_they_need() {
        let plain = |filled| vertices(filled, |_, _| false);
        // Nothing, a plane, an edge; a corner; voxels that touch at an edge and at the corner only.
        assert_eq!([plain(0), plain(0b1111), plain(0b0011), plain(255)], [0; 4]);
        assert_eq!(plain(1), 1);
        assert_eq!(plain(0b1000_0001), 0b11);
        assert_eq!(plain(0b1001), 0b11);
        assert_eq!(plain(0b0110_1001), 0b1111);
        // A plane of four polygons.
        assert_eq!(vertices(0b1111, |_, _| true), 1);
    }
}

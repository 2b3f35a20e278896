//! Links: the faces that meet a face at its four sides.
//!
//! Across each side of an exposed face the surface goes on in one of three ways: up the wall of a
//! neighbour (concave), flat onto the next voxel (coplanar), or round the edge of the same voxel
//! (convex). Where two voxels touch along an edge only, the rule tells whether the surfaces part or
//! join. Links are closed and bidirectional under both rules. Source: specification (A4); digital
//! surfaces of Artzy, Frieder and Herman 1981.

use super::{Direction, Mask};

/// The bit of the face downwards along x.
pub const LOW_X: Mask = 1;

/// The bit of the face upwards along x.
pub const HIGH_X: Mask = 2;

/// What becomes of two voxels that share an edge only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// Their surfaces part: the solid is 6-connected, the rest 26-connected.
    #[default]
    Split,
    /// They join: the solid is 18-connected, the rest 6-connected.
    Join,
}

/// An exposed face of a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Face {
    /// The voxel.
    pub at: [u32; 3],
    /// Where it is exposed.
    pub direction: Direction,
}

/// The four directions along a face.
pub fn tangents(direction: Direction) -> [Direction; 4] {
    let axis = direction / 2;
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    [2 * u, 2 * u + 1, 2 * v, 2 * v + 1]
}

/// The voxel one step on; `None` below 0.
pub fn step(at: [u32; 3], direction: Direction) -> Option<[u32; 3]> {
    let mut next = at;
    let axis = direction as usize / 2;
    next[axis] =
        if direction % 2 == 1 { at[axis].checked_add(1)? } else { at[axis].checked_sub(1)? };
    Some(next)
}

/// The face behind side `tangent` of a face; `contains` tells what is in the solid.
pub fn link(
    face: Face,
    tangent: Direction,
    rule: Rule,
    contains: impl Fn([u32; 3]) -> bool,
) -> Face {
    let filled = |at: Option<[u32; 3]>| at.filter(|&at| contains(at));
    let beside = filled(step(face.at, tangent));
    let above = filled(step(face.at, tangent).and_then(|at| step(at, face.direction)));
    match (above, beside) {
        (Some(at), Some(_)) => Face { at, direction: tangent ^ 1 },
        (Some(at), None) if rule == Rule::Join => Face { at, direction: tangent ^ 1 },
        (_, Some(at)) => Face { at, direction: face.direction },
        (_, None) => Face { at: face.at, direction: tangent },
    }
}

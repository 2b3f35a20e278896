//! What a point's place costs: the quadrics of the planes round it.
//!
//! Each face counts for its own plane, and each special edge for the planes through it that stand
//! square on its faces, so that borders, junctions and seams keep their shape (Garland and
//! Heckbert 1997, sections 4 and 6.3).

use super::complex::{Complex, Spoke};
use crate::quadric::Quadric;

/// How much more the planes along special edges count.
const SPECIAL: f64 = 10.0;

/// Sets the quadrics of all points; `edges` are all edges.
///
/// Planes count alike, whatever the area of their faces: so a quadric bounds the largest of the
/// squared distances, not their mean over the surface.
pub fn lay(complex: &mut Complex, edges: &[Spoke]) {
    for f in 0..complex.faces.len() as u32 {
        let [a, b, c] = complex.places(f);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let plane = Quadric::plane(normal, a, 1.0);
        for p in complex.faces[f as usize].corners {
            complex.quadrics[p as usize] += plane;
        }
    }
    for edge in edges.iter().filter(|e| e.is_special()) {
        let ends @ [p, q] = complex.ends(edge.side);
        let [a, b] = ends.map(|e| complex.at[e as usize]);
        let beside = complex.around(p).map(|c| c >> 2);
        let beside = beside.filter(|&f| complex.faces[f as usize].corners.contains(&q));
        for f in beside.collect::<Vec<_>>() {
            let [x, y, z] = complex.places(f);
            let wall = (y - x).cross(z - x).cross(b - a).normalize_or_zero();
            let plane = Quadric::plane(wall, a, SPECIAL);
            ends.iter().for_each(|&e| complex.quadrics[e as usize] += plane);
        }
    }
}

//! What a point's place costs: the quadrics of the planes round it.
//!
//! Each face counts for its own plane, and each special edge for the planes through it that stand
//! square on its faces, so that borders, junctions and seams keep their shape (Garland and
//! Heckbert 1997, sections 4 and 6.3).

use super::complex::{Complex, Spoke};
use crate::quadric::Quadric;
use glam::DVec3;
use std::f64::consts::PI;

/// How much more the planes along special edges count.
const SPECIAL: f64 = 10.0;

/// Sets the quadrics of all points; `edges` are all edges.
///
/// At each point a plane counts by the angle of its face there, whatever the face's area: so a
/// quadric tells of the largest distances rather than of their mean, and faces of one plane count as much
/// together, however many they are.
pub fn lay(complex: &mut Complex, edges: &[Spoke]) {
    for f in 0..complex.faces.len() as u32 {
        let [a, b, c] = complex.places(f);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let plane = Quadric::plane(normal, a, 1.0);
        let corners = complex.faces[f as usize].corners;
        for (p, angle) in corners.into_iter().zip([angle(a, b, c), angle(b, c, a), angle(c, a, b)])
        {
            complex.quadrics[p as usize] += plane * angle;
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

/// About the angle at `o` between `p` and `q`, by arithmetic that is the same on every machine.
fn angle(o: DVec3, p: DVec3, q: DVec3) -> f64 {
    let (p, q) = (p - o, q - o);
    let half = p.cross(q).length() / ((p.length_squared() * q.length_squared()).sqrt() + p.dot(q));
    let arctan = |t: f64| t / (1.0 + 0.28 * t * t);
    if half <= 1.0 {
        2.0 * arctan(half)
    } else if half.is_nan() {
        0.0
    } else {
        PI - 2.0 * arctan(1.0 / half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_about_right() {
        for degrees in 0..=180 {
            let exact = f64::from(degrees).to_radians();
            let q = DVec3::new(exact.cos(), exact.sin(), 0.0) * 3.0;
            let found = angle(DVec3::ONE, DVec3::ONE + DVec3::X, DVec3::ONE + q);
            assert!((found - exact).abs() < 0.02, "{degrees} {found}");
        }
        assert_eq!(angle(DVec3::ONE, DVec3::ONE, DVec3::X), 0.0);
    }
}

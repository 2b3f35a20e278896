//! A wavy torus, closed and without self-intersections.

use octofold::Mesh;
use std::f64::consts::TAU;

/// A torus of `around` by `across` quads, each cut in two.
pub fn torus(around: u32, across: u32) -> Mesh {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let (u, v) =
                (TAU * f64::from(i) / f64::from(around), TAU * f64::from(j) / f64::from(across));
            let tube = 0.3 + 0.05 * (7.0 * u).sin() * (5.0 * v).cos();
            let out = 1.0 + tube * v.cos();
            points.push([out * u.cos(), out * u.sin(), tube * v.sin()]);
            let at = |di: u32, dj: u32| (i + di) % around * across + (j + dj) % across;
            triangles.push([at(0, 0), at(1, 0), at(1, 1)]);
            triangles.push([at(0, 0), at(1, 1), at(0, 1)]);
        }
    }
    Mesh { points, triangles, ..Mesh::default() }
}

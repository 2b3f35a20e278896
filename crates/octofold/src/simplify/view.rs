//! A direction along an axis from which faces are seen, and what lies over what.

use super::clearance::{Flat, flat};
use glam::DVec3;

/// Cosine of the angle between an axis and normals of faces that are seen along it, squared: 85
/// degrees.
const GRAZING: f64 = 0.0076;

/// A direction along an axis from which a star is seen.
#[derive(Debug, Clone, Copy)]
pub struct View {
    axis: usize,
    up: bool,
}

impl View {
    /// From where a normal points to, about.
    pub fn along(normal: DVec3) -> Self {
        let axis = steepest(normal);
        Self { axis, up: normal[axis] > 0.0 }
    }

    /// What is left of a place, turned so that what is seen from above runs counter-clockwise.
    pub fn flat(&self, p: DVec3) -> Flat {
        let [u, v] = flat(self.axis, p);
        if self.up { [u, v] } else { [v, u] }
    }

    /// How far a triangle that is seen from above lies over or under a place; `None` beside it.
    pub fn height(&self, at: &[DVec3; 3], p: DVec3) -> Option<f64> {
        let [a, b, c] = at.map(|q| self.flat(q));
        let o = self.flat(p);
        let part = |p: Flat, q: Flat| (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
        let parts = [part(b, c), part(c, a), part(a, b)];
        let sum: f64 = parts.iter().sum();
        let inside = parts.iter().all(|&x| x >= -1e-9 * sum);
        let height = (0..3).map(|i| parts[i] / sum * (at[i][self.axis] - p[self.axis])).sum();
        inside.then_some(height)
    }

    /// How far two segments are apart in height where they cross; `None` where they do not.
    pub fn gap(&self, [a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> Option<f64> {
        let [p, q, r, s] = [a, b, c, d].map(|x| self.flat(x));
        let cross = |u: Flat, v: Flat| u[0] * v[1] - u[1] * v[0];
        let way = |u: Flat, v: Flat| [v[0] - u[0], v[1] - u[1]];
        let (along, other, between) = (way(p, q), way(r, s), way(p, r));
        let area = cross(along, other);
        let (t, u) = (cross(between, other) / area, cross(between, along) / area);
        let on = |x: f64| (-1e-9..=1.0 + 1e-9).contains(&x);
        let height = |a: DVec3, b: DVec3, t: f64| a[self.axis] + (b[self.axis] - a[self.axis]) * t;
        (on(t) && on(u)).then(|| height(a, b, t) - height(c, d, u))
    }

    /// Whether a face with this normal is seen from above, and not from its edge: two such faces
    /// are not folded onto each other.
    pub fn sees(&self, normal: DVec3) -> bool {
        let along = if self.up { normal[self.axis] } else { -normal[self.axis] };
        along > 0.0 && along * along > GRAZING * normal.length_squared()
    }
}

/// The coordinate axis that a normal leans to most.
pub fn steepest(normal: DVec3) -> usize {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        0
    } else if n.y >= n.z {
        1
    } else {
        2
    }
}

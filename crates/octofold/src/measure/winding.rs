//! Generalized winding numbers: how often a surface, closed or not, wraps around a point.
//!
//! One inside a closed surface and zero outside; in between where there are holes. Near triangles
//! are taken exactly, far groups of them by a Taylor expansion about their middle (Barill et al.,
//! "Fast Winding Numbers for Soups and Clouds", 2018, here with two terms). Only basic arithmetic
//! is used, so that results are the same on every platform.

use super::bvh::{Box3, Bvh, Child, Item, STACK};
use crate::mesh::Mesh;
use crate::par;
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// A group is far where its middle is farther away than this many times its radius.
const FAR: f64 = 2.5;

/// An index for winding numbers about one mesh.
#[derive(Debug, Clone)]
pub struct Winding {
    tree: Bvh,
    /// In the order of the tree's items.
    corners: Vec<[DVec3; 3]>,
    /// For each node, its children.
    groups: Vec<[Group; 4]>,
}

impl Winding {
    /// Indexes all triangles of `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        let numbers: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let tree = Bvh::new(par::map(&numbers, |&t| Item {
            around: Box3::around(&mesh.corners(t as usize)),
            triangle: t,
        }));
        let corners = par::map(&tree.items, |i| mesh.corners(i.triangle as usize).map(DVec3::from));
        let mut groups = vec![[Group::default(); 4]; tree.nodes.len()];
        // Children come after their parents.
        for (n, node) in tree.nodes.iter().enumerate().rev() {
            for k in (0..4).filter(|&k| node.is_used(k)) {
                let mut group = match node.child(k) {
                    Child::Inner(child) => Group::of(&groups[child as usize]),
                    Child::Leaf(leaf) => {
                        Group::of(&corners[leaf].iter().map(Group::single).collect::<Vec<_>>())
                    }
                };
                // To the farthest corner of the box: another bound, sometimes the better one.
                let reach = |x: usize| {
                    let (low, high) = (f64::from(node.low[x][k]), f64::from(node.high[x][k]));
                    (group.middle[x] - low).max(high - group.middle[x])
                };
                let to_corner = DVec3::new(reach(0), reach(1), reach(2)).length();
                group.radius = group.radius.min(to_corner);
                groups[n][k] = group;
            }
        }
        Self { tree, corners, groups }
    }

    /// The winding number about `point`. Positive where the surface, seen from `point`, winds
    /// clockwise: inside, for the usual orientation.
    pub fn at(&self, point: [f64; 3]) -> f64 {
        let p = DVec3::from(point);
        let mut far = 0.0;
        let mut near = Turn::default();
        let mut stack = [0u32; STACK];
        let mut waiting = usize::from(!self.tree.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let number = stack[waiting] as usize;
            let node = &self.tree.nodes[number];
            for k in (0..4).filter(|&k| node.is_used(k)) {
                let group = &self.groups[number][k];
                let to = group.middle - p;
                let distance_squared = to.length_squared();
                if distance_squared > FAR * FAR * group.radius * group.radius {
                    far += group.angle(to, distance_squared);
                    continue;
                }
                match node.child(k) {
                    Child::Inner(child) => {
                        stack[waiting] = child;
                        waiting += 1;
                    }
                    Child::Leaf(leaf) => {
                        self.corners[leaf].iter().for_each(|t| near.add_half_solid_angle(t, p));
                    }
                }
            }
        }
        far / (2.0 * TAU) + near.turns()
    }
}

/// Triangles seen from afar.
#[derive(Debug, Clone, Copy, Default)]
struct Group {
    area: f64,
    /// Middle of the area.
    middle: DVec3,
    /// All triangles are this near to the middle.
    radius: f64,
    /// Sum of area vectors.
    normal: DVec3,
    /// Sum of outer products of area vector (rows) and place relative to the middle (columns).
    spread: DMat3,
}

impl Group {
    fn single(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = *corners;
        let normal = (b - a).cross(c - a) / 2.0;
        let middle = (a + b + c) / 3.0;
        let radius = corners.iter().fold(0.0, |r: f64, p| r.max(p.distance(middle)));
        Self { area: normal.length(), middle, radius, normal, ..Self::default() }
    }

    fn of(parts: &[Self]) -> Self {
        let area: f64 = parts.iter().map(|g| g.area).sum();
        let moment: DVec3 = parts.iter().map(|g| g.middle * g.area).sum();
        let middle = if area > 0.0 {
            moment / area
        } else {
            parts.first().map_or(DVec3::ZERO, |g| g.middle)
        };
        let mut whole = Self { area, middle, ..Self::default() };
        for part in parts.iter().filter(|g| g.radius > 0.0) {
            let d = part.middle - middle;
            whole.radius = whole.radius.max(d.length() + part.radius);
            whole.normal += part.normal;
            whole.spread += part.spread;
            whole.spread +=
                DMat3::from_cols(part.normal * d.x, part.normal * d.y, part.normal * d.z);
        }
        whole
    }

    /// The solid angle seen from the point that `to` leads from to the middle.
    fn angle(&self, to: DVec3, distance_squared: f64) -> f64 {
        let inverse = 1.0 / distance_squared;
        let cubed = inverse * inverse.sqrt();
        let trace = self.spread.x_axis.x + self.spread.y_axis.y + self.spread.z_axis.z;
        let along = to.dot(self.spread * to);
        cubed * (self.normal.dot(to) + trace - 3.0 * inverse * along)
    }
}

/// A sum of angles between -pi and pi, kept as a direction and whole turns, so that only its end
/// has to be turned into an angle.
#[derive(Debug, Clone, Copy)]
struct Turn {
    x: f64,
    y: f64,
    whole: f64,
}

impl Default for Turn {
    fn default() -> Self {
        Self { x: 1.0, y: 0.0, whole: 0.0 }
    }
}

impl Turn {
    /// Adds half the solid angle of a triangle seen from `p` (van Oosterom and Strackee, "The Solid
    /// Angle of a Plane Triangle", 1983).
    fn add_half_solid_angle(&mut self, corners: &[DVec3; 3], p: DVec3) {
        let [a, b, c] = corners.map(|x| x - p);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let top = a.dot(b.cross(c));
        let bottom = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        let size = top.abs() + bottom.abs();
        // Zero for a point on a corner, which sees no angle.
        if size > 0.0 {
            self.add(bottom / size, top / size);
        }
    }

    fn add(&mut self, x: f64, y: f64) {
        let sum = (self.x * x - self.y * y, self.x * y + self.y * x);
        // Two angles on one side of the x axis whose sum is on the other went past half a turn.
        if self.y > 0.0 && y > 0.0 && sum.1 < 0.0 {
            self.whole += 1.0;
        } else if self.y < 0.0 && y < 0.0 && sum.1 >= 0.0 {
            self.whole -= 1.0;
        }
        let size = sum.0.abs() + sum.1.abs();
        (self.x, self.y) = (sum.0 / size, sum.1 / size);
    }

    fn turns(self) -> f64 {
        self.whole + arc(self.y, self.x) / TAU
    }
}

/// The angle of the direction (`x`, `y`), from -pi to pi, to about 1e-10.
fn arc(y: f64, x: f64) -> f64 {
    let (low, high) = if y.abs() < x.abs() { (y.abs(), x.abs()) } else { (x.abs(), y.abs()) };
    if high == 0.0 {
        return 0.0;
    }
    let t = low / high;
    // The tangent of a sixteenth turn divides the arc's range in two.
    const EIGHTH: f64 = 0.414_213_562_373_095_05;
    let mut angle =
        if t > EIGHTH { FRAC_PI_4 + arc_series((t - 1.0) / (t + 1.0)) } else { arc_series(t) };
    if y.abs() >= x.abs() {
        angle = FRAC_PI_2 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 { -angle } else { angle }
}

/// The alternating series of the arc tangent, for |t| up to 0.4143.
fn arc_series(t: f64) -> f64 {
    const TERMS: u32 = 12;
    let s = t * t;
    let sum = (0..TERMS).rev().fold(0.0, |sum, k| 1.0 / f64::from(2 * k + 1) - s * sum);
    t * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arc_is_the_angle() {
        for i in 0..=4000 {
            let angle = (f64::from(i) / 2000.0 - 1.0) * PI * 0.999_999;
            let found = arc(3.0 * angle.sin(), 3.0 * angle.cos());
            assert!((found - angle).abs() < 1e-10, "{angle} {found}");
        }
        assert_eq!(arc(0.0, 0.0), 0.0);
    }
}

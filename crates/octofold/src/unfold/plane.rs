//! The plane in which pieces lie: rigid motions, and how far convex shapes reach into each other.

use glam::DVec2;

/// A turn about the origin, then a shift. Never a mirror image: paper has one printed side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion {
    turn: DVec2,
    shift: DVec2,
}

impl Motion {
    /// Leaves everything where it is.
    pub const REST: Self = Self { turn: DVec2::X, shift: DVec2::ZERO };

    /// Turns by `angle`, in radians, about the origin.
    pub fn turn(angle: f64) -> Self {
        Self { turn: DVec2::from_angle(angle), shift: DVec2::ZERO }
    }

    /// Shifts by `by`.
    pub fn shift(by: DVec2) -> Self {
        Self { turn: DVec2::X, shift: by }
    }

    /// Takes the middle of `from` to the middle of `to`, and its direction likewise.
    pub fn between(from: [DVec2; 2], to: [DVec2; 2]) -> Self {
        let [a, b] = [from[1] - from[0], to[1] - to[0]];
        let turn = DVec2::new(a.dot(b), a.perp_dot(b)).normalize_or(DVec2::X);
        let middles = [from[0].midpoint(from[1]), to[0].midpoint(to[1])];
        Self { turn, shift: middles[1] - turn.rotate(middles[0]) }
    }

    /// The image of `p`.
    pub fn at(&self, p: DVec2) -> DVec2 {
        self.turn.rotate(p) + self.shift
    }

    /// This motion after `first`.
    pub fn after(&self, first: &Self) -> Self {
        let turn = self.turn.rotate(first.turn);
        // One step of Newton's method holds the length at 1 over any number of products.
        let turn = turn * (1.5 - 0.5 * turn.length_squared());
        Self { turn, shift: self.at(first.shift) }
    }

    /// What undoes this motion.
    pub fn inverse(&self) -> Self {
        let turn = DVec2::new(self.turn.x, -self.turn.y);
        Self { turn, shift: -turn.rotate(self.shift) }
    }
}

/// A box along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    /// Lowest coordinates.
    pub low: DVec2,
    /// Highest coordinates.
    pub high: DVec2,
}

impl Bounds {
    /// The box of `points`; inside out where there are none.
    pub fn of(points: &[DVec2]) -> Self {
        let none = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };
        points.iter().fold(none, |b, &p| Self { low: b.low.min(p), high: b.high.max(p) })
    }

    /// True where the boxes share more than `slack` both ways.
    pub fn meet(&self, other: &Self, slack: f64) -> bool {
        let share = self.high.min(other.high) - self.low.max(other.low);
        share.min_element() > slack
    }

    /// What both boxes hold; inside out where that is nothing.
    pub fn shared(&self, other: &Self) -> Self {
        Self { low: self.low.max(other.low), high: self.high.min(other.high) }
    }

    /// Extent both ways.
    pub fn size(&self) -> DVec2 {
        self.high - self.low
    }
}

/// True where two convex polygons, counter-clockwise, reach into each other by more than `slack`:
/// no line along an edge of either has the other beyond it, but for `slack`.
pub(super) fn convex_meet(a: &[DVec2], b: &[DVec2], slack: f64) -> bool {
    !parted(a, b, slack) && !parted(b, a, slack)
}

fn parted(a: &[DVec2], b: &[DVec2], slack: f64) -> bool {
    let mut from = a[a.len() - 1];
    a.iter().any(|&to| {
        let along = to - from;
        let origin = from;
        from = to;
        let least = slack * along.length();
        along != DVec2::ZERO && b.iter().all(|&p| along.perp_dot(p - origin) <= least)
    })
}

/// Twice the area that a polygon encloses, positive counter-clockwise.
pub(super) fn doubled_area(polygon: &[DVec2]) -> f64 {
    let origin = polygon.first().copied().unwrap_or_default();
    let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
    sides.map(|(&a, &b)| (a - origin).perp_dot(b - origin)).sum()
}

/// True where a polygon turns left or not at all at every corner, once round.
pub(super) fn is_convex(polygon: &[DVec2], slack: f64) -> bool {
    let n = polygon.len();
    let left = (0..n).all(|i| {
        let [a, b, c] = [0, 1, 2].map(|k| polygon[(i + k) % n]);
        let (p, q) = (b - a, c - b);
        p.perp_dot(q) >= -slack * p.length() && p.dot(q) > -p.length() * q.length()
    });
    // Left turns alone might go round twice.
    left && (1..n).all(|i| {
        (polygon[i] - polygon[0]).perp_dot(polygon[(i + 1) % n] - polygon[0])
            >= -slack * polygon[i].distance(polygon[0])
    })
}

/// The convex hull, counter-clockwise (Andrew 1979).
pub(super) fn hull(points: &mut Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points.clone();
    }
    let mut hull: Vec<DVec2> = Vec::new();
    let mut walk = |points: &mut dyn Iterator<Item = DVec2>| {
        let floor = hull.len() + 1;
        for p in points {
            while hull.len() > floor
                && (hull[hull.len() - 1] - hull[hull.len() - 2]).perp_dot(p - hull[hull.len() - 1])
                    <= 0.0
            {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    walk(&mut points.iter().copied());
    walk(&mut points.iter().rev().copied());
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::cases;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec2> {
        prop::array::uniform2(-8i8..=8).prop_map(|[x, y]| DVec2::new(x.into(), y.into()))
    }

    fn triangle() -> impl Strategy<Value = [DVec2; 3]> {
        prop::array::uniform3(point()).prop_filter_map("flat", |[a, b, c]| {
            match (b - a).perp_dot(c - a) {
                0.0 => None,
                area if area < 0.0 => Some([a, c, b]),
                _ => Some([a, b, c]),
            }
        })
    }

    /// Area that two triangles share, by clipping.
    fn shared(a: [DVec2; 3], b: [DVec2; 3]) -> f64 {
        let mut left = a.to_vec();
        for i in 0..3 {
            let (p, q) = (b[i], b[(i + 1) % 3]);
            let side = |r: DVec2| (q - p).perp_dot(r - p);
            let mut kept = Vec::new();
            for (k, &r) in left.iter().enumerate() {
                let s = left[(k + 1) % left.len()];
                if side(r) >= 0.0 {
                    kept.push(r);
                }
                if side(r) * side(s) < 0.0 {
                    kept.push(r.lerp(s, side(r) / (side(r) - side(s))));
                }
            }
            left = kept;
        }
        doubled_area(&left) / 2.0
    }

    proptest! {
        #![proptest_config(cases(500))]

        #[test]
        fn triangles_meet_where_they_share_area(a in triangle(), b in triangle()) {
            prop_assert_eq!(convex_meet(&a, &b, 1e-9), shared(a, b) > 1e-6);
        }

        #[test]
        fn motions_are_undone(angle in -9.0..9.0f64, by in point(), p in point(), q in point()) {
            let m = Motion::shift(by).after(&Motion::turn(angle));
            prop_assert!(m.inverse().at(m.at(p)).distance(p) < 1e-12);
            prop_assume!(p != q);
            let found = Motion::between([p, q], [m.at(p), m.at(q)]);
            prop_assert!(found.at(by).distance(m.at(by)) < 1e-11);
        }

        #[test]
        fn a_hull_holds_its_points(points in prop::collection::vec(point(), 3..20)) {
            let hull = hull(&mut points.clone());
            for i in 0..hull.len() {
                let along = hull[(i + 1) % hull.len()] - hull[i];
                prop_assert!(points.iter().all(|&p| along.perp_dot(p - hull[i]) >= 0.0));
            }
            prop_assert!(hull.len() < 3 || is_convex(&hull, 1e-9));
        }
    }
}

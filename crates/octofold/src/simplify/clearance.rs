//! Whether two triangles keep clear of each other outside what they share, and are not folded onto
//! each other.
//!
//! Answers are exact. Most pairs are told apart by one line, seen along an axis, that has
//! one triangle on either side: products of differences decide that where they are larger than their
//! rounding errors (Shewchuk 1997); the predicates of [`crate::exact`] see to the rest.

use crate::exact;
use crate::measure::intersect::meet_outside_shared;
use glam::DVec3;

/// Cosine of the least angle between neighbours, squared: 10 degrees.
const FOLD: f64 = 0.969_846;

/// Bound of the relative rounding error of a difference of two products of differences.
const ROUNDING: f64 = 4e-16;

/// Sine squared of an angle below which rounding may turn a triangle's normal.
const THIN: f64 = 1e-18;

/// Two of three coordinates.
pub type Flat = [f64; 2];

/// A triangle by points and places.
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    pub corners: [u32; 3],
    pub at: [DVec3; 3],
}

impl Patch {
    /// The places of corners that the other does not have, then of those that it has.
    fn split(&self, other: &Self) -> (usize, [DVec3; 3]) {
        let mut order = self.at;
        let (mut own, mut end) = (0, 3);
        for i in 0..3 {
            if other.corners.contains(&self.corners[i]) {
                end -= 1;
                order[end] = self.at[i];
            } else {
                order[own] = self.at[i];
                own += 1;
            }
        }
        (own, order)
    }
}

/// What is wrong between two triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conflict {
    /// They have all three points in common.
    Same,
    /// The angle at their common edge is below ten degrees.
    Folded,
    /// They meet outside what they share.
    Meeting,
}

/// What is wrong between triangles `a` and `b`, the worst first; `axis` is one along which `a` has
/// some area.
pub fn conflict(a: &Patch, b: &Patch, axis: usize) -> Option<Conflict> {
    let (own, of_a) = a.split(b);
    match own {
        3 => {
            let apart = apart(axis, a.at, b.at) || apart(axis, b.at, a.at);
            (!apart && meet(a, b)).then_some(Conflict::Meeting)
        }
        2 => {
            let (_, of_b) = b.split(a);
            let [p, q, o] = of_a;
            let ([r, s, _], see) = (of_b, |p: DVec3| flat(axis, p));
            let [p, q, r, s, o] = [p, q, r, s, o].map(see);
            let apart = sectors_apart(o, [p, q], [r, s]) || sectors_apart(o, [r, s], [p, q]);
            (!apart && meet(a, b)).then_some(Conflict::Meeting)
        }
        1 => {
            let (_, [apex, ..]) = b.split(a);
            let [own, end, start] = of_a;
            match is_folded(start, end, own, apex) {
                Some(false) => None,
                _ if meet(a, b) => Some(Conflict::Meeting),
                folded => folded.map(|_| Conflict::Folded),
            }
        }
        _ => Some(Conflict::Same),
    }
}

/// Whether `a` and `b` stand on the side `start end` at less than the least angle; `None` where
/// one is too near to its line to tell.
fn is_folded(start: DVec3, end: DVec3, a: DVec3, b: DVec3) -> Option<bool> {
    let along = end - start;
    let (one, other) = (along.cross(a - start), along.cross(b - start));
    let [of_one, of_other] = [one.length_squared(), other.length_squared()];
    let thin =
        |area: f64, p: DVec3| area <= THIN * along.length_squared() * p.distance_squared(start);
    if thin(of_one, a) || thin(of_other, b) {
        return None;
    }
    let dot = one.dot(other);
    Some(dot > 0.0 && dot * dot >= FOLD * of_one * of_other)
}

/// Whether triangles meet outside corners at the same place, decided exactly; flat ones meet none.
fn meet(a: &Patch, b: &Patch) -> bool {
    let points = [a.at, b.at].concat();
    let points: Vec<_> = points.into_iter().map(|p| p.to_array()).collect();
    let first = |p: usize| points.iter().position(|q| *q == points[p]).unwrap_or(p) as u32;
    let [own, other] = [[0, 1, 2].map(first), [3, 4, 5].map(first)];
    let places = |t: [u32; 3]| t.map(|p| points[p as usize]);
    !exact::is_flat(places(own))
        && !exact::is_flat(places(other))
        && meet_outside_shared(&points, own, other)
}

#[inline]
pub fn flat(axis: usize, p: DVec3) -> Flat {
    const NEXT: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];
    let [u, v] = NEXT[axis];
    [p[u], p[v]]
}

/// Turn of the path `o p q`, 0 where rounding hides it.
#[inline]
pub fn turn(o: Flat, p: Flat, q: Flat) -> i8 {
    let left = (p[0] - o[0]) * (q[1] - o[1]);
    let right = (p[1] - o[1]) * (q[0] - o[0]);
    let (turn, error) = (left - right, ROUNDING * (left.abs() + right.abs()) + f64::MIN_POSITIVE);
    i8::from(turn > error) - i8::from(turn < -error)
}

/// Whether the line of a side of the sector `p o q` has it on one side, and the sector `r o s`
/// strictly on the other.
fn sectors_apart(o: Flat, [p, q]: [Flat; 2], [r, s]: [Flat; 2]) -> bool {
    let side = turn(o, p, q);
    side != 0
        && (turn(o, p, r) == -side && turn(o, p, s) == -side
            || turn(o, q, r) == side && turn(o, q, s) == side)
}

/// Whether the line of a side of `t`, seen along an axis, has `t` on one side and `other` strictly
/// on the other.
fn apart(axis: usize, t: [DVec3; 3], other: [DVec3; 3]) -> bool {
    let (t, other) = (t.map(|p| flat(axis, p)), other.map(|p| flat(axis, p)));
    let side = turn(t[0], t[1], t[2]);
    side != 0 && (0..3).any(|i| other.iter().all(|&p| turn(t[i], t[(i + 1) % 3], p) == -side))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn points() -> impl Strategy<Value = Vec<DVec3>> {
        let point = prop::array::uniform3(-3i8..=3).prop_map(|p| DVec3::from(p.map(f64::from)));
        prop::collection::vec(point, 6)
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(2_000))]

        #[test]
        fn conflicts_are_what_exact_predicates_say(points in points(), shared in 0usize..3) {
            let patch = |corners: [u32; 3]| Patch { corners, at: corners.map(|p| points[p as usize]) };
            let (a, b) = (patch([0, 1, 2]), patch(match shared {
                0 => [3, 4, 5],
                1 => [4, 1, 5],
                _ => [2, 1, 5],
            }));
            prop_assume!(!exact::is_flat(a.at.map(|p| p.to_array())));
            prop_assume!(!exact::is_flat(b.at.map(|p| p.to_array())));
            let expected = meet(&a, &b);
            for axis in 0..3 {
                let found = conflict(&a, &b, axis);
                prop_assert_eq!(found == Some(Conflict::Meeting), expected);
                prop_assert_eq!(conflict(&b, &a, axis) == Some(Conflict::Meeting), expected);
                if shared == 2 {
                    let angle = |p: DVec3| {
                        let along = (points[2] - points[1]).normalize();
                        (p - points[1]).reject_from_normalized(along).normalize()
                    };
                    let sharp = angle(points[0]).dot(angle(points[5])) > 10f64.to_radians().cos();
                    prop_assert_eq!(found.is_some(), sharp);
                }
            }
        }
    }
}

//! Self-intersections: pairs of triangles that meet outside a shared corner or edge.
//!
//! Corners are shared by position. Touching is meeting. Triangles on one line are left out, and so
//! are pairs with the same three corners (they are duplicates). What counts is the same as in
//! libigl's `remesh_self_intersections`, and is decided by exact predicates.

use super::bvh::{Box3, Bvh, Item};
use super::weld::{Welding, weld_points};
use crate::exact::{self, Point};
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use std::borrow::Cow;

const BLOCK: usize = 128;

/// Where the largest coordinate is this near to 1, products stay in range as they are.
const NEAR: f64 = (1u64 << 40) as f64;

/// All pairs of triangles that meet outside a shared corner or edge, the lower number first,
/// sorted.
pub fn self_intersections(mesh: &Mesh, run: &Run) -> Result<Vec<[u32; 2]>, Cancelled> {
    let Welding { points, of } = weld_points(&mesh.points, run)?;
    let triangles = par::map(&mesh.triangles, |t| t.map(|p| of[p as usize]));
    meeting_pairs(&points, &triangles, run)
}

/// As [`self_intersections`], of triangles on distinct points.
pub(super) fn meeting_pairs(
    points: &[Point],
    triangles: &[[u32; 3]],
    run: &Run,
) -> Result<Vec<[u32; 2]>, Cancelled> {
    let points = scaled(points);
    let corners = |t: u32| triangles[t as usize].map(|p| points[p as usize]);
    let flat = par::blocks(run, triangles.len(), 32 * BLOCK, |range| {
        let flat = |t: &u32| exact::is_flat(corners(*t));
        (range.start as u32..range.end as u32).filter(flat).collect::<Vec<_>>()
    })?;
    let mut flat = flat.into_iter().flatten().peekable();
    let solid = (0..triangles.len() as u32).filter(|t| flat.next_if_eq(t).is_none());
    let solid: Vec<u32> = solid.collect();
    let item = |&t: &u32| Item { around: Box3::around(&corners(t)), triangle: t };
    let tree = Bvh::new(par::map(&solid, item));
    let found = par::blocks(run, tree.nodes.len(), BLOCK, |range| {
        let mut pairs = Vec::new();
        for (own, around) in tree.leaves(range) {
            tree.overlaps(&around, |other| {
                // Each pair of leaves is met from both; the first sees to it.
                if other.start >= own.start {
                    for i in own.clone() {
                        let rest = other.start.max(i + 1)..other.end;
                        let a = &tree.items[i];
                        for b in tree.items[rest].iter().filter(|b| b.around.overlaps(&a.around)) {
                            let [ta, tb] = [a, b].map(|i| triangles[i.triangle as usize]);
                            if meet_outside_shared(&points, ta, tb) {
                                let [a, b] = [a.triangle, b.triangle];
                                pairs.push([a.min(b), a.max(b)]);
                            }
                        }
                    }
                }
            });
        }
        pairs
    })?;
    let mut pairs = found.concat();
    par::sort(&mut pairs);
    Ok(pairs)
}

/// The points, brought near to 1 by a power of two: nothing but the exponents changes, and products
/// of coordinates stay in range.
fn scaled(points: &[Point]) -> Cow<'_, [Point]> {
    let largest = points.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    // The exponent's bits alone are the power of two just below.
    let power = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
    if power.is_normal() && !(NEAR.recip()..NEAR).contains(&power) {
        par::map(points, |p| p.map(|x| x / power)).into()
    } else {
        points.into()
    }
}

/// Whether two triangles, neither of them flat, meet outside the points that they share.
pub(crate) fn meet_outside_shared(points: &[Point], a: [u32; 3], b: [u32; 3]) -> bool {
    let at = |t: [u32; 3]| t.map(|p| points[p as usize]);
    let own = |t: [u32; 3], other: [u32; 3]| t.map(|p| !other.contains(&p));
    let (own_a, own_b) = (own(a, b), own(b, a));
    let (at_a, at_b) = (at(a), at(b));
    match own_a.iter().filter(|&&own| own).count() {
        3 => exact::triangles_meet(at_a, at_b),
        2 => {
            let [corner, p, q] = odd_first(at_a, own_a, false);
            let [_, r, s] = odd_first(at_b, own_b, false);
            exact::triangles_meet_beyond(corner, [p, q], [r, s])
        }
        1 => {
            // Only triangles folded onto each other in one plane share more than their edge.
            let [apex_a, p, q] = odd_first(at_a, own_a, true);
            let [apex_b, ..] = odd_first(at_b, own_b, true);
            exact::folded_flat(p, q, apex_a, apex_b)
        }
        _ => false,
    }
}

/// The corners, turned so that the one that is `odd` in `own` comes first.
fn odd_first(mut corners: [Point; 3], own: [bool; 3], odd: bool) -> [Point; 3] {
    corners.rotate_left((0..3).find(|&i| own[i] == odd).unwrap_or(0));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::oracle;
    use proptest::prelude::*;

    /// All pairs, in integers; `points` are whole numbers.
    fn pairs_by_brute_force(points: &[Point], triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        for b in 0..triangles.len() {
            for a in 0..b {
                let [ta, tb] = [a, b].map(|t| triangles[t].map(|p| points[p as usize]));
                if [ta, tb].iter().any(|&t| oracle::normal(t) == [0; 3]) {
                    continue;
                }
                let (shared, own_a): (Vec<_>, Vec<_>) =
                    ta.into_iter().partition(|p| tb.contains(p));
                let own_b: Vec<_> = tb.into_iter().filter(|p| !ta.contains(p)).collect();
                let meet = match shared[..] {
                    [] => oracle::meet(&ta, &tb),
                    [_] => oracle::meet(&own_a, &tb) || oracle::meet(&own_b, &ta),
                    [p, q] => {
                        let [na, nb] = [own_a[0], own_b[0]].map(|r| oracle::normal([p, q, r]));
                        oracle::cross(na, nb) == [0; 3] && oracle::dot(na, nb) > 0
                    }
                    _ => false,
                };
                if meet {
                    pairs.push([a as u32, b as u32]);
                }
            }
        }
        pairs.sort();
        pairs
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn pairs_are_those_of_brute_force(
            points in prop::collection::vec(prop::array::uniform3(-3i8..=3), 14),
            triangles in prop::collection::vec(prop::array::uniform3(0u32..14), 0..40),
            exponent in -200i32..200,
        ) {
            let points: Vec<Point> = points.iter().map(|p| p.map(f64::from)).collect();
            let expected = pairs_by_brute_force(&points, &triangles);
            let scale = 2f64.powi(exponent);
            let mesh = Mesh::new(
                points.iter().map(|p| p.map(|x| x * scale)).collect(),
                triangles,
            ).unwrap();
            prop_assert_eq!(self_intersections(&mesh, &Run::default()).unwrap(), expected);
        }
    }

    #[test]
    fn neighbours_folded_onto_each_other_meet() {
        let points = vec![[0.1; 3], [1.1, 0.1, 0.1], [0.3, 1.1, 0.1], [0.6, 0.7, 0.1]];
        let mesh = |triangles: &[[u32; 3]]| Mesh::new(points.clone(), triangles.to_vec()).unwrap();
        let folded = mesh(&[[0, 1, 2], [1, 0, 3]]);
        assert_eq!(self_intersections(&folded, &Run::default()).unwrap(), [[0, 1]]);
        let twice = mesh(&[[0, 1, 2], [1, 0, 2]]);
        assert_eq!(self_intersections(&twice, &Run::default()).unwrap(), [[0u32; 2]; 0]);
    }

    #[test]
    fn a_cancelled_run_stops() {
        let run = Run::default();
        run.cancel.cancel();
        let mesh = Mesh::new(vec![[0.0; 3], [1.0; 3], [0.0, 1.0, 2.0]], vec![[0, 1, 2]]).unwrap();
        assert_eq!(self_intersections(&mesh, &run), Err(Cancelled));
    }
}

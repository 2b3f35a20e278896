//! Card: where paper has a thickness, what is folded is the middle of the sheet.
//!
//! The printed side keeps its place, so that a closed model is as large outside as it should be. The
//! middle of the sheet then lies half the thickness behind it: faces shrink at folds away from the
//! printed side, and grow at folds towards it. Each point moves to where the planes of its faces meet
//! once all have moved inwards: exactly where there are three, else by least squares that keep large
//! flat faces flat. Sheets (parts with a free edge or with more than two faces at one) have their
//! middle where they are. Source: specification of papercraft (C5), made exact at corners.

use super::edges::Edges;
use super::flatten::spoilt;
use super::regions::Regions;
use super::sets::Sets;
use crate::measure::self_intersections;
use crate::mesh::Mesh;
use crate::quadric::Quadric;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// How much more a face of several triangles weighs: a triangle stays flat wherever its corners go.
const FLAT: f64 = 100.0;

/// Weight of staying in place, which settles what the planes leave open.
const PULL: f64 = 1e-4;

/// The furthest that a point moves, in depths: where faces meet in a needle, card ends before its tip.
const FURTHEST: f64 = 4.0;

/// Moves the points of closed parts `depth` behind their oriented triangles; returns how many have no
/// room to.
pub(super) fn inset(
    points: &mut Vec<[f64; 3]>,
    triangles: &[[u32; 3]],
    edges: &Edges,
    regions: &Regions,
    depth: f64,
    run: &Run,
) -> Result<usize, Cancelled> {
    let normals = normals(points, triangles, regions);
    let mut quadrics = vec![Quadric::NOTHING; points.len()];
    for (t, corners) in triangles.iter().enumerate() {
        let region = regions.of[t] as usize;
        let weight = if regions.regions[region].len() > 1 { FLAT } else { 1.0 };
        let plane = Quadric::plane(normals[region], -depth * normals[region], weight);
        let at = |k: usize| DVec3::from(points[corners[k % 3] as usize]);
        for k in 0..3 {
            let angle = (at(k + 1) - at(k)).angle_between(at(k + 2) - at(k));
            if angle.is_finite() {
                quadrics[corners[k] as usize] += plane * angle;
            }
        }
    }
    let moves: Vec<DVec3> = quadrics
        .iter()
        .map(|q| q.lowest(DVec3::ZERO, PULL).unwrap_or(DVec3::ZERO))
        .map(|step| step.clamp_length_max(FURTHEST * depth))
        .collect();
    let mut moving = closed_points(points.len(), triangles, edges);
    let mesh = |points| Mesh { points, triangles: triangles.to_vec(), ..Mesh::default() };
    let before = mesh(points.clone());
    let known = self_intersections(&before, run)?;
    let mut held = 0;
    loop {
        let inner = |p: usize| match moving[p] {
            true => (DVec3::from(before.points[p]) + moves[p]).to_array(),
            false => before.points[p],
        };
        let after = mesh((0..moves.len()).map(inner).collect());
        let mut stuck: Vec<u32> = spoilt(&before, &after, edges, 0.0, &known, run)?
            .iter()
            .flat_map(|&t| triangles[t as usize])
            .filter(|&p| moving[p as usize])
            .collect();
        stuck.sort_unstable();
        stuck.dedup();
        if stuck.is_empty() {
            *points = after.points;
            return Ok(held);
        }
        held += stuck.len();
        stuck.iter().for_each(|&p| moving[p as usize] = false);
    }
}

/// The unit normal of each region.
fn normals(points: &[[f64; 3]], triangles: &[[u32; 3]], regions: &Regions) -> Vec<DVec3> {
    let doubled = |&t: &u32| {
        let [a, b, c] = triangles[t as usize].map(|p| DVec3::from(points[p as usize]));
        (b - a).cross(c - a)
    };
    let normal = |r: &Vec<u32>| r.iter().map(doubled).sum::<DVec3>().normalize_or_zero();
    regions.regions.iter().map(normal).collect()
}

/// True for the points of parts in which two triangles meet at every edge, both with the same side
/// printed.
fn closed_points(count: usize, triangles: &[[u32; 3]], edges: &Edges) -> Vec<bool> {
    let mut parts = Sets::singles(count);
    for &[a, b, c] in triangles {
        parts.join(a, b);
        parts.join(b, c);
    }
    let mut open = vec![false; count];
    for sides in edges.iter() {
        if !matches!(sides, [a, b] if a.opposes(b)) {
            open[parts.find(sides[0].from).0 as usize] = true;
        }
    }
    (0..count as u32).map(|p| !open[parts.find(p).0 as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::check;
    use super::super::{Scale, UnfoldOptions, Unfolded, unfold};
    use crate::mesh::Mesh;
    use crate::run::Run;
    use crate::samples::Sample;
    use crate::sweep::cases;
    use glam::DVec3;
    use proptest::prelude::*;

    fn unfolded(mesh: &Mesh, scale: Scale, thickness: f64) -> Unfolded {
        let options = UnfoldOptions { scale, thickness, effort: 0, ..UnfoldOptions::default() };
        let unfolded = unfold(mesh, &options, &Run::default()).unwrap();
        check(&unfolded.pattern);
        unfolded
    }

    /// A prism over the letter L: five folds away from the printed side, one towards it.
    fn corner_piece() -> Mesh {
        let ground = [[0, 0], [60, 0], [60, 30], [30, 30], [30, 60], [0, 60]];
        let points = [0, 40].map(|z| ground.map(|[x, y]| [x, y, z].map(f64::from))).concat();
        let mut triangles = vec![[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 5, 4]];
        triangles.extend(triangles.clone().iter().map(|&[a, b, c]| [a + 6, c + 6, b + 6]));
        for a in 0..6 {
            let b = (a + 1) % 6;
            triangles.extend([[a, b, b + 6], [a, b + 6, a + 6]]);
        }
        Mesh { points, triangles, ..Mesh::default() }
    }

    #[test]
    fn faces_shrink_at_folds_away_and_grow_at_folds_towards() {
        let pattern = unfolded(&corner_piece(), Scale::Factor(1.0), 2.0).pattern;
        assert_eq!(pattern.mesh.faces.len(), 8);
        let middle = [30.0, 30.0, 20.0];
        for (p, q) in pattern.mesh.points.iter().zip(corner_piece().points) {
            // Away from the origin in the notch too, whose sides look that way.
            let [x, y, z] = q;
            let inside = |a: f64| if a == 0.0 { 1.0 } else { a - 1.0 };
            let meant = [inside(x), inside(y), inside(z)];
            for axis in 0..3 {
                assert!((p[axis] + middle[axis] - meant[axis]).abs() < 1e-3, "{p:?} {meant:?}");
            }
        }
    }

    #[test]
    fn sheets_stay_as_they_are() {
        let house = Sample::House.polygons(1).unwrap().triangulate();
        let [thin, thick] =
            [0.0, 1.0].map(|thickness| unfolded(&house, Scale::Size(100.0), thickness).pattern);
        assert_eq!(thin, thick);
    }

    proptest! {
        #![proptest_config(cases(8))]

        #[test]
        fn closed_models_hold_what_they_should(
            which in 0usize..4,
            resolution in 4usize..9,
            thickness in 0.1f64..1.5,
        ) {
            let sample = [Sample::Sphere, Sample::Torus, Sample::Cone, Sample::Cube][which];
            let mesh = sample.mesh(resolution, &Run::default()).unwrap().triangulate();
            let scale = Scale::Size(80.0);
            let [thin, thick] = [0.0, thickness].map(|t| unfolded(&mesh, scale, t).pattern.mesh);
            let doubled = |mesh: &super::super::pattern::PatternMesh| {
                let ends = |f: &Vec<u32>, k| DVec3::from(mesh.points[f[k] as usize]);
                let fan = |f: &Vec<u32>| -> f64 {
                    (2..f.len())
                        .map(|k| (ends(f, k - 1) - ends(f, 0)).cross(ends(f, k) - ends(f, 0)))
                        .sum::<DVec3>()
                        .length()
                };
                mesh.faces.iter().map(fan).sum::<f64>()
            };
            // Half the thickness times the mean curvature: all are convex on the whole.
            prop_assert!(doubled(&thick) < doubled(&thin));
            for p in &thick.points {
                let near = thin.points.iter().map(|q| DVec3::from(*p).distance(DVec3::from(*q)));
                let near = near.fold(f64::INFINITY, f64::min);
                prop_assert!(near <= super::FURTHEST * thickness / 2.0 + 0.02, "{near} mm");
            }
        }
    }
}

//! What unfolding promises, checked by other means than it works by: areas by clipping, lengths and
//! folds from the mesh in space.

use super::pattern::{Fold, Pattern, STEP, Spot, Tile};
use super::*;
use crate::random::Random;
use crate::samples::Sample;
use crate::sweep::cases;
use glam::DVec3;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

fn unfolded(mesh: &Mesh) -> Unfolded {
    let options = UnfoldOptions { scale: Scale::Size(50.0), effort: 1, ..UnfoldOptions::default() };
    unfold(mesh, &options, &Run::default()).unwrap()
}

fn spot([x, y]: Spot) -> DVec2 {
    DVec2::new(x as f64, y as f64) * STEP
}

/// Area that two polygons share, by clipping triangles of fans; signs make up for concave corners.
fn shared(a: &[DVec2], b: &[DVec2]) -> f64 {
    let fan = |p: &[DVec2]| (1..p.len() - 1).map(|i| [p[0], p[i], p[i + 1]]).collect::<Vec<_>>();
    let mut sum = 0.0;
    for s in fan(a) {
        for t in fan(b) {
            let sign = (s[1] - s[0]).perp_dot(s[2] - s[0]).signum()
                * (t[1] - t[0]).perp_dot(t[2] - t[0]).signum();
            sum += sign * shared_by_triangles(s, t);
        }
    }
    sum
}

fn shared_by_triangles(mut s: [DVec2; 3], mut t: [DVec2; 3]) -> f64 {
    for t in [&mut s, &mut t] {
        if (t[1] - t[0]).perp_dot(t[2] - t[0]) < 0.0 {
            t.swap(1, 2);
        }
    }
    let mut left = s.to_vec();
    for i in 0..3 {
        let (p, q) = (t[i], t[(i + 1) % 3]);
        let side = |r: DVec2| (q - p).perp_dot(r - p);
        let mut kept = Vec::new();
        for (k, &r) in left.iter().enumerate() {
            let next = left[(k + 1) % left.len()];
            if side(r) >= 0.0 {
                kept.push(r);
            }
            if side(r) * side(next) < 0.0 {
                kept.push(r.lerp(next, side(r) / (side(r) - side(next))));
            }
        }
        left = kept;
    }
    let fan = (2..left.len()).map(|i| (left[i - 1] - left[0]).perp_dot(left[i] - left[0]));
    fan.sum::<f64>() / 2.0
}

fn polygon(tile: &Tile) -> Vec<DVec2> {
    tile.corners.iter().map(|c| spot(c.at)).collect()
}

/// All that is promised of a pattern.
pub(super) fn check(pattern: &Pattern) {
    let point = |p: u32| DVec3::from_array(pattern.mesh.points[p as usize]);
    let mut faces = BTreeMap::new();
    let mut hinges: BTreeMap<(usize, u32), Vec<(&Tile, usize)>> = BTreeMap::new();
    let mut cut: BTreeMap<u32, usize> = BTreeMap::new();
    for page in 0..pattern.pages {
        let mut shapes: Vec<Vec<DVec2>> = Vec::new();
        for (number, piece) in pattern.pieces.iter().enumerate().filter(|(_, p)| p.page == page) {
            for tile in &piece.tiles {
                assert!(
                    *faces.entry(tile.face).or_insert(number) == number,
                    "a face on two pieces"
                );
                for (i, (a, b)) in tile.sides().enumerate() {
                    let error =
                        spot(a.at).distance(spot(b.at)) - point(a.point).distance(point(b.point));
                    assert!(error.abs() < 1e-6, "a side is {error} mm too long");
                    match a.fold {
                        Fold::Hinge(_) => {
                            hinges.entry((number, a.edge)).or_default().push((tile, i));
                        }
                        Fold::Seam => *cut.entry(a.edge).or_default() += 1,
                        Fold::Border => {}
                    }
                }
                shapes.push(polygon(tile));
            }
            let tabs = piece.tabs.iter().map(|t| t.outline.iter().map(|&p| spot(p)).collect());
            shapes.extend(tabs);
            let ring = |line: &Vec<Spot>| line.iter().map(|&p| spot(p)).collect::<Vec<_>>();
            let inside: f64 = piece.outlines().iter().map(|l| doubled(&ring(l))).sum();
            let tabs = piece.tabs.iter().map(|t| doubled(&ring(&t.outline)));
            let all: f64 = piece.tiles.iter().map(|t| doubled(&polygon(t))).chain(tabs).sum();
            assert!((inside - all).abs() < 1e-6 * all, "the outline holds {inside}, not {all}");
        }
        let strips = pattern.strips.iter().filter(|s| s.page == page);
        shapes.extend(strips.map(|s| s.outline.iter().map(|&p| spot(p)).collect::<Vec<_>>()));
        for (i, a) in shapes.iter().enumerate() {
            assert!(doubled(a) > 0.0, "a shape is turned over");
            let on_page = |p: &DVec2| {
                p.min_element() >= 0.0 && p.cmple(DVec2::from_array(pattern.page)).all()
            };
            assert!(a.iter().all(on_page), "off the page");
            for b in &shapes[..i] {
                let area = shared(a, b);
                assert!(area < 1e-5, "shapes share {area} mm2");
            }
        }
    }
    assert_eq!(faces.len(), pattern.mesh.faces.len(), "faces are missing");
    for sides in hinges.values() {
        assert!(sides.len() == 2, "a hinge of {} sides", sides.len());
        check_fold(sides, &point);
    }
    let held: BTreeSet<u32> = pattern
        .pieces
        .iter()
        .flat_map(|p| p.tabs.iter().map(|t| t.edge))
        .chain(pattern.strips.iter().map(|s| s.edge))
        .collect();
    assert!(cut.iter().all(|(edge, &n)| n < 2 || held.contains(edge)), "a seam is not held");
    let folded = pattern.folded();
    assert!(folded.error < 1e-4, "folded again, a corner is {} mm off", folded.error);
    assert_eq!(folded.mesh.check(), Ok(()));
}

fn doubled(polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    (0..n).map(|i| polygon[i].perp_dot(polygon[(i + 1) % n])).sum()
}

/// The fold at a hinge is the angle in space, with its sign.
fn check_fold(sides: &[(&Tile, usize)], point: &impl Fn(u32) -> DVec3) {
    let normal = |tile: &Tile| {
        let p: Vec<DVec3> = tile.corners.iter().map(|c| point(c.point)).collect();
        (0..p.len()).map(|i| p[i].cross(p[(i + 1) % p.len()])).sum::<DVec3>().normalize()
    };
    let [(a, i), (b, j)] = [sides[0], sides[1]];
    let (Fold::Hinge(fold), Fold::Hinge(other)) = (a.corners[i].fold, b.corners[j].fold) else {
        panic!("a hinge on one side only");
    };
    assert_eq!(fold, other);
    assert_eq!(a.corners[i].point, b.corners[(j + 1) % b.corners.len()].point);
    assert_eq!(a.corners[i].at, b.corners[(j + 1) % b.corners.len()].at);
    let (m, n) = (normal(a), normal(b));
    let cosine = fold.to_radians().cos();
    assert!((m.dot(n) - cosine).abs() < 1e-6, "a fold of {fold} for {}", m.dot(n));
    let along = point(a.corners[(i + 1) % a.corners.len()].point) - point(a.corners[i].point);
    let sine = m.cross(n).dot(along.normalize());
    assert!((sine - fold.to_radians().sin()).abs() < 1e-6, "a fold the wrong way");
}

/// A box of `n` squares along each edge, in two triangles each.
fn squared_box(n: u32) -> Mesh {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for side in 0..6usize {
        let axis = side / 2;
        for i in 0..n {
            for j in 0..n {
                let corner = |i: u32, j: u32| {
                    let mut p = [0.0; 3];
                    p[axis] = (side % 2) as f64;
                    let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                    (p[(axis + 1) % 3], p[(axis + 2) % 3]) =
                        if side % 2 == 1 { (u, v) } else { (v, u) };
                    p
                };
                let first = points.len() as u32;
                points.extend([
                    corner(i, j),
                    corner(i + 1, j),
                    corner(i + 1, j + 1),
                    corner(i, j + 1),
                ]);
                triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
    }
    Mesh::new(points, triangles).unwrap()
}

fn sample(sample: Sample, resolution: usize) -> Mesh {
    sample.polygons(resolution).unwrap().triangulate()
}

#[test]
fn a_box_is_six_faces_in_one_piece() {
    for n in [1, 4] {
        let Unfolded { pattern, account } = unfolded(&squared_box(n));
        check(&pattern);
        assert_eq!((account.faces, account.pieces_unlimited, account.seams), (6, 1, 7));
        assert_eq!(pattern.mesh.points.len(), 8);
        assert_eq!(account.strips, 0);
    }
}

#[test]
fn a_wall_with_a_window_stays_one_face() {
    // A frame of eight squares with the middle left out.
    let mut mesh = squared_box(3);
    mesh.triangles.truncate(18);
    mesh.triangles.drain(8..10);
    let Unfolded { pattern, account } = unfolded(&mesh);
    check(&pattern);
    assert_eq!((account.faces, account.pieces, account.seams), (1, 1, 0));
    assert_eq!(pattern.pieces[0].outlines().len(), 2);
    assert!(pattern.pieces[0].creases().is_empty());
}

#[test]
fn sheets_that_meet_in_one_edge_are_glued_there() {
    let points =
        vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-1.0, 0.1, 0.0], [0.1, 1.0, 0.0]];
    let mesh = Mesh::new(points, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]).unwrap();
    let Unfolded { pattern, account } = unfolded(&mesh);
    check(&pattern);
    assert_eq!((account.pieces, account.seams), (2, 1));
    let folded = pattern.pieces.iter().flat_map(|p| p.creases()).filter(|c| !c.tab);
    assert!(folded.into_iter().all(|c| c.fold.abs() < 10.0), "the flattest pair is folded");
}

#[test]
fn a_moebius_band_is_one_piece() {
    let n = 12;
    let mut points = Vec::new();
    for i in 0..n {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        for side in [-0.3, 0.3] {
            let (radius, height) = (1.0 + side * (angle / 2.0).cos(), side * (angle / 2.0).sin());
            points.push([radius * angle.cos(), radius * angle.sin(), height]);
        }
    }
    let corner = |i: u32, side: u32| if i < 12 { 2 * i + side } else { 1 - side };
    let quad = |i| {
        let [a, b, c, d] = [corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1)];
        [[a, b, c], [a, c, d]]
    };
    let mesh = Mesh::new(points, (0..12).flat_map(quad).collect()).unwrap();
    let Unfolded { pattern, account } = unfolded(&mesh);
    check(&pattern);
    assert_eq!((account.parts, account.pieces_unlimited, account.seams), (1, 1, 1));
}

#[test]
fn nothing_and_too_much_are_refused() {
    let run = Run::default();
    let options = UnfoldOptions::default();
    assert_eq!(unfold(&Mesh::default(), &options, &run), Err(UnfoldError::Empty));
    let large = UnfoldOptions { scale: Scale::Size(400.0), divide: false, ..options };
    let refused = unfold(&squared_box(1), &large, &run);
    assert!(matches!(refused, Err(UnfoldError::LargeFace { .. })));
    let huge = UnfoldOptions { scale: Scale::Size(1e5), ..options };
    let refused = unfold(&squared_box(1), &huge, &run);
    assert!(matches!(refused, Err(UnfoldError::LargeFace { .. })));
    for bad in [f64::NAN, 0.0, -1.0] {
        let bad = UnfoldOptions { page: [bad, 297.0], ..options };
        assert!(matches!(unfold(&squared_box(1), &bad, &run), Err(UnfoldError::Length { .. })));
    }
}

#[test]
fn large_models_are_bitten_into_pages() {
    let mesh = sample(Sample::Sphere, 6);
    let options =
        UnfoldOptions { scale: Scale::Size(300.0), effort: 1, ..UnfoldOptions::default() };
    let Unfolded { pattern, account } = unfold(&mesh, &options, &Run::default()).unwrap();
    check(&pattern);
    assert!(account.pieces > account.pieces_unlimited && account.pages > 1);
}

#[test]
fn faces_larger_than_a_page_are_cut_across() {
    for (size, least) in [(170.0, 0), (200.0, 6), (400.0, 24)] {
        let options = UnfoldOptions { scale: Scale::Size(size), ..UnfoldOptions::default() };
        let found = unfold(&squared_box(1), &options, &Run::default()).unwrap();
        check(&found.pattern);
        let (cuts, faces) = (found.account.divided, found.account.faces);
        assert!(cuts >= least && (cuts == 0) == (least == 0), "{cuts}");
        assert_eq!(faces, 6 + cuts as usize);
    }
}

#[test]
fn threads_and_repetition_change_nothing() {
    let mesh = sample(Sample::Torus, 12);
    let one = crate::par::with_threads(1, || unfolded(&mesh));
    let three = crate::par::with_threads(3, || unfolded(&mesh));
    assert_eq!(one, three);
    check(&one.pattern);
    let options = UnfoldOptions { seed: 2, effort: 1, ..UnfoldOptions::default() };
    let other = unfold(&mesh, &options, &Run::default()).unwrap();
    check(&other.pattern);
}

proptest! {
    #![proptest_config(cases(24))]

    /// Random triangles over random points: open, with any number at an edge, through each other.
    #[test]
    fn any_triangles_are_unfolded(seed in any::<u64>(), points in 4usize..12, faces in 1usize..24) {
        let mut random = Random::new(seed);
        // Half-way numbers make triangles in one plane, and without area, likely.
        let mut place = || std::array::from_fn(|_| random.below(5) as f64 / 2.0);
        let points: Vec<[f64; 3]> = (0..points).map(|_| place()).collect();
        let count = points.len();
        let mut corner = || random.below(count) as u32;
        let triangles = (0..faces).map(|_| [corner(), corner(), corner()]).collect();
        let mesh = Mesh::new(points, triangles).unwrap();
        let options = UnfoldOptions { scale: Scale::Size(100.0), effort: 1, seed, ..Default::default() };
        match unfold(&mesh, &options, &Run::default()) {
            Ok(Unfolded { pattern, .. }) => check(&pattern),
            Err(UnfoldError::Empty | UnfoldError::Flat | UnfoldError::LargeFace { .. }) => {}
            Err(error) => prop_assert!(false, "{error}"),
        }
    }

    /// Closed models, some of their triangles left out.
    #[test]
    fn models_with_holes_are_unfolded(seed in any::<u64>(), which in 0usize..3, holes in 0usize..8) {
        let mut mesh = match which {
            0 => sample(Sample::Sphere, 6),
            1 => sample(Sample::Torus, 8),
            _ => squared_box(2),
        };
        let mut random = Random::new(seed);
        for _ in 0..holes {
            let t = random.below(mesh.triangles.len());
            mesh.triangles.remove(t);
        }
        check(&unfolded(&mesh).pattern);
    }
}

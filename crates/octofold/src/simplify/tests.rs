//! Guarantees of simplification on random meshes: closed ones, open ones, sheets that meet in
//! junctions, and soups that meet themselves all over.

use super::*;
use crate::attributes::Attributes;
use crate::exact;
use crate::measure::{Topology, Verdict, hausdorff_bounds, self_intersections, within};
use crate::samples::Sample;
use crate::surface::{CubesOptions, Inside, marching_cubes, noise};
use proptest::prelude::*;

fn run() -> Run {
    Run::default()
}

fn sphere(resolution: usize) -> Mesh {
    Sample::Sphere.mesh(resolution, &run()).unwrap().triangulate()
}

/// The surface of random blocks, closed or ending at the border, bent by a wave so that no two of its
/// faces need be in one plane.
fn blocks(dims: [usize; 3], seed: u64, smooth: u64, open: bool, wave: f64) -> Mesh {
    let options = CubesOptions { iso: 0.5, inside: Inside::Above, open };
    let mut mesh = marching_cubes(&noise(dims, seed, smooth), &options, &run()).unwrap();
    for p in &mut mesh.points {
        let [x, y, z] = *p;
        let bent = [x + wave * (y * 0.9).sin(), y + wave * (z * 1.1).sin(), z + wave * x.cos()];
        *p = bent.map(|x| f64::from(x as f32));
    }
    mesh
}

/// `sheets` sheets of cells that all meet in one line, as the pages of a book.
fn book(sheets: u32, across: u32, along: u32, seed: u64) -> Mesh {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let mut state = seed;
    let mut random = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64 - 0.5
    };
    (0..=along).for_each(|j| points.push([0.0, 0.0, f64::from(j)]));
    for sheet in 0..sheets {
        let angle = std::f64::consts::TAU * f64::from(sheet) / f64::from(sheets);
        let first = points.len() as u32;
        for i in 1..=across {
            for j in 0..=along {
                let (r, lift) = (f64::from(i), 0.2 * random());
                let at = |c: f64, s: f64| r * c - lift * s;
                let (c, s) = (angle.cos(), angle.sin());
                points.push([at(c, s), at(s, -c), f64::from(j) + 0.3 * random()]);
            }
        }
        let name = |i: u32, j: u32| if i == 0 { j } else { first + (i - 1) * (along + 1) + j };
        for i in 0..across {
            for j in 0..along {
                let [a, b, c, d] = [name(i, j), name(i + 1, j), name(i + 1, j + 1), name(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    Mesh::new(points, triangles).unwrap()
}

/// Pairs of neighbours at an angle below ten degrees.
fn folds(mesh: &Mesh) -> usize {
    let mut sides: Vec<([u32; 2], u32)> = Vec::new();
    for t in &mesh.triangles {
        for i in 0..3 {
            let (p, q) = (t[i], t[(i + 1) % 3]);
            sides.push(([p.min(q), p.max(q)], t[(i + 2) % 3]));
        }
    }
    sides.sort_unstable();
    let at = |p: u32| DVec3::from(mesh.points[p as usize]);
    let edges = sides.chunk_by(|a, b| a.0 == b.0).filter(|edge| edge.len() == 2);
    edges
        .filter(|edge| {
            let [p, q] = edge[0].0.map(at);
            let square = |r: u32| (q - p).cross(at(r) - p).normalize_or_zero();
            // The exact bound is tested where it is made.
            square(edge[0].1).dot(square(edge[1].1)) > 9.9f64.to_radians().cos()
        })
        .count()
}

/// Everything that is guaranteed, checked by other means than those that made it.
fn assert_simplified(mesh: &Mesh, options: &SimplifyOptions) -> Simplified {
    let run = run();
    // Borders are sewn first.
    let open = Topology::of(mesh.points.len(), &mesh.triangles, &run).unwrap().boundary_edges.count;
    let welded = if open > 0 { sew(mesh, &run).unwrap().mesh } else { mesh.clone() };
    let found = simplify(mesh, options, &run).unwrap();
    let (small, account) = (&found.mesh, &found.account);
    assert!(small.check().is_ok());
    let [before, after] =
        [&welded, small].map(|m| Topology::of(m.points.len(), &m.triangles, &run).unwrap());
    assert_eq!(before.euler(), after.euler(), "{account:?}");
    assert_eq!(before.components, after.components);
    assert_eq!(before.is_closed(), after.is_closed());
    assert_eq!(before.is_manifold(), after.is_manifold());
    assert_eq!(before.boundary_edges.count == 0, after.boundary_edges.count == 0);
    assert!(!before.is_oriented() || after.is_oriented());
    assert!(after.nonmanifold_edges.count <= before.nonmanifold_edges.count);
    assert!(after.duplicate_triangles.count <= before.duplicate_triangles.count);
    assert!(folds(small) <= folds(&welded));
    let pairs = |m: &Mesh| self_intersections(m, &run).unwrap().len();
    assert!(pairs(small) <= pairs(&welded), "{} {}", pairs(small), pairs(&welded));
    let flat = |m: &Mesh| (0..m.triangles.len()).filter(|&t| exact::is_flat(m.corners(t))).count();
    assert!(flat(small) <= flat(&welded));
    if let Some(error) = options.error {
        let verdict = within(small, mesh, error, &run).unwrap();
        assert!(matches!(verdict, Verdict::Proven | Verdict::Empty), "{verdict:?}");
    }
    assert_eq!(small.triangles.len(), account.faces_after);
    let target = account.target.unwrap_or(0);
    assert_eq!(account.stop == Stop::Faces, account.faces_after <= target);
    assert!(
        account.stop == Stop::Faces || !account.kept_by.is_empty() || small.triangles.is_empty()
    );
    found
}

fn options() -> impl Strategy<Value = SimplifyOptions> {
    let error = prop::option::of(0.01..1.5f64);
    (prop::option::of(0.0..0.9f64), error).prop_map(|(ratio, error)| SimplifyOptions {
        faces: None,
        ratio,
        error,
    })
}

proptest! {
    #![proptest_config(crate::sweep::cases(24))]

    #[test]
    fn surfaces_of_blocks_keep_what_they_are(
        dims in prop::array::uniform3(1usize..12),
        seed in any::<u64>(),
        smooth in 1u64..5,
        open in any::<bool>(),
        wave in prop::sample::select(vec![0.0, 0.05, 0.4]),
        options in options(),
    ) {
        assert_simplified(&blocks(dims, seed, smooth, open, wave), &options);
    }

    #[test]
    fn sheets_keep_their_junction(
        sheets in 1u32..6,
        across in 1u32..6,
        along in 1u32..8,
        seed in any::<u64>(),
        options in options(),
    ) {
        let book = book(sheets, across, along, seed);
        let found = assert_simplified(&book, &options);
        // The line in which all meet stays where it is, from end to end.
        let on_line: Vec<f64> = found.mesh.points.iter()
            .filter(|p| p[0].hypot(p[1]) < 1e-5).map(|p| p[2]).collect();
        let reach = |f: fn(f64, f64) -> f64, start| on_line.iter().copied().fold(start, f);
        if sheets > 2 {
            prop_assert_eq!(reach(f64::min, f64::INFINITY), 0.0);
            prop_assert_eq!(reach(f64::max, f64::NEG_INFINITY), f64::from(along));
        }
    }

    #[test]
    fn soups_get_no_worse(
        points in prop::collection::vec(prop::array::uniform3(-2i8..=2), 3..14),
        triangles in prop::collection::vec(prop::array::uniform3(0usize..14), 0..40),
        options in options(),
    ) {
        let count = points.len();
        let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
        // Triangles that name a point twice would go, and with them what they held together.
        let triangles = triangles.iter().map(|t| t.map(|p| p % count))
            .filter(|&[a, b, c]| {
                points[a] != points[b] && points[b] != points[c] && points[c] != points[a]
            })
            .map(|t| t.map(|p| p as u32)).collect();
        let mesh = Mesh::new(points, triangles).unwrap();
        assert_simplified(&mesh, &options);
    }

    #[test]
    fn threads_do_not_change_a_byte(seed in any::<u64>(), options in options()) {
        let mesh = blocks([9, 8, 7], seed, 3, seed % 2 == 0, 0.1);
        let found = [1, 2, 3, 8].map(|threads| {
            par::with_threads(threads, || simplify(&mesh, &options, &run()).unwrap())
        });
        prop_assert!(found.windows(2).all(|f| f[0] == f[1]));
    }

    #[test]
    fn what_is_seen_from_above_stays_so(seed in any::<u64>(), ratio in 0.02..0.5f64) {
        let mut mesh = book(1, 12, 12, seed);
        // Heights over a plane, so low that no slope and 75 degrees, which a triangle may drift from what
        // it stands for, make a right angle: one that turns over shows its back.
        for p in &mut mesh.points {
            *p = [p[2], p[0], p[1] * 0.5];
        }
        let options = SimplifyOptions { ratio: Some(ratio), ..SimplifyOptions::default() };
        let found = assert_simplified(&mesh, &options);
        for t in 0..found.mesh.triangles.len() {
            let [a, b, c] = found.mesh.corners(t).map(DVec3::from);
            let [d, e, f] = mesh.corners(0).map(DVec3::from);
            prop_assert!((b - a).cross(c - a).z * (e - d).cross(f - d).z > 0.0);
        }
    }
}

#[test]
fn a_sphere_goes_down_to_a_tetrahedron_and_says_why_it_stops() {
    let sphere = sphere(24);
    let options = SimplifyOptions { faces: Some(0), ..SimplifyOptions::default() };
    let found = assert_simplified(&sphere, &options);
    assert!(found.account.faces_after < 40, "{:?}", found.account);
    assert_eq!(found.account.stop, Stop::Exhausted);
    let options = SimplifyOptions { faces: Some(300), ..options };
    let found = assert_simplified(&sphere, &options);
    assert!((299..=300).contains(&found.account.faces_after));
    assert!(found.account.kept_by.is_empty());
}

#[test]
fn an_error_bounds_both_distances_on_a_sphere() {
    let sphere = sphere(32);
    let mut last = sphere.triangles.len();
    for error in [0.001, 0.003, 0.01, 0.03] {
        let options = SimplifyOptions { error: Some(error), ..SimplifyOptions::default() };
        let found = assert_simplified(&sphere, &options);
        assert!(found.account.faces_after < last, "{error} {:?}", found.account);
        last = found.account.faces_after;
        let bounds = hausdorff_bounds(&found.mesh, &sphere, 1e-6, &run()).unwrap().unwrap();
        let most = bounds.a_to_b.upper.max(bounds.b_to_a.upper);
        assert!(most <= error + 2e-6 && most > 0.4 * error, "{error} {most}");
    }
}

#[test]
fn no_error_leaves_only_what_is_flat() {
    let cube = blocks([6, 6, 6], 0, 100, false, 0.0);
    let options = SimplifyOptions { error: Some(0.0), ..SimplifyOptions::default() };
    assert_simplified(&cube, &options);
}

/// A square of `n` by `n` cells with a colour that follows x, uv that follow both with a jump in
/// the middle, and a material on either half.
fn painted(n: u32) -> Mesh {
    let side = n + 1;
    let points: Vec<[f64; 3]> =
        (0..side * side).map(|i| [f64::from(i % side), f64::from(i / side), 0.0]).collect();
    let cell = |i: u32| {
        let low = i % n + i / n * side;
        [[low, low + 1, low + side + 1], [low, low + side + 1, low + side]]
    };
    let mut mesh = Mesh::new(points.clone(), (0..n * n).flat_map(cell).collect()).unwrap();
    let right = |t: usize| (t as u32 / 2) % n >= n / 2;
    let uvs = mesh.triangles.iter().enumerate().flat_map(|(t, corners)| {
        corners.map(|p| {
            let [x, y, _] = points[p as usize];
            [x as f32 + if right(t) { 100.0 } else { 0.0 }, y as f32]
        })
    });
    mesh.attributes = Attributes {
        point_colours: Some(points.iter().map(|p| [(p[0] * 8.0) as u8, 0, 0, 255]).collect()),
        corner_uvs: Some(uvs.collect()),
        face_materials: Some((0..mesh.triangles.len()).map(|t| u32::from(right(t))).collect()),
        materials: vec![Default::default(); 2],
        ..Attributes::default()
    };
    mesh
}

#[test]
fn columns_come_along_and_seams_stay() {
    let mesh = painted(16);
    let options = SimplifyOptions { faces: Some(12), ..SimplifyOptions::default() };
    let Simplified { mesh: small, account } = assert_simplified(&mesh, &options);
    assert!(!account.seams_given_up && small.triangles.len() <= 12, "{account:?}");
    let a = &small.attributes;
    let (colours, uvs) = (a.point_colours.as_ref().unwrap(), a.corner_uvs.as_ref().unwrap());
    let mut areas = [0.0; 2];
    for t in 0..small.triangles.len() {
        let material = a.face_materials.as_ref().unwrap()[t];
        let [p, q, r] = small.corners(t).map(DVec3::from);
        areas[material as usize] += (q - p).cross(r - p).z / 2.0;
        for i in 0..3 {
            let point = small.triangles[t][i] as usize;
            let [x, y, _] = small.points[point];
            let [u, v] = uvs[3 * t + i].map(f64::from);
            let jump = 100.0 * f64::from(material);
            assert!((u - jump - x).abs() < 1e-3 && (v - y).abs() < 1e-3, "{u} {v} {x} {y}");
            assert!((f64::from(colours[point][0]) - 8.0 * x).abs() < 6.0);
        }
    }
    assert!(areas.iter().all(|area| (area - 128.0).abs() < 0.01), "{areas:?}");
}

#[test]
fn seams_are_given_up_only_where_the_target_asks_for_it() {
    let mesh = painted(4);
    let all = SimplifyOptions { error: Some(0.5), ..SimplifyOptions::default() };
    assert!(!assert_simplified(&mesh, &all).account.seams_given_up);
    let one = SimplifyOptions { faces: Some(1), ..SimplifyOptions::default() };
    let found = assert_simplified(&mesh, &one);
    assert!(found.account.seams_given_up && found.account.faces_after == 1, "{:?}", found.account);
}

#[test]
fn nothing_is_simplified_to_nothing() {
    let options = SimplifyOptions { faces: Some(10), error: Some(1.0), ratio: Some(0.5) };
    let found = simplify(&Mesh::default(), &options, &run()).unwrap();
    assert_eq!(found.mesh, Mesh::default());
    assert_eq!(found.account.stop, Stop::Faces);
}

#[test]
fn a_cancelled_run_stops() {
    let run = run();
    run.cancel.cancel();
    let sphere = sphere(64);
    let options = SimplifyOptions { faces: Some(0), ..SimplifyOptions::default() };
    assert_eq!(simplify(&sphere, &options, &run), Err(Cancelled));
}

//! Measures of whole meshes.

#[path = "shapes/torus.rs"]
mod torus;

use octofold::measure::{
    Nearest, Verdict, Weld, Winding, compare, hausdorff_bounds, measure, self_intersections, within,
};
use octofold::samples::Sample;
use octofold::{LengthUnit, Mesh, Run, Solid, par};
use torus::torus;

/// Both meshes in one, the second moved.
fn together(a: &Mesh, b: &Mesh, by: [f64; 3]) -> Mesh {
    let first = a.points.len() as u32;
    let moved = b.points.iter().map(|p| std::array::from_fn(|x| p[x] + by[x]));
    let points = a.points.iter().copied().chain(moved).collect();
    let triangles = b.triangles.iter().map(|t| t.map(|p| p + first));
    let triangles = a.triangles.iter().copied().chain(triangles).collect();
    Mesh { points, triangles, ..Mesh::default() }
}

/// Every corner its own point, as in STL.
fn torn(mesh: &Mesh) -> Mesh {
    let points = (0..mesh.triangles.len()).flat_map(|t| mesh.corners(t)).collect();
    let count = mesh.triangles.len() as u32;
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Mesh { points, triangles, ..Mesh::default() }
}

fn cube(size: f64) -> Mesh {
    let points = (0..8u8).map(|i| [0, 1, 2].map(|x| f64::from(i >> x & 1) * size)).collect();
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { points, triangles, ..Mesh::default() }
}

#[test]
fn a_torus_measures_as_a_torus() {
    let mesh = torus(120, 60);
    let run = Run::default();
    let whole = measure(&mesh, Weld::Exact, &run).unwrap();
    assert!(whole.closed && whole.manifold && whole.oriented);
    assert_eq!((whole.euler, whole.genus, whole.components), (0, Some(1), 1));
    assert_eq!((whole.self_intersections, whole.zero_area_triangles), (0, 0));
    assert!(Solid::try_from(mesh.clone()).is_ok());

    let welded = measure(&torn(&mesh), Weld::Exact, &run).unwrap();
    assert_eq!((welded.points, welded.euler), (whole.points, whole.euler));
    let loose = measure(&torn(&mesh), Weld::Off, &run).unwrap();
    assert_eq!(loose.boundary_edges, 3 * mesh.triangles.len());
    assert_eq!((loose.volume, loose.genus), (None, None));
    assert_eq!(loose.places.boundary_edges.len(), 8);
}

#[test]
fn volume_keeps_its_digits_far_from_the_origin() {
    let far = together(&Mesh::default(), &cube(1.0), [1e9; 3]);
    let measures = measure(&far, Weld::Exact, &Run::default()).unwrap();
    assert_eq!((measures.volume, measures.area), (Some(1.0), 6.0));
}

#[test]
fn json_has_the_keys_of_info_in_their_order() {
    let measures = measure(&cube(1.0), Weld::Exact, &Run::default()).unwrap();
    assert_eq!(
        serde_json::to_string(&measures).unwrap(),
        concat!(
            r#"{"kind":"mesh","points":8,"triangles":12,"components":1,"boundary_edges":0,"#,
            r#""nonmanifold_edges":0,"nonmanifold_points":0,"misoriented_edges":0,"#,
            r#""degenerate_triangles":0,"duplicate_triangles":0,"self_intersections":0,"#,
            r#""closed":true,"manifold":true,"oriented":true,"euler":2,"genus":0,"volume":1.0,"#,
            r#""area":6.0,"bounds":[[0.0,0.0,0.0],[1.0,1.0,1.0]],"zero_area_triangles":0}"#,
        )
    );
}

#[test]
fn an_empty_mesh_has_measures() {
    let measures = measure(&Mesh::default(), Weld::Exact, &Run::default()).unwrap();
    assert!(!measures.closed && measures.manifold && measures.oriented);
    assert_eq!((measures.bounds, measures.volume, measures.genus), (None, None, None));
    let comparison = compare(&Mesh::default(), &cube(1.0), 100, &Run::default()).unwrap();
    assert_eq!((comparison.a_to_b, comparison.hausdorff), (None, None));
}

#[test]
fn a_cube_around_a_cube_is_as_far_as_its_corner() {
    let outer = cube(4.0);
    let inner = together(&Mesh::default(), &cube(2.0), [1.0; 3]);
    let found = compare(&inner, &outer, 10_000, &Run::default()).unwrap();
    let (out, back) = (found.a_to_b.unwrap(), found.b_to_a.unwrap());
    assert_eq!((out.max, out.mean, out.rms), (1.0, 1.0, 1.0));
    assert_eq!(back.max, 3f64.sqrt());
    assert_eq!(found.hausdorff, Some(3f64.sqrt()));
    assert_eq!((found.volume_a, found.volume_b), (Some(8.0), Some(64.0)));
    assert_eq!((found.area_a, found.area_b), (24.0, 96.0));
}

#[test]
fn samples_lie_evenly_on_the_surface() {
    // From the faces of a cube to a plane through one of them: 0, 1 and four times 1/2.
    let plane = vec![[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
    let plane = Mesh::new(plane, vec![[0, 1, 2]]).unwrap();
    let found = compare(&cube(1.0), &plane, 60_000, &Run::default()).unwrap().a_to_b.unwrap();
    assert!((found.mean - 0.5).abs() < 1e-3, "{}", found.mean);
    assert!((found.rms - (7f64 / 18.0).sqrt()).abs() < 1e-3, "{}", found.rms);
}

#[test]
fn a_ball_in_a_larger_ball_is_as_far_as_their_radii() {
    let run = Run::default();
    let ball = Sample::Sphere.polygons(48).unwrap().triangulate();
    let larger = ball.map(|p| p.map(|x| 0.5 + 1.1 * (x - 0.5)));
    // Every point of one is a tenth of its way from the centre away from its image in the other.
    assert_eq!(within(&ball, &larger, 0.04, &run).unwrap(), Verdict::Proven);
    let bounds = hausdorff_bounds(&ball, &larger, 1e-4, &run).unwrap().unwrap();
    for found in [bounds.a_to_b, bounds.b_to_a] {
        assert!(found.lower > 0.038 && found.upper < 0.0402, "{found:?}");
        assert!(found.upper - found.lower < 1.01e-4);
    }
    let sampled = compare(&ball, &larger, 20_000, &run).unwrap();
    assert!(sampled.a_to_b.unwrap().max <= bounds.a_to_b.upper);
    assert!(sampled.b_to_a.unwrap().max <= bounds.b_to_a.upper);
    let refuted = within(&ball, &larger, 0.037, &run).unwrap();
    assert!(matches!(refuted, Verdict::Refuted { .. }), "{refuted:?}");
}

#[test]
fn units_are_converted_before_comparing() {
    let mut millimetres = cube(1000.0);
    millimetres.unit = Some(LengthUnit::Millimetre);
    let mut metres = cube(1.0);
    let run = Run::default();
    assert!(compare(&millimetres, &metres, 10, &run).unwrap().hausdorff > Some(900.0));
    metres.unit = Some(LengthUnit::Metre);
    let found = compare(&millimetres, &metres, 10, &run).unwrap();
    assert!(found.hausdorff < Some(1e-9));
    assert!((found.volume_b.unwrap() - 1e9).abs() < 1.0);
    assert_eq!(found.diagonal, Some(1000.0 * 3f64.sqrt()));
}

#[test]
fn winding_numbers_tell_inside_from_outside() {
    let mesh = torus(100, 50);
    let winding = Winding::new(&mesh);
    for i in 0..400 {
        let u = f64::from(i) * 0.7;
        for (out, expected) in [(1.0, 1.0), (1.2, 1.0), (1.5, 0.0), (0.3, 0.0), (4.0, 0.0)] {
            let found = winding.at([out * u.cos(), out * u.sin(), 0.05]);
            assert!((found - expected).abs() < 0.03, "{out}: {found}");
        }
    }
    assert_eq!(Winding::new(&Mesh::default()).at([0.0; 3]), 0.0);
}

#[test]
fn an_open_box_has_the_winding_number_of_its_solid_angle() {
    let mut open = cube(2.0);
    open.triangles.truncate(10);
    let found = Winding::new(&open).at([1.0; 3]);
    assert!((found - 5.0 / 6.0).abs() < 1e-9, "{found}");
}

#[test]
fn results_are_the_same_for_any_number_of_threads() {
    let ring = torus(150, 70);
    let mesh = torn(&together(&ring, &ring, [0.31, 0.17, 0.05]));
    let coarse = torus(40, 20);
    let all = |threads| {
        par::with_threads(threads, || {
            let run = Run::default();
            let measures = measure(&mesh, Weld::Exact, &run).unwrap();
            let pairs = self_intersections(&mesh, &run).unwrap();
            let hits = Nearest::new(&mesh).nearest_all(&coarse.points, &run).unwrap();
            let winding = Winding::new(&mesh);
            let around = coarse.points.iter().map(|&p| winding.at(p)).collect::<Vec<_>>();
            let bounds = hausdorff_bounds(&ring, &coarse, 1e-3, &run).unwrap().unwrap();
            let furthest = bounds.a_to_b.lower.max(bounds.b_to_a.lower);
            let verdicts = [0.3, 0.7, 0.999, 1.1]
                .map(|share| within(&ring, &coarse, share * furthest, &run).unwrap());
            let compared = compare(&mesh, &coarse, 20_000, &run).unwrap();
            (measures, pairs, hits, around, compared, bounds, verdicts)
        })
    };
    let one = all(1);
    assert!(one.1.len() > 100 && one.1.is_sorted());
    assert_eq!(one.0.self_intersections, one.1.len());
    for threads in [2, 3, 8] {
        assert!(one == all(threads), "{threads} threads");
    }
}

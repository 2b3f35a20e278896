//! What the built-in shapes promise: sides, volumes, topology and planted defects.

use super::*;
use crate::mesh::Mesh;
use crate::random::Random;
use crate::run::Run;
use crate::spans::Spans;
use crate::volume::{Region, Volume};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// How often each directed edge of the faces stands there, in the order of the edges.
fn directed_edges<'a>(faces: impl Iterator<Item = &'a [u32]>) -> Vec<([u32; 2], usize)> {
    let mut edges: Vec<[u32; 2]> =
        faces.flat_map(|f| (0..f.len()).map(move |i| [f[i], f[(i + 1) % f.len()]])).collect();
    edges.sort_unstable();
    let mut counted: Vec<([u32; 2], usize)> = Vec::new();
    for edge in edges {
        match counted.last_mut() {
            Some((last, count)) if *last == edge => *count += 1,
            _ => counted.push((edge, 1)),
        }
    }
    counted
}

fn soup_edges(soup: &Soup) -> Vec<([u32; 2], usize)> {
    directed_edges((0..soup.faces()).map(|f| soup.face(f)))
}

/// Every directed edge once, and its opposite once.
fn is_closed_and_oriented(soup: &Soup) -> bool {
    let edges = soup_edges(soup);
    edges
        .iter()
        .all(|&([a, b], count)| count == 1 && edges.binary_search_by_key(&[b, a], |e| e.0).is_ok())
}

/// The faces around every point form one fan.
fn has_manifold_points(soup: &Soup) -> bool {
    let mut next: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    let mut degree = vec![0; soup.points().len()];
    let mut start = vec![None; soup.points().len()];
    for f in 0..soup.faces() {
        let face = soup.face(f);
        let n = face.len();
        for i in 0..n {
            let (before, p, after) = (face[(i + n - 1) % n], face[i], face[(i + 1) % n]);
            next.insert((p, after), before);
            degree[p as usize] += 1;
            start[p as usize] = Some(after);
        }
    }
    (0..soup.points().len() as u32).all(|p| {
        let first = start[p as usize].expect("no point without faces");
        let (mut at, mut steps) = (next[&(p, first)], 1);
        while at != first {
            at = next[&(p, at)];
            steps += 1;
        }
        steps == degree[p as usize]
    })
}

fn volume_of(mesh: &Mesh) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t).map(DVec3::from);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

fn euler(soup: &Soup) -> i64 {
    soup.points().len() as i64 - soup_edges(soup).len() as i64 / 2 + soup.faces() as i64
}

const PRIMITIVES: [Sample; 7] = [
    Sample::Sphere,
    Sample::Cube,
    Sample::Cylinder,
    Sample::Cone,
    Sample::Tetrahedron,
    Sample::Prism,
    Sample::Torus,
];

#[test]
fn names_round_trip() {
    for sample in Sample::ALL {
        assert_eq!(Sample::from_name(sample.name()), Some(sample));
        assert_eq!(Sample::ALL.iter().filter(|s| s.name() == sample.name()).count(), 1);
        let about = sample.about();
        assert!(!about.is_empty() && about.len() < 60 && !about.contains('\n'), "{about}");
    }
    assert_eq!(Sample::from_name("teapot"), None);
}

#[test]
fn primitives_are_closed_manifolds_of_the_right_genus() {
    for sample in PRIMITIVES {
        for resolution in [0, 3, 4, 5, 8, 33, 128] {
            let soup = sample.polygons(resolution).unwrap();
            assert!(is_closed_and_oriented(&soup), "{} at {resolution}", sample.name());
            assert!(has_manifold_points(&soup), "{} at {resolution}", sample.name());
            let expected = if sample == Sample::Torus { 0 } else { 2 };
            assert_eq!(euler(&soup), expected, "{} at {resolution}", sample.name());
        }
    }
}

#[test]
fn volumes_of_primitives_converge_from_below() {
    use std::f64::consts::PI;
    for sample in PRIMITIVES {
        let exact = match sample {
            Sample::Sphere => 4.0 / 3.0 * PI * 0.4f64.powi(3),
            Sample::Cube => 0.7f64.powi(3),
            Sample::Cylinder => PI * 0.09 * 0.8,
            Sample::Cone => PI * 0.38f64.powi(2) * 0.8 / 3.0,
            // Regular, by its inscribed radius r: volume = 8 sqrt(3) r^3.
            Sample::Tetrahedron => 8.0 * 3.0f64.sqrt() * 0.17f64.powi(3),
            // Triangle by its inscribed radius: 3 sqrt(3) r^2.
            Sample::Prism => 3.0 * 3.0f64.sqrt() * 0.04 * 0.8,
            Sample::Torus => 2.0 * PI * PI * 0.3 * 0.01,
            _ => unreachable!(),
        };
        let error = |resolution| {
            let mesh = sample.polygons(resolution).unwrap().triangulate();
            1.0 - volume_of(&mesh) / exact
        };
        let (coarse, fine) = (error(64), error(256));
        let name = sample.name();
        if matches!(sample, Sample::Cube | Sample::Tetrahedron | Sample::Prism) {
            assert!(fine.abs() < 1e-12, "{name}: {fine}");
        } else {
            assert!(0.0 < fine && fine < 1e-3, "{name}: {fine}");
            assert!((coarse / fine - 16.0).abs() < 0.5, "{name}: {coarse} and {fine}");
        }
    }
}

#[test]
fn fields_agree_with_the_polygons() {
    for sample in PRIMITIVES {
        let (field, mesh) = (sample.field().unwrap(), sample.polygons(64).unwrap().triangulate());
        for p in &mesh.points {
            assert!(field(*p).abs() < 1e-12, "{}: {p:?} is off the surface", sample.name());
        }
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t).map(DVec3::from);
            let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize());
            assert!(field((middle + 0.02 * normal).into()) > 0.0, "{}", sample.name());
            assert!(field((middle - 1e-6 * normal).into()) < 0.0, "{}", sample.name());
        }
    }
}

#[test]
fn fields_grow_no_faster_than_the_distance() {
    let mut random = Random::new(3);
    for sample in Sample::ALL {
        let Some(field) = sample.field() else { continue };
        for _ in 0..40_000 {
            let p = DVec3::new(random.unit(), random.unit(), random.unit());
            let q = p + random.direction() * 0.2 * random.unit().powi(4);
            let grown = (field(p.into()) - field(q.into())).abs();
            assert!(grown <= p.distance(q) + 1e-12, "{} from {p} to {q}", sample.name());
        }
    }
}

#[test]
fn solids_lie_inside_the_unit_cube() {
    for sample in Sample::ALL {
        let Some(volume) = sample.volume(40) else { continue };
        let block = volume.read(Region::all(volume.dims())).unwrap();
        let (mut inside, mut at_border) = (0, 0);
        for i in 0..block.len() {
            let border = [i % 41, i / 41 % 41, i / 41 / 41].iter().any(|&a| a == 0 || a == 40);
            inside += usize::from(block.value(i) < 0.0);
            at_border += usize::from(block.value(i) < 0.0 && border);
        }
        assert!(inside > 1000, "{}: {inside}", sample.name());
        assert_eq!(at_border, 0, "{}", sample.name());
    }
}

#[test]
fn bounds_hold_in_every_region() {
    let mut random = Random::new(5);
    for sample in Sample::ALL {
        let (Some(samples), Some(mask)) = (sample.volume(128), sample.voxels(128)) else {
            continue;
        };
        for volume in [&samples as &dyn Volume, &mask] {
            let mut pruned = 0;
            for _ in 0..60 {
                let start = volume.dims().map(|d| random.below(d - 6));
                let region = Region { start, end: start.map(|s| s + 1 + random.below(6)) };
                let [low, high] = volume.bounds(region).unwrap();
                let block = volume.read(region).unwrap();
                for i in 0..block.len() {
                    let value = block.value(i);
                    assert!((low..=high).contains(&value), "{} {region:?}", sample.name());
                }
                pruned += usize::from(if volume.is_binary() {
                    low == high
                } else {
                    low > 0.0 || high < 0.0
                });
            }
            assert!(pruned > 10, "{}: only {pruned} of 60 regions are decided", sample.name());
        }
    }
}

#[test]
fn masks_and_samples_lie_where_they_say() {
    let (samples, mask) = (Sample::PartE.volume(20).unwrap(), Sample::PartE.voxels(20).unwrap());
    assert_eq!((samples.dims(), mask.dims()), ([21; 3], [20; 3]));
    let field = Sample::PartE.field().unwrap();
    let region = Region { start: [3, 4, 5], end: [9, 7, 8] };
    for volume in [&samples as &dyn Volume, &mask] {
        let block = volume.read(region).unwrap();
        let [w, h, _] = region.dims();
        for i in 0..block.len() {
            let index = [3 + i % w, 4 + i / w % h, 5 + i / w / h];
            let f = field(volume.placement().place(index.map(|x| x as f64)));
            if volume.is_binary() {
                assert_eq!(block.value(i) == 1.0, f < 0.0);
            } else {
                assert!((block.value(i) - f).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn the_house_is_no_solid_and_its_chimney_pierces_the_roof() {
    let soup = Sample::House.polygons(1).unwrap();
    assert!(!is_closed_and_oriented(&soup));
    let materials = soup.attributes().face_materials.as_ref().unwrap();
    let of = |name: &str| {
        let at = soup.attributes().materials.iter().position(|m| m.name == name).unwrap();
        (0..soup.faces()).filter(move |&f| materials[f] == at as u32).collect::<Vec<_>>()
    };
    assert_eq!((of("roof").len(), of("brick").len()), (2, 4));
    // The right sheet of the roof falls along x: the chimney's low edges are all below it and
    // its high ones all above.
    let roof = of("roof")[1];
    let corner = |f: usize, i: usize| DVec3::from(soup.points()[soup.face(f)[i] as usize]);
    let normal = (corner(roof, 1) - corner(roof, 0)).cross(corner(roof, 2) - corner(roof, 0));
    for face in of("brick") {
        let side = |i| normal.dot(corner(face, i) - corner(roof, 0));
        assert!(side(0) < 0.0 && side(1) < 0.0 && side(2) > 0.0 && side(3) > 0.0);
    }
}

/// Number of shells, by faces that share points.
fn shells(soup: &Soup) -> usize {
    let mut parent: Vec<u32> = (0..soup.points().len() as u32).collect();
    fn root(parent: &mut [u32], mut p: u32) -> u32 {
        while parent[p as usize] != p {
            parent[p as usize] = parent[parent[p as usize] as usize];
            p = parent[p as usize];
        }
        p
    }
    for f in 0..soup.faces() {
        for pair in soup.face(f).windows(2) {
            let (a, b) = (root(&mut parent, pair[0]), root(&mut parent, pair[1]));
            parent[a as usize] = b;
        }
    }
    (0..parent.len() as u32).filter(|&p| parent[p as usize] == p).count()
}

#[test]
fn planted_defects_are_found_again_by_counting() {
    for (seed, resolution) in [(1, 128), (2, 96), (3, 200), (4, 16)] {
        let plan = ScanPlan { seed, resolution, ..ScanPlan::default() };
        let (soup, census) = plan.plant();
        assert_eq!((&soup, &census), (&plan.plant().0, &plan.plant().1), "not reproducible");
        if resolution > 16 {
            let planted = (census.holes, census.overlaps, census.flipped_faces);
            assert_eq!(planted, (plan.holes, plan.overlaps, plan.flipped));
            let planted = (census.duplicate_faces, census.t_junctions, census.inner_parts);
            assert_eq!(planted, (plan.duplicates, plan.t_junctions, plan.inner_parts));
        }

        let n = resolution / 4;
        let faces = 12 * n * n - census.removed_faces
            + census.duplicate_faces
            + census.t_junctions
            + census.inner_faces
            + census.overlap_faces;
        assert_eq!(soup.faces(), faces);

        let edges = soup_edges(&soup);
        let uses = |edge| edges.binary_search_by_key(&edge, |e| e.0).map_or(0, |i| edges[i].1);
        let (mut boundary, mut misoriented, mut shared_by_three) = (0, 0, 0);
        for &([a, b], count) in &edges {
            let back = uses([b, a]);
            boundary += usize::from(count + back == 1);
            misoriented += usize::from(count == 2 && back == 0);
            shared_by_three += usize::from(count == 2 && back == 1);
        }
        assert_eq!(boundary, census.boundary_edges);
        assert_eq!(misoriented, 3 * census.flipped_faces);
        assert_eq!(shared_by_three, 3 * census.duplicate_faces);
        assert_eq!(shells(&soup), 1 + census.inner_parts + census.overlaps);

        let mut sorted: Vec<[u32; 3]> = soup.triangulate().triangles;
        sorted.iter_mut().for_each(|t| t.sort_unstable());
        sorted.sort_unstable();
        let duplicates = sorted.windows(2).filter(|w| w[0] == w[1]).count();
        assert_eq!(duplicates, census.duplicate_faces);
    }
}

#[test]
fn overlapping_patches_cross_the_surface() {
    let clean = ScanPlan {
        resolution: 64,
        holes: 0,
        flipped: 0,
        duplicates: 0,
        t_junctions: 0,
        inner_parts: 0,
        ..ScanPlan::default()
    };
    let (soup, census) = clean.plant();
    let mesh = soup.triangulate();
    let pebble = mesh.triangles.len() - census.overlap_faces;
    let patch = census.overlap_faces / census.overlaps;
    for overlap in mesh.triangles[pebble..].chunks(patch) {
        let crossing = overlap.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).any(|edge| {
            let [p, q] = edge.map(|i| DVec3::from(mesh.points[i as usize]));
            (0..pebble).any(|t| pierces(p, q, mesh.corners(t).map(DVec3::from)))
        });
        assert!(crossing);
    }
}

/// True where a segment goes through a triangle.
fn pierces(p: DVec3, q: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let side = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a) > 0.0;
    side(a, b, c, p) != side(a, b, c, q)
        && side(p, q, a, b) == side(p, q, b, c)
        && side(p, q, b, c) == side(p, q, c, a)
}

/// Points inside on a lattice of 64 cells, as counted for the stand-ins whose numbers the tables
/// of the papers' repetition quote.
#[test]
fn stand_ins_keep_their_numbers() {
    for (sample, expected) in [
        (Sample::HairDryer, 22_517),
        (Sample::Kettle, 36_703),
        (Sample::TapeCutter, 41_108),
        (Sample::PartA, 103_755),
        (Sample::PartB, 138_875),
        (Sample::PartC, 90_655),
        (Sample::PartD, 144_059),
        (Sample::PartE, 134_961),
    ] {
        let volume = sample.volume(64).unwrap();
        let block = volume.read(Region::all(volume.dims())).unwrap();
        let inside = (0..block.len()).filter(|&i| block.value(i) < 0.0).count();
        assert_eq!(inside, expected, "{}", sample.name());
    }
}

#[test]
fn runs_are_the_cells_of_the_mask() {
    let turn = glam::DMat3::from_quat(glam::DQuat::from_xyzw(0.4, -0.3, 0.5, 0.7).normalize());
    let pose = Pose { turn: turn.to_cols_array_2d(), scale: 0.8, shift: [0.05, -0.02, 0.01] };
    for sample in Sample::ALL {
        for (resolution, pose) in [(37, Pose::default()), (48, pose)] {
            let Some(mask) = sample.voxels(resolution).map(|m| m.posed(pose)) else { continue };
            let runs = mask.spans(&Run::default()).unwrap();
            assert_eq!(runs, Spans::at_least(&mask, 0.5, &Run::default()).unwrap());
        }
    }
}

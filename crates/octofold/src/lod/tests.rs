//! Cuts of closed surfaces have no cracks, whatever their levels; coarse patches are collapsed fine
//! ones; bounds hold; results do not depend on threads.

use super::cut::NONE;
use super::edges::LOCAL;
use super::*;
use crate::measure::{Nearest, Topology};
use crate::mesh::Mesh;
use crate::par;
use crate::run::Run;
use crate::samples::Sample;
use crate::surface::{CubesOptions, Inside};
use crate::sweep::cases;
use proptest::prelude::*;
use rustc_hash::FxHashMap;
use std::sync::LazyLock;

fn run() -> Run {
    Run::default()
}

const MASK: CubesOptions = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };

fn of_mesh(sample: Sample, detail: usize, level: u32) -> Lod {
    let mesh = sample.polygons(detail).unwrap().triangulate();
    build(&mesh, &BuildOptions { level, ..BuildOptions::default() }, &run()).unwrap()
}

fn of_voxels(sample: Sample, resolution: usize) -> Lod {
    let volume = sample.voxels(resolution).unwrap();
    build_volume(&volume, &MASK, &BuildOptions::default(), &run()).unwrap()
}

/// Spheres that touch and overlap nothing but lie closer than a coarse octant, and a thin shell.
pub(super) fn thin() -> Mesh {
    let ball = Sample::Sphere.polygons(24).unwrap().triangulate();
    let mut mesh = Mesh::default();
    for (size, at, inward) in [
        (1.0, [0.0; 3], false),
        (0.97, [0.0; 3], true),
        (0.3, [1.02, 0.0, 0.03], false),
        (0.02, [0.9, 0.9, 0.9], false),
    ] {
        let start = mesh.points.len() as u32;
        mesh.points.extend(
            ball.points.iter().map(|p| std::array::from_fn(|a| (p[a] - 0.5) * 2.0 * size + at[a])),
        );
        mesh.triangles.extend(ball.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|p| p + start);
            if inward { [a, c, b] } else { [a, b, c] }
        }));
    }
    mesh
}

/// Closed models of many kinds.
static CLOSED: LazyLock<Vec<Lod>> = LazyLock::new(|| {
    let options = |level| BuildOptions { level, ..BuildOptions::default() };
    vec![
        of_mesh(Sample::Torus, 40, 7),
        of_mesh(Sample::Cone, 30, 7),
        of_voxels(Sample::Kettle, 100),
        of_voxels(Sample::Gear, 60),
        of_voxels(Sample::TapeCutter, 90),
        build(&thin(), &options(7), &run()).unwrap(),
        build(
            &thin(),
            &BuildOptions { early_leaves: false, vertex: VertexRule::Mean, ..options(6) },
            &run(),
        )
        .unwrap(),
    ]
});

fn mixed(node: u32, seed: u64) -> u64 {
    let mixed = (u64::from(node) ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed >> 33
}

/// A cut that stops at one of four octants from level `least` on: levels from there to the last lie
/// side by side.
pub(super) fn random_cut(lod: &Lod, seed: u64, least: u32) -> Cut {
    Cut::by(lod, |o| o.level >= least && mixed(o.node, seed).is_multiple_of(4))
}

/// Times each edge between two vertices is passed, less those the other way; and times it is passed at
/// all.
fn passes(patches: &[Patch]) -> FxHashMap<[u32; 2], (i32, u32)> {
    passes_of(patches.iter().map(|patch| patch.corners().collect()))
}

/// The same of any polygons.
pub(super) fn passes_of(
    polygons: impl Iterator<Item = Vec<u32>>,
) -> FxHashMap<[u32; 2], (i32, u32)> {
    let mut passes = FxHashMap::default();
    for corners in polygons {
        assert!(corners.len() >= 3);
        for (i, &p) in corners.iter().enumerate() {
            let q = corners[(i + 1) % corners.len()];
            let entry = passes.entry([p.min(q), p.max(q)]).or_insert((0, 0));
            entry.0 += if p < q { 1 } else { -1 };
            entry.1 += 1;
        }
    }
    passes
}

/// The recursion of Ju et al. over cells, faces and edges, in the words of the paper: the oracle.
struct Recursion<'a> {
    lod: &'a Lod,
    cut: &'a Cut,
    found: Vec<[u32; 4]>,
    mode: Mode,
}

impl Recursion<'_> {
    fn child(&self, of: u32, octant: usize) -> u32 {
        let Some(entry) = self.cut.entries.get(of as usize) else { return NONE };
        if entry.first == NONE {
            return of;
        }
        let before = (u32::from(entry.mask) & ((1 << octant) - 1)).count_ones();
        if entry.mask >> octant & 1 == 0 { NONE } else { entry.first + before }
    }

    fn front(&self, of: u32) -> bool {
        self.cut.is_front(of)
    }

    fn cell(&mut self, of: u32) {
        if self.front(of) {
            return;
        }
        let c: [u32; 8] = std::array::from_fn(|o| self.child(of, o));
        c.iter().filter(|&&c| c != NONE).for_each(|&c| self.cell(c));
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for k in 0..4 {
                let o = (k & 1) << u | (k >> 1) << v;
                self.face(axis, c[o], c[o | 1 << axis]);
            }
            for k in 0..2 {
                let o = k << axis;
                self.edge(axis, [c[o], c[o | 1 << u], c[o | 1 << v], c[o | 1 << u | 1 << v]]);
            }
        }
    }

    fn face(&mut self, axis: usize, a: u32, b: u32) {
        if a == NONE || b == NONE || self.front(a) && self.front(b) {
            return;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut m = [[NONE; 2]; 4];
        for (k, pair) in m.iter_mut().enumerate() {
            let o = (k & 1) << u | (k >> 1) << v;
            *pair = [self.child(a, o | 1 << axis), self.child(b, o)];
        }
        m.iter().for_each(|&[a, b]| self.face(axis, a, b));
        for k in 0..2 {
            self.edge(u, [m[k][0], m[k | 2][0], m[k][1], m[k | 2][1]]);
            self.edge(v, [m[2 * k][0], m[2 * k][1], m[2 * k + 1][0], m[2 * k + 1][1]]);
        }
    }

    fn edge(&mut self, axis: usize, c: [u32; 4]) {
        if c.contains(&NONE) {
            return;
        }
        if c.iter().all(|&c| self.front(c)) {
            let deepest = (0..4).min_by_key(|&k| self.cut.octant(c[k]).size).unwrap();
            let node = self.lod.nodes()[self.cut.octant(c[deepest]).node as usize];
            let edges = if self.mode == Mode::Any { node.any() } else { node.odd() };
            if edges >> (4 * axis + 3 - deepest) & 1 == 1 {
                self.found.push([c[0], c[1], c[3], c[2]]);
            }
            return;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for k in 0..2 {
            let child =
                |i: usize| self.child(c[i], (1 - (i & 1)) << u | (1 - (i >> 1)) << v | k << axis);
            let next = [0, 1, 2, 3].map(child);
            self.edge(axis, next);
        }
    }
}

fn is_manifold(lod: &Lod, cut: &Cut) -> Result<(), TestCaseError> {
    let found = patches(lod, cut, Mode::Manifold, &run()).unwrap();
    let mesh = drawn(lod, cut, &found, Mode::Manifold, Diagonal::Fixed, &run()).unwrap().mesh;
    let topology = Topology::of(mesh.points.len(), &mesh.triangles, &run()).unwrap();
    prop_assert!(topology.is_closed() && topology.is_oriented());
    prop_assert_eq!(topology.nonmanifold_edges.count, 0);
    prop_assert_eq!(topology.nonmanifold_points.count, 0);
    Ok(())
}

/// In this cut three pairs on one face join two sheets, so that one of them swaps twice.
#[test]
fn pairs_may_swap_more_than_once() {
    let lod = &CLOSED[3];
    is_manifold(lod, &random_cut(lod, 14_032_325_205_263_951_804, 3)).unwrap();
}

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn closed_surfaces_stay_closed_in_any_cut(which in 0usize..7, seed: u64, least in 2u32..5) {
        let lod = &CLOSED[which];
        let cut = random_cut(lod, seed, least);
        let found = patches(lod, &cut, Mode::Parity, &run()).unwrap();
        prop_assert!(!found.is_empty());
        for (edge, (net, times)) in passes(&found) {
            prop_assert!(net == 0 && times % 2 == 0, "{edge:?}: {times} times, net {net}");
        }
    }

    #[test]
    fn with_a_vertex_for_each_sheet_they_are_manifold(
        which in 0usize..7,
        seed: u64,
        least in 2u32..5,
    ) {
        let lod = &CLOSED[which];
        let cut = random_cut(lod, seed, least);
        is_manifold(lod, &cut)?;
    }

    #[test]
    fn patches_are_those_of_the_recursion(which in 0usize..7, seed: u64, least in 0u32..5) {
        let lod = &CLOSED[which];
        let cut = random_cut(lod, seed, least);
        for mode in [Mode::Any, Mode::Parity] {
            let mut oracle = Recursion { lod, cut: &cut, found: Vec::new(), mode };
            oracle.cell(0);
            let found = patches(lod, &cut, mode, &run()).unwrap();
            let ring = |p: &Patch| {
                let [a, b, c, d] = p.ring;
                if p.along { [a, b, c, d] } else { [a, d, c, b] }
            };
            let mut found: Vec<_> = found.iter().map(ring).collect();
            found.sort_unstable();
            oracle.found.sort_unstable();
            prop_assert_eq!(&found, &oracle.found);
        }
    }

    /// The theorem behind geomorphs: where all children of some octants move to their parents, the fine
    /// patches become the coarse ones; with parity, up to patches that lie on each other in pairs.
    #[test]
    fn collapsed_fine_patches_are_the_coarse_ones(which in 0usize..7, seed: u64, least in 2u32..5) {
        let lod = &CLOSED[which];
        let fine = random_cut(lod, seed, least);
        let mut home: FxHashMap<u32, u32> = FxHashMap::default();
        let mut collapsed = vec![false; lod.nodes().len()];
        let mut fronts = vec![0; fine.places().len()];
        for place in fine.places().filter(|&p| fine.is_front(p)) {
            fronts[fine.parent(place) as usize] += 1;
        }
        for place in fine.places().filter(|&p| !fine.is_front(p)) {
            let own = fine.octant(place).node;
            let first = lod.nodes()[own as usize].first_child();
            let children = first..first + lod.nodes()[own as usize].children().count_ones();
            let whole = fronts[place as usize] == children.len();
            if whole && mixed(own, seed ^ 77).is_multiple_of(2) {
                collapsed[own as usize] = true;
                home.extend(children.map(|child| (child, own)));
            }
        }
        let mut front = vec![false; lod.nodes().len()];
        for place in fine.places().filter(|&p| fine.is_front(p)) {
            front[fine.octant(place).node as usize] = true;
        }
        let coarse = Cut::by(lod, |o| front[o.node as usize] || collapsed[o.node as usize]);
        for mode in [Mode::Any, Mode::Parity] {
            let sets = [&fine, &coarse].map(|cut| {
                let mut counts: FxHashMap<Vec<u32>, u32> = FxHashMap::default();
                for patch in patches(lod, cut, mode, &run()).unwrap() {
                    let node = |place| cut.octant(place).node;
                    let moved = |node: u32| home.get(&node).copied().unwrap_or(node);
                    let mut corners: Vec<u32> = patch.corners().map(|p| moved(node(p))).collect();
                    corners.sort_unstable();
                    corners.dedup();
                    if corners.len() > 2 {
                        *counts.entry(corners).or_default() += 1;
                    }
                }
                let kept = counts.into_iter().filter(|(_, n)| mode == Mode::Any || n % 2 == 1);
                let mut kept: Vec<Vec<u32>> = kept.map(|(corners, _)| corners).collect();
                kept.sort_unstable();
                kept
            });
            prop_assert_eq!(&sets[0], &sets[1]);
        }
    }

    #[test]
    fn settled_cuts_cross_their_edges(which in 0usize..5, seed: u64, least in 2u32..5) {
        let lod = &CLOSED[which];
        let found = settled(lod, random_cut(lod, seed, least), Mode::Any, &run()).unwrap();
        let missing = found.patches.iter().filter(|p| misses(lod, &found.cut, p)).count();
        prop_assert_eq!(missing as u64, found.missing);
        let is_leaf = |&o: &u32| lod.nodes()[found.cut.octant(o).node as usize].children() == 0;
        let mut missing = found.patches.iter().filter(|p| misses(lod, &found.cut, p));
        let last = missing.all(|p| p.ring.iter().all(is_leaf));
        prop_assert!(last);
    }
}

#[test]
fn uniform_cuts_always_cross_their_edges() {
    for lod in CLOSED.iter() {
        for level in 2..=lod.levels() {
            let cut = Cut::by(lod, |o| o.level >= level);
            let found = patches(lod, &cut, Mode::Any, &run()).unwrap();
            let even = found.iter().filter(|p| {
                p.ring.iter().all(|&o| cut.octant(o).size == cut.octant(p.ring[0]).size)
            });
            assert!(even.clone().all(|p| !misses(lod, &cut, p)));
            assert!(even.count() > 0);
        }
    }
}

#[test]
fn bounds_hold_in_cuts_of_many_levels() {
    let mesh = Sample::Torus.polygons(60).unwrap().triangulate();
    let lod = build(&mesh, &BuildOptions::default(), &run()).unwrap();
    let eye = |pixels| Eye { position: [0.5, 0.5, 2.0], fov: 0.8, height: 400.0, pixels };
    for criterion in [
        Criterion::Tolerance(0.01),
        Criterion::Tolerance(0.001),
        Criterion::Pixels(eye(1.0)),
        Criterion::Pixels(eye(4.0)),
    ] {
        let cut = Cut::select(&lod, &criterion, &run()).unwrap();
        let found = patches(&lod, &cut, Mode::Any, &run()).unwrap();
        let out = drawn(&lod, &cut, &found, Mode::Any, Diagonal::Fixed, &run()).unwrap();
        let nearest = Nearest::new(&out.mesh);
        let most = cut.places().filter(|&p| cut.is_front(p));
        let most = most.map(|p| lod.error(cut.octant(p).node) * lod.stretch()).fold(0.0, f64::max);
        for &point in &mesh.points {
            let distance = nearest.nearest(point).unwrap().distance_squared.sqrt();
            assert!(distance <= most, "{criterion:?}: {distance} {most}");
        }
    }
}

#[test]
fn a_front_that_follows_an_eye_is_the_full_extraction() {
    for lod in CLOSED.iter() {
        let eye = |i: i32| {
            let turn = f64::from(i) * 0.07;
            let far = if i < 20 { 60.0 } else { 0.4 + f64::from(40 - i) };
            let middle = lod.world(glam::DVec3::splat(f64::from(1u32 << lod.levels()) / 2.0));
            let scale = lod.stretch() * f64::from(1u32 << lod.levels()) / 40.0;
            let way = [turn.sin(), 0.3, turn.cos()];
            let position = std::array::from_fn(|a| middle[a] + scale * far * way[a]);
            Eye { position, fov: 0.8, height: 1000.0, pixels: 3.0 }
        };
        let mut front = Front::new(lod, eye(0), Mode::Any);
        let mut turned = 0;
        for i in 0..40 {
            if i > 0 {
                let change = front.step(eye(i).position);
                turned += change.divided + change.united;
            }
            let cut = Cut::select(lod, &Criterion::Pixels(eye(i)), &run()).unwrap();
            let node = |place: u32| cut.octant(place).node;
            let full = patches(lod, &cut, Mode::Any, &run()).unwrap().into_iter();
            let full: Vec<Patch> =
                full.map(|p| Patch { ring: p.ring.map(node), owner: node(p.owner), ..p }).collect();
            let nodes: Vec<u32> = cut.places().filter(|&p| cut.is_front(p)).map(node).collect();
            assert_eq!(front.nodes().collect::<Vec<_>>(), nodes);
            assert!(front.patches() == full, "frame {i}");
        }
        assert!(turned > 50, "{turned}");
    }
}

#[test]
fn threads_do_not_change_a_byte() {
    let mesh = thin();
    let options = BuildOptions { level: 7, ..BuildOptions::default() };
    let volume = Sample::Kettle.voxels(50).unwrap();
    let all = [1, 2, 3, 8].map(|threads| {
        par::with_threads(threads, || {
            let lod = build(&mesh, &options, &run()).unwrap();
            let cut = Cut::select(&lod, &Criterion::Tolerance(0.004), &run()).unwrap();
            let found = patches(&lod, &cut, Mode::Manifold, &run()).unwrap();
            let out = drawn(&lod, &cut, &found, Mode::Manifold, Diagonal::Flatter, &run()).unwrap();
            let other = build_volume(&volume, &MASK, &options, &run()).unwrap();
            (lod, found, out, other)
        })
    });
    assert!(all.windows(2).all(|w| w[0] == w[1]));
}

#[test]
fn deep_models_grow_with_their_surface() {
    let mut mesh = Mesh::default();
    for at in [[0.0; 3], [900.0, 500.0, 20.0], [1000.0; 3]] {
        let start = mesh.points.len() as u32;
        let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
        let point = |c: [i32; 3]| std::array::from_fn(|a| at[a] + 0.4 * f64::from(c[a]));
        mesh.points.extend(corners.map(point));
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        mesh.triangles.extend(faces.map(|t| t.map(|p| p + start)));
    }
    let options = BuildOptions { level: 16, early_leaves: false, ..BuildOptions::default() };
    let lod = build(&mesh, &options, &run()).unwrap();
    assert!(lod.nodes().len() < 30_000, "{}", lod.nodes().len());
    let cut = Cut::select(&lod, &Criterion::Level(16), &run()).unwrap();
    let found = patches(&lod, &cut, Mode::Parity, &run()).unwrap();
    assert!(passes(&found).values().all(|&(net, times)| net == 0 && times % 2 == 0));
    let out = drawn(&lod, &cut, &found, Mode::Parity, Diagonal::Flatter, &run()).unwrap();
    let bounds = [mesh.bounds().unwrap(), out.mesh.bounds().unwrap()];
    for axis in 0..3 {
        assert!((bounds[0][0][axis] - bounds[1][0][axis]).abs() < 0.05);
        assert!((bounds[0][1][axis] - bounds[1][1][axis]).abs() < 0.05);
    }
}

#[test]
fn octants_promise_no_less_than_those_below_and_leaves_no_more_than_is_known() {
    for lod in CLOSED.iter() {
        for (i, node) in lod.nodes().iter().enumerate() {
            let below = (0..8).filter(|o| node.children() >> o & 1 == 1).map(|o| node.child(o));
            assert!(below.map(|c| lod.error(c)).all(|error| error <= lod.error(i as u32)));
        }
    }
    for step in 0..=255 {
        assert!((0..2).contains(&(tree::leaf_error(step) - step)));
        assert!((0..17).contains(&(step - tree::leaf_shape(step))));
    }
}

#[test]
fn early_leaves_save_octants_and_keep_creases() {
    let mesh = Sample::Cube.polygons(1).unwrap().triangulate();
    let counts = [false, true].map(|early_leaves| {
        let options = BuildOptions { level: 7, early_leaves, ..BuildOptions::default() };
        let lod = build(&mesh, &options, &run()).unwrap();
        let cut = Cut::select(&lod, &Criterion::Level(7), &run()).unwrap();
        let found = patches(&lod, &cut, Mode::Parity, &run()).unwrap();
        let out = drawn(&lod, &cut, &found, Mode::Parity, Diagonal::Flatter, &run()).unwrap();
        let nearest = Nearest::new(&mesh);
        let cell = lod.stretch();
        for &point in &out.mesh.points {
            assert!(nearest.nearest(point).unwrap().distance_squared.sqrt() < 0.1 * cell);
        }
        lod.nodes().len()
    });
    assert!(4 * counts[1] < counts[0], "{counts:?}");
}

#[test]
fn open_surfaces_and_odd_edges_are_drawn() {
    let mut mesh = Sample::Sphere.polygons(30).unwrap().triangulate();
    mesh.triangles.drain(0..200);
    let whole =
        build(&mesh, &BuildOptions { level: 6, ..BuildOptions::default() }, &run()).unwrap();
    assert!((0..whole.nodes().len() as u32).any(|i| whole.traits(i).is_border()));
    let cut = Cut::select(&whole, &Criterion::Level(6), &run()).unwrap();
    for mode in Mode::ALL {
        let found = patches(&whole, &cut, mode, &run()).unwrap();
        let out = drawn(&whole, &cut, &found, mode, Diagonal::Flatter, &run()).unwrap();
        assert!(out.mesh.triangles.len() > 1000);
        out.mesh.check().unwrap();
    }
    // Three sheets at an edge.
    let points =
        vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.1, 0.5], [-1.0, 0.2, 0.5], [0.1, 1.0, 0.4]];
    let mesh = Mesh::new(points, vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]]).unwrap();
    let lod = build(&mesh, &BuildOptions { level: 6, ..BuildOptions::default() }, &run()).unwrap();
    let cut = Cut::select(&lod, &Criterion::Level(6), &run()).unwrap();
    let found = patches(&lod, &cut, Mode::Any, &run()).unwrap();
    assert!(passes(&found).values().any(|&(_, times)| times == 3));
}

#[test]
fn colours_are_mixed_in_linear_light() {
    let mut mesh = Sample::Sphere.polygons(40).unwrap().triangulate();
    let colours = mesh.points.iter().map(|p| if p[0] < 0.5 { [0, 0, 0, 255] } else { [255; 4] });
    mesh.attributes.point_colours = Some(colours.collect());
    let lod = build(&mesh, &BuildOptions { level: 6, ..BuildOptions::default() }, &run()).unwrap();
    // Half of the light is 188 in sRGB.
    let [r, g, b, a] = lod.colour(0).unwrap();
    assert!((183..194).contains(&r) && r == g && g == b && a == 255, "{r}");
}

#[test]
fn what_cannot_be_built_is_said() {
    let mesh = Sample::Sphere.polygons(20).unwrap().triangulate();
    for level in [0, 17] {
        let options = BuildOptions { level, ..BuildOptions::default() };
        assert!(matches!(build(&mesh, &options, &run()), Err(LodError::Level(_))));
    }
    let nothing = Mesh::default();
    assert!(matches!(build(&nothing, &BuildOptions::default(), &run()), Err(LodError::Lattice(_))));
    let point = Mesh::new(vec![[1.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
    assert!(matches!(build(&point, &BuildOptions::default(), &run()), Err(LodError::NoSurface(8))));
}

#[test]
fn an_edge_is_on_the_sides_that_its_number_says() {
    for (edge, local) in LOCAL.iter().enumerate() {
        assert_eq!(local.axis, edge / 4);
        assert_eq!(local.sides, [(edge & 1) as u32, (edge >> 1 & 1) as u32]);
    }
}

//! The guarantees of sheets, on random labellings and on scenes whose truth is known.

use super::super::piercing::Target;
use super::super::tests::{Anywhere, labels, options};
use super::super::{bricks::Place, frame::Gap, piercing::Guide};
use super::complex::Edge;
use super::guide::{Leaf, Pairing, Piercing};
use super::*;
use crate::measure::{Topology, self_intersections};
use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

impl SheetGuide for Anywhere {
    fn vertex(&self, place: Place, leaf: &Leaf, _: Option<DVec3>) -> Target {
        let salt = 20 + 3 * u64::from(leaf.edges);
        let at = [0, 1, 2].map(|a| (1.4 * self.number(place.at, salt + a) - 0.2) * self.steps);
        Target { at, ..self.target(place) }
    }

    fn holds(&self, Edge { place, axis }: Edge, _: Option<DVec3>) -> bool {
        self.number(place.at, 70 + axis as u64) < 0.5
    }

    fn piercing(&self, Edge { place, axis }: Edge) -> Piercing {
        let salt = 30 + axis as u64;
        let at = (self.number(place.at, salt) < 0.8)
            .then(|| self.number(place.at, salt + 3) * self.steps);
        let normal = [6, 9, 12].map(|s| self.number(place.at, salt + s) - 0.5);
        let normal = DVec3::from_array(normal).normalize_or(DVec3::Z);
        Piercing { at, odd: self.number(place.at, salt + 15) < 0.5, normal }
    }

    fn pairing(&self, place: Place, axis: usize) -> Pairing {
        match (self.number(place.at, 60 + axis as u64) * 3.0) as u8 {
            0 => Pairing::Junction,
            1 => Pairing::Even,
            _ => Pairing::Odd,
        }
    }
}

fn is_embedded(mesh: &Mesh) -> Result<(), TestCaseError> {
    let pairs = self_intersections(mesh, &Run::default()).unwrap();
    prop_assert!(pairs.is_empty(), "{} pairs of triangles meet", pairs.len());
    let found = Topology::of(mesh.points.len(), &mesh.triangles, &Run::default()).unwrap();
    prop_assert_eq!(found.duplicate_triangles.count, 0);
    prop_assert_eq!(found.degenerate_triangles.count, 0);
    Ok(())
}

#[test]
fn random_labellings_give_sheets_that_do_not_meet_themselves() {
    let [lean, dohi] = [0.8, 0.2].map(prop::bool::weighted);
    let shape = (any::<u64>(), 0.02f64..0.98, 1u32..7, 0u32..8, any::<bool>());
    let domain = (shape, lean, dohi, 1u32..3);
    crate::sweep::every([400, 1_000_000], domain, |(shape, lean, dohi, rounds)| {
        let (seed, fill, side, shift, fine) = shape;
        let guide = Anywhere { seed, steps: if fine { 4096.0 } else { 64.0 } };
        let labels = labels(side, shift, |at| guide.number(at, 99) < fill || at == [0; 3]);
        let rule = if dohi { SheetRule::Dohi } else { SheetRule::Collapse };
        let steps = guide.steps as i32;
        let (surface, _) =
            extract(&labels, &guide, rule, rounds, steps, lean, &Run::default()).unwrap();
        let points = surface.points.iter().map(|p| p.map(f64::from)).collect();
        let mesh = Mesh::new(points, surface.triangles).unwrap();
        is_embedded(&mesh)
    });
}

/// Rectangles and discs that hang together, each as a grid of quads.
#[derive(Default)]
struct Scene {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Scene {
    /// Adds the rectangle with corner `at` and sides `u` and `v`, in `n` by `n` quads.
    fn rectangle(&mut self, at: [f64; 3], u: [f64; 3], v: [f64; 3]) {
        self.map(6, |s, t| std::array::from_fn(|a| at[a] + s * u[a] + t * v[a]));
    }

    /// Adds what a function makes of the unit square.
    fn map(&mut self, n: u32, place: impl Fn(f64, f64) -> [f64; 3]) {
        let first = self.points.len() as u32;
        for j in 0..=n {
            for i in 0..=n {
                self.points.push(place(f64::from(i) / f64::from(n), f64::from(j) / f64::from(n)));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let p = first + j * (n + 1) + i;
                let q = p + n + 1;
                self.triangles.extend([[p, p + 1, q + 1], [p, q + 1, q]]);
            }
        }
    }

    /// The scene in pose number `pose`.
    fn mesh(self, pose: u64) -> Mesh {
        let random = Anywhere { seed: pose, steps: 1.0 };
        let [a, b, c, d] = [0, 1, 2, 3].map(|s| random.number([1, 2, 3], s) - 0.5);
        let turn = DMat3::from_quat(DQuat::from_xyzw(a, b, c, d).normalize());
        let points = self.points.iter().map(|&p| (turn * DVec3::from_array(p)).to_array());
        let mesh = Mesh::new(points.collect(), self.triangles).unwrap();
        crate::measure::weld(&mesh, &Run::default()).unwrap()
    }
}

fn area(mesh: &Mesh) -> f64 {
    crate::measure::Extent::of(mesh, &Run::default()).unwrap().area
}

/// What is known of a scene: its area, its Euler number, and the length of its junctions.
struct Truth {
    area: f64,
    euler: i64,
    junctions: f64,
}

/// Repairs a scene in several poses, 48 cells to its longest side, and compares with the truth.
fn compare(scene: impl Fn() -> Scene, truth: &Truth) {
    for pose in 0..4 {
        let mesh = scene().mesh(pose);
        let options = SheetOptions { repair: options(48, Gap::Auto), ..SheetOptions::default() };
        let found = sheets(&mesh, &options, &Run::default()).unwrap();
        is_embedded(&found.mesh).unwrap();
        let told = found.account.sheets.unwrap();
        let share = area(&found.mesh) / truth.area;
        assert!((share - 1.0).abs() < 0.02, "pose {pose}: {share} of the area");
        let topology =
            Topology::of(found.mesh.points.len(), &found.mesh.triangles, &Run::default()).unwrap();
        assert_eq!(topology.euler(), truth.euler, "pose {pose}");
        assert_eq!(topology.misoriented_edges.count > 0, told.one_sided_patches > 0, "pose {pose}");
        let slack = 4.0 * found.account.cell + 1.2 * truth.junctions;
        let length = told.junction_length;
        assert!(length >= 0.7 * truth.junctions, "pose {pose}: {length}");
        assert!(length <= 2.5 * slack, "pose {pose}: {length}");
    }
}

fn leaf(angle: f64) -> impl Fn(&mut Scene) {
    let turn = angle.to_radians();
    move |scene| scene.rectangle([0.0; 3], [turn.cos(), turn.sin(), 0.0], [0.0, 0.0, 1.0])
}

fn leaves(angles: &[f64]) -> Scene {
    let mut scene = Scene::default();
    angles.iter().for_each(|&a| leaf(a)(&mut scene));
    scene
}

#[test]
fn a_plane_and_folds_stay_one_sheet() {
    let truth = |area| Truth { area, euler: 1, junctions: 0.0 };
    compare(|| leaves(&[0.0]), &truth(1.0));
    compare(|| leaves(&[0.0, 135.0]), &truth(2.0));
    compare(|| leaves(&[0.0, 90.0]), &truth(2.0));
    compare(|| leaves(&[0.0, 60.0]), &truth(2.0));
}

#[test]
fn three_and_four_sheets_meet_in_a_junction() {
    compare(|| leaves(&[0.0, 90.0, 180.0]), &Truth { area: 3.0, euler: 1, junctions: 1.0 });
    compare(|| leaves(&[0.0, 90.0, 180.0, 270.0]), &Truth { area: 4.0, euler: 1, junctions: 1.0 });
}

#[test]
fn two_walls_nearer_than_the_thickness_are_one_sheet() {
    for apart in [0.008, 0.02] {
        let walls = || {
            let mut scene = Scene::default();
            for z in [0.0, apart] {
                scene.rectangle([0.0, 0.0, z], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
            }
            scene
        };
        compare(walls, &Truth { area: 1.0, euler: 1, junctions: 0.0 });
        let plate = || {
            let mut scene = walls();
            for (at, side) in
                [([0.0; 3], 0), ([0.0; 3], 1), ([0.0, 1.0, 0.0], 0), ([1.0, 0.0, 0.0], 1)]
            {
                let mut along = [0.0; 3];
                along[side] = 1.0;
                scene.rectangle(at, along, [0.0, 0.0, apart]);
            }
            scene
        };
        compare(plate, &Truth { area: 1.0, euler: 1, junctions: 0.0 });
    }
}

#[test]
fn a_moebius_band_has_one_side() {
    let band = || {
        let mut scene = Scene::default();
        scene.map(96, |s, t| {
            let (turn, across) = (2.0 * std::f64::consts::PI * s, 0.6 * (t - 0.5));
            let far = 1.0 + across * (turn / 2.0).cos();
            let p = [far * turn.cos(), far * turn.sin(), across * (turn / 2.0).sin()];
            // The ends must fall together for the points to be joined.
            p.map(|x| (x * 1e9).round() / 1e9 + 0.0)
        });
        scene
    };
    let mesh = band().mesh(0);
    let truth = area(&mesh);
    let options = SheetOptions { repair: options(48, Gap::Auto), ..SheetOptions::default() };
    let found = sheets(&mesh, &options, &Run::default()).unwrap();
    let told = found.account.sheets.unwrap();
    assert_eq!(told.one_sided_patches, 1);
    assert!((area(&found.mesh) / truth - 1.0).abs() < 0.01);
}

#[test]
fn neither_order_nor_winding_nor_threads_matter_to_sheets() {
    let mesh = leaves(&[0.0, 90.0, 200.0]).mesh(7);
    let options = SheetOptions { repair: options(40, Gap::Auto), ..SheetOptions::default() };
    let found = sheets(&mesh, &options, &Run::default()).unwrap().mesh;
    let mut other = mesh.clone();
    other.triangles.reverse();
    other.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    let again = other.triangles[..20].to_vec();
    other.triangles.extend(again);
    assert_eq!(sheets(&other, &options, &Run::default()).unwrap().mesh, found);
    for threads in [1, 3] {
        let alone = crate::par::with_threads(threads, || {
            sheets(&mesh, &options, &Run::default()).unwrap().mesh
        });
        assert_eq!(alone, found);
    }
}

#[test]
fn a_thickness_of_many_cells_is_refused() {
    let mesh = leaves(&[0.0]).mesh(0);
    let options =
        SheetOptions { repair: options(40, Gap::Auto), thickness: 0.5, ..SheetOptions::default() };
    let refused = sheets(&mesh, &options, &Run::default()).unwrap_err();
    assert!(matches!(refused, RepairError::Thickness { .. }));
}

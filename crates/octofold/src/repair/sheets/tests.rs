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

proptest! {
    #![proptest_config(crate::sweep::cases(400))]

    #[test]
    fn random_labellings_give_sheets_that_do_not_meet_themselves(
        seed in any::<u64>(),
        fill in 0.02f64..0.98,
        side in 1u32..7,
        shift in 0u32..8,
        fine in any::<bool>(),
        lean in prop::bool::weighted(0.8),
        dohi in prop::bool::weighted(0.2),
        rounds in 1u32..3,
    ) {
        let guide = Anywhere { seed, steps: if fine { 4096.0 } else { 64.0 } };
        let labels = labels(side, shift, |at| guide.number(at, 99) < fill || at == [0; 3]);
        let rule = if dohi { SheetRule::Dohi } else { SheetRule::Collapse };
        let steps = guide.steps as i32;
        let (surface, _) =
            extract(&labels, &guide, rule, rounds, steps, lean, &Run::default()).unwrap();
        let points = surface.points.iter().map(|p| p.map(f64::from)).collect();
        let mesh = Mesh::new(points, surface.triangles).unwrap();
        is_embedded(&mesh)?;
    }
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

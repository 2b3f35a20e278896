//! Flattening: nearly flat parts of a mesh become flat, so that paper needs no fold there.
//!
//! Points alone are moved, none further than allowed: what is closed stays closed. No triangle turns
//! over, none folds onto its neighbour and none meets another that it did not meet before, by exact
//! predicates; where one would, the points at fault stay where they are. Source: specification of
//! papercraft (C1, 5).

use super::edges::Edges;
use super::orientation;
use super::regions::{Flatness, Regions};
use super::{distinct, paint};
use crate::measure::{self_intersections, weld};
use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// How flat is flat.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlattenOptions {
    /// The furthest that a point may move, in the mesh's unit.
    pub distance: f64,
    /// The largest angle in degrees between a triangle and the flat face that it becomes part of.
    pub angle: f64,
}

impl Default for FlattenOptions {
    fn default() -> Self {
        Self { distance: 0.0, angle: 5.0 }
    }
}

/// What flattening tells of its own work.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct FlattenAccount {
    /// Triangles with three different corners.
    pub triangles: usize,
    /// Flat faces that they make up.
    pub faces: usize,
    /// The furthest that a point was moved, in the mesh's unit.
    pub moved: f64,
    /// Times that points were let go because of a triangle that would have turned over or met another.
    pub released: usize,
}

/// A mesh whose nearly flat parts are flat.
#[derive(Debug, Clone, PartialEq)]
pub struct Flattened {
    /// The mesh: the same triangles.
    pub mesh: Mesh,
    /// What was done.
    pub account: FlattenAccount,
}

/// Cosine of the largest turn of a triangle: 60 degrees.
const TURN: f64 = 0.5;

/// Cosine of the angle between normals from which on two neighbours lie on one another: 170 degrees.
const FOLD: f64 = -0.985;

/// Flattens a mesh. Points at the same place are joined.
pub fn flatten(mesh: &Mesh, options: &FlattenOptions, run: &Run) -> Result<Flattened, Cancelled> {
    run.stage("flatten");
    let mesh = weld(mesh, run)?;
    let sources = distinct(&mesh.triangles, &Run { cancel: run.cancel.clone(), ..Run::default() });
    let mut triangles: Vec<[u32; 3]> =
        sources.iter().map(|&t| mesh.triangles[t as usize]).collect();
    orientation::orient(&mesh.points, &mut triangles);
    let flat = Flatness { distance: options.distance / 2.0, angle: options.angle.to_radians() };
    let edges = Edges::of_triangles(&triangles);
    let before = Mesh { points: mesh.points.clone(), triangles, ..Mesh::default() };
    let known = self_intersections(&before, run)?;
    let paints: Vec<u64> = sources.iter().map(|&t| paint(&mesh.attributes)(t)).collect();
    let paint = |t: u32| (paints[t as usize], 0);
    let mut after = before.clone();
    let mut regions = Regions::new(&mut after.points, &before.triangles, &edges, &paint, flat);
    let mut released = 0;
    loop {
        run.check()?;
        let spoilt = spoilt(&before, &after, &edges, flat.distance, &known, run)?;
        let mut points: Vec<u32> =
            spoilt.iter().flat_map(|&t| before.triangles[t as usize]).collect();
        points.retain(|&p| before.points[p as usize] != after.points[p as usize]);
        points.sort_unstable();
        points.dedup();
        if points.is_empty() {
            break;
        }
        released += points.len();
        after.points.clone_from(&before.points);
        if !regions.without(&points, &mut after.points, &before.triangles, &edges, flat) {
            break;
        }
    }
    let moved = regions.moved;
    let account =
        FlattenAccount { triangles: sources.len(), faces: regions.regions.len(), moved, released };
    Ok(Flattened { mesh: Mesh { points: after.points, ..mesh }, account })
}

/// Triangles that a move has turned over, folded onto a neighbour, or brought into another.
pub(super) fn spoilt(
    before: &Mesh,
    after: &Mesh,
    edges: &Edges,
    thin: f64,
    known: &[[u32; 2]],
    run: &Run,
) -> Result<Vec<u32>, Cancelled> {
    let normals = |mesh: &Mesh| -> Vec<DVec3> {
        let normal = |t: usize| {
            let [a, b, c] = mesh.corners(t).map(DVec3::from);
            (b - a).cross(c - a)
        };
        (0..mesh.triangles.len()).map(normal).collect()
    };
    let (old, new) = (normals(before), normals(after));
    let mut spoilt: Vec<u32> = Vec::new();
    for (t, (m, n)) in old.iter().zip(&new).enumerate() {
        let [a, b, c] = before.corners(t).map(DVec3::from);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        // What is thinner than points may move has no side to keep.
        if m.length() > thin * longest && m.dot(*n) <= TURN * m.length() * n.length() {
            spoilt.push(t as u32);
        }
    }
    let folded = |normals: &[DVec3], [s, t]: [u32; 2]| {
        let [m, n] = [s, t].map(|t| normals[t as usize].normalize_or_zero());
        m.dot(n) < FOLD
    };
    for sides in edges.iter() {
        if let [a, b] = sides
            && a.opposes(b)
        {
            let pair = [a.face, b.face];
            if folded(&new, pair) && !folded(&old, pair) {
                spoilt.extend(pair);
            }
        }
    }
    let pairs = self_intersections(after, run)?;
    spoilt.extend(pairs.iter().filter(|p| known.binary_search(p).is_err()).flatten());
    Ok(spoilt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Weld, measure};
    use crate::random::Random;
    use crate::samples::Sample;
    use crate::sweep::cases;
    use proptest::prelude::*;

    fn noisy(sample: Sample, resolution: usize, noise: f64, seed: u64) -> Mesh {
        let mesh =
            weld(&sample.mesh(resolution, &Run::default()).unwrap().triangulate(), &Run::default());
        let mut mesh = mesh.unwrap();
        let mut random = Random::new(seed);
        mesh.points.iter_mut().flatten().for_each(|x| *x += noise * (2.0 * random.unit() - 1.0));
        mesh
    }

    #[test]
    fn a_noisy_box_gets_its_six_faces_back() {
        let mesh = noisy(Sample::Cube, 1, 0.002, 7);
        let options = FlattenOptions { distance: 0.02, ..Default::default() };
        let Flattened { mesh: flat, account } = flatten(&mesh, &options, &Run::default()).unwrap();
        assert_eq!((account.faces, account.triangles), (6, 12));
        let moved = mesh.points.iter().zip(&flat.points).any(|(a, b)| a != b);
        assert!(moved && account.moved > 0.0 && account.moved <= 0.02);
    }

    #[test]
    fn nothing_moves_where_nothing_may() {
        let mesh = noisy(Sample::Torus, 8, 0.0, 1);
        let options = FlattenOptions::default();
        assert_eq!(flatten(&mesh, &options, &Run::default()).unwrap().mesh, mesh);
    }

    proptest! {
        #![proptest_config(cases(24))]

        #[test]
        fn what_is_sound_stays_so(
            seed in any::<u64>(),
            which in 0usize..4,
            noise in 0.0f64..0.02,
            distance in 0.0f64..0.1,
            angle in 0.0f64..60.0,
        ) {
            let sample = [Sample::Torus, Sample::Sphere, Sample::Cone, Sample::House][which];
            let mesh = noisy(sample, 8, noise, seed);
            let options = FlattenOptions { distance, angle };
            let run = Run::default();
            let Flattened { mesh: flat, account } = flatten(&mesh, &options, &run).unwrap();
            prop_assert_eq!(&mesh.triangles, &flat.triangles);
            for (p, q) in mesh.points.iter().zip(&flat.points) {
                let moved = DVec3::from(*p).distance(DVec3::from(*q));
                prop_assert!(moved <= distance && moved <= account.moved, "{moved} of {distance}");
            }
            let [before, after] =
                [&mesh, &flat].map(|m| measure(m, Weld::Off, &run).unwrap());
            prop_assert!(after.self_intersections <= before.self_intersections);
            prop_assert_eq!(before.closed, after.closed);
        }
    }
}

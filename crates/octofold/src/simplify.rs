//! Simplify: fewer faces, with guarantees.
//!
//! Edges become points, the one first that costs the least by quadrics (Garland and Heckbert,
//! "Surface Simplification Using Quadric Error Metrics", 1997), each only where all of this outlives
//! it; nothing is repaired afterwards.
//!
//! - The topology of the mesh, of its borders and of its junctions stays: the link condition of
//!   2-complexes (Dey, Edelsbrunner, Guha and Nekhayev 1999). A closed mesh stays closed, no edge
//!   gets more faces than two or than it had, and no face appears twice.
//! - No face turns over, neither in one step nor against the part of the input that it stands for, and
//!   none folds onto a neighbour.
//! - No two faces meet that did not meet before, by exact predicates.
//! - Where an error is named, no point of the result is further from the input, and none of the
//!   input further from the result.
//!
//! Source: specification of papercraft (C1).

mod boxes;
mod clearance;
mod complex;
mod planes;
mod queue;
mod reduce;
mod tether;

use crate::measure::weld;
use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use complex::{Complex, Spoke};
use glam::DVec3;
use reduce::Reducer;
use std::collections::BTreeMap;
use tether::Tether;

/// How far a mesh is simplified: until there are no more faces than asked for, or until no more can go.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimplifyOptions {
    /// Faces that are wanted.
    pub faces: Option<u64>,
    /// Share of the faces that is wanted; the smaller of both counts.
    pub ratio: Option<f64>,
    /// No point of either mesh is further from the other than this, in the input's unit.
    pub error: Option<f64>,
}

/// Why a mesh could not be simplified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimplifyError {
    /// Nothing says how far to go.
    #[error("name a number of faces, a ratio or an error")]
    Aimless,
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Why an edge did not give way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rejection {
    /// Its ends lie on different curves of borders, junctions or seams.
    Curve,
    /// The topology would change.
    Topology,
    /// Too many faces stand round it.
    Crowd,
    /// A face would turn too far.
    Turn,
    /// A face would become a sliver.
    Sliver,
    /// Two neighbours would fold onto each other.
    Fold,
    /// Two faces would meet.
    Crossing,
    /// The error would be passed.
    Distance,
}

/// Counts of what was tried.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Tally {
    /// Edges that became points.
    pub collapses: u64,
    /// Edges that did not, by reason; one that was tried again counts again.
    pub rejected: BTreeMap<Rejection, u64>,
}

/// Why no more faces went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stop {
    /// As few as were asked for are left.
    Faces,
    /// No other edge gives way.
    Exhausted,
}

/// What is told of the work.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SimplifyAccount {
    /// Faces of the input.
    pub faces_before: usize,
    /// Faces that are left.
    pub faces_after: usize,
    /// Faces that were asked for.
    pub target: Option<usize>,
    /// Why it ended.
    pub stop: Stop,
    /// What was tried.
    #[serde(flatten)]
    pub tally: Tally,
}

/// A simplified mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// The mesh.
    pub mesh: Mesh,
    /// How it was made.
    pub account: SimplifyAccount,
}

/// Simplifies a mesh.
pub fn simplify(
    mesh: &Mesh,
    options: &SimplifyOptions,
    run: &Run,
) -> Result<Simplified, SimplifyError> {
    run.stage("simplify");

    let power = scale(&mesh.points);
    let single = mesh.points.iter().flatten().all(|&x| f64::from(x as f32) == x);
    let (mut complex, mut edges) = load(mesh, power);
    if edges.iter().any(|e| e.faces == 1) {
        let welded = weld(mesh, run)?;
        if welded.points.len() < mesh.points.len() {
            (complex, edges) = load(&welded, power);
        }
    }
    let before = mesh.triangles.len();
    let wanted = options.ratio.map(|r| (r * before as f64) as u64).into_iter().chain(options.faces).min();
    let target = wanted.unwrap_or(0) as usize;
    planes::lay(&mut complex, &edges);
    let tether = options.error.map(|error| {
        let points = complex.at.iter().map(|p| p.to_array()).collect();
        let triangles = complex.faces.iter().map(|f| f.corners).collect();
        let input = Mesh { points, triangles, ..Mesh::default() };
        Tether::new(&input, error / power)
    });
    let mut reducer = Reducer::new(complex, single, tether);
    reducer.fill(&edges);
    reducer.reduce(target, run)?;
    loop {
        if reducer.complex.count <= target { break; }
        let before = reducer.complex.count;
        reducer.refill();
        reducer.reduce(target, run)?;
        if reducer.complex.count == before { break; }
    }
    let tally = std::mem::take(&mut reducer.tally);
    let mut complex = reducer.complex;
    complex.compact();
    let points = complex.at.iter().map(|p| (*p * power).to_array()).collect();
    let triangles = complex.faces.iter().map(|f| f.corners).collect();
    let mesh = Mesh { points, triangles, unit: mesh.unit, ..Mesh::default() };
    let account = SimplifyAccount {
        faces_before: before,
        faces_after: mesh.triangles.len(),
        target: wanted.map(|w| w as usize),
        stop: if mesh.triangles.len() <= target { Stop::Faces } else { Stop::Exhausted },
        tally,
    };

    Ok(Simplified { mesh, account })
}

fn load(mesh: &Mesh, power: f64) -> (Complex, Vec<Spoke>) {
    let proper = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().filter(proper).copied().collect();
    let points: Vec<DVec3> = mesh.points.iter().map(|&p| DVec3::from(p) / power).collect();
    let mut complex = Complex::new(&points, &triangles, &[]);
    let edges = complex.rank();
    (complex, edges)
}

/// A power of two near the largest coordinate: divided by it, nothing but exponents changes.
fn scale(points: &[[f64; 3]]) -> f64 {
    let largest = points.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let power = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
    if power.is_normal() { power } else { 1.0 }
}

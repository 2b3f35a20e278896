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
mod columns;
mod complex;
mod planes;
mod prune;
mod queue;
mod reduce;
mod star;
#[cfg(test)]
mod tests;
mod tether;
mod view;

pub use prune::{PruneAccount, PruneOptions, Pruned, prune};

use crate::measure::{Sewn, sew, weld};
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Finding, Run};
use columns::Columns;
use complex::{Complex, Spoke};
use glam::DVec3;
use reduce::Reducer;
use std::collections::BTreeMap;
use tether::Tether;

/// Rounds over all edges that are made in any case; later ones must be worth it.
const FULL_ROUNDS: usize = 4;

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

impl Rejection {
    fn meaning(self) -> &'static str {
        match self {
            Self::Curve => "the other edges join different borders, junctions or seams",
            Self::Topology => "without any other edge the topology would change",
            Self::Crowd => "too many triangles stand round the other edges",
            Self::Turn => "without any other edge a triangle would turn over",
            Self::Sliver => "without any other edge a triangle would become a sliver",
            Self::Fold => "without any other edge two triangles would fold onto each other",
            Self::Crossing => "without any other edge two triangles would meet",
            Self::Distance => "without any other edge the error would be passed",
        }
    }
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
    /// Edges that are left, by what keeps them; empty where they were not all tried.
    pub kept_by: BTreeMap<Rejection, u64>,
    /// Seams of texture coordinates, materials, labels or colours were given up to reach the target.
    pub seams_given_up: bool,
    /// All coordinates are exact in single precision.
    pub exact_in_single_precision: bool,
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
///
/// Where its edges are open, points on them at the same place or apart by rounding are joined
/// first; triangles that name a point
/// twice and points that no triangle names are left out. Faces and points that stay keep their
/// order. Without any aim the mesh is simplified as far as it goes.
pub fn simplify(
    mesh: &Mesh,
    options: &SimplifyOptions,
    run: &Run,
) -> Result<Simplified, Cancelled> {
    run.stage("connect");
    let before = mesh.triangles.len();
    let share = options.ratio.map(|ratio| (ratio.max(0.0) * before as f64) as u64);
    let wanted = share.into_iter().chain(options.faces).min().map(|faces| faces as usize);
    let target = wanted.unwrap_or(0);
    let power = scale(&mesh.points);
    let single = mesh.points.iter().flatten().all(|&x| f64::from(x as f32) == x);
    let (mut input, mut moved) = (Input::new(mesh, power), 0.0);
    if input.edges.iter().any(|e| e.faces == 1) {
        let mut sewn = sew(mesh, run)?;
        if options.error.is_some_and(|error| error <= 2.0 * sewn.moved) {
            sewn = Sewn { mesh: weld(mesh, run)?, ..Sewn::default() };
        }
        sewn.tell(run);
        if sewn.mesh.points.len() < mesh.points.len() {
            (input, moved) = (Input::new(&sewn.mesh, power), sewn.moved);
        }
    }
    let Input { mut complex, columns, edges } = input;
    let tether = options.error.map(|error| Tether::new(&complex, (error - moved) / power));
    planes::lay(&mut complex, &edges);
    let mut reducer = Reducer::new(complex, columns, tether, single);
    reducer.fill(&edges);
    drop(edges);
    run.stage("collapse");
    reducer.reduce(target, run)?;
    // What was refused may pass now that its neighbours have changed.
    let (mut kept_by, mut seams_given_up) = (BTreeMap::new(), false);
    for round in 0.. {
        if reducer.complex.count <= target {
            break;
        }
        let (faces, refused) = (reducer.complex.count, reducer.tally.rejected.clone());
        reducer.refill();
        reducer.reduce(target, run)?;
        let gained = faces - reducer.complex.count;
        if gained == 0 || round >= FULL_ROUNDS && gained < faces / 64 {
            if wanted.is_some() && reducer.give_up_seams() {
                seams_given_up = true;
                continue;
            }
            kept_by = since(&refused, &reducer.tally.rejected);
            break;
        }
    }
    if seams_given_up {
        run.finding(Finding::warning(
            "seams",
            "as few faces as asked for were only reached across seams of texture coordinates, \
             materials, labels or colours",
        ));
    }
    if wanted.is_some_and(|wanted| reducer.complex.count > wanted) {
        run.finding(missed(reducer.complex.count, target, &kept_by));
    }
    let (points, triangles, attributes, tally) = reducer.finish();
    let points = par::map(&points, |&p| (p * power).to_array());
    let mesh = Mesh { points, triangles, attributes, unit: mesh.unit };
    let account = SimplifyAccount {
        faces_before: before,
        faces_after: mesh.triangles.len(),
        target: wanted,
        stop: if mesh.triangles.len() <= target { Stop::Faces } else { Stop::Exhausted },
        kept_by,
        seams_given_up,
        exact_in_single_precision: single,
        tally,
    };
    Ok(Simplified { mesh, account })
}

fn missed(faces: usize, wanted: usize, kept_by: &BTreeMap<Rejection, u64>) -> Finding {
    let most = kept_by.iter().max_by_key(|(_, count)| **count).map_or("", |(r, _)| r.meaning());
    let text = format!("{faces} triangles are left where {wanted} were asked for: {most}");
    Finding::warning("faces", text).of(faces as u64)
}

/// How often each reason came up since `before`.
fn since(
    before: &BTreeMap<Rejection, u64>,
    now: &BTreeMap<Rejection, u64>,
) -> BTreeMap<Rejection, u64> {
    let more = |(&reason, &count): (&Rejection, &u64)| {
        (reason, count - before.get(&reason).copied().unwrap_or(0))
    };
    now.iter().map(more).filter(|(_, count)| *count > 0).collect()
}

/// A mesh made ready.
struct Input {
    complex: Complex,
    columns: Columns,
    edges: Vec<Spoke>,
}

impl Input {
    /// `power` is what coordinates are divided by.
    fn new(mesh: &Mesh, power: f64) -> Self {
        let proper = |&f: &u32| {
            let [a, b, c] = mesh.triangles[f as usize];
            a != b && b != c && c != a
        };
        let faces: Vec<u32> = (0..mesh.triangles.len() as u32).filter(proper).collect();
        let triangles: Vec<[u32; 3]> = par::map(&faces, |&f| mesh.triangles[f as usize]);
        let points = par::map(&mesh.points, |&p| DVec3::from(p) / power);
        let mut complex = Complex::new(&points, &triangles);
        let columns = Columns::new(mesh, faces);
        columns.mark_seams(&mut complex);
        let edges = complex.rank();
        Self { complex, columns, edges }
    }
}

/// A power of two near the largest coordinate: divided by it, nothing but exponents changes.
fn scale(points: &[[f64; 3]]) -> f64 {
    let largest = points.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let power = f64::from_bits(largest.to_bits() & f64::INFINITY.to_bits());
    if power.is_normal() { power } else { 1.0 }
}

//! Measures.

use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use serde::Serialize;

/// Whether points at the same position are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Weld {
    None,
    Positions,
}

/// Measures of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
#[allow(missing_docs)]
pub struct Measures {
    pub kind: &'static str,
    pub points: u64,
    pub triangles: u64,
    pub components: u64,
    pub boundary_edges: u64,
    pub nonmanifold_edges: u64,
    pub nonmanifold_points: u64,
    pub misoriented_edges: u64,
    pub degenerate_triangles: u64,
    pub duplicate_triangles: u64,
    pub self_intersections: Option<u64>,
    pub closed: bool,
    pub manifold: bool,
    pub oriented: bool,
    pub euler: i64,
    pub genus: Option<i64>,
    pub volume: Option<f64>,
    pub area: f64,
    pub bounds: Option<[[f64; 3]; 2]>,
}

/// Measures.
pub fn measure(_: &Mesh, _: Weld, _: &Run) -> Result<Measures, Cancelled> {
    Ok(Measures { kind: "mesh", ..Default::default() })
}

/// One direction.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
#[allow(missing_docs)]
pub struct Distances {
    pub max: f64,
    pub mean: f64,
    pub rms: f64,
}

/// Distances both ways.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
#[allow(missing_docs)]
pub struct Comparison {
    pub a_to_b: Distances,
    pub b_to_a: Distances,
    pub hausdorff: f64,
    pub diagonal: f64,
    pub volume_a: Option<f64>,
    pub volume_b: Option<f64>,
}

/// Compares.
pub fn compare(_: &Mesh, _: &Mesh, _samples: usize, _: &Run) -> Result<Comparison, Cancelled> {
    Ok(Comparison::default())
}

//! Measures.

use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use serde::Serialize;

/// Whether points at the same position are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(missing_docs)]
pub enum Weld {
    #[default]
    Exact,
    Off,
}

/// Measures of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
#[allow(missing_docs)]
pub struct Measures {
    pub kind: &'static str,
    pub points: usize,
    pub triangles: usize,
    pub components: usize,
    pub boundary_edges: usize,
    pub nonmanifold_edges: usize,
    pub nonmanifold_points: usize,
    pub misoriented_edges: usize,
    pub degenerate_triangles: usize,
    pub duplicate_triangles: usize,
    pub self_intersections: usize,
    pub closed: bool,
    pub manifold: bool,
    pub oriented: bool,
    pub euler: i64,
    pub genus: Option<u64>,
    pub volume: Option<f64>,
    pub area: f64,
    pub bounds: Option<[[f64; 3]; 2]>,
    #[serde(skip)]
    pub places: Places,
}

/// Positions of the first few defects of each kind.
#[derive(Debug, Clone, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Places {
    pub boundary_edges: Vec<[[f64; 3]; 2]>,
    pub nonmanifold_edges: Vec<[[f64; 3]; 2]>,
    pub misoriented_edges: Vec<[[f64; 3]; 2]>,
    pub nonmanifold_points: Vec<[f64; 3]>,
    pub degenerate_triangles: Vec<[f64; 3]>,
    pub duplicate_triangles: Vec<[f64; 3]>,
    pub self_intersections: Vec<([u32; 2], [f64; 3])>,
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
    pub hausdorff: Option<f64>,
    pub diagonal: f64,
    pub volume_a: Option<f64>,
    pub volume_b: Option<f64>,
}

/// Compares.
pub fn compare(_: &Mesh, _: &Mesh, _samples: usize, _: &Run) -> Result<Comparison, Cancelled> {
    Ok(Comparison::default())
}

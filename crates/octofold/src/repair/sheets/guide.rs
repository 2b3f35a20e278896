//! What a shape says about where sheets should run.

use super::super::bricks::Place;
use super::super::piercing::Target;
use super::complex::Edge;
use glam::DVec3;

/// Walls whose normals are nearer to each other than this are parallel (10 degrees).
pub const PARALLEL: f64 = 0.985;

/// Which side of parallel walls is canonical where nothing else tells: no plane of a model is likely
/// to lie along it.
pub const CANONICAL: DVec3 = DVec3::new(0.267, 0.534, 0.802);

/// What a shape says about sheets. Nothing that it says can spoil the guarantees of the extraction:
/// positions are clamped and tested, and the collapse takes away free quads alone.
pub trait SheetGuide: Sync {
    /// Where the vertex of a leaf of a cell should be. `up` is the canonical side of parallel walls
    /// near the cell.
    fn vertex(&self, place: Place, leaf: &Leaf, up: Option<DVec3>) -> Target;

    /// Whether the quad of an edge must stay though it has a free side; `up` as above.
    fn holds(&self, edge: Edge, up: Option<DVec3>) -> bool;

    /// How the shape goes through an edge.
    fn piercing(&self, edge: Edge) -> Piercing;

    /// Which edges belong together on the low face of a cell along `axis`, where it has four.
    fn pairing(&self, place: Place, axis: usize) -> Pairing;
}

/// The part of the surface in a cell that hangs together on the walls of the cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leaf {
    /// Its edges.
    pub edges: u16,
    /// Whether the surface ends on a wall of the cell.
    pub rim: bool,
    /// Whether the cell has no other.
    pub alone: bool,
}

/// How a shape goes through an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piercing {
    /// Where in the middle, in steps from the low end.
    pub at: Option<f64>,
    /// Whether a sheet goes from one side of the edge to the other: some part of the shape that
    /// hangs together round the edge pierces it an odd number of times.
    pub odd: bool,
    /// The unit normal of the shape there, either way round.
    pub normal: DVec3,
}

impl Piercing {
    /// That of an edge that the shape does not meet.
    pub const NONE: Self = Self { at: None, odd: false, normal: DVec3::ZERO };
}

/// How the four edges of a face are joined. Corners count round the face from its lowest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pairing {
    /// All four in one point.
    Junction,
    /// By arcs that cut off the first and the third corner.
    Even,
    /// By arcs that cut off the second and the fourth corner.
    Odd,
}

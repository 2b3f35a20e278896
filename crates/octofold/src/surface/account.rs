//! What a method tells of its own work, for the report.

use super::certified::Certificate;
use serde::Serialize;
use std::collections::BTreeMap;

/// The account of one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "method")]
pub enum SurfaceAccount {
    /// Of certified TEL: what is proved of the mesh.
    #[serde(rename = "ctel")]
    Certified(Certificate),
    /// Of adaptive marching cubes.
    #[serde(rename = "amc")]
    Adaptive(OctreeAccount),
    /// Of TEL as published.
    #[serde(rename = "tel")]
    Tel(OctreeAccount),
}

impl SurfaceAccount {
    /// What is proved of the mesh, where something is.
    pub fn certificate(&self) -> Option<&Certificate> {
        match self {
            Self::Certified(certificate) => Some(certificate),
            Self::Adaptive(_) | Self::Tel(_) => None,
        }
    }

    /// The counts of octants, where the method closes cracks between them.
    pub fn octree(&self) -> Option<&OctreeAccount> {
        match self {
            Self::Adaptive(account) | Self::Tel(account) => Some(account),
            Self::Certified(_) => None,
        }
    }
}

/// Counts of a method that divides octants until each can carry its part of the surface, and
/// closes the cracks between octants of different size afterwards.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct OctreeAccount {
    /// Levels below the root.
    pub levels: u32,
    /// Octants that carry a part of the surface.
    pub octants: u64,
    /// The same by level, the root first.
    pub octants_by_level: Vec<u64>,
    /// Loops; a finest octant may hold several.
    pub loops: usize,
    /// Octants that were divided, by reason.
    pub rejected: BTreeMap<Rejection, u64>,
    /// The mesh before cracks are closed.
    pub raw: Tally,
    /// Chains of loop edges on faces between octants of different size that found their
    /// counterpart.
    pub seams: usize,
    /// Chains that found none.
    pub unmatched_chains: usize,
    /// Points put on sides of triangles to close cracks.
    pub points_inserted: usize,
    /// Pairs of points moved to their middle to close cracks.
    pub points_moved: usize,
    /// The mesh as it is handed out.
    pub closed: Tally,
}

/// Why an octant was divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rejection {
    /// The surface does not cross its faces.
    NoLoop,
    /// The surface crosses its faces in more than one loop.
    SeveralLoops,
    /// Fewer than three points of the loop are left.
    FewPoints,
    /// The loop has more points than are tried in pairs.
    ManyPoints,
    /// Two sides of the loop meet on a face.
    MeetingSides,
    /// No two points of the loop have surface between them.
    NoChord,
    /// A gray voxel lies outside all prisms.
    Distance,
}

/// Triangles, and edges that are not shared by two of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Triangles.
    pub triangles: usize,
    /// Edges with one triangle.
    pub open_edges: usize,
    /// Edges with three triangles or more.
    pub nonmanifold_edges: usize,
    /// Points minus edges plus triangles.
    pub euler: i64,
}

impl Tally {
    /// What is wrong, in words; `None` where nothing is.
    pub fn defects(&self) -> Option<String> {
        let Self { open_edges, nonmanifold_edges, .. } = *self;
        (open_edges + nonmanifold_edges > 0).then(|| {
            format!(
                "{open_edges} open edges and {nonmanifold_edges} edges with three triangles or more"
            )
        })
    }
}

//! Meshes into voxels.

use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;

/// How large the voxels are.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// Voxels along the longest side.
    Resolution(u32),
    /// Side of a voxel.
    Pitch(f64),
}

/// Which voxels are set.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Fill {
    /// Inside and surface.
    #[default]
    #[serde(rename = "solid")]
    Solid,
    /// All that a triangle touches.
    #[serde(rename = "surface")]
    Surface,
    /// Thin, without a path through along corners.
    #[serde(rename = "thin26")]
    ThinSurface26,
    /// Thin, without a path through along faces.
    #[serde(rename = "thin6")]
    ThinSurface6,
}

/// Options of [`voxelize`].
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct VoxelizeOptions {
    /// How large the voxels are.
    pub size: Size,
    /// Which are set.
    #[serde(default)]
    pub fill: Fill,
}

/// Why a mesh could not be voxelized.
#[derive(Debug, thiserror::Error)]
pub enum VoxelizeError {
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Voxelizes.
pub fn voxelize(_: &Mesh, _: &VoxelizeOptions, _: &Run) -> Result<Spans, VoxelizeError> {
    Ok(Spans)
}

//! Volumes into meshes.

pub mod threshold;

use crate::mesh::Mesh;
use crate::run::Run;
use crate::volume::{Volume, VolumeError};

/// How a surface is found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Method {
    /// Marching cubes.
    #[default]
    #[serde(rename = "mc")]
    Cubes,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 1] = [Self::Cubes];

    /// Name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cubes => "mc",
        }
    }
}

/// Which side of the isovalue is inside.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// Values above it.
    #[default]
    Above,
    /// Values below it.
    Below,
}

/// Options of [`surface`].
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceOptions {
    /// The method.
    pub method: Method,
    /// Value of the surface.
    pub iso: Option<f64>,
    /// Which side is inside.
    pub inside: Inside,
    /// One part per label.
    pub labels: bool,
    /// Leave the surface open at the volume's border.
    pub open: bool,
    /// Vertex normals from the gradient.
    pub normals: bool,
}

/// Finds the surface.
pub fn surface(_: &dyn Volume, _: &SurfaceOptions, _: &Run) -> Result<Mesh, VolumeError> {
    Ok(Mesh::default())
}

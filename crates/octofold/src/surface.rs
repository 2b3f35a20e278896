//! Volumes into meshes.

pub mod cell;
pub mod cubes;
pub mod labels;
pub mod threshold;

use crate::mesh::Mesh;
use crate::run::Run;
use crate::volume::{Volume, VolumeError};
pub use cubes::{CubesOptions, Inside, marching_cubes};
pub use labels::{LabelComplex, LabelMesh, label_complex, label_meshes};

/// The ways to turn a volume into a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Method {
    /// Marching cubes with a consistent face rule: every mixed cell gets its patch.
    #[default]
    #[serde(rename = "mc")]
    Cubes,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 1] = [Self::Cubes];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cubes => "mc",
        }
    }
}

/// How a volume becomes a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceOptions {
    /// The method.
    pub method: Method,
    /// The isovalue; one half for masks. See [`threshold`] for a choice.
    pub iso: Option<f64>,
    /// Which side of the isovalue is inside.
    pub inside: Inside,
    /// One closed surface per label; `iso`, `inside` and `open` are not used.
    pub labels: bool,
    /// Leave the surface open at the volume's border.
    pub open: bool,
    /// Add vertex normals.
    pub normals: bool,
}

/// Turns a volume into a mesh in world coordinates.
pub fn surface(
    volume: &dyn Volume,
    options: &SurfaceOptions,
    run: &Run,
) -> Result<Mesh, VolumeError> {
    let SurfaceOptions { method, iso, inside, open, .. } = *options;
    let mut mesh = match method {
        Method::Cubes if options.labels => labels::merge(label_meshes(volume, run)?, volume)?,
        Method::Cubes => {
            let iso = iso.unwrap_or(0.5);
            marching_cubes(volume, &CubesOptions { iso, inside, open }, run)?
        }
    };
    if options.normals {
        mesh.attributes.point_normals = Some(mesh.area_weighted_normals());
    }
    Ok(mesh)
}

//! Built-in shapes.

use crate::run::{Cancelled, Run};
use crate::soup::Soup;
use crate::volume::{DenseVolume, Placement};

/// A built-in shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Sample {
    Cone,
    Torus,
    Cylinder,
    Kettle,
    Gyroid,
    Scan,
}

impl Sample {
    /// All.
    pub const ALL: [Self; 6] =
        [Self::Cone, Self::Torus, Self::Cylinder, Self::Kettle, Self::Gyroid, Self::Scan];
    /// Name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cone => "cone",
            Self::Torus => "torus",
            Self::Cylinder => "cylinder",
            Self::Kettle => "kettle",
            Self::Gyroid => "gyroid",
            Self::Scan => "scan",
        }
    }
    /// By name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
    /// One line.
    pub fn about(self) -> &'static str {
        "a shape"
    }
    /// Gray.
    pub fn volume(self, _: usize) -> Option<DenseVolume<f32>> {
        DenseVolume::new([1; 3], vec![0.0], Placement::default())
    }
    /// Binary.
    pub fn voxels(self, _: usize) -> Option<DenseVolume<f32>> {
        DenseVolume::new([1; 3], vec![0.0], Placement::default())
    }
    /// Polygons.
    pub fn mesh(self, _: usize, _: &Run) -> Result<Soup, Cancelled> {
        Ok(Soup::default())
    }
}

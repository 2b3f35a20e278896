//! Built-in shapes.

use crate::run::{Cancelled, Run};
use crate::soup::Soup;
use crate::spans::Spans;

/// A built-in shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Sample {
    Sphere,
    Torus,
    Cube,
    Kettle,
    Gyroid,
    Scan,
}

impl Sample {
    /// All.
    pub const ALL: [Self; 6] =
        [Self::Sphere, Self::Torus, Self::Cube, Self::Kettle, Self::Gyroid, Self::Scan];
    /// Name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Torus => "torus",
            Self::Cube => "cube",
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
    pub fn volume(self, _: usize) -> Option<Spans> {
        Some(Spans)
    }
    /// Binary.
    pub fn voxels(self, _: usize) -> Option<Spans> {
        Some(Spans)
    }
    /// Polygons.
    pub fn mesh(self, _: usize, _: &Run) -> Result<Soup, Cancelled> {
        Ok(Soup::default())
    }
}

//! Pictures.

use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use crate::volume::{Volume, VolumeError};

/// Pixels, RGBA, rows from the top.
#[derive(Debug, Clone, Default)]
#[allow(missing_docs)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

/// Where from.
#[derive(Debug, Clone, Copy, Default)]
#[allow(missing_docs)]
pub struct View {
    pub size: [u32; 2],
}

/// How.
#[derive(Debug, Clone, Copy, Default)]
#[allow(missing_docs)]
pub struct Style {
    pub boundary: Option<[u8; 3]>,
    pub back: Option<[u8; 3]>,
}

impl Style {
    /// Red.
    pub const RED: [u8; 3] = [226, 22, 30];
}

/// How slices look.
#[derive(Debug, Clone, Copy, Default)]
#[allow(missing_docs)]
pub struct SliceStyle {
    pub height: u32,
}

/// Draws a mesh.
pub fn render(_: &Mesh, _: &View, _: &Style, _: &Run) -> Result<Picture, Cancelled> {
    Ok(Picture { width: 1, height: 1, rgba: vec![0; 4] })
}

/// Draws slices.
pub fn slices(_: &dyn Volume, _: &SliceStyle, _: &Run) -> Result<Picture, VolumeError> {
    Ok(Picture { width: 1, height: 1, rgba: vec![0; 4] })
}

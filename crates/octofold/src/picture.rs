//! Pictures of meshes and volumes, drawn in software: the same bytes on every run.
//!
//! [`render`] draws a mesh with two lights, four samples a pixel, in tiles and in parallel.
//! Faces seen from behind are tinted, so that what is turned over shows; edges with a single face
//! can be marked. [`slices`] shows the three middle slices of a volume side by side.

mod colour;
mod raster;
mod shade;
mod slices;
mod view;

pub use slices::{SlicePaint, SliceStyle, slices};
pub use view::{Projection, View};

use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use raster::{Tile, Tiles};
use shade::{Shader, Weld};
use view::Camera;

/// Rows of pixels from the top, four bytes each: sRGB with straight alpha.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The pixels.
    pub rgba: Vec<u8>,
}

/// Where the colours of faces come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Paint {
    /// The mesh's own: of faces, else materials, else points, else [`Style::colour`].
    #[default]
    Own,
    /// A colour for every value of the face labels.
    Labels,
    /// [`Style::colour`] everywhere.
    Plain,
}

/// How light runs over a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shading {
    /// By the face's own normal.
    Flat,
    /// By the mesh's normals where it has some, else smoothly over edges between faces whose
    /// normals differ by less than `crease` degrees.
    Smooth {
        /// Angle from which an edge is sharp, in degrees.
        crease: f64,
    },
}

/// What lies behind the shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Background {
    /// Nothing: transparent pixels.
    Clear,
    /// One colour, sRGB.
    Plain([u8; 3]),
    /// From a colour at the top to one at the bottom, sRGB.
    Gradient([u8; 3], [u8; 3]),
}

/// What a mesh looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// How light runs over faces.
    pub shading: Shading,
    /// Where colours come from.
    pub paint: Paint,
    /// Colour of faces without one, sRGB.
    pub colour: [u8; 3],
    /// Tint of faces seen from behind, sRGB; `None` shows both sides alike.
    pub back: Option<[u8; 3]>,
    /// Colour of lines along all edges of triangles, sRGB.
    pub wireframe: Option<[u8; 3]>,
    /// Colour of lines along edges with a single face, sRGB.
    pub boundary: Option<[u8; 3]>,
    /// What lies behind.
    pub background: Background,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            shading: Shading::Smooth { crease: 38.0 },
            paint: Paint::Own,
            colour: [148, 184, 200],
            back: Some([176, 64, 168]),
            wireframe: None,
            boundary: None,
            background: Background::Gradient([252, 252, 253], [222, 227, 234]),
        }
    }
}

impl Style {
    /// The colour of marked boundary edges where nothing speaks against it.
    pub const RED: [u8; 3] = [226, 22, 30];
    /// The colour of wireframes where nothing speaks against it.
    pub const INK: [u8; 3] = [24, 40, 56];
}

/// Draws `mesh` as seen from `view`.
pub fn render(mesh: &Mesh, view: &View, style: &Style, run: &Run) -> Result<Picture, Cancelled> {
    run.stage("picture");
    let [width, height] = view.size;
    let camera = Camera::new(mesh, view, run)?;
    let weld = Weld::new(mesh, run)?;
    let shader = Shader::new(mesh, style, &camera, &weld, run)?;
    let lines = if style.boundary.is_some() { weld.boundary(mesh) } else { Vec::new() };
    let tiles = Tiles::new(mesh, lines, &camera, run)?;
    let drawn = par::blocks(run, tiles.count(), 1, |range| {
        range
            .map(|t| {
                let tile = tiles.draw(t);
                (tile.origin(), shader.resolve(&tile))
            })
            .collect::<Vec<_>>()
    })?;
    let mut rgba = vec![0; width as usize * height as usize * 4];
    for ([x, y], pixels) in drawn.into_iter().flatten() {
        let across = Tile::SIDE.min(width as usize - x);
        for (row, line) in pixels.chunks_exact(Tile::SIDE).enumerate() {
            if y + row < height as usize {
                let at = ((y + row) * width as usize + x) * 4;
                rgba[at..at + 4 * across].copy_from_slice(line[..across].as_flattened());
            }
        }
    }
    Ok(Picture { width, height, rgba })
}

#[cfg(test)]
mod tests;

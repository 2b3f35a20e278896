//! Pictures of shapes as PNG files.

use crate::files;
use anyhow::Result;
use octofold::picture::{Picture, SliceStyle, Style, View, render, slices};
use octofold::{Mesh, Run, Shape};
use std::path::Path;

/// Draws a mesh, its boundary in red, or the middle slices of a volume into a PNG file.
pub fn draw(shape: &Shape, path: &Path, run: &Run) -> Result<()> {
    match shape {
        Shape::Soup(soup) => {
            let style = Style { boundary: Some(Style::RED), ..Style::default() };
            draw_mesh(&soup.triangulate(), &View::default(), &style, path, run)
        }
        Shape::Volume(volume) => save(&slices(volume.as_ref(), &SliceStyle::default(), run)?, path),
    }
}

/// Draws a mesh into a PNG file.
pub fn draw_mesh(mesh: &Mesh, view: &View, style: &Style, path: &Path, run: &Run) -> Result<()> {
    save(&render(mesh, view, style, run)?, path)
}

fn save(picture: &Picture, path: &Path) -> Result<()> {
    let Picture { width, height, rgba } = picture;
    files::write(path, &octofold_io::png::encode(*width, *height, rgba)?)
}

//! Pictures of shapes as PNG files.

use anyhow::Result;
use octofold::picture::{Picture, SliceStyle, Style, View, render, slices};
use octofold::{Run, Shape};
use octofold_io::WriteError;
use std::path::Path;

/// Draws a mesh, its boundary in red, or the middle slices of a volume into a PNG file.
pub fn draw(shape: &Shape, path: &Path, run: &Run) -> Result<()> {
    let Picture { width, height, rgba } = match shape {
        Shape::Soup(soup) => {
            let style = Style { boundary: Some(Style::RED), ..Style::default() };
            render(&soup.triangulate(), &View::default(), &style, run)?
        }
        Shape::Volume(volume) => slices(volume.as_ref(), &SliceStyle::default(), run)?,
    };
    let bytes = octofold_io::png::encode(width, height, &rgba)?;
    Ok(octofold_io::save(path, |sink| {
        let failed = |source| WriteError::Io { path: path.into(), source };
        sink.out.write_all(&bytes).map_err(failed)
    })?)
}

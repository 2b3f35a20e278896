//! The front door for papercraft sheets: patterns to PDF, SVG, DXF and FOLD.

use crate::columns::sink_error;
use crate::drawing::pages;
use crate::{WriteError, save, svg};
use octofold::unfold::Pattern;
use octofold::{Run, SoupBuilder};
use std::path::Path;

/// File formats that hold sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SheetFormat {
    Svg,
}

impl SheetFormat {
    /// All of them.
    pub const ALL: [Self; 1] = [Self::Svg];

    /// Name, which is also the ending of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Svg => "svg",
        }
    }

    /// The format that a file name's ending stands for.
    pub fn of_name(name: &str) -> Option<Self> {
        let lower = name.to_ascii_lowercase();
        Self::ALL.into_iter().find(|f| {
            lower.strip_suffix(f.name()).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'))
        })
    }
}

/// Writes a pattern: all files, or none of them.
///
/// SVG takes a file for each page, numbered where there are several, and the unfolded mesh as OBJ
/// beside them.
pub fn write_sheets(
    pattern: &Pattern,
    path: &Path,
    format: SheetFormat,
    run: &Run,
) -> Result<(), WriteError> {
    let drawings = pages(pattern);
    match format {
        SheetFormat::Svg => {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let several = drawings.len() > 1;
            let first = if several { path.with_file_name(format!("{stem}-1.svg")) } else { path.into() };
            save(&first, |sink| {
                for (page, drawing) in (0..).zip(&drawings) {
                    run.check()?;
                    let text = svg::page(pattern, drawing, page);
                    if page == 0 {
                        sink.out.write_all(text.as_bytes()).map_err(sink_error)?;
                    } else {
                        sink.beside(format!("{stem}-{}.svg", page + 1), text.into_bytes());
                    }
                }
                sink.beside(format!("{stem}.obj"), mesh_text(pattern, run)?);
                Ok(())
            })
        }
    }
}

/// The unfolded mesh as OBJ.
fn mesh_text(pattern: &Pattern, run: &Run) -> Result<Vec<u8>, WriteError> {
    let mut builder = SoupBuilder::default();
    builder.points.clone_from(&pattern.mesh.points);
    pattern.mesh.faces.iter().for_each(|face| builder.face(face));
    let unfit = |e: octofold::ShapeError| WriteError::Unfit { format: "obj", fact: e.to_string() };
    let soup = builder.build().map_err(unfit)?;
    let mut bytes = Vec::new();
    crate::obj::write(&soup, &mut crate::Sink::new(&mut bytes, "net"), run)?;
    Ok(bytes)
}

//! The front door for papercraft sheets: patterns to PDF, SVG, DXF and FOLD.

use crate::columns::sink_error;
use crate::cover::Cover;
use crate::drawing::{Drawing, pages};
use crate::prints::ModelColours;
use crate::seal::{self, Origin};
use crate::{Sink, WriteError, cutter, dxf, fold, pdf, save, svg};
use octofold::unfold::Pattern;
use octofold::{Run, ShapeError, SoupBuilder};
use std::path::{Path, PathBuf};

/// File formats that hold sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SheetFormat {
    Pdf,
    Svg,
    Dxf,
    Fold,
}

impl SheetFormat {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Pdf, Self::Svg, Self::Dxf, Self::Fold];

    /// Name, which is also the ending of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pdf => "pdf",
            Self::Svg => "svg",
            Self::Dxf => "dxf",
            Self::Fold => "fold",
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

/// What sheets show beside lines.
#[derive(Default)]
pub struct Dress<'a> {
    /// What is printed on faces, in PDF and SVG.
    pub colours: Option<ModelColours<'a>>,
    /// The first page of a PDF.
    pub cover: Option<Cover>,
    /// SVG and DXF are for a cutting machine: nothing but what it draws, scores and cuts.
    pub cutter: bool,
}

/// Writes a pattern: all files, or none of them.
///
/// PDF and FOLD hold all pages. SVG and DXF take a file for each, numbered where there are several;
/// beside an SVG stands the unfolded mesh as OBJ, which never replaces a file of another origin, and
/// beside what a cutting machine takes a square to try it with. Pages that an earlier run has left over
/// are taken away, but for those that were changed since.
pub fn write_sheets(
    pattern: &Pattern,
    dress: &Dress<'_>,
    path: &Path,
    format: SheetFormat,
    run: &Run,
) -> Result<(), WriteError> {
    let cuts = dress.cutter && matches!(format, SheetFormat::Svg | SheetFormat::Dxf);
    let printed = format == SheetFormat::Pdf || format == SheetFormat::Svg && !cuts;
    let colours = dress.colours.as_ref().filter(|_| printed);
    let mut drawings = pages(pattern, colours, run)?;
    let cover = dress.cover.as_ref().filter(|_| format == SheetFormat::Pdf);
    drawings.splice(..0, cover.map(|cover| cover.drawing(pattern)));
    if format == SheetFormat::Svg {
        keep_foreign(&path.with_extension("obj"), "the unfolded model", format)?;
    }
    let title = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let square = format!("{title}-square.{}", format.name());
    if cuts {
        keep_foreign(&path.with_file_name(&square), "the square to try the machine with", format)?;
        drawings.iter_mut().for_each(|drawing| *drawing = cutter::worked(drawing));
    }
    match format {
        SheetFormat::Pdf => save(path, |sink| {
            let bytes = pdf::document(pattern, &drawings, &title).map_err(sink_error)?;
            sink.out.write_all(&bytes).map_err(sink_error)
        }),
        SheetFormat::Fold => save(path, |sink| {
            sink.out.write_all(fold::document(pattern, &title).as_bytes()).map_err(sink_error)
        }),
        SheetFormat::Svg => save(&first(path, drawings.len()), |sink| {
            let page = |number, drawing: &Drawing| match cuts {
                true => cutter::svg(pattern.page, drawing),
                false => svg::page(pattern, drawing, number),
            };
            page_by_page(sink, path, &drawings, page, run)?;
            sink.beside(format!("{title}.obj"), mesh_text(pattern, run)?);
            if cuts {
                let (size, drawing) = cutter::square();
                sink.beside(&square, cutter::svg(size, &drawing).into_bytes());
            }
            Ok(())
        }),
        SheetFormat::Dxf => save(&first(path, drawings.len()), |sink| {
            page_by_page(sink, path, &drawings, |_, drawing| dxf::page(drawing), run)?;
            if cuts {
                sink.beside(&square, dxf::page(&cutter::square().1).into_bytes());
            }
            Ok(())
        }),
    }
    .map_err(|error| match error {
        WriteError::Io { source, .. } => WriteError::Io { path: path.into(), source },
        other => other,
    })?;
    if matches!(format, SheetFormat::Svg | SheetFormat::Dxf) {
        let count = drawings.len();
        let written: Vec<PathBuf> = (0..count).map(|page| numbered(path, page, count)).collect();
        seal::clear(path, &written, run);
    }
    Ok(())
}

/// Refuses to replace a file that we did not write.
fn keep_foreign(path: &Path, what: &str, format: SheetFormat) -> Result<(), WriteError> {
    match std::fs::read(path) {
        Ok(bytes) if seal::origin(&bytes) != Origin::Ours => Err(WriteError::Unfit {
            format: format.name(),
            fact: format!(
                "{what} would be written over {}, which is no work of an earlier run: choose another \
                 name",
                path.display()
            ),
        }),
        _ => Ok(()),
    }
}

/// The name of a page's file.
fn numbered(path: &Path, page: usize, pages: usize) -> PathBuf {
    if pages < 2 {
        return path.into();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{}.{ending}", page + 1))
}

fn first(path: &Path, pages: usize) -> PathBuf {
    numbered(path, 0, pages)
}

/// Writes a text for each page, the first into the main file and the others beside it.
fn page_by_page(
    sink: &mut Sink<'_>,
    path: &Path,
    drawings: &[Drawing],
    text: impl Fn(u32, &Drawing) -> String,
    run: &Run,
) -> Result<(), WriteError> {
    for (page, drawing) in drawings.iter().enumerate() {
        run.check()?;
        let text = text(page as u32, drawing).into_bytes();
        if page == 0 {
            sink.out.write_all(&text).map_err(sink_error)?;
        } else {
            let name = numbered(path, page, drawings.len());
            sink.beside(name.file_name().unwrap_or_default().to_string_lossy(), text);
        }
    }
    Ok(())
}

/// The unfolded mesh as OBJ.
fn mesh_text(pattern: &Pattern, run: &Run) -> Result<Vec<u8>, WriteError> {
    let mut builder = SoupBuilder::default();
    builder.points.clone_from(&pattern.mesh.points);
    pattern.mesh.faces.iter().for_each(|face| builder.face(face));
    let unfit = |e: ShapeError| WriteError::Unfit { format: "obj", fact: e.to_string() };
    let soup = builder.build().map_err(unfit)?;
    let mut bytes = Vec::new();
    crate::obj::write(&soup, &mut Sink::new(&mut bytes, "net"), run)?;
    Ok(seal::sealed("# ", "", &String::from_utf8_lossy(&bytes)).into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use octofold::samples::Sample;
    use octofold::unfold::{Scale, UnfoldOptions, unfold};

    fn pattern() -> Pattern {
        let mesh = Sample::Cube.polygons(1).unwrap().triangulate();
        let options = UnfoldOptions { scale: Scale::Size(120.0), ..UnfoldOptions::default() };
        unfold(&mesh, &options, &Run::default()).unwrap().pattern
    }

    #[test]
    fn every_format_writes_the_same_bytes_twice() {
        let pattern = pattern();
        assert!(pattern.pages > 1);
        let folder = tempfile::tempdir().unwrap();
        for format in SheetFormat::ALL {
            let path = folder.path().join(format!("cube.{}", format.name()));
            let write = || {
                write_sheets(&pattern, &Dress::default(), &path, format, &Run::default()).unwrap();
                let mut files: Vec<_> = std::fs::read_dir(folder.path())
                    .unwrap()
                    .map(|entry| entry.unwrap().path())
                    .map(|path| (path.clone(), std::fs::read(path).unwrap()))
                    .collect();
                files.sort();
                files
            };
            assert_eq!(write(), write());
        }
        let name = |number| folder.path().join(format!("cube-{number}.svg"));
        assert!((1..=pattern.pages).all(|number| name(number).exists()));
        assert!(folder.path().join("cube.obj").exists());
    }

    #[test]
    fn machines_get_a_square_that_replaces_nothing_of_others() {
        let folder = tempfile::tempdir().unwrap();
        let dress = Dress { cutter: true, ..Dress::default() };
        for format in [SheetFormat::Svg, SheetFormat::Dxf] {
            let file = |name: &str| folder.path().join(format!("{name}.{}", format.name()));
            let write = || write_sheets(&pattern(), &dress, &file("cube"), format, &Run::default());
            write().unwrap();
            write().unwrap();
            let page = std::fs::read_to_string(file("cube-1")).unwrap();
            assert!(file("cube-square").exists() && !page.contains("data-face"));
            std::fs::write(file("cube-square"), "mine").unwrap();
            assert!(write().is_err());
        }
    }

    #[test]
    fn the_ruler_is_as_long_as_it_says() {
        let drawing = &pages(&pattern(), None, &Run::default()).unwrap()[0];
        let length = |line: &crate::drawing::Line| line.points[1][0] - line.points[0][0];
        let own = drawing.lines.iter().filter(|l| l.layer == crate::drawing::Layer::Page);
        assert_eq!(own.map(length).fold(0.0, f64::max), 100.0);
    }

    #[test]
    fn printed_pages_are_whole() {
        let house = Sample::House.polygons(1).unwrap().triangulate();
        let pattern = unfold(&house, &UnfoldOptions::default(), &Run::default()).unwrap().pattern;
        let dress = Dress { colours: ModelColours::new(&house), ..Dress::default() };
        assert!(dress.colours.is_some());
        for (page, drawing) in
            pages(&pattern, dress.colours.as_ref(), &Run::default()).unwrap().iter().enumerate()
        {
            let print = drawing.print.as_ref().unwrap();
            assert!(print.rgb.chunks_exact(3).any(|dot| dot[0] != 255));
            let text = svg::page(&pattern, drawing, page as u32);
            assert_eq!(text.matches("<g ").count(), text.matches("</g>").count());
        }
    }

    #[test]
    fn old_pages_go_and_other_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        let write = |pattern: &Pattern| {
            write_sheets(
                pattern,
                &Dress::default(),
                &file("cube.svg"),
                SheetFormat::Svg,
                &Run::default(),
            )
        };
        let many = pattern();
        write(&many).unwrap();
        std::fs::write(file("cube-99.svg"), "<svg/>").unwrap();
        let changed = std::fs::read_to_string(file("cube-2.svg")).unwrap() + " ";
        std::fs::write(file("cube-2.svg"), changed).unwrap();
        let mesh = Sample::Cube.polygons(1).unwrap().triangulate();
        let options = UnfoldOptions { scale: Scale::Size(30.0), ..UnfoldOptions::default() };
        let one = unfold(&mesh, &options, &Run::default()).unwrap().pattern;
        assert_eq!(one.pages, 1);
        write(&one).unwrap();
        assert!(file("cube.svg").exists() && !file("cube-1.svg").exists());
        assert!(file("cube-2.svg").exists() && file("cube-99.svg").exists());
        write(&many).unwrap();
        assert!(!file("cube.svg").exists() && file("cube-1.svg").exists());
        std::fs::write(file("cube.obj"), "v 0 0 0\n").unwrap();
        assert!(write(&many).is_err());
    }

    #[test]
    fn formats_go_by_their_ending() {
        assert_eq!(SheetFormat::of_name("a/B.PDF"), Some(SheetFormat::Pdf));
        assert_eq!(SheetFormat::of_name("a.obj"), None);
    }
}

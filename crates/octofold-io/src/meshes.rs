//! The front door for meshes: finds the format, the file and its neighbours.

use crate::{Format, ReadError, Sink, Source, WriteError, gltf, obj, off, ply, save, stl, threemf};
use octofold::{Run, Soup};
use std::path::Path;

/// Reads polygons in `format`, or in the format that the bytes or the name tell.
pub fn read_mesh(source: &Source, format: Option<Format>, run: &Run) -> Result<Soup, ReadError> {
    let format = format.map_or_else(|| Format::of_source(source), Ok)?;
    let soup = match format {
        Format::Obj => obj::read(source, run),
        Format::Ply => ply::read(source, run),
        Format::Stl => stl::read(source, run),
        Format::Off => off::read(source, run),
        Format::Gltf | Format::Glb => gltf::read(source, run),
        Format::ThreeMf => threemf::read(source, run),
        other => Err(ReadError::unsupported(other.name(), "this format holds a volume, no mesh")),
    };
    soup.map_err(|error| match error {
        ReadError::Cancelled(_) | ReadError::Io { .. } => error,
        _ => ReadError::In { path: source.path.clone(), source: Box::new(error) },
    })
}

/// Writes polygons to `path` in `format`, or in the format that the name's ending stands for.
///
/// The file and those beside it appear only once they are written whole.
pub fn write_mesh(
    soup: &Soup,
    path: &Path,
    format: Option<Format>,
    run: &Run,
) -> Result<(), WriteError> {
    let Some(format) = format.or_else(|| Format::of_name(&path.to_string_lossy())) else {
        return Err(WriteError::Unfit {
            format: "a file without a known ending",
            fact: "say which mesh format to write: obj, ply, stl, off, gltf, glb or 3mf".into(),
        });
    };
    save(path, |sink| {
        write_to(soup, sink, format, run).map_err(|error| match error {
            WriteError::Io { source, .. } => WriteError::Io { path: path.into(), source },
            other => other,
        })
    })
}

fn write_to(soup: &Soup, sink: &mut Sink<'_>, format: Format, run: &Run) -> Result<(), WriteError> {
    match format {
        Format::Obj => obj::write(soup, sink, run),
        Format::Ply => ply::write(soup, sink, run),
        Format::Stl => stl::write(soup, sink, run),
        Format::Off => off::write(soup, sink, run),
        Format::Gltf => gltf::write_gltf(soup, sink, run),
        Format::Glb => gltf::write_glb(soup, sink, run),
        Format::ThreeMf => threemf::write(soup, sink, run),
        other => Err(WriteError::Unfit {
            format: other.name(),
            fact: "it holds volumes; voxelize the mesh first".into(),
        }),
    }
}

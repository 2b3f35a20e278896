//! Readers and writers of Octofold.
//!
//! Every format is one module with `read` and `write` on bytes; [`read()`] and [`write()`] find the
//! module, the file and its neighbours. Readers never allocate by a number that they have not
//! checked against the input's length, and never panic.

mod error;
mod format;
mod sink;
mod source;

pub mod binvox;
pub mod gltf;
pub mod nifti;
pub mod npy;
pub mod nrrd;
pub mod obj;
pub mod off;
pub mod ply;
pub mod png;
pub mod raw;
pub mod stl;
pub mod threemf;
pub mod vox;

pub use error::{At, ReadError, WriteError};
pub use format::{Format, Kind};
pub use sink::{Sink, save};
pub use source::{Bytes, Files, NoFiles, Source};

use octofold::{Run, Soup, Volume};
use std::path::Path;

/// Reads polygons.
pub fn read_mesh(source: &Source, format: Option<Format>, run: &Run) -> Result<Soup, ReadError> {
    match format.map_or_else(|| Format::of_source(source), Ok)? {
        Format::Obj => obj::read(source, run),
        Format::Ply => ply::read(source, run),
        Format::Stl => stl::read(source, run),
        Format::Off => off::read(source, run),
        Format::Gltf | Format::Glb => gltf::read(source, run),
        Format::ThreeMf => threemf::read(source, run),
        other => Err(ReadError::unsupported(other.name(), "holds a volume, not a mesh")),
    }
}

/// Writes polygons.
pub fn write_mesh(
    soup: &Soup,
    path: &Path,
    format: Option<Format>,
    run: &Run,
) -> Result<(), WriteError> {
    let format = format.or_else(|| Format::of_name(&path.to_string_lossy()));
    save(path, |sink| match format {
        Some(Format::Obj) => obj::write(soup, sink, run),
        _ => Err(WriteError::Unfit { format: "this format", fact: "not written yet".into() }),
    })
}

/// Reads samples.
pub fn read_volume(
    source: &Source,
    format: Option<Format>,
    layout: Option<raw::RawLayout>,
    run: &Run,
) -> Result<Box<dyn Volume>, ReadError> {
    match (format.map_or_else(|| Format::of_source(source), Ok)?, layout) {
        (Format::Nifti, _) => nifti::read(source, run),
        (Format::Raw, Some(layout)) => raw::read(source, layout, run),
        (other, _) => Err(ReadError::unsupported(other.name(), "not read yet")),
    }
}

/// Writes samples.
pub fn write_volume(
    volume: &dyn Volume,
    path: &Path,
    format: Option<Format>,
    run: &Run,
) -> Result<(), WriteError> {
    let format = format.or_else(|| Format::of_name(&path.to_string_lossy()));
    save(path, |sink| match format {
        Some(Format::Nrrd) => nrrd::write(volume, sink, run),
        _ => Err(WriteError::Unfit { format: "this format", fact: "not written yet".into() }),
    })
}

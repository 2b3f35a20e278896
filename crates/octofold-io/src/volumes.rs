//! The front door of volumes: finds the format, the reader or writer, and names the file in errors.

use crate::raw::RawLayout;
use crate::{Format, ReadError, Sink, Source, WriteError, save};
use crate::{binvox, format::Kind, nifti, npy, nrrd, ofn, raw, vox};
use octofold::{Run, Volume};
use std::path::{Path, PathBuf};

/// Reads a volume. Without `format` it is told from the file's first bytes, then from its name;
/// with `layout` the file is raw.
pub fn read_volume(
    source: &Source,
    format: Option<Format>,
    layout: Option<RawLayout>,
    run: &Run,
) -> Result<Box<dyn Volume>, ReadError> {
    let read = || {
        let format = match (format, layout) {
            (Some(format), _) => format,
            (None, Some(_)) => Format::Raw,
            (None, None) => Format::of_source(source)?,
        };
        match format {
            Format::Nifti => nifti::read(source, run),
            Format::Nrrd => nrrd::read(source, run),
            Format::Npy => npy::read(source, run),
            Format::Binvox => binvox::read(source, run),
            Format::Vox => vox::read(source, run),
            Format::Ofn => ofn::read(source, run),
            Format::Raw => match layout {
                Some(layout) => raw::read(source, layout, run),
                None => {
                    let fact = "a raw file does not say what it holds: give --dims X,Y,Z and \
                                --dtype TYPE";
                    Err(ReadError::unsupported("raw", fact))
                }
            },
            _ => Err(ReadError::unsupported(format.name(), "it holds a mesh, not a volume")),
        }
    };
    read().map_err(|error| match error {
        ReadError::Cancelled(_) | ReadError::UnknownFormat(_) => error,
        error => ReadError::In { path: source.path.clone(), source: Box::new(error) },
    })
}

/// Writes a volume to a file whose name, or else `format`, says how. `.nii.gz` is compressed.
pub fn write_volume(
    volume: &dyn Volume,
    path: &Path,
    format: Option<Format>,
    run: &Run,
) -> Result<(), WriteError> {
    let name = path.to_string_lossy().to_ascii_lowercase();
    let Some(format) = format.or_else(|| Format::of_name(&name)) else {
        let known: Vec<_> =
            Format::ALL.iter().filter(|f| f.kind() == Kind::Volume).map(|f| f.name()).collect();
        let fact = format!(
            "the name {name:?} tells no known format; use one of the endings {}",
            known.join(", ")
        );
        return Err(WriteError::Unfit { format: "file", fact });
    };
    if volume.dims().contains(&0) {
        let fact = "the volume has no samples".into();
        return Err(WriteError::Unfit { format: format.name(), fact });
    }
    for (ending, instead) in [("hdr", "nii"), ("img", "nii"), ("nhdr", "nrrd")] {
        if name.trim_end_matches(".gz").ends_with(&format!(".{ending}")) {
            let fact = format!("pairs of files are not written: write .{instead}");
            return Err(WriteError::Unfit { format: ending, fact });
        }
    }
    let write = match format {
        Format::Nifti if name.ends_with(".gz") => nifti::write_gz,
        Format::Nifti => nifti::write,
        Format::Nrrd => nrrd::write,
        Format::Npy => npy::write,
        Format::Raw => raw::write,
        Format::Binvox => binvox::write,
        Format::Vox => vox::write,
        Format::Ofn => ofn::write,
        _ => {
            let fact = "it holds meshes: make a surface of the volume first".into();
            return Err(WriteError::Unfit { format: format.name(), fact });
        }
    };
    saved(path, |sink| write(volume, sink, run))
}

/// Writes a binary volume as `.ofn`.
pub fn write_solid(
    volume: &dyn Volume,
    path: &Path,
    layout: ofn::Layout,
    run: &Run,
) -> Result<(), WriteError> {
    saved(path, |sink| ofn::write_as(volume, layout, sink, run))
}

fn saved(
    path: &Path,
    write: impl FnOnce(&mut Sink<'_>) -> Result<(), WriteError>,
) -> Result<(), WriteError> {
    save(path, write).map_err(|error| match error {
        WriteError::Io { path: unnamed, source } if unnamed == PathBuf::new() => {
            WriteError::Io { path: path.to_path_buf(), source }
        }
        error => error,
    })
}

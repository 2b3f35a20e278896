//! NIfTI-1 and NIfTI-2: `.nii`, `.nii.gz`, and pairs of `.hdr` and `.img`.
//!
//! The placement is the sform where there is one, else the qform, else the voxel sizes from the
//! origin (method 1 of the standard). World coordinates are RAS: x to the right, y to the front,
//! z up, in the unit that the header names. `scl_slope` and `scl_inter` are honoured: samples
//! then read as floating-point values. Of more than three dimensions the first volume is read.
//!
//! The header is read here and not by a crate, so that samples stay in the mapped file, and so
//! that what a damaged header says is checked before it is used.
//! Source: the headers `nifti1.h` and `nifti2.h` of the NIfTI data format working group.

mod header;
mod orientation;

use crate::inflate::{self, Gunzip};
use crate::mapped::{Layout, MappedVolume, Stored, sound_placement};
use crate::slabs::{self, lost};
use crate::{At, Bytes, ReadError, Sink, Source, WriteError};
use flate2::{Compression, write::GzEncoder};
use header::Header;
use octofold::volume::ScalarType;
use octofold::{Finding, Run, Volume};
use std::io::Write;

const FORMAT: &str = "nii";

/// Bytes of the longest header and the four bytes after it.
const HEADER_MAX: usize = 544;

/// True where the bytes begin like NIfTI, compressed or not.
pub fn sniff(bytes: &[u8]) -> bool {
    if bytes.starts_with(inflate::MAGIC) {
        let mut gunzip = Gunzip::new(FORMAT, bytes);
        // What a damaged start yields is looked at, too: its own reader will tell.
        let _ = gunzip.fill(HEADER_MAX, &Run::default());
        return Header::magic(gunzip.bytes()).is_some();
    }
    Header::magic(bytes).is_some()
}

/// Reads the first volume. Either file of a pair may be given.
pub fn read(source: &Source, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    if let Some(header) = header_beside(source)? {
        let header = Header::parse(&head(&header, run)?)?;
        return build(&header, source.bytes.clone(), run);
    }
    let header = Header::parse(&head(&source.bytes, run)?)?;
    if header.single_file {
        build(&header, source.bytes.clone(), run)
    } else {
        build(&header, image_beside(source)?, run)
    }
}

/// The first bytes, decompressed where need be.
fn head(bytes: &Bytes, run: &Run) -> Result<Vec<u8>, ReadError> {
    if bytes.starts_with(inflate::MAGIC) {
        let mut gunzip = Gunzip::new(FORMAT, bytes);
        gunzip.fill(HEADER_MAX, run)?;
        return Ok(gunzip.bytes().to_vec());
    }
    Ok(bytes[..bytes.len().min(HEADER_MAX)].to_vec())
}

/// The volume that `header` describes, of the bytes that hold its samples.
fn build(header: &Header, bytes: Bytes, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    let layout = Layout::packed(header.stored, header.big_endian, header.offset, header.dims)
        .and_then(|layout| Some((layout, layout.end()?)));
    let Some((layout, end)) = layout else {
        let [x, y, z] = header.dims;
        let fact = format!("{x} x {y} x {z} samples are more than this machine can address");
        return Err(ReadError::malformed(FORMAT, At::Byte(header.dims_at), fact));
    };
    let bytes = if bytes.starts_with(inflate::MAGIC) {
        let whole = header.volumes == 1;
        Gunzip::new(FORMAT, &bytes).finish(end, whole, run)?.into()
    } else {
        bytes
    };
    let mut volume = MappedVolume::new(FORMAT, bytes, layout, run)?;
    volume.placement = sound_placement(header.placement, run);
    if header.volumes > 1 {
        let text = format!("the file holds {} volumes: the first was read", header.volumes);
        run.finding(Finding::warning("first-of-4d", text).of(header.volumes as u64));
    }
    Ok(match header.scaling {
        Some(scaling) if !matches!(header.stored, Stored::Rgb | Stored::Rgba) => {
            Box::new(volume.scaled(scaling))
        }
        _ => Box::new(volume),
    })
}

/// The header of a pair, where the image was given.
fn header_beside(source: &Source) -> Result<Option<Bytes>, ReadError> {
    let name = file_name(source);
    match pair_stem(&name, "img") {
        Some(stem) => beside(source, stem, "hdr").map(Some),
        None => Ok(None),
    }
}

/// The image of a pair, where the header was given.
fn image_beside(source: &Source) -> Result<Bytes, ReadError> {
    let name = file_name(source);
    match pair_stem(&name, "hdr") {
        Some(stem) => beside(source, stem, "img"),
        None => {
            let fact = "the samples lie in an .img file beside the header, but this is no .hdr";
            Err(ReadError::malformed(FORMAT, At::File, fact))
        }
    }
}

fn file_name(source: &Source) -> String {
    source.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The name without `.ending` or `.ending.gz`.
fn pair_stem<'a>(name: &'a str, ending: &str) -> Option<&'a str> {
    let strip = |name: &'a str, ending: &str| {
        let (stem, last) = name.rsplit_once('.')?;
        last.eq_ignore_ascii_case(ending).then_some(stem)
    };
    strip(strip(name, "gz").unwrap_or(name), ending)
}

/// Opens the other file of a pair.
fn beside(source: &Source, stem: &str, ending: &str) -> Result<Bytes, ReadError> {
    let upper = ending.to_ascii_uppercase();
    for ending in [ending, &upper] {
        for gz in ["", ".gz"] {
            match source.files.open(&format!("{stem}.{ending}{gz}")) {
                Err(ReadError::Io { source, .. })
                    if source.kind() == std::io::ErrorKind::NotFound => {}
                found => return found,
            }
        }
    }
    let fact = format!("the pair is not whole: there is no {stem}.{ending} beside the file");
    Err(ReadError::malformed(FORMAT, At::File, fact))
}

/// Writes one `.nii` file: NIfTI-1, or NIfTI-2 where more than 32767 samples lie along an axis.
pub fn write(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    write_to(volume, sink.out, run)
}

/// Writes the same, compressed.
pub fn write_gz(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    let mut encoder = GzEncoder::new(&mut *sink.out, Compression::default());
    write_to(volume, &mut encoder, run)?;
    encoder.finish().map_err(lost)?;
    Ok(())
}

fn write_to(volume: &dyn Volume, out: &mut dyn Write, run: &Run) -> Result<(), WriteError> {
    out.write_all(&header::encode(volume)).map_err(lost)?;
    slabs::write_samples(volume, out, run)
}

/// The code of a datatype.
fn code(scalar: ScalarType) -> u16 {
    match scalar {
        ScalarType::U8 => 2,
        ScalarType::I16 => 4,
        ScalarType::I32 => 8,
        ScalarType::F32 => 16,
        ScalarType::F64 => 64,
        ScalarType::I8 => 256,
        ScalarType::U16 => 512,
        ScalarType::U32 => 768,
    }
}

/// What the code of a datatype stands for, or its name where it is not read.
fn stored(code: u16) -> Result<Stored, &'static str> {
    if let Some(scalar) = ScalarType::ALL.into_iter().find(|&s| self::code(s) == code) {
        return Ok(Stored::Scalar(scalar));
    }
    match code {
        128 => Ok(Stored::Rgb),
        1024 => Ok(Stored::I64),
        1280 => Ok(Stored::U64),
        2304 => Ok(Stored::Rgba),
        1 => Err("single bits"),
        32 | 1792 | 2048 => Err("complex numbers"),
        1536 => Err("128-bit floating point"),
        _ => Err("unknown"),
    }
}

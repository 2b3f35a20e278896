//! NRRD: `.nrrd` with the samples behind the header, `.nhdr` with the samples in other files.
//!
//! World coordinates are made RAS (x to the right, y to the front, z up), as in NIfTI: of a file
//! in LPS the first two coordinates change sign, of one in LAS the first. Unnamed and scanner
//! spaces stay as they are. The named spaces of patients are in millimetres unless `space units`
//! says otherwise, by the convention of the programs that write them.
//!
//! Axes that are not of space (kinds `list`, `vector`, `time`, directions of `none`) and axes
//! beyond the third are taken for several volumes, of which the first is read; a fastest axis of
//! `RGB-color` is read as luminance. The `Segment` keys of segmentations become labels.
//!
//! Written are samples behind the header, gzip for binary and label volumes, else raw; a binary
//! volume is marked by the key `octofold_binary`.
//! Source: "Definition of NRRD File Format", Teem 1.9.

mod data;
mod header;
mod segments;

use crate::mapped::{Layout, MappedVolume, Stored, sound_placement};
use crate::slabs::{self, lost};
use crate::{At, ReadError, Sink, Source, WriteError};
use flate2::{Compression, write::GzEncoder};
use header::Header;
use octofold::volume::ScalarType;
use octofold::{Finding, LengthUnit, Run, Volume};
use std::fmt::Write;

const FORMAT: &str = "nrrd";

/// The key that tells that all samples are 0 or 1.
const BINARY_KEY: &str = "octofold_binary";

/// Reads the first volume.
pub fn read(source: &Source, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    let mut header = Header::parse(&source.bytes)?;
    let axes = header.axes();
    let is_u8 = header.stored == Stored::Scalar(ScalarType::U8);
    if is_u8 && header.pairs.iter().any(|(key, value)| key == BINARY_KEY && value == "1") {
        header.stored = Stored::Bool;
    }
    let too_large = || {
        let fact = format!("sizes of {:?} are more than this machine can address", header.sizes);
        ReadError::malformed(FORMAT, At::Line(header.sizes_line), fact)
    };
    let mut strides = Vec::with_capacity(header.sizes.len());
    let mut total = header.stored.size();
    for &size in &header.sizes {
        strides.push(total);
        total = total.checked_mul(size).ok_or_else(too_large)?;
    }
    let mut dims = [1; 3];
    let mut steps = [header.stored.size(); 3];
    for slot in 0..3 {
        match axes.get(slot) {
            Some(&axis) => (dims[slot], steps[slot]) = (header.sizes[axis], strides[axis]),
            None if slot > 0 => steps[slot] = steps[slot - 1] * dims[slot - 1],
            None => {}
        }
    }
    let volumes: usize =
        (0..header.sizes.len()).filter(|a| !axes.contains(a)).map(|a| header.sizes[a]).product();
    let colours = if is_u8 { header.colour_axis(&axes) } else { None };
    let stored = colours.unwrap_or(header.stored);
    let big_endian =
        if header.encoding.is_text() { cfg!(target_endian = "big") } else { header.big_endian };
    let layout = Layout { stored, big_endian, offset: 0, dims, strides: steps };
    let needed = layout.end().unwrap_or(total);
    let samples = data::load(&header, source, needed, total, run)?;
    let layout = Layout { offset: samples.offset, ..layout };
    let mut volume = MappedVolume::new(FORMAT, samples.bytes, layout, run)?;
    if volumes > 1 && colours.is_none() {
        let text = format!("the file holds {volumes} volumes: the first was read");
        run.finding(Finding::warning("first-of-4d", text).of(volumes as u64));
    }
    volume.placement = sound_placement(header.placement(&axes), run);
    volume.labels = segments::labels(&header.pairs);
    Ok(Box::new(volume))
}

/// Writes header and samples into one file.
pub fn write(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    let compress = volume.is_binary() || !volume.labels().is_empty();
    let header = encode(volume, if compress { "gzip" } else { "raw" });
    sink.out.write_all(header.as_bytes()).map_err(lost)?;
    if compress {
        let mut encoder = GzEncoder::new(&mut *sink.out, Compression::default());
        slabs::write_samples(volume, &mut encoder, run)?;
        encoder.finish().map_err(lost)?;
        Ok(())
    } else {
        slabs::write_samples(volume, sink.out, run)
    }
}

fn encode(volume: &dyn Volume, encoding: &str) -> String {
    let [x, y, z] = volume.dims();
    let placement = volume.placement();
    let scalar = match volume.scalar_type() {
        ScalarType::U8 => "unsigned char",
        ScalarType::I8 => "signed char",
        ScalarType::U16 => "unsigned short",
        ScalarType::I16 => "short",
        ScalarType::U32 => "unsigned int",
        ScalarType::I32 => "int",
        ScalarType::F32 => "float",
        ScalarType::F64 => "double",
    };
    // An empty unit says that it is unknown; none at all would mean millimetres.
    let unit = match placement.unit {
        None => "",
        Some(LengthUnit::Micrometre) => "um",
        Some(LengthUnit::Millimetre) => "mm",
        Some(LengthUnit::Centimetre) => "cm",
        Some(LengthUnit::Inch) => "in",
        Some(LengthUnit::Foot) => "ft",
        Some(LengthUnit::Metre) => "m",
    };
    let vector = |[x, y, z]: [f64; 3]| format!("({x:?},{y:?},{z:?})");
    let directions = placement.axes.map(vector).join(" ");
    let origin = vector(placement.origin);
    let mut text = format!(
        "NRRD0004\ntype: {scalar}\ndimension: 3\nspace: right-anterior-superior\n\
         sizes: {x} {y} {z}\nspace directions: {directions}\nkinds: domain domain domain\n\
         endian: little\nencoding: {encoding}\nspace origin: {origin}\n\
         space units: \"{unit}\" \"{unit}\" \"{unit}\"\n"
    );
    if volume.is_binary() {
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{BINARY_KEY}:=1");
    }
    segments::write(volume.labels(), &mut text);
    // Raw samples start at a multiple of eight bytes, so that they can be used where they lie.
    let length = text.len() + "#\n\n".len();
    let padding = length.next_multiple_of(8) - length;
    let _ = write!(text, "#{:padding$}\n\n", "");
    text
}

//! NumPy's `.npy`: one array of numbers.
//!
//! In C order the last axis is x, in Fortran order the first, so that x is always the fastest.
//! A fourth axis is taken for a sequence of volumes, of which the first is read; an array of two
//! axes is one slice. Versions 1 to 3 of the format as in NumPy's `numpy.lib.format`.
//!
//! The header is read here and not by a crate, because it is three keys, because the samples are
//! to stay in the mapped file, and because a full parser of Python literals recurses as deep as a
//! hostile header nests.

use crate::mapped::{Layout, MappedVolume, Stored};
use crate::slabs::{self, lost};
use crate::{At, ReadError, Sink, Source, WriteError};
use octofold::volume::ScalarType;
use octofold::{Finding, Run, Volume};

const FORMAT: &str = "npy";

/// Reads the array as a volume, straight from the file.
pub fn read(source: &Source, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    let bytes = &source.bytes;
    let (text, offset) = header_text(bytes)?;
    let header = Header::parse(text)?;
    let (dims, volumes) = header.dims()?;
    let layout = Layout::packed(header.stored, header.big_endian, offset, dims)
        .ok_or_else(|| malformed(format!("the shape {:?} is too large", header.shape)))?;
    let volume = MappedVolume::new(FORMAT, source.bytes.clone(), layout, run)?;
    if volumes > 1 {
        let text = format!("the array holds {volumes} volumes: the first was read");
        run.finding(Finding::warning("first-of-4d", text).of(volumes as u64));
    } else if let Some(rest) = layout.end().and_then(|end| bytes.len().checked_sub(end))
        && rest > 0
    {
        let text = format!("{rest} bytes follow the array");
        run.finding(Finding::note("trailing-data", text).of(rest as u64));
    }
    Ok(Box::new(volume))
}

/// Writes an array of shape (z, y, x) in C order; binary volumes as `bool`, one byte 0 or 1 each.
pub fn write(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    slabs::tell_of_lost_placement(FORMAT, volume, run);
    let descr = match volume.scalar_type() {
        _ if volume.is_binary() => "|b1",
        ScalarType::U8 => "|u1",
        ScalarType::I8 => "|i1",
        ScalarType::U16 => "<u2",
        ScalarType::I16 => "<i2",
        ScalarType::U32 => "<u4",
        ScalarType::I32 => "<i4",
        ScalarType::F32 => "<f4",
        ScalarType::F64 => "<f8",
    };
    let [x, y, z] = volume.dims();
    let mut text =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({z}, {y}, {x}), }}");
    // The samples start at a multiple of 64 bytes, so that they can be mapped.
    let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
    text.extend(std::iter::repeat_n(' ', length - 1 - text.len()));
    text.push('\n');
    sink.out.write_all(b"\x93NUMPY\x01\x00").map_err(lost)?;
    sink.out.write_all(&(length as u16).to_le_bytes()).map_err(lost)?;
    sink.out.write_all(text.as_bytes()).map_err(lost)?;
    slabs::write_samples(volume, sink.out, run)
}

fn malformed(fact: impl Into<String>) -> ReadError {
    ReadError::malformed(FORMAT, At::File, fact)
}

/// The text of the header, and where the samples start.
fn header_text(bytes: &[u8]) -> Result<(&str, usize), ReadError> {
    let cut_off = || malformed("the header is cut off");
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(malformed("the file does not begin with \\x93NUMPY"));
    }
    let (start, length) = match *bytes.get(6..).ok_or_else(cut_off)? {
        [1, _, a, b, ..] => (10, usize::from(u16::from_le_bytes([a, b]))),
        [2 | 3, _, a, b, c, d, ..] => (12, u32::from_le_bytes([a, b, c, d]) as usize),
        [1..=3, ..] | [] => return Err(cut_off()),
        [version, ..] => {
            let fact = format!("version {version} of the format is not known here");
            return Err(ReadError::unsupported(FORMAT, fact));
        }
    };
    let end = start + length;
    let text = bytes.get(start..end).ok_or_else(cut_off)?;
    let text = std::str::from_utf8(text).map_err(|e| {
        let at = At::Byte((start + e.valid_up_to()) as u64);
        ReadError::malformed(FORMAT, at, "the header is not text")
    })?;
    Ok((text, end))
}

struct Header {
    stored: Stored,
    big_endian: bool,
    fortran_order: bool,
    shape: Vec<usize>,
}

impl Header {
    /// Reads the Python dictionary `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }`.
    fn parse(text: &str) -> Result<Self, ReadError> {
        let value = |key: &str| {
            ['\'', '"'].iter().find_map(|quote| {
                let (_, after) = text.split_once(&format!("{quote}{key}{quote}"))?;
                Some(after.trim_start().strip_prefix(':')?.trim_start())
            })
        };
        let missing = |key| malformed(format!("the header has no {key}"));
        let descr = value("descr").ok_or_else(|| missing("descr"))?;
        let descr = descr
            .strip_prefix(['\'', '"'])
            .and_then(|rest| rest.split(['\'', '"']).next())
            .ok_or_else(|| ReadError::unsupported(FORMAT, "records are no samples of a volume"))?;
        let order = value("fortran_order").ok_or_else(|| missing("fortran_order"))?;
        let shape = value("shape")
            .and_then(|rest| rest.strip_prefix(['(', '[']))
            .and_then(|rest| rest.split([')', ']']).next())
            .ok_or_else(|| missing("shape"))?;
        let shape = shape
            .split(',')
            .map(|n| n.trim().trim_end_matches('L'))
            .filter(|n| !n.is_empty())
            .map(|n| n.parse().map_err(|_| malformed(format!("the shape names {n:?} samples"))))
            .collect::<Result<Vec<usize>, _>>()?;
        let stored = match descr.trim_start_matches(['<', '>', '|', '=']) {
            "b1" | "?" => Stored::Bool,
            "u1" => Stored::Scalar(ScalarType::U8),
            "i1" => Stored::Scalar(ScalarType::I8),
            "u2" => Stored::Scalar(ScalarType::U16),
            "i2" => Stored::Scalar(ScalarType::I16),
            "u4" => Stored::Scalar(ScalarType::U32),
            "i4" => Stored::Scalar(ScalarType::I32),
            "u8" => Stored::U64,
            "i8" => Stored::I64,
            "f2" => Stored::F16,
            "f4" => Stored::Scalar(ScalarType::F32),
            "f8" => Stored::Scalar(ScalarType::F64),
            _ => {
                let fact = format!(
                    "samples of type {descr:?} are not read: save whole or real numbers of up to \
                     64 bits"
                );
                return Err(ReadError::unsupported(FORMAT, fact));
            }
        };
        Ok(Self {
            stored,
            big_endian: descr.starts_with('>'),
            fortran_order: order.starts_with("True"),
            shape,
        })
    }

    /// Samples along x, y, z of the first volume, and the number of volumes.
    fn dims(&self) -> Result<([usize; 3], usize), ReadError> {
        let mut fastest_first = self.shape.clone();
        if !self.fortran_order {
            fastest_first.reverse();
        }
        match *fastest_first {
            [x, y] => Ok(([x, y, 1], 1)),
            [x, y, z] => Ok(([x, y, z], 1)),
            [x, y, z, n] => Ok(([x, y, z], n)),
            _ => {
                let fact = format!(
                    "an array of {} axes is no volume: save one of three",
                    fastest_first.len()
                );
                Err(ReadError::unsupported(FORMAT, fact))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use octofold::volume::{Block, Region};

    fn npy(version: u8, header: &str, data: &[u8]) -> Source {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        let length = header.len() as u32;
        bytes.extend(&length.to_le_bytes()[..if version == 1 { 2 } else { 4 }]);
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        Source::from_bytes("x.npy", bytes)
    }

    fn samples(source: &Source) -> ([usize; 3], Block<'static>) {
        let volume = read(source, &Run::default()).unwrap();
        let block = volume.read(Region::all(volume.dims())).unwrap();
        let owned = octofold::with_samples!(block, s => {
            octofold::volume::Scalar::block(s.into_owned().into())
        });
        (volume.dims(), owned)
    }

    #[test]
    fn both_orders_put_x_first() {
        let c = "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 2, 3), }\n";
        let f = "{\"shape\": (3, 2, 1), \"fortran_order\": True, \"descr\": \"|u1\"}";
        let expected = ([3, 2, 1], Block::U8(vec![1, 2, 3, 4, 5, 6].into()));
        assert_eq!(samples(&npy(1, c, &[1, 2, 3, 4, 5, 6])), expected);
        assert_eq!(samples(&npy(3, f, &[1, 2, 3, 4, 5, 6])), expected);
    }

    #[test]
    fn bool_is_binary_and_two_axes_are_a_slice() {
        let source =
            npy(2, "{'descr': '|b1', 'fortran_order': False, 'shape': (2L, 2L)}", &[0, 1, 7, 0]);
        assert!(read(&source, &Run::default()).unwrap().is_binary());
        assert_eq!(samples(&source), ([2, 2, 1], Block::U8(vec![0, 1, 1, 0].into())));
    }

    #[test]
    fn foreign_arrays_are_refused_in_words() {
        for (header, says) in [
            ("{'descr': '<c8', 'fortran_order': False, 'shape': (1, 1, 1)}", "<c8"),
            ("{'descr': 'é', 'fortran_order': False, 'shape': (1, 1, 1)}", "é"),
            ("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1,)}", "records"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (5,)}", "1 axes"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 1, 1)}", "-1"),
            ("{'descr': '<f4', 'fortran_order': False}", "no shape"),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (9, 9, 9)}", "end at byte"),
        ] {
            let error = read(&npy(1, header, &[0; 8]), &Run::default()).err().unwrap();
            assert!(error.to_string().contains(says), "{error}");
        }
    }
}

//! The values behind the head of a PLY file, one after another, in any of its three encodings.

use super::FORMAT;
use super::header::{Encoding, Header, Scalar};
use crate::text::{Words, leading_number, name, number};
use crate::{At, ReadError};

/// A cursor over values. All types fit an `f64`, but for 64-bit integers beyond 2^53, which no
/// property that matters here has.
pub(super) enum Values<'a> {
    Ascii(Words<'a>),
    Binary { bytes: &'a [u8], at: usize, big_endian: bool },
}

impl<'a> Values<'a> {
    pub(super) fn new(bytes: &'a [u8], header: &Header) -> Self {
        match header.encoding {
            Encoding::Ascii => {
                let mut words = Words::new(&bytes[header.end..], None);
                words.line = header.lines + 1;
                Self::Ascii(words)
            }
            encoding => {
                let big_endian = encoding == Encoding::BigEndian;
                Self::Binary { bytes, at: header.end, big_endian }
            }
        }
    }

    /// Bytes that are left.
    pub(super) fn left(&self) -> u64 {
        match self {
            Self::Ascii(words) => words.left() as u64,
            Self::Binary { bytes, at, .. } => (bytes.len() - at) as u64,
        }
    }

    /// Where the next value stands, or the last one in ASCII.
    pub(super) fn place(&self) -> At {
        match self {
            Self::Ascii(words) => At::Line(words.line),
            Self::Binary { at, .. } => At::Byte(*at as u64),
        }
    }

    /// The next value.
    pub(super) fn next(&mut self, scalar: Scalar) -> Result<f64, ReadError> {
        match self {
            Self::Ascii(words) => {
                let word = words.next().ok_or_else(|| ends(At::Line(words.line)))?;
                number(word).or_else(|| leading_number(word)).ok_or_else(|| {
                    let fact = format!("'{}' is not a number", name(word));
                    ReadError::malformed(FORMAT, At::Line(words.line), fact)
                })
            }
            Self::Binary { bytes, at, big_endian } => {
                let size = scalar.size();
                let Some(value) = bytes.get(*at..*at + size) else {
                    return Err(ends(At::Byte(bytes.len() as u64)));
                };
                *at += size;
                let mut raw = [0; 8];
                raw[..size].copy_from_slice(value);
                if *big_endian {
                    raw[..size].reverse();
                }
                Ok(decode(scalar, raw))
            }
        }
    }

    /// The count before a list, checked against what is left.
    pub(super) fn list(&mut self, count: Scalar, of: Scalar) -> Result<usize, ReadError> {
        let length = self.next(count)?;
        let least = match self {
            Self::Ascii(_) => 2,
            Self::Binary { .. } => of.size() as u64,
        };
        // The last value of an ASCII file needs no space behind it.
        if length < 0.0 || length.fract() != 0.0 || length * least as f64 > self.left() as f64 + 1.0
        {
            let fact = format!("a list of {length} values does not fit the file");
            return Err(ReadError::malformed(FORMAT, self.place(), fact));
        }
        Ok(length as usize)
    }

    /// Passes over `count` values.
    pub(super) fn skip(&mut self, count: usize, scalar: Scalar) -> Result<(), ReadError> {
        (0..count).try_for_each(|_| self.next(scalar).map(drop))
    }
}

/// A value from its little-endian bytes.
fn decode(scalar: Scalar, raw: [u8; 8]) -> f64 {
    let [a, b, c, d, ..] = raw;
    match scalar {
        Scalar::I8 => f64::from(a as i8),
        Scalar::U8 => f64::from(a),
        Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
        Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
        Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
        Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
        Scalar::I64 => i64::from_le_bytes(raw) as f64,
        Scalar::U64 => u64::from_le_bytes(raw) as f64,
        Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
        Scalar::F64 => f64::from_le_bytes(raw),
    }
}

fn ends(at: At) -> ReadError {
    ReadError::malformed(FORMAT, at, "the file ends before its last value")
}

//! The head of a PLY file: its encoding, and the elements and properties that follow.

use super::FORMAT;
use crate::text::{name, words};
use crate::{At, ReadError};

/// How values are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    fn of_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"int64" => Self::I64,
            b"uint64" => Self::U64,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a value.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Greatest value that stands for full strength in a colour.
    pub(super) fn full(self) -> f64 {
        match self {
            Self::F32 | Self::F64 => 1.0,
            Self::U16 => 65535.0,
            _ => 255.0,
        }
    }
}

/// A named value of an element, or a list of values with its own count.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) scalar: Scalar,
    /// Type of the count before a list.
    pub(super) list: Option<Scalar>,
}

/// A table of records.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Fewest bytes that a record takes; in ASCII a digit and a space for each value.
    pub(super) fn least(&self, encoding: Encoding) -> u64 {
        let least = |p: &Property| match encoding {
            Encoding::Ascii => 2,
            _ => p.list.unwrap_or(p.scalar).size() as u64,
        };
        self.properties.iter().map(least).sum()
    }
}

/// The head of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Images that `comment TextureFile` names, as MeshLab writes.
    pub(super) images: Vec<String>,
    /// Byte and line at which the values begin.
    pub(super) end: usize,
    pub(super) lines: u64,
}

impl Header {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, ReadError> {
        let ending: &[u8] = match bytes {
            [b'p', b'l', b'y', b'\r', b'\n', ..] => b"\r\n",
            [b'p', b'l', b'y', b'\r', ..] => b"\r",
            [b'p', b'l', b'y', b'\n', ..] => b"\n",
            _ => {
                let fact = "it does not begin with a line 'ply'";
                return Err(ReadError::malformed(FORMAT, At::Line(1), fact));
            }
        };
        let mut header = Self {
            encoding: Encoding::Ascii,
            elements: Vec::new(),
            images: Vec::new(),
            end: 0,
            lines: 0,
        };
        let mut encoding = None;
        loop {
            let rest = &bytes[header.end..];
            let Some(length) = rest.windows(ending.len()).position(|w| w == ending) else {
                let fact = "the file ends in its header";
                return Err(ReadError::malformed(FORMAT, At::Line(header.lines + 1), fact));
            };
            header.end += length + ending.len();
            header.lines += 1;
            let line = rest[..length].trim_ascii();
            if line == b"end_header" {
                break;
            }
            header.line(line, &mut encoding)?;
        }
        header.encoding = encoding.ok_or_else(|| header.wrong("no line tells its format"))?;
        Ok(header)
    }

    fn line(&mut self, line: &[u8], encoding: &mut Option<Encoding>) -> Result<(), ReadError> {
        let parts: Vec<_> = words(line).collect();
        match parts[..] {
            [] | [b"ply" | b"obj_info", ..] => {}
            [b"comment", b"TextureFile", ..] => {
                let text = name(line);
                let image = text.split_once("TextureFile").map_or("", |(_, image)| image);
                self.images.push(image.trim().into());
            }
            [b"comment", ..] => {}
            [b"format", kind, ..] => {
                *encoding = Some(match kind {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::LittleEndian,
                    b"binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(self.wrong(&format!("'{}' is no format", name(kind)))),
                });
            }
            [b"element", title, count] => {
                let count = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok());
                let Some(count) = count else {
                    return Err(self.wrong(&format!("'{}' has no whole count", name(line))));
                };
                self.elements.push(Element { name: name(title), count, properties: Vec::new() });
            }
            [b"property", b"list", count, scalar, title] => {
                let list = Some(self.scalar(count)?);
                self.property(title, scalar, list)?;
            }
            [b"property", scalar, title] => self.property(title, scalar, None)?,
            _ => return Err(self.wrong(&format!("'{}' is no line of a header", name(line)))),
        }
        Ok(())
    }

    fn property(
        &mut self,
        title: &[u8],
        scalar: &[u8],
        list: Option<Scalar>,
    ) -> Result<(), ReadError> {
        let scalar = self.scalar(scalar)?;
        if matches!(list, Some(Scalar::F32 | Scalar::F64)) {
            return Err(self.wrong("a list is counted in fractions"));
        }
        let wrong = self.wrong("a property stands before the first element");
        let element = self.elements.last_mut().ok_or(wrong)?;
        element.properties.push(Property { name: name(title), scalar, list });
        Ok(())
    }

    fn scalar(&self, word: &[u8]) -> Result<Scalar, ReadError> {
        Scalar::of_name(word)
            .ok_or_else(|| self.wrong(&format!("'{}' is no type of a property", name(word))))
    }

    fn wrong(&self, fact: &str) -> ReadError {
        ReadError::malformed(FORMAT, At::Line(self.lines), fact)
    }
}

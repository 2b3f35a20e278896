//! Buffers and the accessors into them. Every range is checked before a byte is read.

use super::{FORMAT, malformed};
use crate::budget::Budget;
use crate::{At, Bytes, Files, ReadError};
use ::gltf::json;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use json::accessor::{Accessor, ComponentType, Type};
use json::validation::Checked;
use json::{Index, Root};
use std::borrow::Cow;

/// All buffers of a file, and what may still be read out of them.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    data: Vec<Result<Data<'a>, String>>,
    pub(super) budget: Budget,
}

enum Data<'a> {
    Chunk(&'a [u8]),
    Own(Bytes),
}

impl std::ops::Deref for Data<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::Own(bytes) => bytes,
        }
    }
}

/// Tightly packed elements of an accessor.
struct Elements<'a> {
    bytes: Cow<'a, [u8]>,
    component: ComponentType,
    width: usize,
    normalized: bool,
}

impl<'a> Buffers<'a> {
    /// Opens all buffers; one that is missing is an error only for those who read it.
    pub(super) fn open(
        root: &'a Root,
        chunk: Option<&'a [u8]>,
        files: &dyn Files,
        budget: Budget,
    ) -> Self {
        let data = root.buffers.iter().enumerate().map(|(i, buffer)| match &buffer.uri {
            Some(uri) => resolve(uri, files).map(Data::Own).map_err(|e| format!("buffer {i}: {e}")),
            None => chunk
                .filter(|_| i == 0)
                .map(Data::Chunk)
                .ok_or_else(|| format!("buffer {i} has no data")),
        });
        Self { root, data: data.collect(), budget }
    }

    /// Values of an accessor with one of these numbers of components, as fractions of one where
    /// it says so.
    pub(super) fn floats(
        &mut self,
        accessor: Index<Accessor>,
        widths: &[usize],
        place: &str,
    ) -> Result<Vec<f32>, ReadError> {
        let elements = self.elements(accessor, place)?;
        if !widths.contains(&elements.width) {
            let fact = format!("accessor {} has the wrong type for {place}", accessor.value());
            return Err(malformed(fact));
        }
        Ok(elements.floats())
    }

    /// Values of an accessor of indices.
    pub(super) fn integers(
        &mut self,
        accessor: Index<Accessor>,
        place: &str,
    ) -> Result<Vec<u32>, ReadError> {
        let elements = self.elements(accessor, place)?;
        let bytes = &elements.bytes;
        match (elements.component, elements.width) {
            (ComponentType::U8, 1) => Ok(bytes.iter().map(|&b| u32::from(b)).collect()),
            (ComponentType::U16, 1) => {
                let words = bytes.as_chunks().0.iter();
                Ok(words.map(|&b| u32::from(u16::from_le_bytes(b))).collect())
            }
            (ComponentType::U32, 1) => {
                Ok(bytes.as_chunks().0.iter().map(|&b| u32::from_le_bytes(b)).collect())
            }
            _ => {
                let fact = format!("accessor {} of {place} holds no indices", accessor.value());
                Err(malformed(fact))
            }
        }
    }

    /// Components of an accessor; one where it is not there.
    pub(super) fn width(&self, accessor: Index<Accessor>) -> usize {
        self.root.get(accessor).and_then(|a| width(&a.type_)).unwrap_or(1)
    }

    /// Bytes of a buffer view and the distance of its elements.
    pub(super) fn view(
        &self,
        view: Index<json::buffer::View>,
    ) -> Result<(&[u8], Option<usize>), ReadError> {
        let number = view.value();
        let Some(view) = self.root.get(view) else {
            return Err(malformed(format!("buffer view {number} is not there")));
        };
        let buffer = match self.data.get(view.buffer.value()) {
            Some(Ok(buffer)) => buffer,
            Some(Err(fact)) => return Err(malformed(fact.clone())),
            None => {
                let fact = format!("buffer {} of view {number} is not there", view.buffer.value());
                return Err(malformed(fact));
            }
        };
        let bytes = part(buffer, view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let bytes = bytes.ok_or_else(|| {
            let fact =
                format!("buffer view {number} ends behind its buffer of {} bytes", buffer.len());
            malformed(fact)
        })?;
        Ok((bytes, view.byte_stride.map(|s| s.0)))
    }

    fn elements(
        &mut self,
        accessor: Index<Accessor>,
        place: &str,
    ) -> Result<Elements<'_>, ReadError> {
        let number = accessor.value();
        let Some(accessor) = self.root.get(accessor) else {
            return Err(malformed(format!("accessor {number} of {place} is not there")));
        };
        let (Checked::Valid(component), Some(width)) =
            (accessor.component_type, width(&accessor.type_))
        else {
            return Err(malformed(format!("accessor {number} of {place} has an unknown type")));
        };
        let component = component.0;
        let size = component.size() * width;
        let count = accessor.count.0;
        // Accessors may share bytes or have none, so that their count alone bounds nothing.
        self.budget.spend(count)?;
        let count = count as usize;
        let short =
            || malformed(format!("accessor {number} of {place} ends behind its buffer view"));
        let mut bytes = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = self.view(view)?;
                let stride = stride.unwrap_or(size);
                let offset = accessor.byte_offset.unwrap_or_default().0;
                strided(bytes, offset, stride, size, count).ok_or_else(short)?
            }
            None => Cow::Owned(vec![0; count * size]),
        };
        if let Some(sparse) = &accessor.sparse {
            let Checked::Valid(kind) = sparse.indices.component_type else {
                return Err(malformed(format!("accessor {number} has no sparse indices")));
            };
            let index_size = kind.0.size();
            let changes = usize::try_from(sparse.count.0).map_err(|_| short())?;
            let (indices, _) = self.view(sparse.indices.buffer_view)?;
            let indices =
                strided(indices, sparse.indices.byte_offset.0, index_size, index_size, changes);
            let (values, _) = self.view(sparse.values.buffer_view)?;
            let values = strided(values, sparse.values.byte_offset.0, size, size, changes);
            let (Some(indices), Some(values)) = (indices, values) else { return Err(short()) };
            let bytes = bytes.to_mut();
            for (index, value) in indices.chunks_exact(index_size).zip(values.chunks_exact(size)) {
                let index = index.iter().rev().fold(0, |sum, &b| sum << 8 | usize::from(b));
                let target = index.checked_mul(size).and_then(|at| bytes.get_mut(at..at + size));
                let Some(target) = target else {
                    let fact = format!("accessor {number} changes element {index} of {count}");
                    return Err(malformed(fact));
                };
                target.copy_from_slice(value);
            }
        }
        Ok(Elements { bytes, component, width, normalized: accessor.normalized })
    }
}

impl Elements<'_> {
    fn floats(&self) -> Vec<f32> {
        let bytes = &self.bytes;
        let scaled = |full: f32| {
            let full = if self.normalized { full } else { 1.0 };
            // The most negative value stands for -1, too.
            move |x: f32| if full == 1.0 { x } else { (x / full).max(-1.0) }
        };
        let bytewise = scaled(if self.component == ComponentType::I8 { 127.0 } else { 255.0 });
        let words = bytes.as_chunks().0.iter();
        let wordwise = scaled(if self.component == ComponentType::I16 { 32767.0 } else { 65535.0 });
        let fours = bytes.as_chunks().0.iter();
        match self.component {
            ComponentType::I8 => bytes.iter().map(|&b| bytewise(f32::from(b as i8))).collect(),
            ComponentType::U8 => bytes.iter().map(|&b| bytewise(f32::from(b))).collect(),
            ComponentType::I16 => {
                words.map(|&b| wordwise(f32::from(i16::from_le_bytes(b)))).collect()
            }
            ComponentType::U16 => {
                words.map(|&b| wordwise(f32::from(u16::from_le_bytes(b)))).collect()
            }
            ComponentType::U32 => fours.map(|&b| u32::from_le_bytes(b) as f32).collect(),
            ComponentType::F32 => fours.map(|&b| f32::from_le_bytes(b)).collect(),
        }
    }
}

fn width(kind: &Checked<Type>) -> Option<usize> {
    match kind {
        Checked::Valid(Type::Scalar) => Some(1),
        Checked::Valid(Type::Vec2) => Some(2),
        Checked::Valid(Type::Vec3) => Some(3),
        Checked::Valid(Type::Vec4) => Some(4),
        _ => None,
    }
}

/// `length` bytes from `offset`.
fn part(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(usize::try_from(offset).ok()?..end)
}

/// `count` elements of `size` bytes, `stride` apart, without the gaps.
fn strided(
    bytes: &[u8],
    offset: u64,
    stride: usize,
    size: usize,
    count: usize,
) -> Option<Cow<'_, [u8]>> {
    if count == 0 {
        return Some(Cow::Borrowed(&[]));
    }
    if stride < size {
        return None;
    }
    let length = stride.checked_mul(count - 1)?.checked_add(size)?;
    let bytes = part(bytes, offset, length as u64)?;
    if stride == size {
        return Some(Cow::Borrowed(bytes));
    }
    Some(Cow::Owned(bytes.chunks(stride).flat_map(|c| &c[..size]).copied().collect()))
}

/// What a URI names: data within itself, or a file beside.
pub(super) fn resolve(uri: &str, files: &dyn Files) -> Result<Bytes, ReadError> {
    const BASE64: GeneralPurpose = GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        GeneralPurposeConfig::new()
            .with_decode_padding_mode(DecodePaddingMode::Indifferent)
            .with_decode_allow_trailing_bits(true),
    );
    let Some(data) = uri.strip_prefix("data:") else {
        let name = percent_decoded(uri);
        return files.open(&String::from_utf8_lossy(&name)).or_else(|error| {
            // Some writers do not encode their file names.
            files.open(uri).map_err(|_| error)
        });
    };
    let Some((kind, data)) = data.split_once(',') else {
        return Err(ReadError::malformed(FORMAT, At::File, "a data URI has no comma"));
    };
    if kind.ends_with(";base64") {
        BASE64
            .decode(data.trim())
            .map(Bytes::from)
            .map_err(|error| malformed(format!("a data URI is not base64: {error}")))
    } else {
        Ok(percent_decoded(data).into())
    }
}

fn percent_decoded(text: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, after @ ..] = rest {
        let code = after.get(..2).filter(|_| *first == b'%');
        let code = code.and_then(|c| std::str::from_utf8(c).ok());
        match code.and_then(|c| u8::from_str_radix(c, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NoFiles;

    #[test]
    fn ranges_are_checked_without_overflow() {
        let bytes = [1, 2, 3, 4, 5, 6];
        assert_eq!(strided(&bytes, 0, 4, 2, 2).as_deref(), Some(&[1, 2, 5, 6][..]));
        assert_eq!(strided(&bytes, 1, 4, 2, 2), None);
        assert_eq!(strided(&bytes, u64::MAX, 4, 2, 2), None);
        assert_eq!(strided(&bytes, 0, 4, 2, usize::MAX), None);
        assert_eq!(strided(&bytes, 0, 1, 2, 1), None);
        assert_eq!(strided(&bytes, 99, 4, 2, 0).as_deref(), Some(&[][..]));
    }

    #[test]
    fn data_uris_hold_base64_or_text() {
        let read = |uri| resolve(uri, &NoFiles).map(|b| b.to_vec()).ok();
        assert_eq!(read("data:application/octet-stream;base64,AQI="), Some(vec![1, 2]));
        assert_eq!(read("data:;base64,AQI"), Some(vec![1, 2]));
        assert_eq!(read("data:,a%20b%"), Some(b"a b%".to_vec()));
        assert_eq!(read("data:;base64,?"), None);
        assert_eq!(read("data:nothing"), None);
        assert_eq!(read("a.bin"), None);
    }
}

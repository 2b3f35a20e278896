//! Chunks, and the small types inside them.

use super::FORMAT;
use crate::{At, ReadError};

/// Bytes that are taken from the front.
#[derive(Debug, Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    /// Where they lie in the file.
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// An error at this place.
    pub(super) fn malformed(&self, fact: impl Into<String>) -> ReadError {
        ReadError::malformed(FORMAT, At::Byte(self.at as u64), fact)
    }

    /// The next `count` bytes.
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], ReadError> {
        let Some((taken, rest)) = self.bytes.split_at_checked(count) else {
            let left = self.bytes.len();
            let fact = format!("{count} bytes should follow, but {left} are left: cut off");
            return Err(self.malformed(fact));
        };
        self.bytes = rest;
        self.at += count;
        Ok(taken)
    }

    pub(super) fn u32(&mut self) -> Result<u32, ReadError> {
        let mut bytes = [0; 4];
        bytes.copy_from_slice(self.take(4)?);
        Ok(u32::from_le_bytes(bytes))
    }

    /// The next `count` bytes as their own cursor.
    fn part(&mut self, count: u32) -> Result<Self, ReadError> {
        let at = self.at;
        Ok(Self { bytes: self.take(count as usize)?, at })
    }

    fn string(&mut self) -> Result<&'a [u8], ReadError> {
        let length = self.u32()?;
        self.take(length as usize)
    }

    /// The entries of a dictionary.
    pub(super) fn dict(&mut self) -> Result<Dict<'a>, ReadError> {
        let count = self.u32()?;
        let mut entries = Vec::new();
        for _ in 0..count {
            entries.push((self.string()?, self.string()?));
        }
        Ok(Dict(entries))
    }
}

/// Keys and values.
pub(super) struct Dict<'a>(Vec<(&'a [u8], &'a [u8])>);

impl<'a> Dict<'a> {
    pub(super) fn get(&self, key: &str) -> Option<&'a str> {
        let (_, value) = self.0.iter().find(|(k, _)| *k == key.as_bytes())?;
        std::str::from_utf8(value).ok()
    }
}

/// A named stretch of bytes, with chunks inside.
pub(super) struct Chunk<'a> {
    pub(super) id: [u8; 4],
    pub(super) content: Cursor<'a>,
    pub(super) children: Cursor<'a>,
}

impl<'a> Chunk<'a> {
    /// The chunk at the front.
    pub(super) fn next(cursor: &mut Cursor<'a>) -> Result<Self, ReadError> {
        let mut id = [0; 4];
        id.copy_from_slice(cursor.take(4)?);
        let (content, children) = (cursor.u32()?, cursor.u32()?);
        Ok(Self { id, content: cursor.part(content)?, children: cursor.part(children)? })
    }
}

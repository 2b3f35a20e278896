//! The GLB container: a head, one chunk of JSON, and at most one of binary data.

use super::FORMAT;
use crate::text::decoded;
use crate::{At, ReadError};
use std::borrow::Cow;

pub(super) const MAGIC: u32 = 0x4654_6c67;
pub(super) const JSON: u32 = 0x4e4f_534a;
pub(super) const BIN: u32 = 0x004e_4942;

/// The JSON, and the binary chunk that a GLB may have.
pub(super) type Parts<'a> = (Cow<'a, [u8]>, Option<&'a [u8]>);

/// Takes either form apart.
pub(super) fn split(bytes: &[u8]) -> Result<Parts<'_>, ReadError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((decoded(bytes), None));
    }
    let word = |at: usize| {
        let raw = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(raw))
    };
    let wrong = |at: usize, fact: String| ReadError::malformed(FORMAT, At::Byte(at as u64), fact);
    let ends = || wrong(bytes.len(), "the file ends inside its chunks".into());
    let version = word(4).ok_or_else(ends)?;
    if version != 2 {
        let fact = format!("glTF {version} is not read; save it as glTF 2.0");
        return Err(ReadError::unsupported(FORMAT, fact));
    }
    let (mut json, mut chunk) = (None, None);
    let mut at = 12;
    while json.is_none() || at < bytes.len() {
        // A few bytes behind the last chunk are padding.
        if json.is_some() && bytes.len() - at < 8 {
            break;
        }
        let (length, kind) = (word(at).ok_or_else(ends)?, word(at + 4).ok_or_else(ends)?);
        let body = (at + 8).checked_add(length as usize).and_then(|end| bytes.get(at + 8..end));
        let body = body.ok_or_else(ends)?;
        match kind {
            JSON if json.is_none() => json = Some(body),
            _ if json.is_none() => {
                return Err(wrong(at, "the first chunk is not JSON".into()));
            }
            BIN if chunk.is_none() => chunk = Some(body),
            _ => {}
        }
        at += 8 + body.len();
    }
    Ok((Cow::Borrowed(json.unwrap_or_default()), chunk))
}

/// A GLB from its JSON and binary data; its length is a multiple of eight, as 3D Tiles want it.
pub(super) fn join(json: &[u8], data: &[u8]) -> Option<Vec<u8>> {
    let padded = |length: usize| length.next_multiple_of(4);
    let head = 20 + if data.is_empty() { 0 } else { 8 + padded(data.len()) };
    let total = (head + padded(json.len())).next_multiple_of(8);
    let text = total - head;
    let total = u32::try_from(total).ok()?;
    let mut bytes = Vec::with_capacity(total as usize);
    bytes.extend([MAGIC, 2, total].map(u32::to_le_bytes).as_flattened());
    let mut chunk = |kind: u32, body: &[u8], length: usize, fill: u8| {
        bytes.extend([length as u32, kind].map(u32::to_le_bytes).as_flattened());
        bytes.extend(body);
        bytes.resize(bytes.len() + length - body.len(), fill);
    };
    chunk(JSON, json, text, b' ');
    if !data.is_empty() {
        chunk(BIN, data, padded(data.len()), 0);
    }
    Some(bytes)
}

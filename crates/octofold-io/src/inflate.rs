//! Gzip, decompressed no further than the reader asks for.
//!
//! A reader first takes what its header needs, then exactly what the header promises. A promise
//! that the compressed bytes cannot keep (deflate packs at most 1032 to 1) is refused before
//! anything is allocated for it.

use crate::{At, ReadError};
use flate2::bufread::GzDecoder;
use octofold::{Finding, Run};
use std::io::{ErrorKind, Read};

/// First bytes of every gzip member.
pub(crate) const MAGIC: &[u8] = &[0x1f, 0x8b];

/// The most bytes that deflate makes of one.
const MAX_RATIO: usize = 1032;

/// Bytes decompressed between two looks at the cancel flag.
const BLOCK: usize = 1 << 20;

/// Decompresses gzip of one or several members.
pub(crate) struct Gunzip<'a> {
    format: &'static str,
    /// Number of compressed bytes.
    total: usize,
    state: State<'a>,
    out: Vec<u8>,
}

enum State<'a> {
    /// Inside a member.
    Member(Box<GzDecoder<&'a [u8]>>),
    /// After the last member, with the bytes that follow it.
    Ended(&'a [u8]),
}

impl<'a> State<'a> {
    fn member(compressed: &'a [u8]) -> Self {
        Self::Member(Box::new(GzDecoder::new(compressed)))
    }
}

impl<'a> Gunzip<'a> {
    pub(crate) fn new(format: &'static str, compressed: &'a [u8]) -> Self {
        let state = State::member(compressed);
        Self { format, total: compressed.len(), state, out: Vec::new() }
    }

    /// Everything decompressed so far.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.out
    }

    /// Decompresses up to a total of `len` bytes; fewer where the data ends before.
    pub(crate) fn fill(&mut self, len: usize, run: &Run) -> Result<(), ReadError> {
        let missing = len.saturating_sub(self.out.len());
        // A few bits that are taken already may still wait in the decoder.
        if missing > self.rest().len().saturating_add(64).saturating_mul(MAX_RATIO) {
            let fact = format!(
                "the header promises {len} bytes, more than {} compressed bytes can hold",
                self.total
            );
            return Err(ReadError::malformed(self.format, At::File, fact));
        }
        self.out.reserve_exact(missing);
        while self.out.len() < len {
            run.check()?;
            run.progress(self.out.len() as u64, len as u64);
            if self.step(BLOCK.min(len - self.out.len()))? == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Decompresses exactly `len` bytes in total. Where `whole`, they should be all there is: the
    /// checksum is verified, and more data is told of.
    pub(crate) fn finish(
        mut self,
        len: usize,
        whole: bool,
        run: &Run,
    ) -> Result<Vec<u8>, ReadError> {
        self.fill(len, run)?;
        if self.out.len() < len {
            let fact = format!(
                "the compressed data ends after {} of {len} bytes: it is cut off, or the header \
                 is wrong",
                self.out.len()
            );
            return Err(ReadError::malformed(self.format, self.at(), fact));
        }
        if whole && (self.step(1)? > 0 || !self.rest().is_empty()) {
            let text = format!("there is more data than the {len} bytes of the header");
            run.finding(Finding::note("trailing-data", text));
        }
        self.out.truncate(len);
        Ok(self.out)
    }

    /// Decompresses up to `len` more bytes and says how many; 0 only at the end.
    fn step(&mut self, len: usize) -> Result<usize, ReadError> {
        while let State::Member(member) = &mut self.state {
            match member.take(len as u64).read_to_end(&mut self.out) {
                Ok(0) => {
                    let rest = *member.get_ref();
                    self.state = if rest.starts_with(MAGIC) {
                        State::member(rest)
                    } else {
                        State::Ended(rest)
                    };
                }
                Ok(got) => return Ok(got),
                Err(e) if e.kind() == ErrorKind::UnexpectedEof => {
                    let fact = format!(
                        "the compressed data is cut off after {} bytes of content",
                        self.out.len()
                    );
                    return Err(ReadError::malformed(self.format, self.at(), fact));
                }
                Err(e) => {
                    let fact = format!("the compressed data is damaged ({e})");
                    return Err(ReadError::malformed(self.format, self.at(), fact));
                }
            }
        }
        Ok(0)
    }

    /// The compressed bytes that are not taken yet.
    fn rest(&self) -> &'a [u8] {
        match &self.state {
            State::Member(member) => member.get_ref(),
            State::Ended(rest) => rest,
        }
    }

    fn at(&self) -> At {
        At::Byte((self.total - self.rest().len()) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn gunzip(compressed: &[u8], len: usize) -> Result<Vec<u8>, ReadError> {
        Gunzip::new("test", compressed).finish(len, true, &Run::default())
    }

    #[test]
    fn members_follow_each_other() {
        let both = [gzip(b"first "), gzip(b""), gzip(b"second")].concat();
        assert_eq!(gunzip(&both, 12).unwrap(), b"first second");
        let padded = [both, vec![0; 20]].concat();
        assert_eq!(gunzip(&padded, 12).unwrap(), b"first second");
    }

    #[test]
    fn every_prefix_is_an_error() {
        let compressed = gzip(&(0..5000u32).flat_map(u32::to_le_bytes).collect::<Vec<_>>());
        for end in 0..compressed.len() {
            let error = gunzip(&compressed[..end], 20_000).unwrap_err().to_string();
            assert!(error.contains("cut off") || error.contains("can hold"), "{end}: {error}");
        }
        assert_eq!(gunzip(&compressed, 20_000).unwrap().len(), 20_000);
        assert_eq!(gunzip(&compressed, 5).unwrap(), [0, 0, 0, 0, 1]);
    }

    #[test]
    fn promises_are_checked_before_memory_is_taken() {
        let error = gunzip(&gzip(b"tiny"), usize::MAX / 2).unwrap_err().to_string();
        assert!(error.contains("more than 24 compressed bytes can hold"), "{error}");
        assert!(gunzip(&gzip(b"tiny"), 100).unwrap_err().to_string().contains("4 of 100"));
    }

    #[test]
    fn a_wrong_checksum_is_an_error() {
        let mut compressed = gzip(&[7; 1000]);
        let at = compressed.len() - 6;
        compressed[at] ^= 1;
        assert!(gunzip(&compressed, 1000).unwrap_err().to_string().contains("damaged"));
    }
}

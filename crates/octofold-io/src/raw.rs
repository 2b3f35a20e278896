//! Bare samples: dimensions and type come from the user.

use crate::{ReadError, Sink, Source, WriteError};
use octofold::{Run, Volume, volume::ScalarType};

/// What a raw file does not say itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawLayout {
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Type of the samples.
    pub scalar: ScalarType,
    /// Bytes to skip at the start.
    pub offset: u64,
    /// Samples are big-endian.
    pub big_endian: bool,
}

/// Reads a volume.
pub fn read(
    _source: &Source,
    _layout: RawLayout,
    _run: &Run,
) -> Result<Box<dyn Volume>, ReadError> {
    Err(ReadError::unsupported("raw", "not read yet"))
}

/// Writes the samples alone, little-endian, x fastest.
pub fn write(_volume: &dyn Volume, _sink: &mut Sink<'_>, _run: &Run) -> Result<(), WriteError> {
    Err(WriteError::Unfit { format: "raw", fact: "not written yet".into() })
}

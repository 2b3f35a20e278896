//! binvox

use crate::{ReadError, Sink, Source, WriteError};
use octofold::{Run, Volume};

/// Reads a volume.
pub fn read(_source: &Source, _run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    Err(ReadError::unsupported("binvox", "not read yet"))
}

/// Writes a volume.
pub fn write(_volume: &dyn Volume, _sink: &mut Sink<'_>, _run: &Run) -> Result<(), WriteError> {
    Err(WriteError::Unfit { format: "binvox", fact: "not written yet".into() })
}

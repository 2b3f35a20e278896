//! obj

use crate::{ReadError, Sink, Source, WriteError};
use octofold::{Run, Soup};

/// Reads polygons.
pub fn read(_source: &Source, _run: &Run) -> Result<Soup, ReadError> {
    Err(ReadError::unsupported("obj", "not read yet"))
}

/// Writes polygons.
pub fn write(_soup: &Soup, _sink: &mut Sink<'_>, _run: &Run) -> Result<(), WriteError> {
    Err(WriteError::Unfit { format: "obj", fact: "not written yet".into() })
}

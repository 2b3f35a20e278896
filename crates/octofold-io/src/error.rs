//! What can go wrong between a file and a shape.

use octofold::lod::LodError;
use octofold::{Cancelled, ShapeError};
use std::path::PathBuf;

/// Where in a file a fact was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// Byte offset from the start, counted from 0.
    Byte(u64),
    /// Line, counted from 1.
    Line(u64),
    /// The file as a whole.
    File,
}

impl std::fmt::Display for At {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Byte(n) => write!(f, "byte {n}: "),
            Self::Line(n) => write!(f, "line {n}: "),
            Self::File => Ok(()),
        }
    }
}

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file itself could not be opened or read.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The bytes are not what the format asks for: damaged, truncated or hostile.
    #[error("{format}: {at}{fact}")]
    Malformed {
        /// Format that was read.
        format: &'static str,
        /// Where.
        at: At,
        /// What, and what to do where that is known.
        fact: String,
    },
    /// The bytes are sound, but hold something that is not read here.
    #[error("{format}: {fact}")]
    Unsupported {
        /// Format that was read.
        format: &'static str,
        /// What, and what to do instead.
        fact: String,
    },
    /// No known format.
    #[error("{0}")]
    UnknownFormat(String),
    /// The shape that was read breaks a promise of its type.
    #[error("{format}: {source}")]
    Shape {
        /// Format that was read.
        format: &'static str,
        /// Which promise.
        source: ShapeError,
    },
    /// The error of a file, with the file's name before it.
    #[error("{path}: {source}")]
    In {
        /// The file.
        path: PathBuf,
        /// What went wrong in it.
        source: Box<ReadError>,
    },
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl ReadError {
    /// A fact about damaged bytes.
    pub fn malformed(format: &'static str, at: At, fact: impl Into<String>) -> Self {
        Self::Malformed { format, at, fact: fact.into() }
    }

    /// A fact about sound bytes that are not read here.
    pub fn unsupported(format: &'static str, fact: impl Into<String>) -> Self {
        Self::Unsupported { format, fact: fact.into() }
    }
}

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The format cannot hold this shape.
    #[error("{format} cannot hold this: {fact}")]
    Unfit {
        /// The format.
        format: &'static str,
        /// Why, and what to use instead.
        fact: String,
    },
    /// A block of the volume that is written could not be read.
    #[error(transparent)]
    Volume(#[from] octofold::volume::VolumeError),
    /// The model cannot be divided so.
    #[error(transparent)]
    Lod(LodError),
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<LodError> for WriteError {
    fn from(error: LodError) -> Self {
        match error {
            LodError::Cancelled(cancelled) => cancelled.into(),
            error => Self::Lod(error),
        }
    }
}

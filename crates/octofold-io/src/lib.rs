//! Readers and writers of Octofold.
//!
//! Every format is one module with `read` and `write` on bytes; [`read()`] and [`write()`] find the
//! module, the file and its neighbours. Readers never allocate by a number that they have not
//! checked against the input's length, and never panic.

mod error;
mod format;
mod inflate;
mod mapped;
mod sink;
mod slabs;
mod source;

pub mod binvox;
pub mod gltf;
pub mod nifti;
pub mod npy;
pub mod nrrd;
pub mod obj;
pub mod off;
pub mod ply;
pub mod png;
pub mod raw;
pub mod stl;
pub mod threemf;
mod volumes;
pub mod vox;

pub use error::{At, ReadError, WriteError};
pub use format::{Format, Kind};
pub use mapped::{Layout, MappedVolume, Scaling, Stored};
pub use raw::RawLayout;
pub use sink::{Sink, save};
pub use source::{Bytes, Files, NoFiles, Source};
pub use volumes::{read_volume, write_volume};

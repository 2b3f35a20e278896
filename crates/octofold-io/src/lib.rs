//! Readers and writers of Octofold.
//!
//! Every format is one module with `read` and `write` on bytes; [`read_mesh`],
//! [`write_mesh`], [`read_volume`] and [`write_volume`] find the module, the file and its neighbours. Readers never allocate by a number that they have not
//! checked against the input's length, and never panic.

mod budget;
mod colour;
mod columns;
mod cover;
mod cutter;
#[cfg(test)]
mod dice;
mod drawing;
mod dxf;
mod error;
mod fold;
mod format;
mod images;
mod inflate;
mod lettering;
mod mapped;
mod meshes;
mod parts;
mod pdf;
mod prints;
mod seal;
mod sheets;
mod sink;
mod slabs;
mod source;
mod svg;
mod text;
mod volumes;

pub mod binvox;
pub mod gltf;
pub mod nifti;
pub mod npy;
pub mod nrrd;
pub mod obj;
pub mod off;
pub mod oflod;
pub mod ofn;
pub mod ply;
pub mod png;
pub mod raw;
pub mod stl;
pub mod threemf;
pub mod tiles;
pub mod vox;

pub use cover::Cover;
pub use error::{At, ReadError, WriteError};
pub use format::{Format, Kind};
pub use images::images;
pub use mapped::{Layout, MappedVolume, Scaling, Stored};
pub use meshes::{read_mesh, write_mesh};
pub use prints::ModelColours;
pub use raw::RawLayout;
pub use sheets::{Dress, SheetFormat, write_sheets};
pub use sink::{Sink, save};
pub use source::{Bytes, Files, NoFiles, Source};
pub use volumes::{read_volume, write_solid, write_volume};

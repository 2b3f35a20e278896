//! Octofold: a 3D shape from any form into any other useful form, through the octree.
//!
//! This crate is geometry only: no files, no clock, no environment. Data flows one way,
//! `soup | volume -> octree -> method -> mesh`, and each arrow is a function of plain values, an
//! options struct and a [`Run`].

pub mod attributes;
pub mod bits;
pub mod craft;
pub mod exact;
pub mod histogram;
pub mod image;
pub mod lattice;
mod light;
pub mod lod;
pub mod measure;
pub mod mesh;
pub mod network;
pub mod octree;
pub mod par;
pub mod payload;
pub mod picture;
pub mod pipeline;
pub mod polygon;
pub mod quadric;
pub mod radix;
mod random;
mod range;
pub mod repair;
pub mod report;
pub mod rows;
pub mod run;
pub mod samples;
pub mod scan;
mod sets;
pub mod simplify;
pub mod solid;
pub mod soup;
pub mod spans;
pub mod surface;
pub mod tint;
pub mod unfold;
pub mod volume;
pub mod voxelize;

#[cfg(test)]
mod sweep;

pub use attributes::{Attributes, LengthUnit, Material};
pub use mesh::Mesh;
pub use pipeline::{Kind, Shape, Step, pipeline};
pub use report::Report;
pub use run::{Cancel, Cancelled, Finding, Run, Watch};
pub use solid::{NotSolid, Solid};
pub use soup::{ShapeError, Soup, SoupBuilder};
pub use volume::{Placement, Volume};

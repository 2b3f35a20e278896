//! Linear octrees: sorted keys and columns.

pub mod key;

pub use key::{CellKey, VertexName};

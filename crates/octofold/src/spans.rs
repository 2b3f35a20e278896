//! Runs of voxels along x.

use crate::volume::{Block, Placement, Region, ScalarType, Volume, VolumeError};

/// A binary volume.
#[derive(Debug, Clone, Default)]
pub struct Spans;

impl Spans {
    /// Voxels inside.
    pub fn count(&self) -> u64 {
        0
    }
}

impl Volume for Spans {
    fn dims(&self) -> [usize; 3] {
        [0; 3]
    }
    fn placement(&self) -> Placement {
        Placement::default()
    }
    fn scalar_type(&self) -> ScalarType {
        ScalarType::U8
    }
    fn read(&self, _region: Region) -> Result<Block<'_>, VolumeError> {
        Ok(Block::U8(Vec::new().into()))
    }
    fn is_binary(&self) -> bool {
        true
    }
}

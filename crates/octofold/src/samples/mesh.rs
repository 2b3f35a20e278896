//! Meshes of the built-in shapes.

use super::Sample;
use crate::run::Run;
use crate::soup::Soup;
use crate::surface::{CubesOptions, Inside, marching_cubes};
use crate::volume::VolumeError;

impl Sample {
    /// The shape as polygons: its own, with `resolution` segments around curved faces, or else
    /// the isosurface of its field on a lattice of `resolution` cells along each axis.
    pub fn mesh(self, resolution: usize, run: &Run) -> Result<Soup, VolumeError> {
        run.check()?;
        if let Some(soup) = self.polygons(resolution) {
            return Ok(soup);
        }
        let Some(volume) = self.volume(resolution) else {
            return Ok(Soup::default());
        };
        let options = CubesOptions { iso: 0.0, inside: Inside::Below, open: false };
        Ok(marching_cubes(&volume, &options, run)?.into())
    }
}

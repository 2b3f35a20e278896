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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Weld, measure};

    #[test]
    fn solids_give_closed_oriented_manifolds() {
        for sample in Sample::ALL.into_iter().filter(|s| s.field().is_some()) {
            let run = Run::default();
            let mesh = sample.mesh(48, &run).unwrap().triangulate();
            let found = measure(&mesh, Weld::Exact, &run).unwrap();
            let name = sample.name();
            assert!(found.closed && found.manifold && found.oriented, "{name}");
            assert_eq!(found.self_intersections, 0, "{name}");
            assert!(found.volume > Some(0.0), "{name}");
        }
    }

    #[test]
    fn stand_ins_have_their_euler_numbers() {
        for (sample, euler) in [
            (Sample::PartA, 2),
            (Sample::PartB, 2),
            (Sample::PartC, 2),
            (Sample::PartD, 2),
            (Sample::PartE, 2),
            (Sample::HairDryer, 2),
            (Sample::Kettle, 0),
            (Sample::TapeCutter, 0),
            (Sample::Gyroid, -106),
        ] {
            let run = Run::default();
            let mesh = sample.mesh(64, &run).unwrap().triangulate();
            let found = measure(&mesh, Weld::Exact, &run).unwrap();
            assert_eq!(found.euler, euler, "{}", sample.name());
        }
    }
}

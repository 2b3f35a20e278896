//! A field as a volume: its values on lattice points, or a mask on cell centres.

use super::field::Field;
use crate::volume::{Block, Placement, Region, ScalarType, Volume, VolumeError};
use std::borrow::Cow;

/// Room for the rounding of field values beside the bound by distance.
const ROUNDING: f64 = 1e-12;

/// Values of a field on the lattice points i/N of the unit cube, i from 0 to N, in f32.
#[derive(Debug, Clone, Copy)]
pub struct FieldSamples {
    pub(super) field: Field,
    pub(super) resolution: usize,
}

/// 1 where a field is negative at the centre (i + 1/2)/N of a cell of the unit cube, else 0.
#[derive(Debug, Clone, Copy)]
pub struct FieldMask {
    pub(super) field: Field,
    pub(super) resolution: usize,
}

/// Positions of samples along any axis: (i + offset)/N.
#[derive(Clone, Copy)]
struct Axis {
    cells: f64,
    offset: f64,
}

impl Axis {
    fn new(resolution: usize, offset: f64) -> Self {
        Self { cells: resolution as f64, offset }
    }

    fn at(self, index: usize) -> f64 {
        (index as f64 + self.offset) / self.cells
    }

    fn placement(self) -> Placement {
        let mut placement = Placement::spacing([1.0 / self.cells; 3]);
        placement.origin = [self.at(0); 3];
        placement
    }

    fn read<T>(self, field: Field, region: Region, value: impl Fn(f64) -> T) -> Vec<T> {
        let mut out = Vec::with_capacity(region.len());
        for z in region.start[2]..region.end[2] {
            for y in region.start[1]..region.end[1] {
                let (y, z) = (self.at(y), self.at(z));
                let row = region.start[0]..region.end[0];
                out.extend(row.map(|x| value(field([self.at(x), y, z]))));
            }
        }
        out
    }

    /// Bounds of the field in `region`: it grows no faster than the distance from the middle.
    fn bounds(self, field: Field, region: Region) -> Option<[f64; 2]> {
        if region.is_empty() {
            return None;
        }
        let ends: [[f64; 2]; 3] =
            std::array::from_fn(|a| [self.at(region.start[a]), self.at(region.end[a] - 1)]);
        let middle = field(ends.map(|[low, high]| (low + high) / 2.0));
        let reach = ends.map(|[low, high]| (high - low) / 2.0);
        let radius = glam::DVec3::from(reach).length() + ROUNDING;
        Some([middle - radius, middle + radius])
    }
}

impl FieldSamples {
    fn axis(&self) -> Axis {
        Axis::new(self.resolution, 0.0)
    }
}

impl FieldMask {
    fn axis(&self) -> Axis {
        Axis::new(self.resolution, 0.5)
    }
}

impl Volume for FieldSamples {
    fn dims(&self) -> [usize; 3] {
        [self.resolution + 1; 3]
    }

    fn placement(&self) -> Placement {
        self.axis().placement()
    }

    fn scalar_type(&self) -> ScalarType {
        ScalarType::F32
    }

    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError> {
        let values = self.axis().read(self.field, region, |f| f as f32);
        Ok(Block::F32(Cow::Owned(values)))
    }

    fn bounds(&self, region: Region) -> Option<[f64; 2]> {
        // Rounding to f32 keeps the order, so that it may be applied to the bounds as well.
        let bounds = self.axis().bounds(self.field, region)?;
        Some(bounds.map(|b| f64::from(b as f32)))
    }
}

impl Volume for FieldMask {
    fn dims(&self) -> [usize; 3] {
        [self.resolution; 3]
    }

    fn placement(&self) -> Placement {
        self.axis().placement()
    }

    fn scalar_type(&self) -> ScalarType {
        ScalarType::U8
    }

    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError> {
        let mask = self.axis().read(self.field, region, |f| u8::from(f < 0.0));
        Ok(Block::U8(Cow::Owned(mask)))
    }

    fn bounds(&self, region: Region) -> Option<[f64; 2]> {
        let [low, high] = self.axis().bounds(self.field, region)?;
        let inside = |f: f64| if f < 0.0 { 1.0 } else { 0.0 };
        Some([inside(high), inside(low)])
    }

    fn is_binary(&self) -> bool {
        true
    }
}

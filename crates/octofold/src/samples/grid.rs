//! A field as a volume: its values on lattice points, or a mask on cell centres.

use super::field::Field;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::spans::boxes::Boxes;
use crate::volume::{Block, Placement, Region, ScalarType, Volume, VolumeError};
use glam::{DMat3, DVec3};
use std::borrow::Cow;
use std::ops::Range;

/// Room for the rounding of field values beside the bound by distance.
const ROUNDING: f64 = 1e-12;

/// Values of a field on the lattice points i/N of the unit cube, i from 0 to N, in f32.
#[derive(Debug, Clone, Copy)]
pub struct FieldSamples {
    pub(super) field: Field,
    pub(super) resolution: usize,
}

/// How a shape lies in the unit cube: scaled and turned about its middle, then shifted.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Pose {
    /// Columns of a rotation.
    pub turn: [[f64; 3]; 3],
    /// Above 0.
    pub scale: f64,
    /// In edges of the cube.
    pub shift: [f64; 3],
}

impl Default for Pose {
    fn default() -> Self {
        Self { turn: DMat3::IDENTITY.to_cols_array_2d(), scale: 1.0, shift: [0.0; 3] }
    }
}

/// 1 where a field is negative at the centre (i + 1/2)/N of a cell of the unit cube, else 0.
#[derive(Debug, Clone, Copy)]
pub struct FieldMask {
    pub(super) field: Field,
    pub(super) resolution: usize,
    pub(super) pose: Pose,
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

    fn read<T>(
        self,
        field: impl Fn([f64; 3]) -> f64,
        region: Region,
        value: impl Fn(f64) -> T,
    ) -> Vec<T> {
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
    fn bounds(self, field: impl Fn([f64; 3]) -> f64, region: Region) -> Option<[f64; 2]> {
        if region.is_empty() {
            return None;
        }
        let ends: [[f64; 2]; 3] =
            std::array::from_fn(|a| [self.at(region.start[a]), self.at(region.end[a] - 1)]);
        let middle = field(ends.map(|[low, high]| (low + high) / 2.0));
        let reach = ends.map(|[low, high]| (high - low) / 2.0);
        let radius = DVec3::from(reach).length() + ROUNDING;
        Some([middle - radius, middle + radius])
    }
}

impl FieldSamples {
    fn axis(&self) -> Axis {
        Axis::new(self.resolution, 0.0)
    }
}

impl FieldMask {
    /// The same shape in another pose; what leaves the unit cube is cut off.
    #[must_use]
    pub fn posed(self, pose: Pose) -> Self {
        Self { pose, ..self }
    }

    fn axis(&self) -> Axis {
        Axis::new(self.resolution, 0.5)
    }

    fn value(&self, p: [f64; 3]) -> f64 {
        if self.pose == Pose::default() {
            return (self.field)(p);
        }
        let Pose { turn, scale, shift } = self.pose;
        let back = DMat3::from_cols_array_2d(&turn).transpose();
        let p = back * (DVec3::from(p) - 0.5 - DVec3::from(shift)) / scale + 0.5;
        scale * (self.field)(p.to_array())
    }

    /// The cells as runs. Boxes that the field's slope shows to be full or empty are not visited, so
    /// the work is that of the surface.
    pub fn spans(&self, run: &Run) -> Result<Spans, Cancelled> {
        run.stage("cells");
        Spans::of_boxes(self.dims(), self.placement(), self, run)
    }

    /// The field in the middle of a cube of cells, and how much it may differ from that in any.
    fn about(&self, at: [u32; 3], side: u32) -> [f64; 2] {
        let half = f64::from(side - 1) / 2.0;
        let axis = self.axis();
        let value = self.value(at.map(|i| (f64::from(i) + half + axis.offset) / axis.cells));
        [value, half * 3f64.sqrt() / axis.cells + ROUNDING]
    }
}

impl Boxes for FieldMask {
    const LEAST: u32 = 2;

    fn look(&self, at: [u32; 3], side: u32) -> Option<bool> {
        let [value, reach] = self.about(at, side);
        (value.abs() > reach).then_some(value < 0.0)
    }

    fn row(&self, [y, z]: [u32; 2], cells: Range<u32>, mut push: impl FnMut([u32; 2])) {
        for x in cells {
            if self.about([x, y, z], 1)[0] < 0.0 {
                push([x, x + 1]);
            }
        }
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
        let mask = self.axis().read(|p| self.value(p), region, |f| u8::from(f < 0.0));
        Ok(Block::U8(Cow::Owned(mask)))
    }

    fn bounds(&self, region: Region) -> Option<[f64; 2]> {
        let [low, high] = self.axis().bounds(|p| self.value(p), region)?;
        let inside = |f: f64| if f < 0.0 { 1.0 } else { 0.0 };
        Some([inside(high), inside(low)])
    }

    fn is_binary(&self) -> bool {
        true
    }
}

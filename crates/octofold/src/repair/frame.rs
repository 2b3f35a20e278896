//! Where a repair takes place: the cells, and the lattice that its output lies on.
//!
//! A cell has a whole number of output steps along an edge. A step is a power of two and the grid
//! begins on a multiple of it, so that the world coordinates of every output point are exact in
//! single precision wherever 24 bits allow, and what is proved of lattice points is true of the
//! file that holds them. Source: specification of repair (D.2).

use super::RepairError;
use super::bricks::BRICK;
use super::reach::Reach;
use crate::lattice::{Lattice, LatticeError};
use crate::voxelize::Size;

/// The most cells along the longest side of the input.
pub const MAX_RESOLUTION: u32 = 16_384;

/// The most output steps along an edge of a cell: all predicates then fit 64 bits.
const MOST_STEPS: f64 = 65_536.0;

/// Fewer steps than this leave vertices no room; coordinates then take more than 24 bits.
const LEAST_STEPS: f64 = 32.0;

/// Steps along an edge of a cell where 24 bits are not enough.
const DOUBLE_STEPS: f64 = 1024.0;

/// Cells between the border of the grid and the lowest cell that may be full, beside those that
/// closing needs: a ring of bricks that is always empty, and a cell more.
const MARGIN: u32 = BRICK + 1;

/// The input lies this far into its first cell, so that faces square to the axes at the border of
/// its box, which CAD models are full of, do not lie on the walls of cells.
const SHIFT: f64 = 0.4375;

/// The cells of a repair and its output lattice.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The cells; the input is snapped to its sub-steps.
    pub lattice: Lattice,
    /// Output steps along an edge of a cell.
    pub steps: i32,
    /// Whether every output coordinate is exact in single precision.
    pub single: bool,
    /// The dilation that closes gaps of the size asked for.
    pub reach: Reach,
    /// World coordinates of step 0, in steps.
    origin: [f64; 3],
    step: f64,
}

impl Frame {
    /// The frame of a shape with the given bounds.
    pub fn new([low, high]: [[f64; 3]; 2], size: Size, gap: Gap) -> Result<Self, RepairError> {
        let largest = low.iter().chain(&high).fold(0.0f64, |m, x| m.max(x.abs()));
        let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
        if !longest.is_finite() {
            return Err(LatticeError::Bounds.into());
        }
        // A single point has no size; what is made round it is small beside its coordinates.
        let longest = if longest > 0.0 { longest } else { largest.max(1.0) / 64.0 };
        let wanted = match size {
            Size::Resolution(n) if (1..=MAX_RESOLUTION).contains(&n) => longest / f64::from(n),
            Size::Pitch(pitch) if pitch.is_finite() && pitch > 0.0 => pitch,
            Size::Resolution(n) => return Err(RepairError::Resolution(f64::from(n))),
            Size::Pitch(pitch) => return Err(LatticeError::Pitch(pitch).into()),
        };
        if longest / wanted > f64::from(MAX_RESOLUTION) * 1.001 {
            return Err(RepairError::Resolution((longest / wanted).ceil()));
        }
        let closing = gap.reach(wanted)?;
        let rounds = closing.rounds();
        let margin = f64::from(MARGIN + rounds) + SHIFT;
        let reach = largest + (margin + 2.0 * f64::from(BRICK)) * wanted;
        let finest = power_above(reach) / f64::from(1 << 24);
        let single = wanted / finest >= LEAST_STEPS;
        let step = if single {
            finest.max(power_above(wanted / MOST_STEPS))
        } else {
            power_above(wanted / DOUBLE_STEPS)
        };
        // Beyond this doubles cannot hold the coordinates either.
        if !step.is_normal() || reach / step > f64::from(1u32 << 31) * f64::from(1 << 20) {
            return Err(LatticeError::Bounds.into());
        }
        let steps = (wanted / step).floor();
        let cell = steps * step;
        let origin = low.map(|x| ((x - margin * cell) / step).floor());
        let start = origin.map(|x| x * step);
        let end = high.map(|x| x + (f64::from(MARGIN + rounds + BRICK) + SHIFT) * cell);
        let lattice = Lattice::with_pitch([start, end], cell)?;
        Ok(Self { lattice, steps: steps as i32, single, reach: closing, origin, step })
    }

    /// Edge of a cell in world units.
    pub fn cell(&self) -> f64 {
        self.lattice.cell()
    }

    /// The width of the gaps that are closed, in world units.
    pub fn gap(&self) -> f64 {
        2.0 * self.reach.radius * self.cell()
    }

    /// World position of an output point, given in steps.
    pub fn world(&self, point: [i32; 3]) -> [f64; 3] {
        std::array::from_fn(|a| (self.origin[a] + f64::from(point[a])) * self.step)
    }

    /// World position of the middle of a cell.
    pub fn centre(&self, cell: [u32; 3]) -> [f64; 3] {
        let origin = self.lattice.origin();
        std::array::from_fn(|a| origin[a] + (f64::from(cell[a]) + 0.5) * self.cell())
    }

    /// Bricks along x, y, z.
    pub fn bricks(&self) -> [u32; 3] {
        self.lattice.cells().map(|n| n.div_ceil(BRICK))
    }
}

/// The largest gap that is closed.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gap {
    /// As wide as the widest throat: an opening up to a quarter of the longest side through which
    /// the outside gets into a space that is large beside it.
    Auto,
    /// So many cells wide.
    Cells(f64),
    /// So wide, in world units.
    Width(f64),
}

/// What is closed where nothing needs more, in cells.
const LEAST_CELLS: f64 = 2.0;

/// The most cells to either side of a gap: the cost of closing grows with them.
const MOST_CELLS: f64 = 4096.0;

impl Gap {
    fn reach(self, cell: f64) -> Result<Reach, RepairError> {
        let cells = match self {
            Self::Auto => LEAST_CELLS,
            Self::Cells(cells) => cells,
            Self::Width(width) => width / cell,
        };
        if (0.0..=2.0 * MOST_CELLS).contains(&cells) {
            Ok(Reach::new(cells / 2.0))
        } else {
            Err(RepairError::Gap { cells })
        }
    }
}

/// The smallest power of two that is not below `x`, for positive normal numbers.
fn power_above(x: f64) -> f64 {
    let below = f64::from_bits(x.to_bits() & f64::INFINITY.to_bits());
    if below < x { 2.0 * below } else { below }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(512))]

        #[test]
        fn output_points_are_exact(
            low in prop::array::uniform3(-1e3f64..1e3),
            extent in prop::array::uniform3(1e-3f64..1e3),
            scale in -60i32..60,
            resolution in 1u32..5000,
            share in prop::array::uniform3(0.0f64..=1.0),
        ) {
            let scale = 2f64.powi(scale);
            let low = low.map(|x| x * scale);
            let high = std::array::from_fn(|a| low[a] + extent[a] * scale);
            let size = Size::Resolution(resolution);
            let frame = Frame::new([low, high], size, Gap::Cells(2.0)).unwrap();
            let most = frame.lattice.cells().map(|n| i64::from(n) * i64::from(frame.steps));
            prop_assert!(most.iter().all(|&n| n < 1 << 31));
            let point = std::array::from_fn(|a| (share[a] * most[a] as f64) as i32);
            let world = frame.world(point);
            for a in 0..3 {
                let back = (world[a] - frame.lattice.origin()[a]) / frame.step;
                prop_assert_eq!(back, f64::from(point[a]));
                prop_assert!(!frame.single || f64::from(world[a] as f32) == world[a]);
            }
            let longest = extent.iter().fold(0.0, |m: f64, &x| m.max(x)) * scale;
            let cells = longest / frame.cell();
            prop_assert!(cells >= f64::from(resolution) * 0.999);
            prop_assert!(cells <= f64::from(resolution) * 1.04);
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let frame = |size, gap| Frame::new([[0.0; 3], [1.0; 3]], size, gap);
        assert!(frame(Size::Resolution(0), Gap::Cells(0.0)).is_err());
        assert!(frame(Size::Resolution(16_385), Gap::Cells(0.0)).is_err());
        assert!(frame(Size::Pitch(-1.0), Gap::Cells(0.0)).is_err());
        assert!(frame(Size::Pitch(1e-9), Gap::Cells(0.0)).is_err());
        assert!(frame(Size::Resolution(64), Gap::Width(-1.0)).is_err());
        assert!(frame(Size::Resolution(64), Gap::Width(f64::NAN)).is_err());
        assert!(
            Frame::new([[-1e308; 3], [1e308; 3]], Size::Resolution(8), Gap::Cells(0.0)).is_err()
        );
        assert!(Frame::new([[3.0; 3]; 2], Size::Resolution(8), Gap::Cells(0.0)).is_ok());
    }
}

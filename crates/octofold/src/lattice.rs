//! The one integer lattice that all methods share.
//!
//! A box in the world is cut into cubic cells, and each cell into 2^s sub-steps. Points are
//! snapped to odd sub-steps, so that no vertex ever lies on a grid plane, on a line through cell
//! centres or on a centre itself; what a triangle does to the grid is then decided in integers.
//! Sources: specifications of repair (D.2) and LOD (A.9 no. 2).

use crate::volume::Placement;

/// Cells along the longest axis of the finest lattice.
pub const MAX_CELLS: u32 = 65_536;

/// Sub-steps along an axis fit this many bits.
const COORDINATE_BITS: u32 = 30;

/// Finer sub-steps than 2^-16 of a cell would only slow the predicates.
const MAX_SUB_BITS: u32 = 16;

/// Why there is no lattice.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LatticeError {
    /// More cells along an axis than the lattice has, or none.
    #[error("{0} cells along the longest side: choose between 1 and {MAX_CELLS}")]
    Resolution(f64),
    /// The pitch is not a positive number.
    #[error("the pitch {0} is not a positive length")]
    Pitch(f64),
    /// There is nothing to put a lattice round.
    #[error("the shape has no points, or they are too far apart to measure")]
    Bounds,
}

/// A grid of cubic cells with an integer sub-lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    origin: [f64; 3],
    cell: f64,
    cells: [u32; 3],
    sub_bits: u32,
}

impl Lattice {
    /// The box `[low, high]` with its origin at `low` and `resolution` cells on the longest side.
    pub fn fit([low, high]: [[f64; 3]; 2], resolution: u32) -> Result<Self, LatticeError> {
        let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
        if resolution == 0 || resolution > MAX_CELLS {
            return Err(LatticeError::Resolution(f64::from(resolution)));
        }
        let cell = if longest > 0.0 { longest / f64::from(resolution) } else { 1.0 };
        // Rounding may ask for one cell more than the resolution that the cell came from.
        Self::new([low, high], cell, resolution, 1.0)
    }

    /// The box `[low, high]` with its origin at `low` and cells of edge `pitch`.
    pub fn with_pitch(bounds: [[f64; 3]; 2], pitch: f64) -> Result<Self, LatticeError> {
        if !(pitch.is_finite() && pitch > 0.0) {
            return Err(LatticeError::Pitch(pitch));
        }
        Self::new(bounds, pitch, MAX_CELLS, 0.0)
    }

    fn new(
        [low, high]: [[f64; 3]; 2],
        cell: f64,
        most: u32,
        slack: f64,
    ) -> Result<Self, LatticeError> {
        if !(cell.is_finite() && cell > 0.0 && low.iter().all(|x| x.is_finite())) {
            return Err(LatticeError::Bounds);
        }
        let wanted: [f64; 3] = std::array::from_fn(|a| ((high[a] - low[a]) / cell).ceil().max(1.0));
        let longest = wanted.into_iter().fold(0.0, f64::max);
        if longest > f64::from(most) + slack {
            return Err(LatticeError::Resolution(longest));
        }
        let cells = wanted.map(|n| (n as u32).min(most));
        let sub_bits = MAX_SUB_BITS.min(COORDINATE_BITS - levels(cells));
        Ok(Self { origin: low, cell, cells, sub_bits })
    }

    /// Cells along x, y, z.
    pub fn cells(&self) -> [u32; 3] {
        self.cells
    }

    /// Edge of a cell in world units.
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// World position of the grid's low corner.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// A cell has `1 << sub_bits` sub-steps along an axis.
    pub fn sub_bits(&self) -> u32 {
        self.sub_bits
    }

    /// Levels below the root of the smallest octree that covers the grid.
    pub fn levels(&self) -> u32 {
        levels(self.cells)
    }

    /// The odd sub-step next to a world position, clamped to the grid: at most two sub-steps
    /// away along each axis for positions inside.
    pub fn snap(&self, point: [f64; 3]) -> [i32; 3] {
        let scale = f64::from(1u32 << self.sub_bits) / self.cell;
        std::array::from_fn(|a| {
            let last = (self.cells[a] << self.sub_bits) as i32 - 1;
            let pair = ((point[a] - self.origin[a]) * scale / 2.0).floor();
            (2 * pair.clamp(0.0, f64::from(last / 2)) as i32 + 1).min(last)
        })
    }

    /// World position of a sub-step.
    pub fn world(&self, step: [i32; 3]) -> [f64; 3] {
        let size = self.cell / f64::from(1u32 << self.sub_bits);
        std::array::from_fn(|a| self.origin[a] + f64::from(step[a]) * size)
    }

    /// Placement of a volume with one sample at each cell's centre.
    pub fn placement(&self) -> Placement {
        let origin = self.origin.map(|o| o + self.cell / 2.0);
        Placement { origin, ..Placement::spacing([self.cell; 3]) }
    }
}

fn levels(cells: [u32; 3]) -> u32 {
    cells.into_iter().max().unwrap_or(1).next_power_of_two().trailing_zeros()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_longest_side_has_the_resolution() {
        let lattice = Lattice::fit([[0.0; 3], [1.0, 0.3, 0.0]], 100).unwrap();
        assert_eq!(lattice.cells(), [100, 30, 1]);
        assert!(Lattice::fit([[0.0; 3], [1.0; 3]], 65_536).is_ok());
        assert!(Lattice::fit([[0.0; 3], [1.0; 3]], 65_537).is_err());
        assert!(Lattice::fit([[0.0; 3], [1.0; 3]], 0).is_err());
        assert!(Lattice::with_pitch([[0.0; 3], [1.0; 3]], 1e-9).is_err());
        assert!(Lattice::with_pitch([[0.0; 3], [1.0; 3]], -1.0).is_err());
        assert!(Lattice::fit([[-1e308; 3], [1e308; 3]], 8).is_err());
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(256))]

        #[test]
        fn snapped_points_are_odd_inside_and_near(
            low in prop::array::uniform3(-1e3f64..1e3),
            extent in prop::array::uniform3(0.0f64..1e3),
            share in prop::array::uniform3(0.0f64..=1.0),
            resolution in 1u32..5000,
        ) {
            let high = std::array::from_fn(|a| low[a] + extent[a]);
            let lattice = Lattice::fit([low, high], resolution).unwrap();
            let cells = lattice.cells();
            prop_assert!(cells.iter().all(|&n| n >= 1 && n <= resolution));
            let point = std::array::from_fn(|a| low[a] + share[a] * extent[a]);
            let step = lattice.snap(point);
            let back = lattice.world(step);
            let size = lattice.cell() / f64::from(1u32 << lattice.sub_bits());
            for a in 0..3 {
                prop_assert_eq!(step[a] & 1, 1);
                prop_assert!(step[a] > 0 && step[a] < (cells[a] << lattice.sub_bits()) as i32);
                prop_assert!((back[a] - point[a]).abs() <= 2.0 * size + 1e-9);
            }
        }
    }
}

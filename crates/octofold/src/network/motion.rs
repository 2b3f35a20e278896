//! Rigid motion and scaling, exactly.
//!
//! A voxel of the result is filled where the voxel that holds its centre's preimage is: no holes, and
//! the same bits everywhere, since preimages are sums of integers. The work is that of the surface: a
//! cube of voxels of the result whose preimage keeps away from all nodes is full or empty as a whole,
//! which one look into a grid of bricks tells; other cubes are divided, and rows of the smallest walk
//! through the voxels of the solid. Source: specification (A7).

use super::bricks::Bricks;
use super::{MOST_VOXELS, Network, NetworkError};
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::spans::boxes::{Boxes, TILE};
use crate::volume::Placement;
use glam::{DMat3, DVec3};
use std::ops::Range;

/// Fixed point: 2^32 to one voxel.
const ONE: f64 = 4_294_967_296.0;

/// What rounding to single parts of [`ONE`] and arithmetic in double precision may add to a distance.
const SLACK: f64 = 1e-3;

/// What differs less from a whole number of voxels is one.
const SNAP: f64 = 1e-9;

/// How many voxels away a result may lie.
const FAR: f64 = 268_435_456.0;

/// Why a solid cannot be moved so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MotionError {
    /// It would be flat.
    #[error("the motion makes the solid flat: its matrix has no inverse")]
    Flat,
    /// It leaves what integers can hold.
    #[error("the motion leads to places that are too far away")]
    TooFar,
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<NetworkError> for MotionError {
    fn from(error: NetworkError) -> Self {
        match error {
            NetworkError::TooLong { .. } => Self::TooFar,
            NetworkError::Cancelled(cancelled) => cancelled.into(),
        }
    }
}

/// Which voxel each voxel of the result comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Preimage {
    /// Steps of the preimage for a step along x, y and z, in fixed point.
    columns: [[i64; 3]; 3],
    /// Preimage of voxel 0 0 0, half a voxel ahead so that cutting off rounds.
    start: [i64; 3],
}

impl Preimage {
    /// For a motion that takes place `p` of a solid, in voxels, to `linear * p + shift` in the
    /// result.
    pub fn new(linear: DMat3, shift: DVec3) -> Result<Self, MotionError> {
        let inverse = linear.inverse();
        if !inverse.is_finite() || linear.determinant() == 0.0 {
            return Err(MotionError::Flat);
        }
        let fixed = |v: DVec3| {
            let far = v.abs().max_element();
            // Room for 2^17 steps along each axis.
            if far * ONE < 2f64.powi(44) || far == 0.0 {
                Ok(v.to_array().map(|x| (x * ONE).round() as i64))
            } else {
                Err(MotionError::TooFar)
            }
        };
        let start = -(inverse * shift);
        let far = start.abs().max_element();
        if far.is_nan() || far >= 2f64.powi(28) {
            return Err(MotionError::TooFar);
        }
        Ok(Self {
            columns: [fixed(inverse.x_axis)?, fixed(inverse.y_axis)?, fixed(inverse.z_axis)?],
            start: start.to_array().map(|x| ((x + 0.5) * ONE).round() as i64),
        })
    }

    /// The voxel that a voxel of the result comes from.
    pub fn of(&self, at: [u32; 3]) -> [i64; 3] {
        self.fixed(at).map(|x| x >> 32)
    }

    /// The place in voxels that the centre of a voxel of the result comes from.
    pub fn place(&self, at: [u32; 3]) -> [f64; 3] {
        self.fixed(at).map(|x| x as f64 / ONE - 0.5)
    }

    fn fixed(&self, at: [u32; 3]) -> [i64; 3] {
        std::array::from_fn(|a| {
            let steps = (0..3).map(|b| self.columns[b][a] * i64::from(at[b]));
            self.start[a] + steps.sum::<i64>()
        })
    }

    /// How far from the middle's preimage those of a cube of voxels may lie.
    fn reach(&self, side: u32) -> f64 {
        let [x, y, z] = self.columns.map(|c| DVec3::from(c.map(|x| x as f64 / ONE)));
        let corners = [x + y + z, x + y - z, x - y + z, x - y - z];
        let far = corners.map(DVec3::length).into_iter().fold(0.0, f64::max);
        f64::from(side - 1) / 2.0 * far
    }
}

/// A motion of the world, that takes `p` to `linear * (p - about) + about + shift`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Motion {
    /// Columns of the linear part.
    pub linear: [[f64; 3]; 3],
    /// What the linear part leaves in its place; the middle of the solid's box where it is not told.
    #[serde(default)]
    pub about: Option<[f64; 3]>,
    /// What is added.
    #[serde(default)]
    pub shift: [f64; 3],
}

/// Moves a solid in the world. The result's grid is as large as it must be and has the axes of the
/// solid's, whole voxels away from it.
pub fn transformed(solid: &Spans, motion: &Motion, run: &Run) -> Result<Spans, MotionError> {
    let Some(Moved { preimage, dims, placement }) = Moved::new(solid, motion)? else {
        return Ok(solid.clone());
    };
    moved(&Network::new(solid, run)?, &preimage, dims, placement, run)
}

/// The grid of a moved solid, and where its voxels come from.
pub(super) struct Moved {
    pub preimage: Preimage,
    pub dims: [usize; 3],
    pub placement: Placement,
}

impl Moved {
    /// Of a solid in the world; `None` where it is empty.
    pub fn new(solid: &Spans, motion: &Motion) -> Result<Option<Self>, MotionError> {
        let Some(extent) = solid.extent() else { return Ok(None) };
        let axes = DMat3::from_cols_array_2d(&solid.placement.axes);
        let linear = axes.inverse() * DMat3::from_cols_array_2d(&motion.linear) * axes;
        let middle = [0, 1, 2].map(|a| (extent.start[a] + extent.end[a] - 1) as f64 / 2.0);
        let about = motion.about.unwrap_or_else(|| solid.placement.place(middle));
        let about = axes.inverse() * (DVec3::from(about) - DVec3::from(solid.placement.origin));
        // Where axes are turned by right angles this keeps whole steps whole.
        let clean = |v: f64| if (v - v.round()).abs() < SNAP { v.round() } else { v };
        let linear = DMat3::from_cols_array(&linear.to_cols_array().map(clean));
        let shift = axes.inverse() * DVec3::from(motion.shift) + about - linear * about;
        let shift = DVec3::from(shift.to_array().map(clean));
        let corners = (0..8).map(|corner| {
            let at = [0, 1, 2].map(|a| match corner >> a & 1 {
                0 => extent.start[a] as f64 - 0.5,
                _ => extent.end[a] as f64 - 0.5,
            });
            linear * DVec3::from(at) + shift
        });
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = corners.fold(none, |(low, high), at| (low.min(at), high.max(at)));
        let (low, high) = ((low - SNAP).ceil(), (high + SNAP).floor());
        let size = high - low + 1.0;
        if !size.is_finite()
            || size.max_element() > MOST_VOXELS as f64
            || low.abs().max_element() > FAR
        {
            return Err(MotionError::TooFar);
        }
        let dims = size.to_array().map(|n| n.max(1.0) as usize);
        let mut placement = solid.placement;
        placement.origin = solid.placement.place(low.to_array());
        let preimage = Preimage::new(linear, shift - low)?;
        Ok(Some(Self { preimage, dims, placement }))
    }
}

/// Moves a solid into a grid of `dims` voxels; what leaves the grid is cut off.
pub fn moved(
    network: &Network,
    preimage: &Preimage,
    dims: [usize; 3],
    placement: Placement,
    run: &Run,
) -> Result<Spans, MotionError> {
    run.stage("motion");
    let solid = network.spans();
    let reach = |side: u32| preimage.reach(side) + SLACK;
    let bricks = Bricks::new(network, &solid, reach(TILE));
    let sides = (0..=TILE.ilog2()).map(|i| bricks.grid_for(reach(1 << i))).collect();
    let image = Image { preimage, bricks, grids: sides };
    Ok(Spans::of_boxes(dims, placement, &image, run)?)
}

/// A solid seen through a motion.
struct Image<'a> {
    preimage: &'a Preimage,
    bricks: Bricks,
    /// The grid that tells of the preimages of cubes, by the logarithm of their side.
    grids: Vec<Option<usize>>,
}

impl Boxes for Image<'_> {
    const LEAST: u32 = 4;

    fn look(&self, at: [u32; 3], side: u32) -> Option<bool> {
        let grid = self.grids[side.ilog2() as usize]?;
        let half = i64::from(side - 1);
        let from = self.preimage.fixed(at);
        let middle = std::array::from_fn(|a| {
            let steps: i64 = self.preimage.columns.iter().map(|c| (c[a] * half) >> 1).sum();
            (from[a] + steps) >> 32
        });
        self.bricks.ball(grid, middle)
    }

    fn row(&self, [y, z]: [u32; 2], cells: Range<u32>, mut push: impl FnMut([u32; 2])) {
        let mut at = self.preimage.fixed([cells.start, y, z]);
        let step = self.preimage.columns[0];
        let mut start = None;
        for x in cells.clone() {
            match (start, self.bricks.contains(at.map(|i| i >> 32))) {
                (None, true) => start = Some(x),
                (Some(from), false) => {
                    push([from, x]);
                    start = None;
                }
                _ => {}
            }
            at = [0, 1, 2].map(|a| at[a].wrapping_add(step[a]));
        }
        if let Some(from) = start {
            push([from, cells.end]);
        }
    }
}

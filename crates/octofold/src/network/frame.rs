//! One grid for several solids, so that they can be combined.
//!
//! Solids whose grids are whole voxels apart are only shifted; any other is resampled into the
//! voxels of the first, exactly as a motion is.

use super::combine::Operation;
use super::motion::{MotionError, Preimage, moved};
use super::{MOST_VOXELS, Network, NetworkError};
use crate::run::{Cancelled, Finding, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Region, Volume};
use glam::{DMat3, DVec3};

/// Why solids have no common grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// They lie too far apart.
    #[error(
        "the common grid of the solids has {voxels} voxels along an axis: {MOST_VOXELS} are the most"
    )]
    TooLong {
        /// How many it would have.
        voxels: u64,
    },
    /// A solid cannot be resampled.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A solid has no network.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What is less than this part of a voxel off is where it should be.
const SNAP: f64 = 1e-3;

/// How a solid's grid lies in that of the first.
enum Fit {
    /// So many whole voxels away.
    Whole([i64; 3]),
    /// In any other way.
    Any(DMat3, DVec3),
}

impl Fit {
    fn new(first: &Spans, other: &Spans) -> Self {
        let axes = |p: &Placement| DMat3::from_cols_array_2d(&p.axes);
        let inverse = axes(&first.placement).inverse();
        let linear = inverse * axes(&other.placement);
        let away = DVec3::from(other.placement.origin) - DVec3::from(first.placement.origin);
        let shift = inverse * away;
        let longest = other.dims().into_iter().max().unwrap_or(1) as f64;
        let turned = (linear - DMat3::IDENTITY).to_cols_array().map(f64::abs);
        let off = (shift - shift.round()).abs().max_element();
        if turned.iter().all(|v| v * longest < SNAP) && off < SNAP {
            Self::Whole(shift.round().to_array().map(|v| v as i64))
        } else {
            Self::Any(linear, shift)
        }
    }

    /// The box of a solid in voxels of the first, low and high.
    fn extent(&self, solid: &Spans) -> Option<[[i64; 3]; 2]> {
        let Region { start, end } = solid.extent()?;
        Some(match self {
            Self::Whole(by) => [start, end].map(|c| [0, 1, 2].map(|a| c[a] as i64 + by[a])),
            Self::Any(linear, shift) => {
                let ends = [start, end].map(|c| c.map(|i| i as f64 - 0.5));
                let corner = |i: usize| [0, 1, 2].map(|a| ends[i >> a & 1][a]);
                let at = (0..8).map(|i| *linear * DVec3::from(corner(i)) + *shift);
                let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
                let (low, high) = at.fold(none, |(l, h), at| (l.min(at), h.max(at)));
                let whole = |v: DVec3| v.to_array().map(|v| v as i64);
                [whole(low.floor()), whole(high.ceil() + 1.0)]
            }
        })
    }
}

/// Brings solids into one grid: that of the first, widened for what the operation may add to it.
pub fn framed(
    operation: Operation,
    solids: Vec<Spans>,
    run: &Run,
) -> Result<Vec<Spans>, FrameError> {
    let all: Vec<&Spans> = solids.iter().collect();
    let Some(frame) = Frame::new(operation, &all)? else { return Ok(solids) };
    let bring = |(number, solid)| Ok(frame.bring(solid, number, run)?.0);
    let brought = solids.iter().enumerate().map(bring).collect::<Result<_, FrameError>>()?;
    frame.tell(run);
    Ok(brought)
}

/// One grid for several solids.
pub(super) struct Frame {
    start: [i64; 3],
    dims: [usize; 3],
    placement: Placement,
    fits: Vec<Fit>,
}

/// Where the voxels of a solid that was brought into a grid come from.
pub(super) enum Back {
    Whole([f64; 3]),
    Any(Preimage),
}

impl Back {
    /// The place in voxels of the solid as it was.
    pub fn of(&self, at: [u32; 3]) -> [f64; 3] {
        match self {
            Self::Whole(by) => std::array::from_fn(|a| f64::from(at[a]) + by[a]),
            Self::Any(preimage) => preimage.place(at),
        }
    }
}

impl Frame {
    /// The grid of the first, widened for what the operation may add to it; `None` where all have it.
    pub fn new(operation: Operation, solids: &[&Spans]) -> Result<Option<Self>, FrameError> {
        let Some(first) = solids.first() else { return Ok(None) };
        if solids.iter().all(|s| s.dims() == first.dims() && s.placement == first.placement) {
            return Ok(None);
        }
        let fits: Vec<Fit> = solids.iter().map(|solid| Fit::new(first, solid)).collect();
        let mut start = [0; 3];
        let mut end = first.dims().map(|n| n as i64);
        if matches!(operation, Operation::Union | Operation::SymmetricDifference) {
            let extents = solids.iter().zip(&fits).filter_map(|(solid, fit)| fit.extent(solid));
            for [low, high] in extents {
                start = [0, 1, 2].map(|a| start[a].min(low[a]));
                end = [0, 1, 2].map(|a| end[a].max(high[a]));
            }
        }
        let size = [0, 1, 2].map(|a| end[a].abs_diff(start[a]));
        if let Some(voxels) = size.into_iter().find(|&n| n > MOST_VOXELS as u64) {
            return Err(FrameError::TooLong { voxels });
        }
        let mut placement = first.placement;
        placement.origin = first.placement.place(start.map(|i| i as f64));
        Ok(Some(Self { start, dims: size.map(|n| n as usize), placement, fits }))
    }

    /// Brings the solid of this number, and tells where its voxels come from.
    pub fn bring(
        &self,
        solid: &Spans,
        number: usize,
        run: &Run,
    ) -> Result<(Spans, Back), FrameError> {
        let (mut own, back) = match &self.fits[number] {
            Fit::Whole(by) => {
                let start = [0, 1, 2].map(|a| self.start[a] - by[a]);
                let back = Back::Whole(start.map(|i| i as f64));
                (solid.framed(start, self.dims), back)
            }
            Fit::Any(linear, shift) => {
                let shift = *shift - DVec3::from(self.start.map(|i| i as f64));
                let preimage = Preimage::new(*linear, shift)?;
                let network = Network::new(solid, run)?;
                let own = moved(&network, &preimage, self.dims, self.placement, run)?;
                (own, Back::Any(preimage))
            }
        };
        own.placement = self.placement;
        Ok((own, back))
    }

    /// Tells how many solids were resampled.
    pub fn tell(&self, run: &Run) {
        let resampled = self.fits.iter().filter(|fit| matches!(fit, Fit::Any(..))).count() as u64;
        if resampled > 0 {
            let text = format!(
                "{resampled} of the solids lie on other grids and were resampled to the voxels of \
                 the first"
            );
            run.finding(Finding::note("resampled", text).of(resampled));
        }
    }
}

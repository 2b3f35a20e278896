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
    let Some(first) = solids.first() else { return Ok(solids) };
    if solids.iter().all(|s| s.dims() == first.dims() && s.placement == first.placement) {
        return Ok(solids);
    }
    let fits: Vec<Fit> = solids.iter().map(|solid| Fit::new(first, solid)).collect();
    let mut start = [0; 3];
    let mut end = first.dims().map(|n| n as i64);
    if matches!(operation, Operation::Union | Operation::SymmetricDifference) {
        for [low, high] in solids.iter().zip(&fits).filter_map(|(solid, fit)| fit.extent(solid)) {
            start = [0, 1, 2].map(|a| start[a].min(low[a]));
            end = [0, 1, 2].map(|a| end[a].max(high[a]));
        }
    }
    let size = [0, 1, 2].map(|a| end[a].abs_diff(start[a]));
    if let Some(voxels) = size.into_iter().find(|&n| n > MOST_VOXELS as u64) {
        return Err(FrameError::TooLong { voxels });
    }
    let dims = size.map(|n| n as usize);
    let mut placement = first.placement;
    placement.origin = first.placement.place(start.map(|i| i as f64));
    let mut resampled = 0;
    let bring = |(solid, fit): (&Spans, &Fit)| -> Result<Spans, FrameError> {
        let mut own = match fit {
            Fit::Whole(by) => solid.framed([0, 1, 2].map(|a| start[a] - by[a]), dims),
            Fit::Any(linear, shift) => {
                resampled += 1;
                let shift = *shift - DVec3::from(start.map(|i| i as f64));
                let preimage = Preimage::new(*linear, shift)?;
                moved(&Network::new(solid, run)?, &preimage, dims, placement, run)?
            }
        };
        own.placement = placement;
        Ok(own)
    };
    let brought = solids.iter().zip(&fits).map(bring).collect::<Result<Vec<_>, _>>()?;
    if resampled > 0 {
        let text = format!(
            "{resampled} of the solids lie on other grids and were resampled to the voxels of the first"
        );
        run.finding(Finding::note("resampled", text).of(resampled));
    }
    Ok(brought)
}

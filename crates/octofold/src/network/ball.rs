//! Solids grown and shrunk by a ball.
//!
//! A voxel is in the grown solid where the centre of some voxel of the solid is no further than the
//! radius, and in the shrunk one where all voxels whose centres are no further are in the solid; beyond
//! the grid nothing is. Distances are those of the world, so voxels need not be cubes. Rows of the
//! result are put together from the rows of the solid that the ball reaches.

use super::{MOST_VOXELS, NetworkError};
use crate::par;
use crate::rows::Rows;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Volume};
use glam::{DMat3, DVec3};

/// Slices that one unit of work takes.
const BLOCK: usize = 4;

/// Rows that a ball may reach.
const MOST_ROWS: f64 = (1 << 22) as f64;

/// Centres that lie this part of the radius too far away are no further than the radius.
const SLACK: f64 = 1e-9;

/// Why a solid cannot be grown or shrunk.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BallError {
    /// No ball has this radius.
    #[error("a radius of {0}: it must be a number that is not below 0")]
    Radius(f64),
    /// The ball has too many voxels, or a voxel no size.
    #[error("a radius of {0} reaches too many voxels of this size: resample the solid first")]
    TooLarge(f64),
    /// The grown solid has no network.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What becomes of a solid.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ball {
    /// Grown by a radius in units of the world.
    Dilate(f64),
    /// Shrunk by one.
    Erode(f64),
}

/// Grows or shrinks a solid. A grown one has a grid that is larger on all sides by the ball.
pub fn balled(solid: &Spans, ball: Ball, run: &Run) -> Result<Spans, BallError> {
    match ball {
        Ball::Dilate(radius) => dilated(solid, radius, run),
        Ball::Erode(radius) => eroded(solid, radius, run),
    }
}

/// All that is within a radius of a solid.
fn dilated(solid: &Spans, radius: f64, run: &Run) -> Result<Spans, BallError> {
    let reached = Reach::new(&solid.placement, radius)?;
    let dims: [usize; 3] = std::array::from_fn(|a| solid.dims()[a] + 2 * reached.far[a] as usize);
    if let Some(voxels) = dims.into_iter().find(|&n| n > MOST_VOXELS) {
        return Err(NetworkError::TooLong { voxels }.into());
    }
    let framed = solid.framed(reached.far.map(|n| -n), dims);
    run.stage("dilate");
    each_row(&framed, run, |row, runs| {
        for line in &reached.lines {
            let ends = line.of(&framed, row, -1).iter();
            // What lies at the end of a line reaches back along it.
            let [first, last] = line.ends;
            runs.extend(ends.map(|[start, end]| {
                [start.saturating_add_signed(first as i32), end.saturating_add_signed(last as i32)]
            }));
        }
        runs.sort_unstable();
        runs.dedup_by(|next, last| {
            let touches = next[0] <= last[1];
            if touches {
                last[1] = last[1].max(next[1]);
            }
            touches
        });
    })
}

/// All whose surroundings within a radius are in a solid.
fn eroded(solid: &Spans, radius: f64, run: &Run) -> Result<Spans, BallError> {
    let reached = Reach::new(&solid.placement, radius)?;
    run.stage("erode");
    each_row(solid, run, |row, runs| {
        let mut left = Vec::new();
        for (number, line) in reached.lines.iter().enumerate() {
            let [first, last] = line.ends;
            let room = line.of(solid, row, 1).iter().filter_map(|&[start, end]| {
                let [start, end] = [i64::from(start) - first, i64::from(end) - last];
                (start < end).then(|| [start.max(0) as u32, end.max(0) as u32])
            });
            if number == 0 {
                runs.extend(room);
            } else {
                intersect(runs, room, &mut left);
                std::mem::swap(runs, &mut left);
            }
            if runs.is_empty() {
                return;
            }
        }
    })
}

/// A solid on the same grid, whose rows `[y, z]` are told one by one.
fn each_row(
    solid: &Spans,
    run: &Run,
    row: impl Fn([i64; 2], &mut Vec<[u32; 2]>) + Sync,
) -> Result<Spans, BallError> {
    let [_, height, depth] = solid.dims();
    let parts = par::blocks(run, depth, BLOCK, |slices| {
        let mut rows = Rows::default();
        let mut runs = Vec::new();
        for z in slices {
            for y in 0..height {
                runs.clear();
                row([y as i64, z as i64], &mut runs);
                rows.extend(&runs);
                rows.end_row(y as u32);
            }
            rows.end_slice();
        }
        rows
    })?;
    Ok(Spans::from_rows(solid.dims(), solid.placement, parts))
}

/// What two rows have in common.
fn intersect(a: &[[u32; 2]], mut b: impl Iterator<Item = [u32; 2]>, common: &mut Vec<[u32; 2]>) {
    common.clear();
    let (mut i, mut other) = (0, b.next());
    while let (Some(own), Some(run)) = (a.get(i), other) {
        let [start, end] = [own[0].max(run[0]), own[1].min(run[1])];
        if start < end {
            common.push([start, end]);
        }
        if own[1] < run[1] {
            i += 1;
        } else {
            other = b.next();
        }
    }
}

/// The steps from a voxel to all that a ball about it reaches.
struct Reach {
    /// The outermost first: they empty a row soonest.
    lines: Vec<Line>,
    /// The most steps along each axis.
    far: [i64; 3],
}

/// Steps along x, in a row so many rows away.
struct Line {
    row: [i64; 2],
    /// The first and the last step; one is the other's negative only where axes are square.
    ends: [i64; 2],
}

impl Line {
    /// The runs of the row that it leads to from row `[y, z]`, or back.
    fn of<'a>(&self, solid: &'a Spans, [y, z]: [i64; 2], way: i64) -> &'a [[u32; 2]] {
        let at = [y + way * self.row[0], z + way * self.row[1]].map(usize::try_from);
        let [Ok(y), Ok(z)] = at else { return &[] };
        solid.row(y, z)
    }
}

impl Reach {
    fn new(placement: &Placement, radius: f64) -> Result<Self, BallError> {
        if !radius.is_finite() || radius < 0.0 {
            return Err(BallError::Radius(radius));
        }
        let axes = DMat3::from_cols_array_2d(&placement.axes);
        let back = axes.inverse().transpose();
        let radius_too = radius * (1.0 + SLACK);
        let far = [back.x_axis, back.y_axis, back.z_axis].map(|row| row.length() * radius_too);
        let rows = (2.0 * far[1] + 1.0) * (2.0 * far[2] + 1.0);
        if rows.is_nan() || rows > MOST_ROWS || far[0].is_nan() || far[0] > MOST_VOXELS as f64 {
            return Err(BallError::TooLarge(radius));
        }
        let far = far.map(|n| n as i64);
        let length =
            |x: i64, y: i64, z: i64| (axes * DVec3::from([x, y, z].map(|i| i as f64))).length();
        let mut lines = Vec::new();
        for z in -far[2]..=far[2] {
            for y in -far[1]..=far[1] {
                // Nearest where the way is square to x; from there on it only gets longer.
                let away = axes * DVec3::new(0.0, y as f64, z as f64);
                let middle = -away.dot(axes.x_axis) / axes.x_axis.length_squared();
                let is_in = |x: &i64| length(*x, y, z) <= radius_too;
                let half = (radius_too * radius_too
                    - (away + middle * axes.x_axis).length_squared())
                .max(0.0)
                .sqrt()
                    / axes.x_axis.length();
                let [low, high] = [(middle - half).floor() as i64, (middle + half).ceil() as i64];
                let first = (low - 1..=high + 1).find(is_in);
                let last = (low - 1..=high + 1).rev().find(is_in);
                lines.extend(first.zip(last).map(|(a, b)| Line { row: [y, z], ends: [a, b] }));
            }
        }
        lines.sort_by_key(|l| std::cmp::Reverse(l.row[0].abs().max(l.row[1].abs())));
        Ok(Self { lines, far })
    }
}

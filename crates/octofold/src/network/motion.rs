//! Rigid motion and scaling, exactly.
//!
//! A voxel of the result is filled where the voxel that holds its centre's preimage is: no holes, and
//! the same bits everywhere, since preimages are sums of integers. The work is that of the surface:
//! where a voxel of the result differs from a neighbour, the way between their preimages passes
//! through a surface voxel, so the preimage lies within the length of that way plus half a voxel's
//! diagonal of a node. Only such a band is looked up; between its parts rows do not change. Source:
//! specification (A7).

use super::{MOST_VOXELS, Network, NetworkError, Stretch};
use crate::par;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
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

/// Stretches that one unit of work takes.
const BLOCK: usize = 4096;

/// Rows of the result that one unit of work takes.
const ROWS: usize = 256;

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

    fn fixed(&self, at: [u32; 3]) -> [i64; 3] {
        std::array::from_fn(|a| {
            let steps = (0..3).map(|b| self.columns[b][a] * i64::from(at[b]));
            self.start[a] + steps.sum::<i64>()
        })
    }

    /// The same in double precision: the matrix, and the preimage of voxel 0 0 0.
    fn in_doubles(&self) -> (DMat3, DVec3) {
        let [x, y, z] = self.columns.map(|c| DVec3::from(c.map(|x| x as f64 / ONE)));
        (DMat3::from_cols(x, y, z), DVec3::from(self.start.map(|x| x as f64 / ONE)) - 0.5)
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
    let Some(extent) = solid.extent() else { return Ok(solid.clone()) };
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
    if !size.is_finite() || size.max_element() > MOST_VOXELS as f64 || low.abs().max_element() > FAR
    {
        return Err(MotionError::TooFar);
    }
    let dims = size.to_array().map(|n| n.max(1.0) as usize);
    let mut placement = solid.placement;
    placement.origin = solid.placement.place(low.to_array());
    let preimage = Preimage::new(linear, shift - low)?;
    let network = Network::new(solid, run).map_err(|error| match error {
        NetworkError::TooLong { .. } => MotionError::TooFar,
        NetworkError::Cancelled(cancelled) => cancelled.into(),
    })?;
    moved(&network, &preimage, dims, placement, run)
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
    let band = Band::new(preimage, dims)?;
    let mut stretches: Vec<([u32; 2], Stretch)> = Vec::new();
    network.for_each_row(|row, own| stretches.extend(own.iter().map(|&s| (row, s))));
    let parts = par::blocks(run, stretches.len(), BLOCK, |range| {
        let mut parts = Vec::new();
        for &(row, stretch) in &stretches[range] {
            band.round(row, stretch, |part| parts.push(part));
        }
        parts
    })?;
    let mut parts = parts.concat();
    par::sort(&mut parts);
    let mut rows: Vec<([u32; 2], &[Part])> =
        parts.chunk_by(|a, b| a.row == b.row).map(|parts| (parts[0].row, parts)).collect();
    let cut = band.cut_rows(&stretches);
    if let Some(cut) = &cut {
        let of_row = |row| rows.binary_search_by_key(&row, |r| r.0).map_or(&[][..], |i| rows[i].1);
        rows = cut.iter().map(|&row| (row, of_row(row))).collect();
    }
    let solid = network.spans();
    let found = par::blocks(run, rows.len(), ROWS, |range| {
        let runs = |&(row, parts): &([u32; 2], &[Part])| {
            let [z, y] = row;
            let runs = fill(&solid, preimage, row, parts, [cut.is_some() as u32, dims[0] as u32]);
            runs.into_iter().map(move |run| ([y, z], run))
        };
        rows[range].iter().flat_map(runs).collect::<Vec<_>>()
    })?;
    Ok(Spans::from_runs(dims, placement, found.into_iter().flatten()))
}

/// Voxels of one row of the result that must be looked up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Part {
    /// z and y.
    row: [u32; 2],
    start: u32,
    end: u32,
}

/// The voxels of the result whose preimages lie near nodes.
struct Band {
    inverse: DMat3,
    origin: DVec3,
    linear: DMat3,
    reach: f64,
    /// How far the band reaches beyond an image of a node along each axis.
    wide: DVec3,
    dims: [usize; 3],
}

impl Band {
    fn new(preimage: &Preimage, dims: [usize; 3]) -> Result<Self, MotionError> {
        let (inverse, origin) = preimage.in_doubles();
        let linear = inverse.inverse();
        if !linear.is_finite() {
            return Err(MotionError::Flat);
        }
        let step = [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(DVec3::length);
        let reach = step[0].max(step[1]).max(step[2]) + 0.75f64.sqrt() + SLACK;
        let rows = linear.transpose();
        let wide = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        Ok(Self { inverse, origin, linear, reach, wide: wide * reach, dims })
    }

    /// Calls `visit` with the rows round a stretch.
    fn round(&self, [y, z]: [u32; 2], stretch: Stretch, mut visit: impl FnMut(Part)) {
        let ends = [stretch.start, stretch.end - 1];
        let ends = ends.map(|x| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
        let [a, b] = ends.map(|p| self.linear * (p - self.origin));
        let (low, high) = (a.min(b) - self.wide, a.max(b) + self.wide);
        for z in self.clip(2, low.z, high.z) {
            // Only a part of the stretch is near this slice.
            let along = |z: f64| ((z - a.z) / (b.z - a.z)).clamp(0.0, 1.0);
            let near = if (b.z - a.z).abs() < 1e-9 {
                [0.0, 1.0]
            } else {
                let z = f64::from(z);
                let [p, q] = [along(z - self.wide.z), along(z + self.wide.z)];
                [p.min(q), p.max(q)]
            };
            let [p, q] = near.map(|t| a.y + (b.y - a.y) * t);
            for y in self.clip(1, p.min(q) - self.wide.y, p.max(q) + self.wide.y) {
                if let Some([start, end]) = self.on_row([z, y], ends) {
                    let span = self.clip(0, start, end);
                    if !span.is_empty() {
                        visit(Part { row: [z, y], start: span.start, end: span.end });
                    }
                }
            }
        }
    }

    /// All rows that may hold something, where the grid cuts through the solid at its low end along
    /// x: such rows may begin inside, far from any node.
    fn cut_rows(&self, stretches: &[([u32; 2], Stretch)]) -> Option<Vec<[u32; 2]>> {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let nodes = stretches.iter().flat_map(|&([y, z], s)| {
            [s.start, s.end - 1].map(|x| DVec3::new(f64::from(x), f64::from(y), f64::from(z)))
        });
        let images = nodes.map(|p| self.linear * (p - self.origin));
        let (low, high) = images.fold(none, |(low, high), at| (low.min(at), high.max(at)));
        let (low, high) = (low - self.wide, high + self.wide);
        (low.x < 0.0).then(|| {
            let slices = self.clip(2, low.z, high.z);
            slices.flat_map(|z| self.clip(1, low.y, high.y).map(move |y| [z, y])).collect()
        })
    }

    /// Places from `low` to `high` in the grid.
    fn clip(&self, axis: usize, low: f64, high: f64) -> Range<u32> {
        let last = self.dims[axis] as f64 - 1.0;
        if high < 0.0 || low > last {
            return 0..0;
        }
        low.ceil().max(0.0) as u32..high.floor().min(last) as u32 + 1
    }

    /// From where to where a row's preimages lie within reach of the way between two nodes along x.
    fn on_row(&self, [z, y]: [u32; 2], [a, b]: [DVec3; 2]) -> Option<[f64; 2]> {
        let from =
            self.origin + self.inverse.y_axis * f64::from(y) + self.inverse.z_axis * f64::from(z);
        let way = self.inverse.x_axis;
        let mut found: Option<[f64; 2]> = None;
        let mut add = |[low, high]: [f64; 2]| {
            let [l, h] = found.unwrap_or([low, high]);
            found = Some([l.min(low), h.max(high)]);
        };
        for end in [a, b] {
            if let Some(near) = within(from - end, way, self.reach) {
                add(near);
            }
        }
        // Straight beside the way: within reach of the line, and between its ends.
        let flat = |v: DVec3| DVec3::new(0.0, v.y, v.z);
        if let Some([low, high]) = within(flat(from - a), flat(way), self.reach) {
            let [p, q] = [a, b].map(|end| (end.x - from.x) / way.x);
            let between = if way.x == 0.0 {
                (a.x..=b.x).contains(&from.x).then_some([low, high])
            } else {
                let (low, high) = (low.max(p.min(q)), high.min(p.max(q)));
                (low <= high).then_some([low, high])
            };
            if let Some(between) = between {
                add(between);
            }
        }
        found
    }
}

/// Where `from + t way` is no longer than `reach`.
fn within(from: DVec3, way: DVec3, reach: f64) -> Option<[f64; 2]> {
    let (a, b) = (way.length_squared(), from.dot(way));
    let c = from.length_squared() - reach * reach;
    if a == 0.0 {
        return (c <= 0.0).then_some([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let root = b * b - a * c;
    (root >= 0.0).then(|| [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a])
}

/// The runs of a row of the result, of which `parts` must be looked up; so must its first voxels.
fn fill(
    solid: &Spans,
    preimage: &Preimage,
    [z, y]: [u32; 2],
    parts: &[Part],
    [first, width]: [u32; 2],
) -> Vec<[u32; 2]> {
    let mut runs = Vec::new();
    let mut start = None;
    let mut next = 0;
    for (from, to) in std::iter::once((0, first)).chain(parts.iter().map(|p| (p.start, p.end))) {
        for x in from.max(next)..to {
            let at = preimage.of([x, y, z]);
            let inside = at.iter().all(|&i| (0..1 << 17).contains(&i))
                && solid.contains(at.map(|i| i as u32));
            match (start, inside) {
                (None, true) => start = Some(x),
                (Some(from), false) => {
                    runs.push([from, x]);
                    start = None;
                }
                _ => {}
            }
        }
        next = next.max(to);
    }
    // Beyond the last part nothing changes.
    runs.extend(start.map(|from| [from, width]));
    runs
}

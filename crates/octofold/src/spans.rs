//! Solids as runs of cells along x: the form in which large solids fit in memory.
//!
//! Only rows that hold something are kept, so memory grows with the surface and not with the
//! volume.

pub(crate) mod boxes;

use crate::attributes::LengthUnit;
use crate::par;
use crate::rows::Rows;
use crate::run::Run;
use crate::volume::{Block, Placement, Region, Scalar, ScalarType, Volume, VolumeError};
use crate::with_samples;
use std::borrow::Cow;
use std::ops::Range;

/// Slices that one unit of work takes.
const BLOCK: usize = 8;

/// A set of cells of a grid, as maximal runs along x.
#[derive(Debug, Clone, PartialEq)]
pub struct Spans {
    dims: [usize; 3],
    /// Where cell centres lie in the world.
    pub placement: Placement,
    rows: Rows<[u32; 2]>,
}

impl Spans {
    /// An empty set of cells.
    pub fn empty(dims: [usize; 3], placement: Placement) -> Self {
        Self::from_rows(dims, placement, [])
    }

    /// Collects runs in order of slice, row and start; runs that touch are joined.
    pub(crate) fn from_runs(
        dims: [usize; 3],
        placement: Placement,
        ordered: impl IntoIterator<Item = ([u32; 2], [u32; 2])>,
    ) -> Self {
        let rows = Rows::collect(dims[2], ordered, |last: &mut [u32; 2], run| {
            let touches = last[1] >= run[0];
            if touches {
                last[1] = last[1].max(run[1]);
            }
            touches
        });
        Self { dims, placement, rows }
    }

    /// Joins tables of runs, slice after slice; runs of a row do not touch.
    pub(crate) fn from_rows(
        dims: [usize; 3],
        placement: Placement,
        parts: impl IntoIterator<Item = Rows<[u32; 2]>>,
    ) -> Self {
        let mut rows = Rows::default();
        parts.into_iter().for_each(|part| rows.append(part));
        rows.fill_to(dims[2]);
        Self { dims, placement, rows }
    }

    /// The table of its runs.
    pub(crate) fn rows(&self) -> &Rows<[u32; 2]> {
        &self.rows
    }

    /// The samples of a volume that are `iso` or more; those that are 1, of a volume of runs.
    pub fn at_least(volume: &dyn Volume, iso: f64, run: &Run) -> Result<Self, VolumeError> {
        run.stage("solid");
        Self::slab_at_least(volume, iso, 0..volume.dims()[2], run)
    }

    /// The same of some slices, as a solid of their own.
    pub fn slab_at_least(
        volume: &dyn Volume,
        iso: f64,
        slices: Range<usize>,
        run: &Run,
    ) -> Result<Self, VolumeError> {
        let [width, height, _] = volume.dims();
        let parts = par::blocks(run, slices.len(), BLOCK, |block| {
            let mut rows = Rows::default();
            for z in block {
                add_slice(&mut rows, volume, iso, slices.start + z)?;
                rows.end_slice();
            }
            Ok(rows)
        })?;
        let parts = parts.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
        let mut placement = volume.placement();
        placement.origin = placement.place([0.0, 0.0, slices.start as f64]);
        Ok(Self::from_rows([width, height, slices.len()], placement, parts))
    }

    /// Stacks solids of one width and height, the first lowest.
    pub fn stack(
        [width, height]: [usize; 2],
        placement: Placement,
        slabs: impl IntoIterator<Item = Self>,
    ) -> Self {
        let mut rows = Rows::default();
        let mut depth = 0;
        for slab in slabs {
            depth += slab.dims[2];
            rows.append(slab.rows);
        }
        Self { dims: [width, height, depth], placement, rows }
    }

    /// The part of the set in a box of `dims` cells from `start` on, which may lie beyond the grid; the
    /// placement is that of the box.
    pub fn framed(&self, start: [i64; 3], dims: [usize; 3]) -> Self {
        let mut rows = Rows::default();
        let [x0, y0, z0] = start;
        let width = dims[0] as i64;
        for z in z0..z0 + dims[2] as i64 {
            let inside = usize::try_from(z).ok().filter(|&z| z < self.dims[2]);
            for (y, runs) in
                inside.into_iter().flat_map(|z| self.rows.of_slice(z, y0.max(0) as u32))
            {
                let y = i64::from(y) - y0;
                if y >= dims[1] as i64 {
                    break;
                }
                for run in runs {
                    let [start, end] = run.map(|x| (i64::from(x) - x0).clamp(0, width) as u32);
                    if start < end {
                        rows.push([start, end]);
                    }
                }
                rows.end_row(y as u32);
            }
            rows.end_slice();
        }
        let mut placement = self.placement;
        placement.origin = self.placement.place(start.map(|i| i as f64));
        Self { dims, placement, rows }
    }

    /// The least box that holds the set, as its low and high corners; `None` where it is empty.
    pub fn extent(&self) -> Option<Region> {
        let mut region: Option<Region> = None;
        self.for_each_row(|[y, z], runs| {
            let start = [runs[0][0], y, z].map(|i| i as usize);
            let end = [runs[runs.len() - 1][1], y + 1, z + 1].map(|i| i as usize);
            let known = region.unwrap_or(Region { start, end });
            region = Some(Region {
                start: std::array::from_fn(|a| start[a].min(known.start[a])),
                end: std::array::from_fn(|a| end[a].max(known.end[a])),
            });
        });
        region
    }

    /// The runs of a row, `[start, end)` along x.
    pub fn row(&self, y: usize, z: usize) -> &[[u32; 2]] {
        self.rows.row(y, z).1
    }

    /// The rows of a slice that hold something, with their y.
    pub fn of_slice(&self, z: usize) -> impl ExactSizeIterator<Item = (u32, &[[u32; 2]])> + Clone {
        self.rows.of_slice(z, 0)
    }

    /// Calls `visit` with row `[y, z]` and its runs, in order, for every row that holds something.
    pub fn for_each_row(&self, mut visit: impl FnMut([u32; 2], &[[u32; 2]])) {
        for z in 0..self.dims[2] {
            self.of_slice(z).for_each(|(y, runs)| visit([y, z as u32], runs));
        }
    }

    /// True where the cell is in the set; cells outside the grid are not.
    pub fn contains(&self, [x, y, z]: [u32; 3]) -> bool {
        if z as usize >= self.dims[2] {
            return false;
        }
        let row = self.row(y as usize, z as usize);
        let after = row.partition_point(|run| run[0] <= x);
        after > 0 && x < row[after - 1][1]
    }

    /// Number of cells in the set.
    pub fn count(&self) -> u64 {
        self.rows.items().iter().map(|r| u64::from(r[1] - r[0])).sum()
    }

    /// Sets the unit of the world coordinates.
    #[must_use]
    pub fn in_unit(mut self, unit: Option<LengthUnit>) -> Self {
        self.placement.unit = unit;
        self
    }
}

/// Adds the rows of a slice of a volume.
fn add_slice(
    rows: &mut Rows<[u32; 2]>,
    volume: &dyn Volume,
    iso: f64,
    z: usize,
) -> Result<(), VolumeError> {
    let [width, height, _] = volume.dims();
    if volume.runs(0, z).is_some() {
        for y in 0..height {
            rows.extend(volume.runs(y, z).unwrap_or_default());
            rows.end_row(y as u32);
        }
        return Ok(());
    }
    let slice = Region { start: [0, 0, z], end: [width, height, z + 1] };
    with_samples!(volume.read(slice)?, samples => {
        for (y, row) in samples.chunks_exact(width.max(1)).enumerate() {
            let mut x = 0;
            for part in row.chunk_by(|a, b| (a.to_f64() >= iso) == (b.to_f64() >= iso)) {
                let end = x + part.len() as u32;
                if part[0].to_f64() >= iso {
                    rows.push([x, end]);
                }
                x = end;
            }
            rows.end_row(y as u32);
        }
    });
    Ok(())
}

impl Volume for Spans {
    fn dims(&self) -> [usize; 3] {
        self.dims
    }

    fn placement(&self) -> Placement {
        self.placement
    }

    fn scalar_type(&self) -> ScalarType {
        ScalarType::U8
    }

    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError> {
        let [w, h, _] = region.dims();
        let [x0, y0, z0] = region.start;
        let mut out = vec![0u8; region.len()];
        for z in z0..region.end[2] {
            for (y, runs) in self.rows.of_slice(z, y0 as u32) {
                let y = y as usize;
                if y >= region.end[1] {
                    break;
                }
                let line = ((z - z0) * h + (y - y0)) * w;
                for run in runs {
                    let [start, end] = run.map(|x| (x as usize).clamp(x0, region.end[0]) - x0);
                    out[line + start..line + end].fill(1);
                }
            }
        }
        Ok(Block::U8(Cow::Owned(out)))
    }

    fn bounds(&self, region: Region) -> Option<[f64; 2]> {
        let [x0, y0, z0] = region.start.map(|i| i as u32);
        let [x1, y1, z1] = region.end.map(|i| i as u32);
        if region.is_empty() {
            return None;
        }
        let mut empty = true;
        let mut full = true;
        for z in z0..z1 {
            let rows = self.rows.of_slice(z as usize, y0);
            let count = rows.len() - self.rows.of_slice(z as usize, y1).len();
            full &= count == (y1 - y0) as usize;
            for (_, runs) in rows.take(count) {
                let at = runs.partition_point(|run| run[1] <= x0);
                let run = runs.get(at).filter(|run| run[0] < x1);
                empty &= run.is_none();
                full &= run.is_some_and(|run| run[0] <= x0 && run[1] >= x1);
                if !empty && !full {
                    return Some([0.0, 1.0]);
                }
            }
        }
        Some([f64::from(u8::from(full)), f64::from(u8::from(!empty))])
    }

    fn runs(&self, y: usize, z: usize) -> Option<&[[u32; 2]]> {
        Some(self.row(y, z))
    }

    fn is_binary(&self) -> bool {
        true
    }

    fn nonzero(&self) -> Option<u64> {
        Some(self.count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::DenseVolume;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(256))]

        #[test]
        fn runs_say_what_their_cells_say(
            dims in (1usize..20, 1usize..5, 1usize..5),
            cells in prop::collection::vec(any::<bool>(), 20 * 5 * 5),
            corner in (0usize..20, 0usize..5, 0usize..5),
        ) {
            let dims = [dims.0, dims.1, dims.2];
            let inside = |x: usize, y: usize, z: usize| cells[(z * 5 + y) * 20 + x];
            let mut runs = Vec::new();
            for z in 0..dims[2] {
                for y in 0..dims[1] {
                    for x in (0..dims[0]).filter(|&x| inside(x, y, z)) {
                        runs.push(([y as u32, z as u32], [x as u32, x as u32 + 1]));
                    }
                }
            }
            let count = runs.len() as u64;
            let spans = Spans::from_runs(dims, Placement::default(), runs);
            prop_assert_eq!(spans.count(), count);
            let gray = |i: usize| cells[i / dims[0] / dims[1] * 100 + i / dims[0] % dims[1] * 20 + i % dims[0]];
            let gray = (0..dims[0] * dims[1] * dims[2]).map(|i| if gray(i) { 7.5f32 } else { f32::NAN });
            let gray = DenseVolume::new(dims, gray.collect(), Placement::default()).unwrap();
            prop_assert_eq!(&Spans::at_least(&gray, 7.5, &Run::default()).unwrap(), &spans);
            prop_assert_eq!(&Spans::at_least(&spans, 0.5, &Run::default()).unwrap(), &spans);
            let start = [corner.0 % dims[0], corner.1 % dims[1], corner.2 % dims[2]];
            let region = Region { start, end: dims };
            let block = spans.read(region).unwrap();
            let mut range = [1.0, 0.0f64];
            let mut i = 0;
            for z in start[2]..dims[2] {
                for y in start[1]..dims[1] {
                    for x in start[0]..dims[0] {
                        let expected = inside(x, y, z);
                        prop_assert_eq!(block.value(i) == 1.0, expected);
                        prop_assert_eq!(spans.contains([x, y, z].map(|i| i as u32)), expected);
                        range = [range[0].min(block.value(i)), range[1].max(block.value(i))];
                        i += 1;
                    }
                }
            }
            prop_assert_eq!(spans.bounds(region), Some(range));
        }
    }
}

//! The voxels before a voxel, as bits.
//!
//! Slices are kept as runs; what a prediction looks at is cut out of them as words of 64 voxels, so
//! that the work is that of the runs and never that of the voxels between them.

use crate::rows::Rows;

/// Slices that are kept: the one in the making and those before it.
pub const SLICES: usize = 6;

/// Voxels of a word that lie before the first and behind the last voxel that it serves.
pub const MARGIN: u32 = 8;

/// Voxels that a word serves.
pub const SERVED: u32 = 64 - 2 * MARGIN;

/// The runs of one slice.
#[derive(Debug, Clone, Default)]
pub struct Slice {
    /// One past the last run of each row that is there.
    ends: Vec<usize>,
    runs: Vec<[u32; 2]>,
}

impl Slice {
    /// The runs of a row; none beyond the slice.
    pub fn row(&self, y: i64) -> &[[u32; 2]] {
        let Some(&end) = usize::try_from(y).ok().and_then(|y| self.ends.get(y)) else {
            return &[];
        };
        let start = if y == 0 { 0 } else { self.ends[y as usize - 1] };
        &self.runs[start..end]
    }

    /// Adds a row.
    pub fn push(&mut self, runs: &[[u32; 2]]) {
        self.runs.extend_from_slice(runs);
        self.ends.push(self.runs.len());
    }

    /// Takes all rows away.
    pub fn clear(&mut self) {
        self.ends.clear();
        self.runs.clear();
    }

    /// Adds all rows to a table.
    pub fn append_to(&self, rows: &mut Rows<[u32; 2]>) {
        let mut start = 0;
        for (y, &end) in self.ends.iter().enumerate() {
            if start < end {
                rows.extend(&self.runs[start..end]);
                rows.end_row(y as u32);
            }
            start = end;
        }
    }

    /// All runs.
    pub fn runs(&self) -> &[[u32; 2]] {
        &self.runs
    }
}

/// A row that is looked at from low to high x.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cursor<'a> {
    runs: &'a [[u32; 2]],
}

impl<'a> Cursor<'a> {
    /// At the start of a row.
    pub fn new(runs: &'a [[u32; 2]]) -> Self {
        Self { runs }
    }

    /// Forgets what lies before x.
    #[inline]
    fn advance(&mut self, x: i64) {
        while let Some((run, rest)) = self.runs.split_first()
            && i64::from(run[1]) <= x
        {
            self.runs = rest;
        }
    }

    /// The first place from `x` on within `reach` of a voxel that is not `value`; `x` never falls.
    #[inline]
    pub fn differs(&mut self, x: u32, reach: u32, value: bool) -> u32 {
        self.advance(i64::from(x) - i64::from(MARGIN));
        let from = i64::from(x) - i64::from(reach);
        let run = self.runs.iter().find(|run| i64::from(run[1]) > from);
        match (run, value) {
            (None, false) => u32::MAX,
            (Some(run), false) => x.max(run[0].saturating_sub(reach)),
            (Some(run), true) if i64::from(run[0]) <= from => x.max(run[1] - reach),
            (_, true) => x,
        }
    }

    /// The 64 voxels from `start` on; `start` never falls.
    #[inline]
    pub fn word(&mut self, start: i64) -> u64 {
        self.advance(start);
        word(self.runs, start)
    }
}

/// The 64 voxels from `start` on.
#[inline]
pub fn word(runs: &[[u32; 2]], start: i64) -> u64 {
    let mut word = 0;
    for run in runs {
        let low = i64::from(run[0]) - start;
        if low >= 64 {
            break;
        }
        let high = i64::from(run[1]) - start;
        if high > 0 {
            word |= below(high.min(64)) & !below(low.max(0));
        }
    }
    word
}

/// The lowest `count` bits.
#[inline]
fn below(count: i64) -> u64 {
    if count >= 64 { u64::MAX } else { (1 << count) - 1 }
}

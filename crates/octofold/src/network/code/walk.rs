//! The way through a solid, slice by slice and row by row: which voxels are coded, and in which order.
//!
//! Sixteen voxels before a voxel (the same row, two rows below it, three rows of the slice before,
//! and one of the slice before that) tell nearly always what it is. Where they are all the same the
//! voxel is quiet and follows them; a quiet stretch says once whether something is born in it. All
//! other voxels are left to a model. Quiet stretches are found from the ends of runs, so the work is
//! that of the surface. Encoder and decoder take the same way. Source: specification (D3.3).

use super::neighbourhood::{Cursor, MARGIN, SERVED, SLICES, Slice, word};
use crate::range::{Chance, Coder, Number};

/// What tells the chance of a voxel from those before it.
pub trait Model {
    /// Rows that predictions look at, as slices before and rows above; the first are [`NEAR`].
    const ROWS: &'static [(usize, i64)];

    /// The chance in 2^32 that the voxel of bit `at` is filled; `words` are the rows of
    /// [`Model::ROWS`], `own` its own row so far, `near` the sixteen voxels.
    fn predict(&mut self, words: &[u64], own: u64, at: u32, near: u32) -> u32;

    /// Learns what the voxel that was predicted last is.
    fn learn(&mut self, filled: bool);
}

/// Rows that tell whether a voxel is quiet, and how far to both sides.
pub const NEAR: [(usize, i64, u32); 6] =
    [(0, -1, 1), (0, -2, 0), (1, -1, 1), (1, 0, 1), (1, 1, 1), (2, 0, 0)];

/// Most rows that a model may look at.
pub const MOST_ROWS: usize = 32;

/// All sixteen voxels.
const ALL: u32 = 0xFFFF;

/// The sixteen voxels before the voxel of bit `at`.
#[inline]
fn near(words: &[u64; MOST_ROWS], own: u64, at: u32) -> u32 {
    let bits = |word: u64, shift: u32, mask: u64| (word >> shift & mask) as u32;
    bits(own, at - 2, 3)
        | bits(words[0], at - 1, 7) << 2
        | bits(words[1], at, 1) << 5
        | bits(words[2], at - 1, 7) << 6
        | bits(words[3], at - 1, 7) << 9
        | bits(words[4], at - 1, 7) << 12
        | bits(words[5], at, 1) << 15
}

/// The slices of a solid, as far as they are known to both sides.
#[derive(Debug)]
pub struct Walk {
    width: u32,
    height: u32,
    most: u64,
    /// The slice in the making, then those before it.
    slices: [Slice; SLICES],
    births: Births,
}

impl Walk {
    /// Before the first slice of `width` by `height` voxels, which may have any number of runs.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            most: u64::MAX,
            slices: Default::default(),
            births: Births::default(),
        }
    }

    /// The same for slices of at most so many runs.
    pub fn with_most(self, most: u64) -> Self {
        Self { most, ..self }
    }

    /// Codes the next slice and returns it; `source` tells an encoder its rows. `None` where bytes ran
    /// out or there are too many runs.
    pub fn slice<'s, M: Model>(
        &mut self,
        model: &mut M,
        coder: &mut impl Coder,
        mut source: impl FnMut(u32) -> &'s [[u32; 2]],
    ) -> Option<&Slice> {
        self.slices.rotate_right(1);
        self.slices[0].clear();
        self.births.next_slice();
        let mut row = Vec::new();
        for y in 0..self.height {
            row.clear();
            self.row(model, coder, y, source(y), &mut row);
            self.slices[0].push(&row);
            if coder.is_overrun() || self.slices[0].runs().len() as u64 > self.most {
                return None;
            }
        }
        Some(&self.slices[0])
    }

    /// Codes a row into `own`.
    fn row<M: Model>(
        &mut self,
        model: &mut M,
        coder: &mut impl Coder,
        y: u32,
        source: &[[u32; 2]],
        own: &mut Vec<[u32; 2]>,
    ) {
        let mut rows = [Cursor::default(); MOST_ROWS];
        for (cursor, &(back, up)) in rows.iter_mut().zip(M::ROWS) {
            *cursor = Cursor::new(self.slices[back].row(i64::from(y) + up));
        }
        let mut source = Cursor::new(source);
        let mut run = Growing { runs: own, start: None };
        let mut words = [0; MOST_ROWS];
        let mut quiet = Some(false);
        let mut x = 0;
        while x < self.width {
            if let Some(value) = quiet {
                let until = NEAR.iter().zip(&mut rows);
                let until = until.map(|(&(.., reach), row)| row.differs(x, reach, value)).min();
                let until = until.unwrap_or(u32::MAX).min(self.width);
                let born = source.differs(x, 0, value);
                if until > x {
                    let stretch = Stretch { start: x, end: until, row: y, value };
                    let Some(at) = self.births.code(coder, stretch, born) else {
                        x = until;
                        continue;
                    };
                    run.turn(at);
                    x = at + 1;
                    if x == self.width {
                        break;
                    }
                }
            }
            let start = i64::from(x) - i64::from(MARGIN);
            for (word, row) in words.iter_mut().zip(&mut rows[..M::ROWS.len()]) {
                *word = row.word(start);
            }
            let truth = source.word(start);
            let mut own = run.word(x, start);
            let end = MARGIN + SERVED.min(self.width - x);
            let mut at = MARGIN;
            quiet = None;
            while at < end {
                let near = near(&words, own, at);
                if near == 0 || near == ALL {
                    quiet = Some(near == ALL);
                    break;
                }
                let chance = model.predict(&words[..M::ROWS.len()], own, at, near);
                let filled = coder.code(chance, truth >> at & 1 == 1);
                model.learn(filled);
                if filled != run.start.is_some() {
                    run.turn(x + at - MARGIN);
                }
                own |= u64::from(filled) << at;
                at += 1;
            }
            x += at - MARGIN;
        }
        run.end(self.width);
    }
}

/// A row in the making.
struct Growing<'a> {
    runs: &'a mut Vec<[u32; 2]>,
    /// Start of the run that has not ended.
    start: Option<u32>,
}

impl Growing<'_> {
    /// From `x` on the other value holds.
    fn turn(&mut self, x: u32) {
        match self.start.take() {
            Some(start) => self.runs.push([start, x]),
            None => self.start = Some(x),
        }
    }

    /// The row ends.
    fn end(&mut self, width: u32) {
        if self.start.is_some() {
            self.turn(width);
        }
    }

    /// The voxels from `start` on, before `x`.
    fn word(&self, x: u32, start: i64) -> u64 {
        let recent = self.runs.len().saturating_sub(MARGIN as usize);
        let open = self.start.map_or([0, 0], |start| [start, x]);
        word(&self.runs[recent..], start) | word(&[open], start)
    }
}

/// Voxels that are all quiet.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    start: u32,
    end: u32,
    row: u32,
    value: bool,
}

/// Births in quiet stretches: whether, and where.
#[derive(Debug)]
struct Births {
    /// Whether one happens, by value, by how many there were in this slice or the one before, and
    /// by whether the last one was in this row or the one above.
    happens: [Chance; 16],
    /// Whether it is nearer to the stretch's end.
    behind: [Chance; 2],
    /// How far from the nearer end it is.
    distance: Number,
    counts: [u32; 2],
    last_row: Option<u32>,
}

impl Default for Births {
    fn default() -> Self {
        Self {
            happens: [Chance::RARE; 16],
            behind: [Chance::EVEN; 2],
            distance: Number::default(),
            counts: [0; 2],
            last_row: None,
        }
    }
}

impl Births {
    fn next_slice(&mut self) {
        self.counts = [0, self.counts[0]];
        self.last_row = None;
    }

    /// Codes whether and where the first birth in a stretch is; `born` tells an encoder.
    fn code(&mut self, coder: &mut impl Coder, stretch: Stretch, born: u32) -> Option<u32> {
        let Stretch { start, end, row, value } = stretch;
        let many = (self.counts[0] + self.counts[1]).min(3) as usize;
        let close = self.last_row.is_some_and(|last| row - last <= 1);
        let context = usize::from(value) * 8 + many * 2 + usize::from(close);
        if !self.happens[context].code(coder, born < end) {
            return None;
        }
        self.counts[0] += 1;
        self.last_row = Some(row);
        let last = end - 1 - start;
        // Distance from the nearer end.
        let half = last / 2;
        let before = born.wrapping_sub(start);
        let behind = last > 0 && self.behind[usize::from(value)].code(coder, before > half);
        let most = if behind { last - half - 1 } else { half };
        let distance = if behind { last.wrapping_sub(before) } else { before };
        let distance = self.distance.code(coder, distance, most);
        Some(if behind { end - 1 - distance } else { start + distance })
    }
}

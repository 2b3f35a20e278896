//! The way through a solid, slice by slice and row by row: which voxels are coded, and in which order.
//!
//! Sixteen voxels before a voxel (the same row, two rows below it, three rows of the slice before,
//! and one of the slice before that) tell nearly always what it is. Where they are all the same the
//! voxel is quiet and follows them; a quiet stretch says once whether something is born in it. All
//! other voxels are left to a model. Quiet stretches are found from the ends of runs, so the work is
//! that of the surface. Encoder and decoder take the same way.
//!
//! Beyond a solid there is nothing. Beyond a part of one there is what there is at its border: its
//! rows go on as they end, and a row that is not there is the one next to it; and a slice that is as
//! the one before is only named. Source: specification (D3.3).

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

/// Where the rows of a part go on to behind their end.
const FAR: u32 = 1 << 30;

/// What a row of the slice in the making takes, in decisions.
const ROW: u64 = 4;

/// The slices of a solid, as far as they are known to both sides.
#[derive(Debug)]
pub struct Walk {
    most: u64,
    /// The first voxel of a row; those of a part have room before them.
    low: u32,
    /// One past the last voxel of a row.
    high: u32,
    known: Known,
    births: Births,
    /// Whether a slice of a part is as the one before, by whether that was; and before any.
    same: [Chance; 3],
    was_same: usize,
    work: u64,
}

/// The slices that predictions look at.
#[derive(Debug)]
struct Known {
    /// Rows of a slice.
    height: u32,
    /// In any order.
    slices: [Slice; SLICES],
    /// The slice in the making, then those before it: their places, where one may stand for several.
    order: [usize; SLICES],
    /// Slices before the one in the making.
    z: u32,
    /// Whether it is a part of a solid, which goes on beyond its border.
    is_part: bool,
}

impl Known {
    /// A row before row `y` of the slice in the making: so many slices before and rows above.
    fn before(&self, y: u32, back: usize, up: i64) -> &[[u32; 2]] {
        let y = i64::from(y);
        if !self.is_part {
            return self.slices[self.order[back]].row(y + up);
        }
        let back = back.min(self.z as usize);
        let row = (y + up).clamp(0, i64::from(self.height) - 1);
        match (back, row.min(y - 1)) {
            (1.., _) => self.slices[self.order[back]].row(row),
            (_, -1) if self.z > 0 => self.slices[self.order[1]].row(0),
            (_, row) => self.slices[self.order[0]].row(row),
        }
    }

    /// Begins another slice and tells its place.
    fn begin(&mut self) -> usize {
        self.order.copy_within(..SLICES - 1, 1);
        let free = (0..SLICES).find(|i| !self.order[1..].contains(i)).unwrap_or(0);
        self.order[0] = free;
        self.slices[free].clear();
        free
    }

    /// Adds a slice that is as the one before.
    fn repeat(&mut self) {
        self.order.copy_within(..SLICES - 1, 1);
        self.z += 1;
    }
}

impl Walk {
    /// Before the first slice of `width` by `height` voxels, which may have any number of runs.
    pub fn new(width: u32, height: u32) -> Self {
        let known = Known {
            height,
            slices: Default::default(),
            order: std::array::from_fn(|i| i),
            z: 0,
            is_part: false,
        };
        Self {
            most: u64::MAX,
            low: 0,
            high: width,
            known,
            births: Births::default(),
            same: [Chance::told(90, 1), Chance::told(95, 1), Chance::told(50, 1)],
            was_same: 2,
            work: 0,
        }
    }

    /// The same for a part of a solid, which goes on beyond its border.
    pub fn of_part(width: u32, height: u32) -> Self {
        let mut walk = Self::new(width, height);
        walk.low += MARGIN;
        walk.high += MARGIN;
        walk.known.is_part = true;
        walk.births.happens = [Births::OF_PART; 16];
        walk
    }

    /// The same for slices of at most so many runs.
    pub fn with_most(self, most: u64) -> Self {
        Self { most, ..self }
    }

    /// How much there was to do so far, in decisions.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Codes the next slice and returns it; `source` tells an encoder its rows. `None` where bytes ran
    /// out or there are too many runs.
    pub fn slice<'s, M: Model>(
        &mut self,
        model: &mut M,
        coder: &mut impl Coder,
        mut source: impl FnMut(u32) -> &'s [[u32; 2]],
    ) -> Option<&Slice> {
        self.births.next_slice();
        if self.known.is_part && self.known.z > 0 {
            let told = (0..self.known.height).all(|y| self.runs(y).eq(source(y).iter().copied()));
            let is_same = self.same[self.was_same].code(coder, told);
            self.was_same = usize::from(is_same);
            if is_same {
                self.work += 1;
                self.known.repeat();
                return (!coder.is_overrun()).then(|| &self.known.slices[self.known.order[0]]);
            }
        }
        let place = self.known.begin();
        let mut row = Vec::new();
        for y in 0..self.known.height {
            row.clear();
            self.row(model, coder, y, source(y), &mut row);
            let slice = &mut self.known.slices[place];
            slice.push(&row);
            if coder.is_overrun() || slice.runs().len() as u64 > self.most {
                return None;
            }
        }
        self.known.z += 1;
        Some(&self.known.slices[place])
    }

    /// How many runs the last slice has.
    pub fn count(&self) -> u64 {
        self.known.slices[self.known.order[0]].runs().len() as u64
    }

    /// The runs of a row of the last slice.
    pub fn runs(&self, y: u32) -> impl Iterator<Item = [u32; 2]> {
        let row = self.known.slices[self.known.order[0]].row(i64::from(y)).iter();
        row.map(|&run| within(run, self.low, self.high))
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
        let (low, high) = (self.low, self.high);
        let mut rows = [Cursor::default(); MOST_ROWS];
        for (cursor, &(back, up)) in rows.iter_mut().zip(M::ROWS) {
            *cursor = Cursor::new(self.known.before(y, back, up));
        }
        let mut source = Cursor::new(source);
        let mut run = Growing { runs: own, start: None };
        let mut quiet = Some(false);
        if self.known.is_part {
            // Before the row there is what there is in the one above.
            let above = self.known.before(y, 0, -1).first();
            run.start = above.filter(|run| run[0] == 0).map(|_| 0);
            quiet = None;
        }
        let mut words = [0; MOST_ROWS];
        let mut decisions = 0;
        let mut x = low;
        while x < high {
            if let Some(value) = quiet {
                let until = NEAR.iter().zip(&mut rows);
                let until = until.map(|(&(.., reach), row)| row.differs(x, reach, value)).min();
                let until = until.unwrap_or(u32::MAX).min(high);
                let born = source.differs(x - low, 0, value).saturating_add(low);
                if until > x {
                    let first = self.known.is_part && self.known.z == 0 && y == 0;
                    let stretch = Stretch { start: x, end: until, row: y, value, first };
                    let Some(at) = self.births.code(coder, stretch, born) else {
                        x = until;
                        continue;
                    };
                    run.turn(at);
                    x = at + 1;
                    if x == high {
                        break;
                    }
                }
            }
            let start = i64::from(x) - i64::from(MARGIN);
            for (word, row) in words.iter_mut().zip(&mut rows[..M::ROWS.len()]) {
                *word = row.word(start);
            }
            let truth = source.word(start - i64::from(low));
            let mut own = run.word(x, start);
            let end = MARGIN + SERVED.min(high - x);
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
            decisions += u64::from(at - MARGIN);
            x += at - MARGIN;
        }
        run.end(high);
        self.work += ROW + decisions;
        if self.known.is_part {
            own.retain(|run| run[1] > low);
            for run in own {
                *run = [
                    if run[0] <= low { 0 } else { run[0] },
                    if run[1] >= high { FAR } else { run[1] },
                ];
            }
        }
    }
}

/// The part of a run in a row, counted from the first voxel of the row.
fn within(run: [u32; 2], low: u32, high: u32) -> [u32; 2] {
    run.map(|x| x.clamp(low, high) - low)
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
    /// Whether it is the first of a part.
    first: bool,
}

/// Births in quiet stretches: whether, and where.
#[derive(Debug)]
struct Births {
    /// Whether one happens, by value, by how many there were in this slice or the one before, and
    /// by whether the last one was in this row or the one above.
    happens: [Chance; 16],
    /// The same of the first stretch of a part.
    first: Chance,
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
            first: Chance::EVEN,
            behind: [Chance::EVEN; 2],
            distance: Number::default(),
            counts: [0; 2],
            last_row: None,
        }
    }
}

impl Births {
    /// Whether one happens in a part, as far as is known.
    const OF_PART: Chance = Chance::told(2, 4);

    fn next_slice(&mut self) {
        self.counts = [0, self.counts[0]];
        self.last_row = None;
    }

    /// Codes whether and where the first birth in a stretch is; `born` tells an encoder.
    fn code(&mut self, coder: &mut impl Coder, stretch: Stretch, born: u32) -> Option<u32> {
        let Stretch { start, end, row, value, first } = stretch;
        let many = (self.counts[0] + self.counts[1]).min(3) as usize;
        let close = self.last_row.is_some_and(|last| row - last <= 1);
        let context = usize::from(value) * 8 + many * 2 + usize::from(close);
        let happens = if first { &mut self.first } else { &mut self.happens[context] };
        if !happens.code(coder, born < end) {
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

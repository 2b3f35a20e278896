//! Which part of a solid is what: a box of bricks is one part, or it is halved.

use super::{Content, MOST_BRICKS, SIDE};
use crate::network::code::CodeError;
use crate::range::{Chance, Coder, Decoder};

/// The most bricks along a side of a part.
pub const MOST_ALONG: usize = 8;

/// A box of bricks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    pub start: [usize; 3],
    pub size: [usize; 3],
}

impl Cell {
    /// All bricks of a box of voxels.
    pub fn all(dims: [usize; 3]) -> Self {
        Self { start: [0; 3], size: counts(dims) }
    }

    /// Its two halves, at a power of two; `None` of one brick.
    pub fn halves(self) -> Option<[Self; 2]> {
        let longest =
            (0..3).rev().reduce(|a, b| if self.size[b] > self.size[a] { b } else { a })?;
        if self.size[longest] == 1 {
            return None;
        }
        let half = self.size[longest].next_power_of_two() / 2;
        let (mut low, mut high) = (self, self);
        low.size[longest] = half;
        high.start[longest] += half;
        high.size[longest] -= half;
        Some([low, high])
    }

    /// Whether it may be one part with a stream.
    pub fn is_part(self) -> bool {
        self.size.iter().all(|&n| n <= MOST_ALONG)
    }

    /// Its first voxel, and its voxels along x, y and z, in a solid of `dims`.
    pub fn voxels(self, dims: [usize; 3]) -> ([usize; 3], [usize; 3]) {
        let start = self.start.map(|i| i * SIDE);
        let end: [usize; 3] =
            std::array::from_fn(|a| ((self.start[a] + self.size[a]) * SIDE).min(dims[a]));
        (start, std::array::from_fn(|a| end[a] - start[a]))
    }

    /// How often it may be halved.
    fn rank(self) -> usize {
        self.size.iter().map(|n| n.next_power_of_two().trailing_zeros() as usize).sum()
    }

    /// The places of its bricks among those of a solid, row by row.
    pub fn rows(self, counts: [usize; 3]) -> impl Iterator<Item = std::ops::Range<usize>> {
        let [x, y, z] = self.start;
        let row = move |y: usize, z: usize| (z * counts[1] + y) * counts[0] + x;
        (z..z + self.size[2]).flat_map(move |z| {
            (y..y + self.size[1]).map(move |y| row(y, z)..row(y, z) + self.size[0])
        })
    }
}

/// Bricks along each axis.
pub fn counts(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| n.div_ceil(SIDE))
}

/// What a part is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leaf {
    Empty,
    Full,
    /// What the stream of this number tells, whose slices follow this axis.
    Stream(u32, u8),
}

/// Codes which parts there are.
#[derive(Debug)]
pub struct Tree {
    /// Whether a box is halved, by how often it may be.
    halved: [Chance; 64],
    /// Whether a part has a stream, and else whether it is full; by what the last one was.
    stream: [Chance; 6],
    full: [Chance; 6],
    last: usize,
    /// Whether a stream is another than those before.
    fresh: Chance,
    /// Whether slices are along z, and else along y.
    axis: [Chance; 2],
    streams: u32,
}

impl Default for Tree {
    fn default() -> Self {
        Self {
            halved: [Chance::EVEN; 64],
            stream: [Chance::EVEN; 6],
            full: [Chance::EVEN; 6],
            last: 0,
            fresh: Chance::EVEN,
            axis: [Chance::EVEN; 2],
            streams: 0,
        }
    }
}

impl Tree {
    /// Codes a box. `source` tells an encoder what it is, or that it is halved; each part is handed
    /// to `found`.
    pub fn code(
        &mut self,
        coder: &mut impl Coder,
        cell: Cell,
        source: &mut impl FnMut(Cell) -> Option<Leaf>,
        found: &mut impl FnMut(Cell, Leaf) -> Result<(), CodeError>,
    ) -> Result<(), CodeError> {
        if coder.is_overrun() {
            return Err(CodeError::CutOff);
        }
        let truth = source(cell);
        let halves = cell.halves();
        if let Some(halves) = halves
            && self.halved[cell.rank()].code(coder, truth.is_none())
        {
            return halves.into_iter().try_for_each(|half| self.code(coder, half, source, found));
        }
        let context = 2 * self.last + usize::from(halves.is_some());
        let has_stream = matches!(truth, Some(Leaf::Stream(..)));
        let leaf = if cell.is_part() && self.stream[context].code(coder, has_stream) {
            self.last = 2;
            self.stream(coder, truth)?
        } else if self.full[context].code(coder, truth == Some(Leaf::Full)) {
            self.last = 1;
            Leaf::Full
        } else {
            self.last = 0;
            Leaf::Empty
        };
        found(cell, leaf)
    }

    fn stream(&mut self, coder: &mut impl Coder, truth: Option<Leaf>) -> Result<Leaf, CodeError> {
        let (number, axis) =
            if let Some(Leaf::Stream(i, axis)) = truth { (i, axis) } else { (0, 0) };
        if self.streams == 0 || self.fresh.code(coder, number == self.streams) {
            self.streams += 1;
            let axis = match self.axis[0].code(coder, axis == 2) {
                true => 2,
                false => u8::from(self.axis[1].code(coder, axis == 1)),
            };
            Ok(Leaf::Stream(self.streams - 1, axis))
        } else {
            Ok(Leaf::Stream(below(coder, number, self.streams)?, axis))
        }
    }
}

/// Reads what all bricks hold in files of the first versions, where a number is both that of a
/// stream and what tells streams apart; also how many streams there are.
///
/// A brick is most often what one of the three bricks before it is.
pub fn grid(coder: &mut Decoder<'_>, dims: [usize; 3]) -> Result<(Vec<Content>, u32), CodeError> {
    let [nx, ny, nz] = counts(dims);
    let mut contents: Vec<Content> = Vec::new();
    let mut same = [[Chance::EVEN; 5]; 27];
    let mut fresh = Chance::EVEN;
    let mut streams = 0;
    for i in 0..nx * ny * nz {
        let (x, y, z) = (i % nx, i / nx % ny, i / nx / ny);
        let beside = |there: bool, back: usize| {
            if there { contents[i - back] } else { Content::Empty }
        };
        let before = [beside(z > 0, nx * ny), beside(y > 0, nx), beside(x > 0, 1)];
        let context = before.iter().fold(0, |all, &content| 3 * all + kind(content));
        let mut guesses = before.into_iter().chain([Content::Empty, Content::Full]);
        let mut tried = [None; 5];
        let mut found = None;
        for rank in 0..5 {
            let Some(guess) = guesses.next() else { break };
            if tried.contains(&Some(guess)) {
                continue;
            }
            tried[rank] = Some(guess);
            if same[context][rank].code(coder, false) {
                found = Some(guess);
                break;
            }
        }
        let content = match found {
            Some(content) => content,
            None if streams == 0 || fresh.code(coder, false) => {
                streams += 1;
                Content::Part(streams - 1)
            }
            None => Content::Part(below(coder, 0, streams)?),
        };
        contents.push(content);
        if x + 1 == nx && coder.is_overrun() {
            return Err(CodeError::CutOff);
        }
    }
    Ok((contents, streams))
}

/// How many bricks there are; an error where there are too many.
pub fn bounded(dims: [usize; 3]) -> Result<usize, CodeError> {
    let count = counts(dims).into_iter().try_fold(1usize, usize::checked_mul);
    count.filter(|&count| count <= MOST_BRICKS).ok_or(CodeError::Damaged)
}

/// Which of three kinds a content is.
fn kind(content: Content) -> usize {
    match content {
        Content::Empty => 0,
        Content::Full => 1,
        Content::Part(_) => 2,
    }
}

/// Codes a number below `end` of which nothing is known.
fn below(coder: &mut impl Coder, number: u32, end: u32) -> Result<u32, CodeError> {
    let bits = u32::BITS - (end - 1).leading_zeros();
    let bit = |value, bit| value << 1 | u32::from(coder.code(1 << 31, number >> bit & 1 == 1));
    let value = (0..bits).rev().fold(0, bit);
    if value < end { Ok(value) } else { Err(CodeError::Damaged) }
}

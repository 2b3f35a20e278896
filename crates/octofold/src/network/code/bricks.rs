//! A solid in bricks: any part of it can be read without the rest.
//!
//! The box is cut into bricks of 64 voxels a side. Those that are empty or full, and those that are
//! the same as another, are only named; every other one is a stream of its own, which starts from
//! what is known of solids at large. Beyond the box a brick is empty. Source: specification (D3.7).

use super::CodeError;
use super::direct::Direct;
use super::walk::Walk;
use crate::par;
use crate::range::{Chance, Coder, Decoder, Encoder, Number};
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Region, Volume};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Voxels along a side of a brick.
pub const SIDE: usize = 64;

/// The most bricks that a solid may be read from.
pub const MOST_BRICKS: usize = 1 << 24;

/// The most runs of voxels in one brick.
const MOST_RUNS: u64 = (SIDE * SIDE * SIDE / 2) as u64;

/// Contents that one unit of work takes.
const BLOCK: usize = 8;

/// What a brick holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Nothing.
    Empty,
    /// Every voxel.
    Full,
    /// What the stream of this number tells.
    Stream(u32),
}

/// A solid in bricks, but for their streams.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bricks {
    dims: [usize; 3],
    /// Of each brick, x fastest.
    contents: Vec<Content>,
    /// Bytes of each stream.
    lengths: Vec<u32>,
}

/// A run of voxels in a brick: z, y, start and end.
type Part = [u8; 4];

/// Cuts a solid into bricks; also the streams, one after the other.
pub fn encode(solid: &Spans, run: &Run) -> Result<(Bricks, Vec<Vec<u8>>), Cancelled> {
    let dims = solid.dims();
    let [_, rows, layers] = counts(dims);
    let cut = par::blocks(run, rows * layers, 1, |range| {
        range.flat_map(|i| cut(solid, i % rows, i / rows)).collect::<Vec<_>>()
    })?;
    let mut numbers: FxHashMap<Vec<Part>, u32> = FxHashMap::default();
    let mut parts = Vec::new();
    let contents = cut.into_iter().flatten().map(|brick| match brick {
        Err(known) => known,
        Ok(own) => {
            let next = parts.len() as u32;
            let number = *numbers.entry(own.clone()).or_insert(next);
            if number == next {
                parts.push(own);
            }
            Content::Stream(number)
        }
    });
    let contents = contents.collect();
    let streams = par::blocks(run, parts.len(), BLOCK, |range| {
        let mut model = Direct::small();
        let streams = parts[range].iter().map(|parts| {
            model.reset();
            write(&mut model, parts)
        });
        streams.collect::<Vec<_>>()
    })?;
    let streams = streams.concat();
    let lengths = streams.iter().map(|s| s.len() as u32).collect();
    Ok((Bricks { dims, contents, lengths }, streams))
}

impl Bricks {
    /// Voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Bytes of each stream.
    pub fn lengths(&self) -> &[u32] {
        &self.lengths
    }

    /// What every brick holds, x fastest.
    pub fn contents(&self) -> &[Content] {
        &self.contents
    }

    /// What a voxel's brick holds; nothing beyond the box.
    pub fn at(&self, at: [usize; 3]) -> Content {
        if (0..3).any(|a| at[a] >= self.dims[a]) {
            return Content::Empty;
        }
        let [x, y, z] = at.map(|i| i / SIDE);
        let [nx, ny, _] = counts(self.dims);
        self.contents[(z * ny + y) * nx + x]
    }

    /// All this as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut coder = Encoder::default();
        let mut source = self.contents.iter().copied();
        // An encoder finds nothing wrong.
        let _ = index(&mut coder, self.dims, || source.next().unwrap_or(Content::Empty));
        let mut lengths = Number::default();
        for &length in &self.lengths {
            lengths.code(&mut coder, length, u32::MAX - 1);
        }
        coder.finish()
    }

    /// The same, of bytes; `most` is how long all streams may be together.
    pub fn from_bytes(dims: [usize; 3], bytes: &[u8], most: u64) -> Result<Self, CodeError> {
        let count = counts(dims).into_iter().try_fold(1usize, usize::checked_mul);
        if count.is_none_or(|count| count > MOST_BRICKS) {
            return Err(CodeError::Damaged);
        }
        let mut coder = Decoder::new(bytes);
        let (contents, streams) = index(&mut coder, dims, || Content::Empty)?;
        let mut number = Number::default();
        let (mut lengths, mut sum) = (Vec::new(), 0);
        for _ in 0..streams {
            let length = number.code(&mut coder, 0, u32::MAX - 1);
            sum += u64::from(length);
            if coder.is_overrun() || sum > most {
                return Err(CodeError::CutOff);
            }
            lengths.push(length);
        }
        Ok(Self { dims, contents, lengths })
    }

    /// The part of the solid in a region of the box, read from the streams of its bricks alone.
    pub fn region<'s, E: From<CodeError> + From<Cancelled> + Send>(
        &self,
        region: Region,
        stream: impl Fn(u32) -> Result<&'s [u8], E> + Sync,
        run: &Run,
    ) -> Result<Spans, E> {
        let bricks = Region {
            start: region.start.map(|i| i / SIDE),
            end: region.end.map(|i| i.div_ceil(SIDE)),
        };
        let [nx, ny, _] = counts(self.dims);
        let row = |y: usize, z: usize| {
            let first = (z * ny + y) * nx;
            &self.contents[first + bricks.start[0]..first + bricks.end[0]]
        };
        let rows = || {
            let layers = bricks.start[2]..bricks.end[2];
            layers.flat_map(|z| (bricks.start[1]..bricks.end[1]).map(move |y| [y, z]))
        };
        let mut needed: Vec<u32> = rows()
            .flat_map(|[y, z]| row(y, z))
            .filter_map(|c| if let Content::Stream(i) = c { Some(*i) } else { None })
            .collect();
        par::sort(&mut needed);
        needed.dedup();
        let parts = par::blocks(run, needed.len(), BLOCK, |range| {
            let mut model = Direct::small();
            let read = needed[range].iter().map(|&i| {
                model.reset();
                Ok(read(&mut model, stream(i)?, SIDE)?)
            });
            read.collect::<Result<Vec<_>, E>>()
        })?;
        let parts = parts.into_iter().collect::<Result<Vec<_>, E>>()?.concat();
        let mut slabs = Vec::new();
        for z in bricks.start[2]..bricks.end[2] {
            run.check()?;
            let mut layer = Layer::new(region, z);
            for y in bricks.start[1]..bricks.end[1] {
                for (i, content) in row(y, z).iter().enumerate() {
                    let corner = [bricks.start[0] + i, y].map(|i| i * SIDE);
                    match content {
                        Content::Empty => {}
                        Content::Full => full().for_each(|part| layer.put(corner, part)),
                        Content::Stream(number) => {
                            let at =
                                needed.binary_search(number).map_err(|_| CodeError::Damaged)?;
                            parts[at].iter().for_each(|&part| layer.put(corner, part));
                        }
                    }
                }
                layer.end_row();
            }
            if layer.runs.len() as u64 > super::MOST_RUNS {
                return Err(CodeError::TooMany(super::MOST_RUNS).into());
            }
            slabs.push(layer.into_slab());
        }
        let [width, height, _] = region.dims();
        Ok(Spans::stack([width, height], Placement::default(), slabs))
    }

    /// Whether a voxel of the brick that a stream tells is filled; reads the brick and no other.
    pub fn is_filled(stream: &[u8], at: [usize; 3]) -> Result<bool, CodeError> {
        let [x, y, z] = at.map(|i| (i % SIDE) as u8);
        let parts = read(&mut Direct::small(), stream, z as usize + 1)?;
        Ok(parts.iter().any(|p| p[0] == z && p[1] == y && (p[2]..p[3]).contains(&x)))
    }
}

/// The part of a region in one layer of bricks.
struct Layer {
    region: Region,
    /// Slices, of the whole.
    slices: Range<usize>,
    /// Rows `[z, y]` of the part with their runs; up to `done` in order and joined.
    runs: Vec<([u32; 2], [u32; 2])>,
    done: usize,
}

impl Layer {
    fn new(region: Region, layer: usize) -> Self {
        let [start, end] = [layer, layer + 1].map(|i| i * SIDE);
        let slices = start.max(region.start[2])..end.min(region.end[2]);
        Self { region, slices, runs: Vec::new(), done: 0 }
    }

    /// Adds what lies in the region.
    fn put(&mut self, corner: [usize; 2], [z, y, start, end]: Part) {
        let [x0, y0, _] = self.region.start;
        let [x1, y1, _] = self.region.end;
        let z = self.slices.start / SIDE * SIDE + z as usize;
        let y = corner[1] + y as usize;
        let part = [start, end].map(|x| (corner[0] + x as usize).clamp(x0, x1) - x0);
        if self.slices.contains(&z) && (y0..y1).contains(&y) && part[0] < part[1] {
            let row = [z - self.slices.start, y - y0].map(|i| i as u32);
            self.runs.push((row, part.map(|x| x as u32)));
        }
    }

    /// Joins the runs of a row of bricks.
    fn end_row(&mut self) {
        self.runs[self.done..].sort_unstable();
        let mut last = self.done;
        for i in self.done + 1..self.runs.len() {
            let (row, run) = self.runs[i];
            let (before, joined) = &mut self.runs[last];
            if *before == row && joined[1] == run[0] {
                joined[1] = run[1];
            } else {
                last += 1;
                self.runs[last] = (row, run);
            }
        }
        self.runs.truncate(last + 1);
        self.done = self.runs.len();
    }

    fn into_slab(mut self) -> Spans {
        let [width, height, _] = self.region.dims();
        self.runs.sort_unstable();
        let ordered = self.runs.into_iter().map(|([z, y], run)| ([y, z], run));
        let dims = [width, height, self.slices.len()];
        Spans::from_runs(dims, Placement::default(), ordered)
    }
}

/// Bricks along each axis.
fn counts(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| n.div_ceil(SIDE))
}

/// All rows of a full brick.
fn full() -> impl Iterator<Item = Part> {
    const END: u8 = SIDE as u8;
    (0..END).flat_map(|z| (0..END).map(move |y| [z, y, 0, END]))
}

/// The bricks of one row of bricks.
fn cut(solid: &Spans, row: usize, layer: usize) -> Vec<Result<Vec<Part>, Content>> {
    let dims = solid.dims();
    let [nx, ..] = counts(dims);
    let mut bricks: Vec<Vec<Part>> = vec![Vec::new(); nx];
    let within = |i: usize, a: usize| i * SIDE..((i + 1) * SIDE).min(dims[a]);
    for z in within(layer, 2) {
        for y in within(row, 1) {
            for &[start, end] in solid.row(y, z) {
                let [start, end] = [start as usize, end as usize];
                for (i, brick) in
                    bricks.iter_mut().enumerate().take(end.div_ceil(SIDE)).skip(start / SIDE)
                {
                    let [from, to] = [start, end].map(|x| x.clamp(i * SIDE, (i + 1) * SIDE));
                    brick.push(
                        [z % SIDE, y % SIDE, from - i * SIDE, to - i * SIDE].map(|i| i as u8),
                    );
                }
            }
        }
    }
    let area = (within(layer, 2).len() * within(row, 1).len()) as u64;
    let known = |(i, brick): (usize, Vec<Part>)| {
        let filled: u64 = brick.iter().map(|p| u64::from(p[3] - p[2])).sum();
        match filled {
            0 => Err(Content::Empty),
            _ if filled == area * within(i, 0).len() as u64 => Err(Content::Full),
            _ => Ok(brick),
        }
    };
    bricks.into_iter().enumerate().map(known).collect()
}

/// The stream of a brick.
fn write(model: &mut Direct, parts: &[Part]) -> Vec<u8> {
    let mut walk = Walk::new(SIDE as u32, SIDE as u32);
    let mut coder = Encoder::default();
    let mut rows: Vec<Vec<[u32; 2]>> = vec![Vec::new(); SIDE * SIDE];
    for &[z, y, start, end] in parts {
        rows[z as usize * SIDE + y as usize].push([start, end].map(u32::from));
    }
    for slice in rows.chunks_exact(SIDE) {
        walk.slice(model, &mut coder, |y| &slice[y as usize]);
    }
    coder.finish()
}

/// The lowest slices of the brick of a stream.
fn read(model: &mut Direct, stream: &[u8], slices: usize) -> Result<Vec<Part>, CodeError> {
    let mut walk = Walk::new(SIDE as u32, SIDE as u32).with_most(MOST_RUNS);
    let mut coder = Decoder::new(stream);
    let mut parts = Vec::new();
    for z in 0..slices {
        let slice = walk.slice(model, &mut coder, |_| &[]).ok_or(CodeError::CutOff)?;
        for y in 0..SIDE {
            let row = slice.row(y as i64).iter();
            parts.extend(row.map(|&[start, end]| [z as u8, y as u8, start as u8, end as u8]));
        }
    }
    Ok(parts)
}

/// Codes what all bricks hold, and tells how many streams there are. `source` tells an encoder what
/// the next one holds.
///
/// A brick is most often what one of the three bricks before it is.
fn index(
    coder: &mut impl Coder,
    dims: [usize; 3],
    mut source: impl FnMut() -> Content,
) -> Result<(Vec<Content>, u32), CodeError> {
    let [nx, ny, nz] = counts(dims);
    let mut contents: Vec<Content> = Vec::new();
    let mut same = [[Chance::EVEN; 5]; 27];
    let mut fresh = Chance::EVEN;
    let mut streams = 0;
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let i = contents.len();
                let beside = |there: bool, back: usize| {
                    if there { contents[i - back] } else { Content::Empty }
                };
                let before = [beside(z > 0, nx * ny), beside(y > 0, nx), beside(x > 0, 1)];
                let context = before.iter().fold(0, |all, &content| 3 * all + kind(content));
                let truth = source();
                let mut guesses = before.into_iter().chain([Content::Empty, Content::Full]);
                let mut tried = [None; 5];
                let mut found = None;
                for rank in 0..5 {
                    let Some(guess) = guesses.next() else { break };
                    if tried.contains(&Some(guess)) {
                        continue;
                    }
                    tried[rank] = Some(guess);
                    if same[context][rank].code(coder, truth == guess) {
                        found = Some(guess);
                        break;
                    }
                }
                let content = match found {
                    Some(content) => content,
                    None => {
                        let number = if let Content::Stream(i) = truth { i } else { 0 };
                        if streams == 0 || fresh.code(coder, number == streams) {
                            streams += 1;
                            Content::Stream(streams - 1)
                        } else {
                            Content::Stream(below(coder, number, streams)?)
                        }
                    }
                };
                contents.push(content);
            }
            if coder.is_overrun() {
                return Err(CodeError::CutOff);
            }
        }
    }
    Ok((contents, streams))
}

/// Which of three kinds a content is.
fn kind(content: Content) -> usize {
    match content {
        Content::Empty => 0,
        Content::Full => 1,
        Content::Stream(_) => 2,
    }
}

/// Codes a number below `end` of which nothing is known.
fn below(coder: &mut impl Coder, number: u32, end: u32) -> Result<u32, CodeError> {
    let bits = u32::BITS - (end - 1).leading_zeros();
    let bit = |value, bit| value << 1 | u32::from(coder.code(1 << 31, number >> bit & 1 == 1));
    let value = (0..bits).rev().fold(0, bit);
    if value < end { Ok(value) } else { Err(CodeError::Damaged) }
}

//! A solid in bricks: any part of it can be read without the rest.
//!
//! The box is cut into bricks of 64 voxels a side. Where there is little to read a box of several is one
//! part. Parts that are empty or full, and those that are the same as another, are only named; every
//! other one is a stream of its own, which starts from what is known of solids at large. It is coded
//! along the axis that takes least, as if it went on beyond its border as it ends there. Files of the
//! first versions have one part for each brick, with nothing around it. Source: specification (D3.7).

mod cutting;
mod index;
mod stream;
mod turned;

use super::CodeError;
use crate::par;
use crate::range::{Coder, Decoder, Encoder, Number};
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Region, Volume};
use cutting::State;
use index::{Cell, Leaf, Tree, bounded, counts};
use rustc_hash::FxHashMap;
use std::ops::Range;
use std::sync::atomic::AtomicU64;
use stream::{Coding, Packet};

/// Voxels along a side of a brick.
pub const SIDE: usize = 64;

/// The most bricks that a solid may be read from.
pub const MOST_BRICKS: usize = 1 << 24;

/// Parts that one unit of work takes.
const BLOCK: usize = 8;

/// What a brick holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Nothing.
    Empty,
    /// Every voxel.
    Full,
    /// What the part of this number tells.
    Part(u32),
}

/// A solid in bricks, but for their streams.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bricks {
    dims: [usize; 3],
    /// Of each brick, x fastest.
    contents: Vec<Content>,
    parts: Vec<Part>,
    streams: Vec<Stream>,
}

/// A box of bricks that one stream tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Part {
    /// Its first brick.
    start: [u16; 3],
    stream: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stream {
    /// Bytes.
    length: u32,
    coding: Coding,
}

/// Cuts a solid into bricks; also the streams, one after the other.
pub fn encode(solid: &Spans, run: &Run) -> Result<(Bricks, Vec<Vec<u8>>), Cancelled> {
    let cut = cutting::parts(solid, run)?;
    let mut bricks = Bricks::empty(solid.dims());
    let mut streams = Vec::new();
    let mut numbers: FxHashMap<Packet, u32> = FxHashMap::default();
    for (cell, state) in cut {
        let content = match state {
            State::Part(packet) => {
                let number = *numbers.entry(packet).or_insert_with_key(|packet| {
                    let coding = Coding::Part(packet.dims, packet.axis);
                    let length = packet.bytes.len() as u32;
                    bricks.streams.push(Stream { length, coding });
                    streams.push(packet.bytes.clone());
                    streams.len() as u32 - 1
                });
                bricks.part(cell, number)
            }
            State::Full => Content::Full,
            State::Empty | State::Halved => Content::Empty,
        };
        bricks.put(cell, content);
    }
    Ok((bricks, streams))
}

impl Bricks {
    fn empty(dims: [usize; 3]) -> Self {
        let contents = vec![Content::Empty; counts(dims).iter().product()];
        Self { dims, contents, parts: Vec::new(), streams: Vec::new() }
    }

    /// Adds a part that a stream tells.
    fn part(&mut self, cell: Cell, stream: u32) -> Content {
        self.parts.push(Part { start: cell.start.map(|i| i as u16), stream });
        Content::Part(self.parts.len() as u32 - 1)
    }

    /// Sets what the bricks of a box hold.
    fn put(&mut self, cell: Cell, content: Content) {
        for row in cell.rows(counts(self.dims)) {
            self.contents[row].fill(content);
        }
    }

    /// Voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Bytes of each stream.
    pub fn lengths(&self) -> impl ExactSizeIterator<Item = u32> {
        self.streams.iter().map(|s| s.length)
    }

    /// What every brick holds, x fastest.
    pub fn contents(&self) -> &[Content] {
        &self.contents
    }

    /// All this as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut coder = Encoder::default();
        let all = counts(self.dims);
        let mut source = |cell: Cell| {
            let rows = || cell.rows(all).flat_map(|row| &self.contents[row]);
            let first = rows().next()?;
            rows().all(|content| content == first).then_some(match *first {
                Content::Empty => Leaf::Empty,
                Content::Full => Leaf::Full,
                Content::Part(i) => {
                    let number = self.parts[i as usize].stream;
                    match self.streams[number as usize].coding {
                        Coding::Part(_, axis) => Leaf::Stream(number, axis),
                        Coding::Alone => Leaf::Stream(number, 2),
                    }
                }
            })
        };
        let mut tree = Tree::default();
        // An encoder finds nothing wrong.
        let _ = tree.code(&mut coder, Cell::all(self.dims), &mut source, &mut |_, _| Ok(()));
        let mut lengths = Number::default();
        for length in self.lengths() {
            lengths.code(&mut coder, length, u32::MAX - 1);
        }
        coder.finish()
    }

    /// The same, of bytes; `most` is how long all streams may be together.
    pub fn from_bytes(dims: [usize; 3], bytes: &[u8], most: u64) -> Result<Self, CodeError> {
        bounded(dims)?;
        let mut coder = Decoder::new(bytes);
        let mut bricks = Self::empty(dims);
        let mut found = |cell: Cell, leaf: Leaf| {
            let content = match leaf {
                Leaf::Empty => return Ok(()),
                Leaf::Full => Content::Full,
                Leaf::Stream(number, axis) => {
                    let (_, voxels) = cell.voxels(dims);
                    match bricks.streams.get(number as usize).map(|s| s.coding) {
                        None => {
                            let coding = Coding::Part(voxels, axis);
                            bricks.streams.push(Stream { length: 0, coding });
                        }
                        Some(Coding::Part(known, _)) if known == voxels => {}
                        Some(_) => return Err(CodeError::Damaged),
                    }
                    bricks.part(cell, number)
                }
            };
            bricks.put(cell, content);
            Ok(())
        };
        Tree::default().code(&mut coder, Cell::all(dims), &mut |_| None, &mut found)?;
        bricks.read_lengths(&mut coder, most)?;
        Ok(bricks)
    }

    /// The same of the index of a file of the first versions.
    pub fn from_first_bytes(dims: [usize; 3], bytes: &[u8], most: u64) -> Result<Self, CodeError> {
        bounded(dims)?;
        let mut coder = Decoder::new(bytes);
        let (contents, streams) = index::grid(&mut coder, dims)?;
        let [nx, ny, _] = counts(dims);
        let mut bricks = Self::empty(dims);
        bricks.streams = vec![Stream { length: 0, coding: Coding::Alone }; streams as usize];
        bricks.contents = contents;
        for i in 0..bricks.contents.len() {
            if let Content::Part(stream) = bricks.contents[i] {
                let start = [i % nx, i / nx % ny, i / nx / ny];
                bricks.contents[i] = bricks.part(Cell { start, size: [1; 3] }, stream);
            }
        }
        bricks.read_lengths(&mut coder, most)?;
        Ok(bricks)
    }

    fn read_lengths(&mut self, coder: &mut Decoder<'_>, most: u64) -> Result<(), CodeError> {
        let mut number = Number::default();
        let mut sum = 0;
        for stream in &mut self.streams {
            stream.length = number.code(coder, 0, u32::MAX - 1);
            sum += u64::from(stream.length);
            if coder.is_overrun() || sum > most {
                return Err(CodeError::CutOff);
            }
        }
        Ok(())
    }

    /// Whether a voxel is filled; reads one stream at most. Nothing is beyond the box.
    pub fn is_filled<'s, E: From<CodeError>>(
        &self,
        at: [usize; 3],
        stream: impl FnOnce(u32) -> Result<&'s [u8], E>,
    ) -> Result<bool, E> {
        if (0..3).any(|a| at[a] >= self.dims[a]) {
            return Ok(false);
        }
        let [x, y, z] = at.map(|i| i / SIDE);
        let [nx, ny, _] = counts(self.dims);
        match self.contents[(z * ny + y) * nx + x] {
            Content::Empty => Ok(false),
            Content::Full => Ok(true),
            Content::Part(i) => {
                let part = self.parts[i as usize];
                let coding = self.streams[part.stream as usize].coding;
                let at = std::array::from_fn(|a| at[a] - usize::from(part.start[a]) * SIDE);
                Ok(stream::is_filled(stream(part.stream)?, coding, at)?)
            }
        }
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
        let number = |content: &Content| match content {
            Content::Part(i) => Some(self.parts[*i as usize].stream),
            _ => None,
        };
        let mut needed: Vec<u32> = rows().flat_map(|[y, z]| row(y, z)).filter_map(number).collect();
        par::sort(&mut needed);
        needed.dedup();
        let left = AtomicU64::new(super::MOST_RUNS);
        let solids = par::blocks(run, needed.len(), BLOCK, |range| {
            let coding = |i: u32| self.streams[i as usize].coding;
            let mut model = coding(needed[range.start]).model();
            let read = needed[range].iter().map(|&i| {
                model.reset();
                Ok(stream::read(&mut model, stream(i)?, coding(i), &left)?)
            });
            read.collect::<Result<Vec<_>, E>>()
        })?;
        let solids = solids.into_iter().collect::<Result<Vec<_>, E>>()?.concat();
        let mut slabs = Vec::new();
        for z in bricks.start[2]..bricks.end[2] {
            run.check()?;
            let mut layer = Layer::new(region, z);
            for y in bricks.start[1]..bricks.end[1] {
                let mut x = bricks.start[0] * SIDE;
                for same in row(y, z).chunk_by(|a, b| a == b) {
                    let end = x + same.len() * SIDE;
                    match same[0] {
                        Content::Empty => {}
                        Content::Full => layer.fill(y, [x, end]),
                        Content::Part(i) => {
                            let part = self.parts[i as usize];
                            let at = needed.binary_search(&part.stream);
                            let solid = &solids[at.map_err(|_| CodeError::Damaged)?];
                            layer.put(y, part.start.map(|i| usize::from(i) * SIDE), solid);
                        }
                    }
                    x = end;
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

    /// The rows of a row of bricks that lie in the region.
    fn rows(&self, row: usize) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [from, to] = [self.region.start[1], self.region.end[1]];
        let rows = (row * SIDE).max(from)..((row + 1) * SIDE).min(to);
        self.slices.clone().flat_map(move |z| rows.clone().map(move |y| [z, y]))
    }

    /// Adds a run.
    fn push(&mut self, [z, y]: [usize; 2], run: [usize; 2]) {
        let (low, high) = (self.region.start[0], self.region.end[0]);
        let [start, end] = run.map(|x| x.clamp(low, high) - low);
        if start < end {
            let row = [z - self.slices.start, y - self.region.start[1]];
            self.runs.push((row.map(|i| i as u32), [start as u32, end as u32]));
        }
    }

    /// Fills bricks of a row.
    fn fill(&mut self, row: usize, run: [usize; 2]) {
        self.rows(row).for_each(|at| self.push(at, run));
    }

    /// Adds what a part has in a row of bricks.
    fn put(&mut self, row: usize, start: [usize; 3], part: &Spans) {
        for [z, y] in self.rows(row) {
            for run in part.row(y - start[1], z - start[2]) {
                self.push([z, y], run.map(|x| start[0] + x as usize));
            }
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

//! The stream of a part of a solid.

use super::SIDE;
use super::turned::turned;
use crate::network::code::direct::Direct;
use crate::network::code::walk::Walk;
use crate::network::code::{CodeError, MOST_RUNS};
use crate::range::{Decoder, Encoder};
use crate::rows::Rows;
use crate::spans::Spans;
use crate::volume::{Placement, Volume};
use std::sync::atomic::{AtomicU64, Ordering};

/// What a part of a solid is coded as.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Packet {
    pub bytes: Vec<u8>,
    /// The axis that slices follow each other along.
    pub axis: u8,
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// How much there is to do to read it, in decisions.
    pub work: u64,
}

/// The most that a part of several bricks may take to read, in decisions: far more than it does.
const MOST_TO_READ: u64 = 1 << 20;

/// How a stream is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coding {
    /// A part of these voxels, its slices along this axis.
    Part([usize; 3], u8),
    /// A whole brick as if there were nothing around it, as files of the first versions have it.
    Alone,
}

impl Coding {
    /// What tells the chances of its voxels.
    pub fn model(self) -> Direct {
        match self {
            Self::Part(..) => Direct::of_part(),
            Self::Alone => Direct::small(),
        }
    }
}

/// Codes a part along the axis of some that takes least; `None` where there is more to do than `most`.
pub fn write(model: &mut Direct, part: &Spans, axes: &[u8], most: u64) -> Option<Packet> {
    let packets = axes.iter().filter_map(|&axis| along(model, part, axis, most));
    packets.reduce(|a, b| if b.bytes.len() < a.bytes.len() { b } else { a })
}

fn along(model: &mut Direct, part: &Spans, axis: u8, most: u64) -> Option<Packet> {
    let seen = turned(part, usize::from(axis));
    let [width, height, depth] = seen.dims();
    model.reset();
    let mut walk = Walk::of_part(width as u32, height as u32);
    let mut coder = Encoder::default();
    for z in 0..depth {
        walk.slice(model, &mut coder, |y| seen.row(y as usize, z));
        if walk.work() > most {
            return None;
        }
    }
    Some(Packet { bytes: coder.finish(), axis, dims: part.dims(), work: walk.work() })
}

/// A part of a solid while it is read.
struct Reader<'a> {
    walk: Walk,
    coder: Decoder<'a>,
    dims: [usize; 3],
    axis: usize,
}

impl<'a> Reader<'a> {
    fn new(stream: &'a [u8], coding: Coding) -> Self {
        let (dims, axis, make): (_, _, fn(u32, u32) -> Walk) = match coding {
            Coding::Part(dims, axis) => (dims, usize::from(axis), Walk::of_part),
            Coding::Alone => ([SIDE; 3], 2, Walk::new),
        };
        let mut seen = dims;
        seen.swap(axis, 2);
        let most = seen.iter().map(|&n| n as u64).product::<u64>() / 2 + 1;
        let walk = make(seen[0] as u32, seen[1] as u32).with_most(most);
        Self { walk, coder: Decoder::new(stream), dims: seen, axis }
    }

    /// Reads the next slice.
    fn slice(&mut self, model: &mut Direct) -> Result<(), CodeError> {
        let slice = self.walk.slice(model, &mut self.coder, |_| &[]);
        slice.ok_or(CodeError::CutOff)?;
        let is_brick = self.dims.iter().all(|&n| n <= SIDE);
        if is_brick || self.walk.work() <= MOST_TO_READ { Ok(()) } else { Err(CodeError::Damaged) }
    }
}

/// All of the part; an error where it takes more runs than are `left`, which become fewer.
pub fn read(
    model: &mut Direct,
    stream: &[u8],
    coding: Coding,
    left: &AtomicU64,
) -> Result<Spans, CodeError> {
    let mut reader = Reader::new(stream, coding);
    let mut rows = Rows::default();
    for _ in 0..reader.dims[2] {
        reader.slice(model)?;
        let own = reader.walk.count();
        let fewer = |left: u64| left.checked_sub(own);
        left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fewer)
            .map_err(|_| CodeError::TooMany(MOST_RUNS))?;
        for y in 0..reader.dims[1] as u32 {
            reader.walk.runs(y).for_each(|run| rows.push(run));
            rows.end_row(y);
        }
        rows.end_slice();
    }
    let seen = Spans::from_rows(reader.dims, Placement::default(), [rows]);
    Ok(if reader.axis == 2 { seen } else { turned(&seen, reader.axis) })
}

/// Whether a voxel of the part is filled; reads no slice behind it.
pub fn is_filled(stream: &[u8], coding: Coding, at: [usize; 3]) -> Result<bool, CodeError> {
    let mut reader = Reader::new(stream, coding);
    let mut at = at;
    at.swap(reader.axis, 2);
    let mut model = coding.model();
    for _ in 0..=at[2] {
        reader.slice(&mut model)?;
    }
    let [x, y, _] = at.map(|i| i as u32);
    Ok(reader.walk.runs(y).any(|run| (run[0]..run[1]).contains(&x)))
}

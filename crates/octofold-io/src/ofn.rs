//! Octofold's own format of solids, `.ofn`: a network as the coded boundary of its solid.
//!
//! All numbers are little-endian; counts are of variable length, seven bits a byte, the lowest first.
//!
//! | bytes | what |
//! | --- | --- |
//! | 4 | `OFN` and the version: 1, or 2 with a payload; in bricks 3, or 4 with a payload |
//! | 1 | flags: 1 archive mode, 2 bricks, 4 as many voxels along every axis, 8 a placement follows, 16 whose voxels are upright cubes; the upper three bits are the unit |
//! | 0 or 1 | version 2: flags of the payload |
//! | 1 or 3 counts | voxels along x, y and z |
//! | 0, 32 or 96 | the placement: side and origin of upright cubes, or axes and origin |
//! | count | runs of voxels along x |
//!
//! A stream takes the rest of the file but four bytes, which are the CRC-32C of all before them. With
//! bricks there follow the length of their index and the index, then their streams in groups of at
//! least 4096 bytes but for the last; behind each group stands its CRC-32C, that of the first being
//! of all before it. What the streams hold is told in [`octofold::network::code`], how labels and
//! colours stand behind them in `carried`.
//!
//! Files in bricks of versions 1 and 2 are read too: there the index is followed by the CRC-32C of all
//! so far, and each brick's stream has its own before it.

mod carried;
#[cfg(test)]
mod tests;

use crate::slabs::lost;
use crate::source::Bytes;
use crate::{At, ReadError, Sink, Source, WriteError, mapped::sound_placement};
use carried::{Carried, MOST_NODES};
use octofold::network::code::bricks::{self, Bricks};
use octofold::network::code::{CodeError, MOST_RUNS, Mode, Reader, SLAB, Writer};
use octofold::network::painted::{PaintError, Painted};
use octofold::network::{MOST_VOXELS, NetworkError};
use octofold::payload::Kinds;
use octofold::spans::Spans;
use octofold::volume::Region;
use octofold::{LengthUnit, Placement, Run, Volume};
use std::ops::Range;

const FORMAT: &str = "ofn";

/// The name and version that a file begins with.
pub(crate) const MAGIC: &[u8] = b"OFN\x01";

/// The same of a file with a payload.
const MAGIC_CARRIED: &[u8] = b"OFN\x02";

/// The same of a file in bricks, and of one with a payload.
const MAGIC_BRICKS: [&[u8]; 2] = [b"OFN\x03", b"OFN\x04"];

const ARCHIVE: u8 = 1;
const BRICKS: u8 = 2;
const CUBE: u8 = 4;
const PLACED: u8 = 8;
const UPRIGHT: u8 = 16;

/// Units, as the upper three bits of the flags count them from 1.
pub(crate) const UNITS: [LengthUnit; 6] = [
    LengthUnit::Micrometre,
    LengthUnit::Millimetre,
    LengthUnit::Centimetre,
    LengthUnit::Inch,
    LengthUnit::Foot,
    LengthUnit::Metre,
];

/// Bytes of a checksum.
const SUM: usize = 4;

/// The least bytes of streams of bricks that share a checksum, but for the last.
const GROUP: u64 = 4096;

/// How a solid is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Layout {
    /// How chances are found; bricks are always fast.
    pub mode: Mode,
    /// In bricks, so that any part can be read without the rest.
    pub bricks: bool,
}

/// Reads the solid.
pub fn read(source: &Source, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    let file = File::open(source, run)?;
    if let Some(painted) = file.painted(run)? {
        return Ok(Box::new(painted));
    }
    Ok(Box::new(file.solid(run)?))
}

/// Writes a binary volume as one stream in fast mode; any other does not fit.
pub fn write(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    write_as(volume, Layout::default(), sink, run)
}

/// Writes a binary volume.
pub fn write_as(
    volume: &dyn Volume,
    layout: Layout,
    sink: &mut Sink<'_>,
    run: &Run,
) -> Result<(), WriteError> {
    if !volume.is_binary() {
        let fact = "its voxels are full or empty only: `octofold net encode` finds what is inside";
        return Err(WriteError::Unfit { format: FORMAT, fact: fact.into() });
    }
    let dims = volume.dims();
    if let Some(voxels) = dims.into_iter().find(|&n| n > MOST_VOXELS) {
        let fact = format!("{voxels} voxels along an axis; {MOST_VOXELS} are the most");
        return Err(WriteError::Unfit { format: FORMAT, fact });
    }
    let painted = Painted::of(volume, run).map_err(unpainted)?;
    let painted = painted.filter(|p| !p.payload().kinds().is_none());
    if let Some(count) = painted.as_ref().map(|p| p.network().count()).filter(|&n| n > MOST_NODES) {
        let fact = format!("{count} surface voxels carry something; {MOST_NODES} are the most");
        return Err(WriteError::Unfit { format: FORMAT, fact });
    }
    let kinds = painted.as_ref().map(|p| p.payload().kinds()).unwrap_or_default();
    let bytes = if layout.bricks {
        let solid = Spans::at_least(volume, 0.5, run)?;
        run.stage("encode");
        let (bricks, streams) = bricks::encode(&solid, run)?;
        let mut runs = 0;
        solid.for_each_row(|_, row| runs += row.len() as u64);
        let mut out = header(&solid, layout, kinds, runs);
        let mut put_index = |index: Vec<u8>| {
            put_count(&mut out, index.len() as u64);
            out.extend(index);
        };
        put_index(bricks.to_bytes());
        let carried = painted.as_ref().map(carried::bricks);
        let parts = carried.map(|(index, parts)| {
            put_index(index);
            parts
        });
        let mut summed = 0;
        let mut streams = streams.iter();
        for group in groups(bricks.lengths().map(u64::from)) {
            streams.by_ref().take(group).for_each(|stream| out.extend(stream));
            let sum = crc32c(&out[summed..]);
            out.extend(sum.to_le_bytes());
            summed = out.len();
        }
        for part in parts.into_iter().flatten() {
            out.extend(crc32c(&part).to_le_bytes());
            out.extend(part);
        }
        out
    } else if let Some(painted) = &painted {
        run.stage("encode");
        let mut writer = Writer::new([dims[0], dims[1]], layout.mode);
        writer.push(painted.solid(), run)?;
        let (stream, runs) = writer.finish();
        let mut out = header(painted.solid(), layout, kinds, runs);
        let columns = carried::streams(painted);
        put_count(&mut out, stream.len() as u64);
        columns.iter().for_each(|column| put_count(&mut out, column.len() as u64));
        out.extend(stream);
        put_sum(&mut out);
        for column in columns.iter().filter(|c| !c.is_empty()) {
            out.extend(crc32c(column).to_le_bytes());
            out.extend(column);
        }
        out
    } else {
        run.stage("encode");
        let mut writer = SolidWriter::new(dims, volume.placement(), layout.mode);
        // Slab by slab, so that no second solid is held.
        for start in (0..dims[2]).step_by(SLAB) {
            let slices = start..(start + SLAB).min(dims[2]);
            writer.push(&Spans::slab_at_least(volume, 0.5, slices, run)?, run)?;
        }
        writer.finish()
    };
    sink.out.write_all(&bytes).map_err(lost)
}

fn unpainted(error: PaintError) -> WriteError {
    match error {
        PaintError::Volume(error) => error.into(),
        PaintError::Network(NetworkError::Cancelled(cancelled)) => cancelled.into(),
        PaintError::Network(error) => WriteError::Unfit { format: FORMAT, fact: error.to_string() },
    }
}

/// Writes a solid as one stream, slab after slab, without ever holding all of it.
pub struct SolidWriter {
    frame: Spans,
    layout: Layout,
    writer: Writer,
}

impl SolidWriter {
    /// Before the first slice of a solid of `dims` voxels.
    pub fn new(dims: [usize; 3], placement: Placement, mode: Mode) -> Self {
        Self {
            frame: Spans::empty(dims, placement),
            layout: Layout { mode, bricks: false },
            writer: Writer::new([dims[0], dims[1]], mode),
        }
    }

    /// Adds the next slices.
    pub fn push(&mut self, slab: &Spans, run: &Run) -> Result<(), octofold::Cancelled> {
        self.writer.push(slab, run)
    }

    /// The whole file.
    pub fn finish(self) -> Vec<u8> {
        let (stream, runs) = self.writer.finish();
        let mut out = header(&self.frame, self.layout, Kinds::default(), runs);
        out.extend(stream);
        put_sum(&mut out);
        out
    }
}

/// The bytes before a stream or an index.
fn header(solid: &Spans, layout: Layout, kinds: Kinds, runs: u64) -> Vec<u8> {
    let (dims, placement) = (solid.dims(), solid.placement);
    let plain = Placement { unit: placement.unit, ..Placement::default() };
    let side = placement.axes[0][0];
    let upright = placement.axes == Placement::spacing([side; 3]).axes;
    let unit = placement.unit.and_then(|unit| UNITS.iter().position(|u| *u == unit));
    let flag = |set, flag| if set { flag } else { 0 };
    let version = match (layout.bricks, kinds.is_none()) {
        (true, plain) => MAGIC_BRICKS[usize::from(!plain)],
        (false, true) => MAGIC,
        (false, false) => MAGIC_CARRIED,
    };
    let mut out = version.to_vec();
    out.push(
        flag(layout.mode == Mode::Archive && !layout.bricks, ARCHIVE)
            | flag(layout.bricks, BRICKS)
            | flag(dims == [dims[0]; 3], CUBE)
            | flag(placement != plain, PLACED)
            | flag(placement != plain && upright, UPRIGHT)
            | unit.map_or(0, |unit| (unit as u8 + 1) << 5),
    );
    if !kinds.is_none() {
        out.push(carried::flags(kinds));
    }
    let told = if dims == [dims[0]; 3] { &dims[..1] } else { &dims[..] };
    told.iter().for_each(|&n| put_count(&mut out, n as u64));
    if placement != plain {
        let axes = placement.axes.as_flattened();
        let axes = if upright { &axes[..1] } else { axes };
        out.extend(axes.iter().chain(&placement.origin).flat_map(|v| v.to_le_bytes()));
    }
    put_count(&mut out, runs);
    out
}

fn put_count(out: &mut Vec<u8>, mut count: u64) {
    while count > 127 {
        out.push(count as u8 | 128);
        count >>= 7;
    }
    out.push(count as u8);
}

fn put_sum(out: &mut Vec<u8>) {
    let sum = crc32c(out);
    out.extend(sum.to_le_bytes());
}

/// A file whose header was read.
pub struct File {
    bytes: Bytes,
    dims: [usize; 3],
    placement: Placement,
    mode: Mode,
    runs: u64,
    body: Body,
    carried: Option<Carried>,
}

/// Where the solid is.
enum Body {
    /// In one stream.
    Stream(Range<usize>),
    /// In bricks.
    Bricks(Bricks, Stored),
}

/// Where streams of bricks are.
#[derive(Debug, Default)]
struct Stored {
    /// Where each stream begins, and which sum it is under.
    streams: Vec<(usize, usize)>,
    /// Bytes that are summed, and where their sums stand.
    sums: Vec<(Range<usize>, usize)>,
    /// One past all.
    end: usize,
}

impl Stored {
    /// In groups, behind a header and index that end at a byte.
    fn in_groups(lengths: &[u32], head: usize) -> Self {
        let mut stored = Self { end: head, ..Self::default() };
        let mut summed = 0;
        let mut lengths = lengths.iter();
        for group in groups(lengths.clone().map(|&l| u64::from(l))) {
            for &length in lengths.by_ref().take(group) {
                stored.streams.push((stored.end, stored.sums.len()));
                stored.end += length as usize;
            }
            stored.sums.push((summed..stored.end, stored.end));
            stored.end += SUM;
            summed = stored.end;
        }
        stored
    }

    /// Each behind a sum of its own, as files of the first versions have them.
    fn alone(lengths: &[u32], head: usize) -> Self {
        let mut stored = Self { sums: vec![(0..head, head)], end: head + SUM, ..Self::default() };
        for &length in lengths {
            let start = stored.end + SUM;
            stored.streams.push((start, stored.sums.len()));
            stored.sums.push((start..start + length as usize, stored.end));
            stored.end = start + length as usize;
        }
        stored
    }
}

/// How many streams each group has.
fn groups(lengths: impl Iterator<Item = u64>) -> Vec<usize> {
    let mut groups = vec![0];
    let mut bytes = 0;
    for length in lengths {
        if bytes >= GROUP {
            groups.push(0);
            bytes = 0;
        }
        if let Some(last) = groups.last_mut() {
            *last += 1;
        }
        bytes += length;
    }
    groups
}

impl File {
    /// Reads the header, and the index where there is one; nothing else is read.
    pub fn open(source: &Source, run: &Run) -> Result<Self, ReadError> {
        let bytes = source.bytes.clone();
        let mut head = Head { bytes: &bytes, next: 0 };
        let (carries, is_grouped) = match head.take(4)? {
            MAGIC => (false, false),
            MAGIC_CARRIED => (true, false),
            magic if MAGIC_BRICKS.contains(&magic) => (magic == MAGIC_BRICKS[1], true),
            [b'O', b'F', b'N', version] => {
                let fact = format!("version {version} of the format is not known here");
                return Err(ReadError::unsupported(FORMAT, fact));
            }
            _ => return Err(head.wrong("the file does not begin with OFN")),
        };
        let flags = head.take(1)?[0];
        if is_grouped && flags & BRICKS == 0 {
            return Err(head.wrong("no bricks in a file of this version"));
        }
        let kinds = if carries { carried::kinds(head.take(1)?[0]) } else { None };
        if carries && kinds.is_none() {
            return Err(head.wrong("no such payload"));
        }
        let mut dims = [head.dim()?; 3];
        if flags & CUBE == 0 {
            dims = [dims[0], head.dim()?, head.dim()?];
        }
        let mut placement = Placement::default();
        if flags & PLACED != 0 {
            placement = head.placement(flags & UPRIGHT != 0)?;
            placement = sound_placement(placement, run);
        }
        placement.unit = match flags >> 5 {
            0 => None,
            unit => Some(*UNITS.get(unit as usize - 1).ok_or_else(|| head.wrong("no such unit"))?),
        };
        let runs = head.count()?;
        if runs > MOST_RUNS {
            let fact = format!("it holds {runs} runs of voxels; {MOST_RUNS} are read at most");
            return Err(ReadError::unsupported(FORMAT, fact));
        }
        let mode = if flags & ARCHIVE != 0 { Mode::Archive } else { Mode::Fast };
        let mut carried = None;
        let body = if flags & BRICKS != 0 {
            let mut next_index = || {
                let length = head.count()?;
                head.take(usize::try_from(length).unwrap_or(usize::MAX))
            };
            let index = next_index()?;
            let of_payload = kinds.map(|kinds| Ok::<_, ReadError>((kinds, next_index()?)));
            let of_payload = of_payload.transpose()?;
            let end = head.next;
            let rest = (bytes.len() - end) as u64;
            let (index, stored) = if is_grouped {
                let index = Bricks::from_bytes(dims, index, rest).map_err(damaged)?;
                let lengths: Vec<u32> = index.lengths().collect();
                (index, Stored::in_groups(&lengths, end))
            } else {
                head.sum(0..end, end)?;
                let index = Bricks::from_first_bytes(dims, index, rest).map_err(damaged)?;
                let lengths: Vec<u32> = index.lengths().collect();
                (index, Stored::alone(&lengths, end))
            };
            if let Some((kinds, index)) = of_payload {
                let end = bytes.len();
                carried = Some(Carried::in_bricks(kinds, dims, index, stored.end, end)?);
            } else if stored.end != bytes.len() {
                let fact =
                    format!("the bricks end at byte {}, the file at {}", stored.end, bytes.len());
                return Err(ReadError::malformed(FORMAT, At::File, fact));
            }
            let (summed, at) = stored.sums[0].clone();
            head.sum(summed, at)?;
            Body::Bricks(index, stored)
        } else if let Some(kinds) = kinds {
            let length = head.count()?;
            let told = carried::columns_of(kinds).map(|_| head.count());
            let told = told.collect::<Result<Vec<_>, _>>()?;
            let start = head.next;
            head.take(usize::try_from(length).unwrap_or(usize::MAX))?;
            let end = head.next;
            head.take(SUM)?;
            carried = Some(Carried::in_streams(kinds, &told, head.next, bytes.len())?);
            Body::Stream(start..end)
        } else {
            let end = bytes.len().checked_sub(SUM).filter(|&end| end >= head.next);
            let Some(end) = end else { return Err(head.wrong("the file is cut off")) };
            Body::Stream(head.next..end)
        };
        Ok(Self { bytes, dims, placement, mode, runs, body, carried })
    }

    /// Voxels along x, y and z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Where voxel centres lie in the world.
    pub fn placement(&self) -> Placement {
        self.placement
    }

    /// Runs of voxels along x.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// Bytes of the file.
    pub fn size(&self) -> u64 {
        self.bytes.len() as u64
    }

    /// How the file was written.
    pub fn layout(&self) -> Layout {
        Layout { mode: self.mode, bricks: matches!(self.body, Body::Bricks(..)) }
    }

    /// Whether a voxel is in the solid; reads the brick that holds it, or the stream up to it.
    pub fn contains(&self, at: [usize; 3], run: &Run) -> Result<bool, ReadError> {
        if (0..3).any(|a| at[a] >= self.dims[a]) {
            return Ok(false);
        }
        match &self.body {
            Body::Bricks(index, stored) => {
                let stream = |i| self.brick(index, stored, i).map_err(Failed);
                Ok(index.is_filled(at, stream)?)
            }
            Body::Stream(_) => {
                let mut slabs = self.slabs(run)?;
                for _ in 0..at[2] / SLAB {
                    slabs.next_slab(run)?;
                }
                let [x, y, z] = [at[0], at[1], at[2] % SLAB].map(|i| i as u32);
                Ok(slabs.next_slab(run)?.is_some_and(|slab| slab.contains([x, y, z])))
            }
        }
    }

    /// The whole solid.
    pub fn solid(&self, run: &Run) -> Result<Spans, ReadError> {
        let mut slabs = self.slabs(run)?;
        run.stage("decode");
        let mut all = Vec::new();
        while let Some(slab) = slabs.next_slab(run)? {
            all.push(slab);
        }
        Ok(Spans::stack([self.dims[0], self.dims[1]], self.placement, all))
    }

    /// The part of the solid in a region of its box; of bricks only those in the region are read.
    pub fn region(&self, region: Region, run: &Run) -> Result<Spans, ReadError> {
        match &self.body {
            Body::Bricks(index, stored) => {
                let stream = |i| self.brick(index, stored, i).map_err(Failed);
                let mut part = index.region(region, stream, run)?;
                part.placement = self.placement;
                part.placement.origin = self.placement.place(region.start.map(|i| i as f64));
                Ok(part)
            }
            Body::Stream(_) => {
                let mut slabs = self.slabs(run)?;
                let mut all = Vec::new();
                while let Some(slab) = slabs.next_slab(run)?
                    && slabs.from.saturating_sub(SLAB) < region.end[2]
                {
                    all.push(slab);
                }
                let lower = Spans::stack([self.dims[0], self.dims[1]], self.placement, all);
                Ok(lower.framed(region.start.map(|i| i as i64), region.dims()))
            }
        }
    }

    /// The solid, slab after slab.
    pub fn slabs(&self, run: &Run) -> Result<Slabs<'_>, ReadError> {
        let reader = match &self.body {
            Body::Bricks(..) => None,
            Body::Stream(range) => {
                run.check()?;
                let head = Head { bytes: &self.bytes, next: 0 };
                head.sum(0..range.end, range.end)?;
                let size = [self.dims[0], self.dims[1]];
                Some(Reader::new(size, self.mode, &self.bytes[range.clone()], self.runs))
            }
        };
        Ok(Slabs { file: self, reader, from: 0 })
    }

    /// The stream of a part.
    fn brick(&self, index: &Bricks, stored: &Stored, i: u32) -> Result<&[u8], ReadError> {
        let (start, sum) = stored.streams[i as usize];
        let length = index.lengths().nth(i as usize).unwrap_or_default() as usize;
        let (range, at) = stored.sums[sum].clone();
        Head { bytes: &self.bytes, next: 0 }.sum(range, at)?;
        Ok(&self.bytes[start..start + length])
    }
}

/// The slabs of a solid, the lowest first.
pub struct Slabs<'a> {
    file: &'a File,
    reader: Option<Reader<'a>>,
    from: usize,
}

impl Slabs<'_> {
    /// The next slices, 64 or what is left; `None` behind the last.
    pub fn next_slab(&mut self, run: &Run) -> Result<Option<Spans>, ReadError> {
        let [width, height, depth] = self.file.dims;
        let start = self.from;
        let end = (start + SLAB).min(depth);
        if start == end {
            return Ok(None);
        }
        self.from = end;
        match &mut self.reader {
            Some(reader) => Ok(Some(reader.pull(end - start, run).map_err(damaged)?)),
            None => {
                let region = Region { start: [0, 0, start], end: [width, height, end] };
                let mut slab = self.file.region(region, run)?;
                slab.placement = Placement::default();
                Ok(Some(slab))
            }
        }
    }
}

/// An error on the way through bricks.
struct Failed(ReadError);

impl From<CodeError> for Failed {
    fn from(error: CodeError) -> Self {
        Self(damaged(error))
    }
}

impl From<octofold::Cancelled> for Failed {
    fn from(error: octofold::Cancelled) -> Self {
        Self(error.into())
    }
}

impl From<Failed> for ReadError {
    fn from(Failed(error): Failed) -> Self {
        error
    }
}

fn damaged(error: CodeError) -> ReadError {
    match error {
        CodeError::Cancelled(cancelled) => cancelled.into(),
        error => ReadError::malformed(FORMAT, At::File, error.to_string()),
    }
}

/// The header while it is read.
struct Head<'a> {
    bytes: &'a [u8],
    next: usize,
}

impl<'a> Head<'a> {
    fn wrong(&self, fact: impl Into<String>) -> ReadError {
        ReadError::malformed(FORMAT, At::Byte(self.next as u64), fact)
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], ReadError> {
        let rest = &self.bytes[self.next..];
        let taken = rest.get(..count).ok_or_else(|| self.wrong("the file is cut off"))?;
        self.next += count;
        Ok(taken)
    }

    fn count(&mut self) -> Result<u64, ReadError> {
        let mut count = 0;
        for shift in (0..63).step_by(7) {
            let byte = self.take(1)?[0];
            count |= u64::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(count);
            }
        }
        Err(self.wrong("a count does not end"))
    }

    fn dim(&mut self) -> Result<usize, ReadError> {
        match self.count()? {
            0 => Err(self.wrong("there are no voxels along an axis")),
            n if n > MOST_VOXELS as u64 => {
                Err(self.wrong(format!("{n} voxels along an axis; {MOST_VOXELS} are the most")))
            }
            n => Ok(n as usize),
        }
    }

    fn placement(&mut self, upright: bool) -> Result<Placement, ReadError> {
        let mut number = || -> Result<f64, ReadError> {
            let bytes = self.take(8)?;
            Ok(bytes.try_into().map_or(0.0, f64::from_le_bytes))
        };
        let mut placement = Placement::default();
        if upright {
            placement = Placement::spacing([number()?; 3]);
        } else {
            for v in placement.axes.as_flattened_mut() {
                *v = number()?;
            }
        }
        for v in &mut placement.origin {
            *v = number()?;
        }
        Ok(placement)
    }

    /// Checks the sum that stands at `at` for the bytes of `range`.
    fn sum(&self, range: Range<usize>, at: usize) -> Result<(), ReadError> {
        let told = self.bytes.get(at..at + SUM).and_then(|b| b.try_into().ok());
        let told = told.map(u32::from_le_bytes);
        if told.is_some() && told == self.bytes.get(range).map(crc32c) {
            return Ok(());
        }
        let fact = "the checksum is wrong: the file is damaged or cut off";
        Err(ReadError::malformed(FORMAT, At::Byte(at as u64), fact))
    }
}

/// The CRC-32C (Castagnoli) of bytes.
pub(crate) fn crc32c(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut i = 0;
        while i < 256 {
            let mut value = i as u32;
            let mut bit = 0;
            while bit < 8 {
                value = if value & 1 == 1 { value >> 1 ^ 0x82F6_3B78 } else { value >> 1 };
                bit += 1;
            }
            table[i] = value;
            i += 1;
        }
        table
    };
    !bytes.iter().fold(u32::MAX, |sum, &b| sum >> 8 ^ TABLE[(sum as u8 ^ b) as usize])
}

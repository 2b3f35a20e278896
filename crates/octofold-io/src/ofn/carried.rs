//! Payload streams of `.ofn`: what the surface voxels of a solid carry.
//!
//! A file with a payload has version 2, or 4 in bricks, and one more byte of flags: 1 labels, 2 colours. A stream is
//! followed by its sum, as in version 1, but that the header ends with its length and with that of each
//! column, labels first; each column then stands with its own CRC-32C before it. With bricks there is a
//! second index behind the first: for each column the scheme of its values, then the length of each
//! brick's part, x fastest, 0 where a brick has no surface; the parts follow the bricks' streams, each
//! with its own CRC-32C before it. Colours are numbers with red in their highest byte.

use super::{FORMAT, File, SUM, damaged};
use crate::{At, ReadError};
use octofold::network::carry::{cut_painted, told};
use octofold::network::code::CodeError;
use octofold::network::code::bricks::{MOST_BRICKS, SIDE};
use octofold::network::code::payload::{Scheme, lengths, read_lengths};
use octofold::network::painted::Painted;
use octofold::network::{Network, Node};
use octofold::payload::{Kinds, Payload, Value};
use octofold::spans::Spans;
use octofold::volume::Region;
use octofold::{Run, Volume};
use std::ops::Range;

/// Nodes of a solid with a payload, at most.
pub(super) const MOST_NODES: u64 = 1 << 26;

/// Where the payload of a file is.
#[derive(Debug)]
pub(super) enum Carried {
    /// One stream for each column, behind its sum.
    Streams(Kinds, Vec<Range<usize>>),
    /// Schemes of the columns, and the parts of all bricks.
    Bricks(Kinds, Vec<(Scheme, Vec<Range<usize>>)>),
}

/// Flags of kinds.
pub(super) fn flags(kinds: Kinds) -> u8 {
    u8::from(kinds.labels) | u8::from(kinds.colours) << 1
}

/// The kinds of flags.
pub(super) fn kinds(flags: u8) -> Option<Kinds> {
    let kinds = Kinds { labels: flags & 1 != 0, colours: flags & 2 != 0 };
    (flags == self::flags(kinds) && flags != 0).then_some(kinds)
}

/// Which of the columns are colours.
pub(super) fn columns_of(kinds: Kinds) -> impl Iterator<Item = bool> {
    [(kinds.labels, false), (kinds.colours, true)].into_iter().filter_map(|(is, c)| is.then_some(c))
}

/// The column of values.
fn column(values: &[Value], colours: bool) -> Vec<u32> {
    let of = |v: &Value| if colours { u32::from_be_bytes(v.colour) } else { v.label };
    values.iter().map(of).collect()
}

/// Puts columns together.
fn values(kinds: Kinds, columns: &[Vec<u32>], count: usize) -> Vec<Value> {
    let mut values = vec![Value::PLAIN; count];
    for (colours, column) in columns_of(kinds).zip(columns) {
        for (value, &told) in values.iter_mut().zip(column) {
            if colours {
                value.colour = told.to_be_bytes();
            } else {
                value.label = told;
            }
        }
    }
    values
}

/// The streams of all columns.
pub(super) fn streams(painted: &Painted) -> Vec<Vec<u8>> {
    let nodes = painted.network().nodes();
    let encode = |colours| {
        let column = column(painted.payload().values(), colours);
        Scheme::of(&nodes, &column, colours).encode_whole(&nodes, &column)
    };
    columns_of(painted.payload().kinds()).map(encode).collect()
}

/// The index of all columns in bricks, and their parts.
pub(super) fn bricks(painted: &Painted) -> (Vec<u8>, Vec<Vec<u8>>) {
    let nodes = painted.network().nodes();
    let shares = by_brick(&nodes, painted.dims());
    let mut parts = Vec::new();
    let mut schemes = Vec::new();
    for colours in columns_of(painted.payload().kinds()) {
        let column = column(painted.payload().values(), colours);
        let scheme = Scheme::of(&nodes, &column, colours);
        let mut told = vec![0; counts(painted.dims()).iter().product()];
        for (brick, share) in &shares {
            let own: Vec<Node> = share.iter().map(|&i| nodes[i as usize]).collect();
            let values: Vec<u32> = share.iter().map(|&i| column[i as usize]).collect();
            let part = scheme.encode(&own, &values);
            // What takes no byte at all says nothing, and needs no sum.
            told[*brick] = part.len() as u32;
            if !part.is_empty() {
                parts.push(part);
            }
        }
        schemes.push((scheme, told));
    }
    (lengths(&schemes), parts)
}

/// Bricks along each axis.
fn counts(dims: [usize; 3]) -> [usize; 3] {
    dims.map(|n| n.div_ceil(SIDE))
}

/// The nodes of each brick that has any, in order.
fn by_brick(nodes: &[Node], dims: [usize; 3]) -> Vec<(usize, Vec<u32>)> {
    let [nx, ny, _] = counts(dims);
    let brick = |node: &Node| {
        let [x, y, z] = node.at().map(|i| i as usize / SIDE);
        (z * ny + y) * nx + x
    };
    let mut numbered: Vec<(usize, u32)> = nodes.iter().map(brick).zip(0..).collect();
    octofold::par::sort(&mut numbered);
    let share = |own: &[(usize, u32)]| (own[0].0, own.iter().map(|n| n.1).collect());
    numbered.chunk_by(|a, b| a.0 == b.0).map(share).collect()
}

impl Carried {
    /// Which columns there are.
    pub fn kinds(&self) -> Kinds {
        match self {
            Self::Streams(kinds, _) | Self::Bricks(kinds, _) => *kinds,
        }
    }

    /// The streams that begin at a byte and take the rest of a file.
    pub fn in_streams(
        kinds: Kinds,
        told: &[u64],
        start: usize,
        end: usize,
    ) -> Result<Self, ReadError> {
        let mut next = start;
        let ranges = ranges(told.iter().copied(), &mut next, end)?;
        ends(next, end)?;
        Ok(Self::Streams(kinds, ranges))
    }

    /// The parts that begin at a byte and take the rest of a file, as an index tells.
    pub fn in_bricks(
        kinds: Kinds,
        dims: [usize; 3],
        index: &[u8],
        start: usize,
        end: usize,
    ) -> Result<Self, ReadError> {
        let count = counts(dims).into_iter().try_fold(1usize, usize::checked_mul);
        let count = count.filter(|&n| n <= MOST_BRICKS).ok_or(CodeError::Damaged);
        let columns = columns_of(kinds).count();
        let schemes = count.and_then(|n| read_lengths(index, columns, n, MOST_NODES));
        let mut next = start;
        let mut all = Vec::new();
        for (scheme, told) in schemes.map_err(damaged)? {
            let told = told.into_iter().map(u64::from);
            all.push((scheme, ranges(told, &mut next, end)?));
        }
        ends(next, end)?;
        Ok(Self::Bricks(kinds, all))
    }

    /// Bytes of each column, with its sums.
    pub fn bytes(&self) -> Vec<u64> {
        let with_sum = |r: &Range<usize>| if r.is_empty() { 0 } else { (r.len() + SUM) as u64 };
        match self {
            Self::Streams(_, ranges) => ranges.iter().map(with_sum).collect(),
            Self::Bricks(_, columns) => {
                columns.iter().map(|c| c.1.iter().map(with_sum).sum()).collect()
            }
        }
    }
}

/// Streams one behind the other, each with a sum before it; those of no length have none.
fn ranges(
    told: impl Iterator<Item = u64>,
    next: &mut usize,
    end: usize,
) -> Result<Vec<Range<usize>>, ReadError> {
    let range = |length: u64| {
        if length == 0 {
            return Ok(*next..*next);
        }
        let start = *next + SUM;
        let past = usize::try_from(length).ok().and_then(|l| start.checked_add(l));
        let past = past.filter(|&past| past <= end);
        let fact = "the payload ends behind the end of the file";
        *next = past.ok_or_else(|| ReadError::malformed(FORMAT, At::File, fact))?;
        Ok(start..*next)
    };
    told.map(range).collect()
}

fn ends(at: usize, end: usize) -> Result<(), ReadError> {
    if at == end {
        return Ok(());
    }
    let fact = format!("the payload ends at byte {at}, the file at {end}");
    Err(ReadError::malformed(FORMAT, At::File, fact))
}

impl File {
    /// Which payload the file has.
    pub fn kinds(&self) -> Kinds {
        self.carried.as_ref().map(Carried::kinds).unwrap_or_default()
    }

    /// Bytes of labels and of colours, where there are any.
    pub fn payload_bytes(&self) -> [Option<u64>; 2] {
        let mut bytes = [None; 2];
        if let Some(carried) = &self.carried {
            for (colours, count) in columns_of(carried.kinds()).zip(carried.bytes()) {
                bytes[usize::from(colours)] = Some(count);
            }
        }
        bytes
    }

    /// The whole solid with its payload; `None` where the file has none.
    pub fn painted(&self, run: &Run) -> Result<Option<Painted>, ReadError> {
        let Some(carried) = &self.carried else { return Ok(None) };
        let solid = self.solid(run)?;
        let nodes = nodes(&solid, run)?;
        let values = match carried {
            Carried::Streams(kinds, ranges) => {
                let columns = ranges.iter().map(|range| {
                    let bytes = self.summed(range)?;
                    Scheme::decode_whole(&nodes, bytes).map_err(damaged)
                });
                values(*kinds, &columns.collect::<Result<Vec<_>, _>>()?, nodes.len())
            }
            Carried::Bricks(kinds, columns) => {
                let mut all = vec![Value::PLAIN; nodes.len()];
                self.fill(*kinds, columns, &nodes, &mut all, run)?;
                all
            }
        };
        let payload = Payload::new(carried.kinds(), values);
        let painted = Painted::new(solid, payload, run).map_err(unfit)?;
        Ok(painted)
    }

    /// The part of the solid in a region of its box, with its payload; of bricks only those are read
    /// that the region touches, and those beside them for their solid alone. Voxels that lie on the
    /// surface only since the rest was cut off have what the nearest node of the bricks has.
    pub fn painted_region(&self, region: Region, run: &Run) -> Result<Option<Painted>, ReadError> {
        let Some(carried) = &self.carried else { return Ok(None) };
        let Carried::Bricks(kinds, columns) = carried else {
            let start = region.start.map(|i| i as i64);
            let cut = |whole: Painted| cut_painted(&whole, start, region.dims(), run);
            return self.painted(run)?.map(cut).transpose().map_err(unfit);
        };
        // Whole bricks, since their parts are read whole, and one voxel more to know their surface.
        let bricks = Region {
            start: region.start.map(|i| i / SIDE * SIDE),
            end: std::array::from_fn(|a| region.end[a].next_multiple_of(SIDE).min(self.dims[a])),
        };
        let wider = Region {
            start: bricks.start.map(|i| i.saturating_sub(1)),
            end: std::array::from_fn(|a| (bricks.end[a] + 1).min(self.dims[a])),
        };
        let shift = wider.start.map(|i| i as u32);
        let mut within = nodes(&self.region(wider, run)?, run)?;
        within.retain_mut(|n| {
            let at: [u32; 3] = std::array::from_fn(|a| n.at()[a] + shift[a]);
            let [x, y, z] = at.map(|i| i as u16);
            n.zyx = [z, y, x];
            (0..3).all(|a| (bricks.start[a]..bricks.end[a]).contains(&(at[a] as usize)))
        });
        let mut own = vec![Value::PLAIN; within.len()];
        self.fill(*kinds, columns, &within, &mut own, run)?;
        let payload = Payload::new(*kinds, own);
        let back =
            |at: [u32; 3]| std::array::from_fn(|a| (at[a] as usize + region.start[a]) as f64);
        let solid = self.region(region, run)?;
        told(solid, &within, &payload, back, run).map(Some).map_err(unfit)
    }

    /// Reads what nodes in some bricks carry.
    fn fill(
        &self,
        kinds: Kinds,
        columns: &[(Scheme, Vec<Range<usize>>)],
        nodes: &[Node],
        all: &mut [Value],
        run: &Run,
    ) -> Result<(), ReadError> {
        for (brick, share) in by_brick(nodes, self.dims) {
            run.check()?;
            let own: Vec<Node> = share.iter().map(|&i| nodes[i as usize]).collect();
            let columns = columns.iter().map(|(scheme, ranges)| {
                let bytes = self.summed(&ranges[brick])?;
                scheme.decode(&own, bytes).map_err(damaged)
            });
            let columns = columns.collect::<Result<Vec<_>, _>>()?;
            for (&i, value) in share.iter().zip(values(kinds, &columns, own.len())) {
                all[i as usize] = value;
            }
        }
        Ok(())
    }

    /// The bytes of a range, whose sum stands before it.
    fn summed(&self, range: &Range<usize>) -> Result<&[u8], ReadError> {
        if !range.is_empty() {
            super::Head { bytes: &self.bytes, next: 0 }.sum(range.clone(), range.start - SUM)?;
        }
        Ok(&self.bytes[range.clone()])
    }
}

fn unfit(error: octofold::network::NetworkError) -> ReadError {
    match error {
        octofold::network::NetworkError::Cancelled(cancelled) => cancelled.into(),
        error => ReadError::unsupported(FORMAT, error.to_string()),
    }
}

/// The nodes of a solid, where they are not too many.
fn nodes(solid: &Spans, run: &Run) -> Result<Vec<Node>, ReadError> {
    let network = Network::new(solid, run).map_err(unfit)?;
    let count = network.count();
    if count > MOST_NODES {
        let fact = format!("{count} surface voxels carry something; {MOST_NODES} are read at most");
        return Err(ReadError::unsupported(FORMAT, fact));
    }
    Ok(network.nodes())
}

#[cfg(test)]
mod tests {
    use super::super::tests::LAYOUTS;
    use super::super::{Body, Layout, crc32c, write_as};
    use super::*;
    use crate::{Sink, Source};
    use octofold::Placement;
    use octofold::network::links::HIGH_X;

    const KINDS: [Kinds; 3] = [
        Kinds { labels: true, colours: false },
        Kinds { labels: false, colours: true },
        Kinds { labels: true, colours: true },
    ];

    /// A ball with labels in octants and colours that change all over.
    fn ball(side: u32, kinds: Kinds) -> Painted {
        let dims = [side as usize + 3, side as usize, side as usize];
        let inside = |x: u32, y: u32, z: u32| {
            let off = [x, y, z].map(|i| i64::from(2 * i) - i64::from(side));
            off.iter().map(|v| v * v).sum::<i64>() < i64::from(side * side)
        };
        let mut samples = Vec::new();
        for z in 0..side {
            for y in 0..side {
                samples.extend((0..side + 3).map(|x| u8::from(inside(x, y, z))));
            }
        }
        let volume =
            octofold::volume::DenseVolume::new(dims, samples, Placement::default()).unwrap();
        let run = Run::default();
        let solid = Spans::at_least(&volume, 0.5, &run).unwrap();
        let nodes = Network::new(&solid, &run).unwrap().nodes();
        let value = |n: &Node| {
            let [x, y, z] = n.at();
            let label = 1000 * (1 + (2 * x / side + 2 * y / side * 2 + 2 * z / side * 4));
            Value { label, colour: [x as u8, (y + z) as u8, n.mask & HIGH_X, 255] }
        };
        let payload = Payload::new(kinds, nodes.iter().map(value).collect());
        Painted::new(solid, payload, &run).unwrap().unwrap()
    }

    fn written(painted: &Painted, layout: Layout) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_as(painted, layout, &mut Sink::new(&mut bytes, "x"), &Run::default()).unwrap();
        bytes
    }

    fn open(bytes: &[u8]) -> Result<File, ReadError> {
        File::open(&Source::from_bytes("x.ofn", bytes), &Run::default())
    }

    #[test]
    fn every_layout_keeps_every_payload() {
        let run = Run::default();
        for side in [1, 20, 140] {
            for (kinds, layout) in KINDS.into_iter().flat_map(|k| LAYOUTS.map(|l| (k, l))) {
                let painted = ball(side, kinds);
                let bytes = written(&painted, layout);
                let file = open(&bytes).unwrap();
                assert_eq!((file.kinds(), file.layout()), (kinds, layout));
                assert_eq!(file.solid(&run).unwrap(), *painted.solid());
                assert_eq!(file.painted(&run).unwrap().unwrap(), painted);
                let told = file.payload_bytes();
                assert_eq!(told.map(|b| b.is_some()), [kinds.labels, kinds.colours]);
                assert!(told.into_iter().flatten().sum::<u64>() < bytes.len() as u64);
            }
        }
    }

    #[test]
    fn parts_have_the_payload_of_the_whole() {
        let run = Run::default();
        let painted = ball(140, KINDS[2]);
        for layout in LAYOUTS {
            let file = open(&written(&painted, layout)).unwrap();
            for region in [
                Region { start: [10, 0, 3], end: [40, 70, 50] },
                Region { start: [64, 64, 0], end: [128, 128, 64] },
                Region { start: [1, 2, 3], end: [142, 139, 138] },
            ] {
                let part = file.painted_region(region, &run).unwrap().unwrap();
                let start = region.start.map(|i| i as i64);
                let expected = cut_painted(&painted, start, region.dims(), &run).unwrap();
                assert_eq!(part.solid(), expected.solid());
                let nodes = part.network().nodes();
                let values = part.payload().values().iter().zip(expected.payload().values());
                let mut own = 0;
                for (node, (value, told)) in nodes.iter().zip(values) {
                    let at = std::array::from_fn(|a| node.at()[a] + region.start[a] as u32);
                    if let octofold::network::Side::Surface(_) = painted.network().side(at) {
                        assert_eq!(value, told, "{at:?}");
                        own += 1;
                    }
                }
                assert!(own > 0);
            }
        }
    }

    #[test]
    fn payloads_are_pinned_byte_for_byte() {
        let hex = |layout| -> String {
            let bytes = written(&ball(6, KINDS[2]), layout);
            bytes.iter().map(|b| format!("{b:02x}")).collect()
        };
        let pinned = [
            concat!(
                "4f464e020003090606190c1a1d02d23dc89290fd2500f19bcee6d23766dfb0aef9e3a0085850",
                "2be952915fe693cd47e277b8ba1f1437259a6f2d7001df09ac113a39faff37138a38f4299811",
                "b633a5820e75bff96c5285fdd9c55a79",
            ),
            concat!(
                "4f464e020103090606190e1a1d02d228e817d721cacc941f2f2240328202eddfb0aef9e3a008",
                "58502be952915fe693cd47e277b8ba1f1437259a6f2d7001df09ac113a39faff37138a38f429",
                "9811b633a5820e75bff96c5285fdd9c55a79",
            ),
            concat!(
                "4f464e040203090606190203c00fe3a00858502be952915fe69283e380c56523353a9559ab81",
                "c7d08ca953cb6f4b9a71c23f2d8b31de3cf8910a8f207fa29dfa0d4d70b3025f3e227473f67e",
                "6e26bbd56306fee79c33c608f50baf8fabcadb864a2bd8a0",
            ),
        ];
        assert_eq!(LAYOUTS.map(hex), pinned);
    }

    #[test]
    fn payloads_in_bricks_of_the_second_version_are_read() {
        let written = concat!(
            "4f464e0202030906061902c3c00fe3a00858502be952915fe69283e3802ccdd690672c040509",
            "4308ba5d8bb30508620fa7e560bf203f2d8b31de3cf8910a8f207fa29dfa0d4d70b3025f3e22",
            "7473f67e6e26bbd56306fee79c33c608f50baf8fabcadb864a2bd8a0",
        );
        let bytes: Vec<u8> = written
            .as_bytes()
            .chunks(2)
            .map(|two| u8::from_str_radix(std::str::from_utf8(two).unwrap(), 16).unwrap())
            .collect();
        let read = open(&bytes).unwrap().painted(&Run::default()).unwrap().unwrap();
        assert_eq!(read, ball(6, KINDS[2]));
    }

    #[test]
    fn damage_is_an_error_even_where_sums_are_mended() {
        let painted = ball(70, KINDS[2]);
        let mut random = crate::dice::dice();
        let run = Run::default();
        let read = |bytes: &[u8]| open(bytes)?.painted(&run);
        for layout in LAYOUTS {
            let bytes = written(&painted, layout);
            for end in (0..bytes.len()).step_by(bytes.len() / 97 + 1) {
                assert!(read(&bytes[..end]).is_err(), "{end}");
            }
            let sums = sums(&open(&bytes).unwrap());
            for round in 0..100 {
                let mut damaged = bytes.clone();
                // Headers and payloads more often than the solid.
                let at = match round % 3 {
                    0 => random() % 40,
                    1 => bytes.len() - 1 - random() % (bytes.len() / 2),
                    _ => random() % bytes.len(),
                };
                damaged[at] ^= 1 + random() as u8 % 255;
                assert!(read(&damaged).is_err(), "a sum must tell of byte {at}");
                for range in &sums {
                    let sum = crc32c(&damaged[range.0.clone()]).to_le_bytes();
                    damaged[range.1..range.1 + SUM].copy_from_slice(&sum);
                }
                // A damaged size may ask for more work than a test should do.
                if at > 12 {
                    let _ = read(&damaged);
                }
            }
        }
    }

    /// The bytes that are summed, and where their sums stand.
    fn sums(file: &File) -> Vec<(Range<usize>, usize)> {
        let mut sums = match &file.body {
            Body::Stream(range) => vec![(0..range.end, range.end)],
            Body::Bricks(_, stored) => stored.sums.clone(),
        };
        let ranges = match file.carried.as_ref().unwrap() {
            Carried::Streams(_, ranges) => ranges.clone(),
            Carried::Bricks(_, columns) => columns.iter().flat_map(|c| c.1.clone()).collect(),
        };
        sums.extend(ranges.into_iter().filter(|r| !r.is_empty()).map(|r| {
            let at = r.start - SUM;
            (r, at)
        }));
        sums
    }
}

//! What nodes carry as samples: for formats whose voxels are numbers, with a table of colours.
//!
//! Voxels inside have the number of the node before them in their row. Where colours are more than a
//! table can hold, boxes of them share one, each time halving that whose voxels are spread the most.
//! Source: Heckbert, "Color image quantization for frame buffer display", 1982.

use super::painted::Painted;
use super::{links, numbered::Numbered};
use crate::payload::Value;
use crate::volume::{Block, Label, Placement, Region, ScalarType, Volume, VolumeError};
use std::borrow::Cow;

/// A painted solid as a volume of labels.
pub struct Labelled<'a> {
    painted: &'a Painted,
    numbered: Numbered<'a>,
    /// Of each node.
    samples: Vec<u32>,
    table: Vec<Label>,
}

impl<'a> Labelled<'a> {
    /// Samples are labels.
    pub fn by_label(painted: &'a Painted) -> Self {
        let values = painted.payload().values();
        let mut all: Vec<Value> = values.to_vec();
        all.sort_unstable();
        all.dedup_by_key(|v| v.label);
        let coloured = painted.payload().kinds().colours;
        let entry = |v: &Value| Label {
            value: v.label,
            name: String::new(),
            colour: if coloured { v.colour } else { Label::plain_colour(v.label) },
        };
        let table = all.iter().filter(|v| v.label > 0).map(entry).collect();
        let samples = values.iter().map(|v| v.label).collect();
        Self { painted, numbered: Numbered::new(painted.network()), samples, table }
    }

    /// Samples are numbers of colours, from 1 to at most `most`; labels have colours of their own where
    /// there are no others.
    pub fn by_colour(painted: &'a Painted, most: usize) -> Self {
        let coloured = painted.payload().kinds().colours;
        let colour = |v: &Value| {
            if coloured { v.colour } else { Label::plain_colour(v.label) }
        };
        let colours: Vec<[u8; 4]> = painted.payload().values().iter().map(colour).collect();
        let mut sorted = colours.clone();
        sorted.sort_unstable();
        let mut shades: Vec<Shade> = sorted
            .chunk_by(|a, b| a == b)
            .map(|same| Shade { colour: same[0], count: same.len() as u64 })
            .collect();
        let shares = shares(&mut shades, most);
        let mut numbers: Vec<([u8; 4], u32)> = Vec::with_capacity(shades.len());
        let mut table = Vec::new();
        for (share, value) in shares.into_iter().zip(1..) {
            let share = &shades[share];
            numbers.extend(share.iter().map(|s| (s.colour, value)));
            table.push(Label { value, name: String::new(), colour: mean(share) });
        }
        numbers.sort_unstable();
        let number =
            |c: &[u8; 4]| numbers.binary_search_by_key(c, |n| n.0).map_or(0, |at| numbers[at].1);
        let samples = colours.iter().map(number).collect();
        Self { painted, numbered: Numbered::new(painted.network()), samples, table }
    }
}

/// A colour, and how many nodes have it.
#[derive(Debug, Clone, Copy)]
struct Shade {
    colour: [u8; 4],
    count: u64,
}

/// Parts shades into at most `most` shares of neighbours.
fn shares(shades: &mut [Shade], most: usize) -> Vec<std::ops::Range<usize>> {
    let whole = 0..shades.len();
    let mut shares: Vec<_> = if whole.is_empty() { Vec::new() } else { vec![whole] };
    while shares.len() < most.min(shades.len()) {
        let spread = |share: &std::ops::Range<usize>| {
            let (_, length) = longest(&shades[share.clone()]);
            length * shades[share.clone()].iter().map(|s| s.count).sum::<u64>()
        };
        let widest = shares.iter().enumerate().max_by_key(|(i, s)| (spread(s), usize::MAX - i));
        let Some((at, share)) = widest.filter(|(_, s)| s.len() > 1) else { break };
        let (at, share) = (at, share.clone());
        let own = &mut shades[share.clone()];
        let (channel, _) = longest(own);
        own.sort_unstable_by_key(|s| (s.colour[channel], s.colour));
        let half = own.iter().map(|s| s.count).sum::<u64>() / 2;
        let mut passed = 0;
        let middle = own.iter().position(|s| {
            passed += s.count;
            passed > half
        });
        let middle = share.start + middle.unwrap_or(0).clamp(1, share.len() - 1);
        shares[at] = share.start..middle;
        shares.push(middle..share.end);
    }
    shares
}

/// The channel in which shades are the furthest apart, and how far.
fn longest(shades: &[Shade]) -> (usize, u64) {
    let length = |c: usize| {
        let values = shades.iter().map(|s| s.colour[c]);
        let (low, high) = values.fold((255, 0), |(l, h), v| (v.min(l), v.max(h)));
        u64::from(high.saturating_sub(low))
    };
    (0..4).map(|c| (c, length(c))).max_by_key(|&(c, l)| (l, 3 - c)).unwrap_or((0, 0))
}

fn mean(shades: &[Shade]) -> [u8; 4] {
    let count: u64 = shades.iter().map(|s| s.count).sum();
    std::array::from_fn(|c| {
        let sum: u64 = shades.iter().map(|s| u64::from(s.colour[c]) * s.count).sum();
        ((sum + count / 2) / count.max(1)) as u8
    })
}

impl Volume for Labelled<'_> {
    fn dims(&self) -> [usize; 3] {
        self.painted.dims()
    }

    fn placement(&self) -> Placement {
        self.painted.placement()
    }

    fn scalar_type(&self) -> ScalarType {
        ScalarType::U32
    }

    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError> {
        let [width, height, _] = region.dims();
        let mut out = vec![0; region.len()];
        for z in region.start[2]..region.end[2] {
            for y in region.start[1]..region.end[1] {
                let line = ((z - region.start[2]) * height + (y - region.start[1])) * width;
                let mut put = |start: u32, end: u32, value: u32| {
                    let place = |x: u32| {
                        (x as usize).clamp(region.start[0], region.end[0]) - region.start[0]
                    };
                    out[line + place(start)..line + place(end)].fill(value);
                };
                let (mut next, row) = self.numbered.row(y as u32, z as u32);
                for (i, s) in row.iter().enumerate() {
                    for x in s.start..s.end {
                        put(x, x + 1, self.samples[next as usize]);
                        next += 1;
                    }
                    if s.mask & links::HIGH_X == 0
                        && let Some(after) = row.get(i + 1)
                    {
                        put(s.end, after.start, self.samples[next as usize - 1]);
                    }
                }
            }
        }
        Ok(Block::U32(Cow::Owned(out)))
    }

    fn labels(&self) -> &[Label] {
        &self.table
    }
}

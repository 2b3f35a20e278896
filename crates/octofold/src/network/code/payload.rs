//! What nodes carry as bytes.
//!
//! A column of a payload (labels, or colours) is coded along the order of nodes, which whoever reads it
//! knows already. Before a node come up to thirteen of its neighbours. Where values are few a node most
//! often has what most of these have, the nearer counting for more: whether it does is one decision, and
//! so for the next of them; what none of them has is named out of a palette. Where colours are many, each
//! channel is predicted from the neighbours (green first, the others with what green was off), and
//! the difference coded by how much the neighbours differ, be it at once or only where none of the
//! neighbours has it. The smallest of these is taken for a whole column, so that its parts can be coded alone. Source: specification (D3.7); the prediction from
//! three neighbours: Weinberger, Seroussi and Sapiro, "LOCO-I", 1996.

use super::CodeError;
use crate::network::Node;
use crate::range::{Chance, Coder, Decoder, Encoder, Number};

/// Entries of a palette, at most.
const MOST_ENTRIES: usize = 1 << 16;

/// Neighbours that come before a node.
const BEFORE: usize = 13;

/// How much each neighbour counts: by how many of its coordinates differ.
const WEIGHTS: [u32; BEFORE] = [6, 3, 6, 3, 1, 3, 1, 3, 6, 3, 1, 3, 1];

/// Neighbours that stand in for the left, upper and upper left of an image, in three planes.
const CORNERS: [[usize; 3]; 3] = [[0, 2, 1], [0, 8, 7], [2, 8, 5]];

/// How the values of a column are coded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Scheme {
    /// As entries of a palette, in rising order.
    Palette(Vec<u32>),
    /// As they are.
    Wide,
    /// As four channels, by their differences from what is predicted.
    Channels,
    /// As what neighbours have, and where none has it as four channels.
    Near,
}

/// The neighbours that come before each node of some nodes, one node after the other.
struct Neighbours<'a> {
    nodes: &'a [Node],
    /// First nodes of rows.
    rows: Vec<usize>,
    /// The row of the next node, and the first that may be in the slice below it.
    row: usize,
    below: usize,
    next: usize,
    /// Where four rows are looked at: the one before the row, and three of the slice below.
    cursors: [Option<usize>; 4],
}

/// Which of the thirteen there are, and their numbers.
type Before = [Option<u32>; BEFORE];

impl<'a> Neighbours<'a> {
    fn new(nodes: &'a [Node]) -> Self {
        let is_first = |&i: &usize| i == 0 || nodes[i].zyx[..2] != nodes[i - 1].zyx[..2];
        let rows = (0..nodes.len()).filter(is_first).collect();
        Self { nodes, rows, row: 0, below: 0, next: 0, cursors: [None; 4] }
    }

    /// Finds the rows beside the row of the next node, which is its first.
    fn enter(&mut self) {
        let (nodes, rows, next) = (self.nodes, &self.rows, self.next);
        self.row = rows.partition_point(|&r| r <= next) - 1;
        let place = |row: usize| (nodes[rows[row]].zyx[0], nodes[rows[row]].zyx[1]);
        let (z, y) = place(self.row);
        self.cursors = [None; 4];
        if let Some(last) = self.row.checked_sub(1)
            && (place(last).0, place(last).1 + 1) == (z, y)
        {
            self.cursors[0] = Some(rows[last]);
        }
        let Some(slice) = z.checked_sub(1) else { return };
        while place(self.below) < (slice, y.saturating_sub(1)) {
            self.below += 1;
        }
        for row in (self.below..self.row).take(3) {
            let (own, other) = place(row);
            if own == slice && other.abs_diff(y) <= 1 {
                self.cursors[(other + 2 - y) as usize] = Some(rows[row]);
            }
        }
    }

    /// The neighbours of the next node.
    fn advance(&mut self) -> Before {
        let i = self.next;
        if self.rows.get(self.row + usize::from(i > 0)).is_some_and(|&r| r == i) {
            self.enter();
        }
        self.next += 1;
        let nodes = self.nodes;
        let x = nodes[i].zyx[2];
        let mut before = [None; BEFORE];
        if i > self.rows[self.row] && nodes[i - 1].zyx[2] + 1 == x {
            before[0] = Some(i as u32 - 1);
        }
        for (line, cursor) in self.cursors.iter_mut().enumerate() {
            let Some(cursor) = cursor else { continue };
            let row = &nodes[*cursor].zyx[..2];
            let at = |i: usize| nodes.get(i).filter(|n| n.zyx[..2] == *row).map(|n| n.zyx[2]);
            while at(*cursor + 1).is_some() && nodes[*cursor].zyx[2] + 1 < x {
                *cursor += 1;
            }
            for i in *cursor..*cursor + 3 {
                if let Some(off) = at(i).map(|other| i32::from(other) - i32::from(x))
                    && off.abs() <= 1
                {
                    before[1 + 3 * line + (off + 1) as usize] = Some(i as u32);
                }
            }
        }
        before
    }
}

/// The neighbours that there are.
fn known(before: &Before) -> impl Iterator<Item = (usize, usize)> + '_ {
    before.iter().enumerate().filter_map(|(i, n)| Some((i, (*n)? as usize)))
}

impl Scheme {
    /// The scheme that takes the fewest bytes for a column.
    pub fn of(nodes: &[Node], column: &[u32], channels: bool) -> Self {
        let mut entries = column.to_vec();
        entries.sort_unstable();
        entries.dedup();
        let few = if entries.len() <= MOST_ENTRIES { Self::Palette(entries) } else { Self::Wide };
        if !channels {
            return few;
        }
        let length = |scheme: &Self| scheme.head().len() + scheme.encode(nodes, column).len();
        let all = [few, Self::Near, Self::Channels];
        all.into_iter().min_by_key(length).unwrap_or(Self::Channels)
    }

    /// The scheme as bytes.
    pub fn head(&self) -> Vec<u8> {
        let mut coder = Encoder::default();
        self.code(&mut coder);
        coder.finish()
    }

    /// Codes the scheme beside other things.
    pub fn code(&self, coder: &mut impl Coder) {
        // An encoder finds nothing wrong.
        let _ = scheme(coder, Some(self), 0);
    }

    /// Reads a scheme for a column of so many values.
    pub fn read(coder: &mut impl Coder, values: u64) -> Result<Self, CodeError> {
        scheme(coder, None, values)
    }

    /// The values of some nodes in order.
    pub fn encode(&self, nodes: &[Node], column: &[u32]) -> Vec<u8> {
        let mut coder = Encoder::default();
        // An encoder finds nothing wrong.
        let _ = self.values(&mut coder, nodes, Some(column));
        coder.finish()
    }

    /// The same of bytes.
    pub fn decode(&self, nodes: &[Node], bytes: &[u8]) -> Result<Vec<u32>, CodeError> {
        self.values(&mut Decoder::new(bytes), nodes, None)
    }

    /// A scheme and the values of all nodes in one stream.
    pub fn encode_whole(&self, nodes: &[Node], column: &[u32]) -> Vec<u8> {
        let mut coder = Encoder::default();
        self.code(&mut coder);
        let _ = self.values(&mut coder, nodes, Some(column));
        coder.finish()
    }

    /// The same of bytes.
    pub fn decode_whole(nodes: &[Node], bytes: &[u8]) -> Result<Vec<u32>, CodeError> {
        let mut coder = Decoder::new(bytes);
        Self::read(&mut coder, nodes.len() as u64)?.values(&mut coder, nodes, None)
    }

    fn values(
        &self,
        coder: &mut impl Coder,
        nodes: &[Node],
        column: Option<&[u32]>,
    ) -> Result<Vec<u32>, CodeError> {
        if let Self::Palette(entries) = self
            && let [only] = entries[..]
        {
            return Ok(vec![only; nodes.len()]);
        }
        let mut neighbours = Neighbours::new(nodes);
        let mut values: Vec<u32> = Vec::with_capacity(nodes.len());
        let mut few = Few::new(self);
        let mut channels = Channels::default();
        for node in 0..nodes.len() {
            let told = column.map_or(0, |c| c[node]);
            let before = neighbours.advance();
            let value = match self {
                Self::Channels => channels.code(coder, &before, &values, told),
                _ => few.code(coder, &before, &values, told),
            };
            if node % 1024 == 0 && coder.is_overrun() {
                return Err(CodeError::CutOff);
            }
            values.push(value);
        }
        if coder.is_overrun() { Err(CodeError::CutOff) } else { Ok(values) }
    }
}

/// Codes a scheme.
fn scheme(coder: &mut impl Coder, told: Option<&Scheme>, values: u64) -> Result<Scheme, CodeError> {
    const EVEN: u32 = 1 << 31;
    if coder.code(EVEN, matches!(told, Some(Scheme::Channels))) {
        return Ok(Scheme::Channels);
    }
    if coder.code(EVEN, matches!(told, Some(Scheme::Near))) {
        return Ok(Scheme::Near);
    }
    if coder.code(EVEN, matches!(told, Some(Scheme::Wide))) {
        return Ok(Scheme::Wide);
    }
    let known = if let Some(Scheme::Palette(known)) = told { known.as_slice() } else { &[] };
    let count = Number::default().code(coder, known.len() as u32, MOST_ENTRIES as u32);
    if told.is_none() && u64::from(count) > values {
        return Err(CodeError::Damaged);
    }
    let mut halves = Halves::default();
    let mut entries: Vec<u32> = Vec::new();
    for i in 0..count as usize {
        let before = entries.last().copied();
        let step = known.get(i).map_or(0, |k| k.wrapping_sub(before.unwrap_or(0)));
        let step = halves.code(coder, step);
        let entry = before.unwrap_or(0).checked_add(step).ok_or(CodeError::Damaged)?;
        if coder.is_overrun() || before.is_some_and(|b| b >= entry) {
            return Err(CodeError::Damaged);
        }
        entries.push(entry);
    }
    Ok(Scheme::Palette(entries))
}

/// Schemes of columns, and the lengths of their parts, as bytes.
pub fn lengths(columns: &[(Scheme, Vec<u32>)]) -> Vec<u8> {
    let mut coder = Encoder::default();
    for (scheme, lengths) in columns {
        scheme.code(&mut coder);
        let mut number = Number::default();
        for &length in lengths {
            number.code(&mut coder, length, u32::MAX - 1);
        }
    }
    coder.finish()
}

/// The same of bytes: so many columns of so many parts, with at most `values` values.
pub fn read_lengths(
    bytes: &[u8],
    columns: usize,
    parts: usize,
    values: u64,
) -> Result<Vec<(Scheme, Vec<u32>)>, CodeError> {
    let mut coder = Decoder::new(bytes);
    let mut all = Vec::new();
    for _ in 0..columns {
        let scheme = Scheme::read(&mut coder, values)?;
        let mut number = Number::default();
        let mut lengths = Vec::new();
        for _ in 0..parts {
            lengths.push(number.code(&mut coder, 0, u32::MAX - 1));
            if coder.is_overrun() {
                return Err(CodeError::CutOff);
            }
        }
        all.push((scheme, lengths));
    }
    Ok(all)
}

/// Numbers of 32 bits.
#[derive(Default)]
struct Halves {
    high: Number,
    low: Number,
}

impl Halves {
    fn code(&mut self, coder: &mut impl Coder, value: u32) -> u32 {
        let high = self.high.code(coder, value >> 16, 0xffff);
        high << 16 | self.low.code(coder, value & 0xffff, 0xffff)
    }
}

/// What none of the neighbours has.
enum Rest {
    /// One of a palette, whose place is a path through a tree.
    Tree(Vec<u32>, Vec<Chance>),
    Wide(Box<Halves>),
    Channels(Box<Channels>),
}

/// Chances of few values.
struct Few {
    /// Whether the value is that of the neighbours that count the most, of what is left of them; by how
    /// many were asked, and what part of all they are.
    hits: [[[Chance; 9]; 2]; Few::ASKED],
    /// Whether it is that of the node before in order, where there are no neighbours.
    again: Chance,
    rest: Rest,
}

impl Few {
    /// How many different values are asked for.
    const ASKED: usize = 3;

    fn new(scheme: &Scheme) -> Self {
        let rest = match scheme {
            Scheme::Palette(entries) => {
                let leaves = entries.len().next_power_of_two();
                Rest::Tree(entries.clone(), vec![Chance::EVEN; leaves])
            }
            Scheme::Wide => Rest::Wide(Box::default()),
            _ => Rest::Channels(Box::default()),
        };
        Self { hits: [[[Chance::EVEN; 9]; 2]; Self::ASKED], again: Chance::EVEN, rest }
    }

    fn code(&mut self, coder: &mut impl Coder, before: &Before, values: &[u32], told: u32) -> u32 {
        let mut votes: [(u32, u32); BEFORE] = [(0, 0); BEFORE];
        let (mut count, mut all) = (0, 0);
        for (which, other) in known(before) {
            let value = values[other];
            let known = votes[..count].iter().position(|v| v.1 == value);
            let at = known.unwrap_or_else(|| {
                count += 1;
                count - 1
            });
            votes[at] = (votes[at].0 + WEIGHTS[which], value);
            all += WEIGHTS[which];
        }
        if count == 0 {
            if let Some(&last) = values.last()
                && self.again.code(coder, told == last)
            {
                return last;
            }
            return self.rest(coder, before, values, told);
        }
        votes[..count].sort_unstable_by(|a, b| b.cmp(a));
        for (asked, &(weight, value)) in votes[..count].iter().take(Self::ASKED).enumerate() {
            let share = (weight * 8 / all) as usize;
            let alone = usize::from(asked + 1 == count);
            if self.hits[asked][alone][share].code(coder, told == value) {
                return value;
            }
        }
        self.rest(coder, before, values, told)
    }

    fn rest(&mut self, coder: &mut impl Coder, before: &Before, values: &[u32], told: u32) -> u32 {
        match &mut self.rest {
            Rest::Channels(channels) => channels.code(coder, before, values, told),
            Rest::Wide(halves) => halves.code(coder, told),
            Rest::Tree(entries, chances) => {
                let place = entries.binary_search(&told).unwrap_or(0);
                let bits = chances.len().ilog2();
                let mut node = 1;
                for bit in (0..bits).rev() {
                    let one = chances[node].code(coder, place >> bit & 1 == 1);
                    node = node << 1 | usize::from(one);
                }
                // Only a damaged stream names what is not there.
                let last = entries.len().saturating_sub(1);
                entries.get((node - chances.len()).min(last)).copied().unwrap_or(0)
            }
        }
    }
}

/// Steps by which neighbours differ.
const ACTIVITIES: usize = 9;

/// Chances of the differences of channels.
#[derive(Default)]
struct Channels {
    /// Of green; of red and of blue, by how far green was off too; of alpha.
    green: [Number; ACTIVITIES],
    others: [[[Number; 4]; ACTIVITIES]; 2],
    alpha: [Number; 2],
}

impl Channels {
    fn code(&mut self, coder: &mut impl Coder, before: &Before, values: &[u32], told: u32) -> u32 {
        let around = Around::new(before, values);
        let told = told.to_be_bytes().map(i32::from);
        let mut found = [0; 4];
        let mut off = 0;
        for channel in [1, 0, 2] {
            let (predicted, spread) = around.predict(channel);
            let predicted = (predicted + off).clamp(0, 255);
            let activity = ACTIVITIES.min(32 - spread.leading_zeros() as usize + 1) - 1;
            let numbers = match channel {
                1 => &mut self.green[activity],
                other => {
                    let far = (32 - off.unsigned_abs().leading_zeros() as usize).div_ceil(2);
                    &mut self.others[other / 2][activity][far.min(3)]
                }
            };
            found[channel] = differ(numbers, coder, told[channel], predicted);
            off = if channel == 1 {
                found[1] - predicted
            } else {
                (off + found[0] - around.predict(0).0) / 2
            };
        }
        let (predicted, spread) = around.predict(3);
        let alpha = &mut self.alpha[usize::from(spread > 0)];
        found[3] = differ(alpha, coder, told[3], predicted);
        u32::from_be_bytes(found.map(|v| v as u8))
    }
}

/// Codes a value by how far it is from what was predicted.
fn differ(numbers: &mut Number, coder: &mut impl Coder, told: i32, predicted: i32) -> i32 {
    let off = (told - predicted) as u8 as i8;
    let folded = numbers.code(coder, u32::from((off << 1 ^ off >> 7) as u8), 255);
    let off = (folded >> 1) as i32 ^ -((folded & 1) as i32);
    (predicted + off) & 255
}

/// The colours of the neighbours of a node.
struct Around {
    colours: [Option<[i32; 4]>; BEFORE],
    last: [i32; 4],
}

impl Around {
    fn new(before: &Before, values: &[u32]) -> Self {
        let of = |value: u32| value.to_be_bytes().map(i32::from);
        let mut colours = [None; BEFORE];
        for (which, other) in known(before) {
            colours[which] = Some(of(values[other]));
        }
        Self { colours, last: values.last().map_or([255; 4], |&v| of(v)) }
    }

    /// What a channel is likely to be, and how far the neighbours are apart.
    fn predict(&self, channel: usize) -> (i32, u32) {
        let at = |i: usize| self.colours[i].map(|c| c[channel]);
        let known = || (0..BEFORE).filter_map(|i| Some((at(i)?, WEIGHTS[i] as i32)));
        let (mut low, mut high, mut sum, mut weights) = (255, 0, 0, 0);
        for (value, weight) in known() {
            (low, high) = (low.min(value), high.max(value));
            sum += value * weight;
            weights += weight;
        }
        if weights == 0 {
            return (self.last[channel], 255);
        }
        let spread = (high - low) as u32;
        let planes = CORNERS.iter().filter_map(|&[left, up, corner]| {
            let (a, b, c) = (at(left)?, at(up)?, at(corner)?);
            Some((a + b - c).clamp(a.min(b), a.max(b)))
        });
        let (count, total) = planes.fold((0, 0), |(n, s), v| (n + 1, s + v));
        let mean = (2 * sum + weights) / (2 * weights);
        if count == 0 { (mean, spread) } else { ((total + mean + count / 2) / (count + 1), spread) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::{Network, tests::noise};
    use crate::run::Run;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(60))]

        #[test]
        fn columns_come_back(
            dims in (1usize..14, 1usize..14, 1usize..14),
            seed in any::<u64>(),
            coarse in 1usize..6,
            spread in 0u32..33,
            channels in any::<bool>(),
            damage in any::<u64>(),
        ) {
            let solid = noise([dims.0, dims.1, dims.2], seed, coarse, 50);
            let nodes = Network::new(&solid, &Run::default()).unwrap().nodes();
            let value = |i: usize| {
                let any = (i as u64).wrapping_mul(seed | 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                (any >> 32) as u32 & 1u32.checked_shl(spread).unwrap_or(0).wrapping_sub(1)
            };
            let column: Vec<u32> = (0..nodes.len()).map(value).collect();
            let mut schemes = vec![Scheme::of(&nodes, &column, channels), Scheme::Wide];
            schemes.extend([Scheme::Channels, Scheme::Near]);
            for scheme in schemes {
                let bytes = scheme.encode_whole(&nodes, &column);
                prop_assert_eq!(&Scheme::decode_whole(&nodes, &bytes).unwrap(), &column);
                for end in [0, bytes.len() / 2] {
                    let _ = Scheme::decode_whole(&nodes, &bytes[..end]);
                }
                let mut damaged = bytes;
                if !damaged.is_empty() {
                    let at = damage as usize % damaged.len();
                    damaged[at] ^= (damage >> 32) as u8;
                    let _ = Scheme::decode_whole(&nodes, &damaged);
                }
            }
        }
    }

    #[test]
    fn neighbours_are_the_thirteen_that_come_before() {
        for seed in 0..40 {
            let solid = noise([9, 8, 7], seed, 1 + seed as usize % 3, 60);
            let nodes = Network::new(&solid, &Run::default()).unwrap().nodes();
            let mut neighbours = Neighbours::new(&nodes);
            for node in &nodes {
                let before = neighbours.advance();
                let [z, y, x] = node.zyx.map(i32::from);
                let rows = [(0, -1), (-1, -1), (-1, 0), (-1, 1)];
                let steps = rows.iter().flat_map(|&(z, y)| (-1..2).map(move |x| [z, y, x]));
                for (i, step) in std::iter::once([0, 0, -1]).chain(steps).enumerate() {
                    let at = [z + step[0], y + step[1], x + step[2]];
                    let expected = nodes.iter().position(|n| n.zyx.map(i32::from) == at);
                    assert_eq!(before[i].map(|n| n as usize), expected, "{at:?}");
                    let differ = step.iter().map(|s| s.abs()).sum::<i32>();
                    assert_eq!(WEIGHTS[i], [6, 3, 1][differ as usize - 1]);
                }
            }
        }
    }
}

//! The archive model: eight contexts and a regression, mixed by their odds.
//!
//! Contexts of more and more voxels, of how far away the next changes along rows are, and of columns
//! of voxels along each axis are counted as in the fast model. The regression carries most of the
//! gain. All is in integers, so that every platform gets the same. Source: specification (D3.4,
//! P-mix).

use super::direct::far;
use super::neighbourhood::MARGIN;
use super::prior;
use super::regression::Regression;
use super::walk::Model;
use crate::range::counted::Counted;
use crate::range::logistic::{Logistic, Logit};
use crate::range::mixer::{Mixer, ONE};

/// Contexts that are counted.
const CONTEXTS: usize = 8;

/// What is mixed: odds and trust of each context, odds of the regression, and a constant.
const INPUTS: usize = 2 * CONTEXTS + 2;

/// Bits of a place in a table of contexts.
const BITS: u32 = 22;

/// How many times a chance looks back over.
const MEMORY: u32 = 30;

/// Steps of a correction: odds in parts of 2.
const STEPS: usize = 33;

/// How far a correction moves: one part in so many.
const CORRECTION: i64 = 50;

/// Rates of the mixers, at first and later.
const RATES: [i64; 2] = [820, 328];

/// When the later rate begins.
const LATER: u32 = 20_000;

/// The least chance, in 2^32.
const LEAST: u64 = 1 << 16;

/// Rows, by their place in [`Model::ROWS`]: so many slices before, so many rows below or above.
mod row {
    pub const Y1: usize = 0;
    pub const Y2: usize = 1;
    pub const Z1_Y1: usize = 2;
    pub const Z1: usize = 3;
    pub const Z1_UP1: usize = 4;
    pub const Z2: usize = 5;
    pub const Z1_UP2: usize = 6;
    pub const Y3: usize = 7;
    pub const Z1_Y2: usize = 8;
    pub const Z2_Y1: usize = 11;
    pub const Z2_UP1: usize = 12;
    pub const Z3: usize = 17;
    pub const Y4: usize = 22;
    pub const Y5: usize = 23;
    pub const Z4: usize = 24;
    pub const Z5: usize = 25;
}

/// Contexts, a regression, and what mixes them.
#[derive(Debug)]
pub struct Mixture {
    logistic: Logistic,
    logit: Logit,
    tables: [Vec<Counted>; CONTEXTS],
    places: [usize; CONTEXTS],
    regression: Regression,
    inputs: [i32; INPUTS],
    mixers: [Mixer<INPUTS>; 2],
    corrections: Vec<[u32; STEPS]>,
    /// The correction that was looked up, and its step.
    corrected: (usize, usize),
    seen: u32,
}

impl Default for Mixture {
    fn default() -> Self {
        let logistic = Logistic::default();
        let mut weights = [0; INPUTS];
        weights[..CONTEXTS].fill(ONE / 10);
        weights[2 * CONTEXTS] = ONE * 4 / 10;
        let correction = std::array::from_fn(|i| logistic.chance((i as i32 - 16) * 128));
        Self {
            logit: Logit::new(&logistic),
            tables: std::array::from_fn(|i| {
                vec![Counted::default(); 1 << if i == 0 { 16 } else { BITS }]
            }),
            places: [0; CONTEXTS],
            regression: Regression::default(),
            inputs: [0; INPUTS],
            mixers: [Mixer::new(weights, 17 * 8), Mixer::new(weights, 64 * 64)],
            corrections: vec![correction; 64 * 16],
            corrected: (0, 0),
            seen: 0,
            logistic,
        }
    }
}

/// Where the nearest change along a row is, up to seven voxels away: how far, on which side, and
/// from which value.
#[inline]
fn change(word: u64, at: u32) -> u64 {
    const FAR: u32 = MARGIN - 1;
    let value = word >> at & 1;
    let other = if value == 1 { !word } else { word };
    let up = (other >> (at + 1) | 1 << FAR).trailing_zeros();
    let down = (other << (64 - at) | 1 << (63 - FAR)).leading_zeros();
    let way = match (up, down) {
        (FAR, FAR) => 15,
        _ if up <= down => up + 1,
        _ => 16 + down,
    };
    u64::from(way) << 1 | value
}

#[inline]
fn hash<const N: usize>(parts: [u64; N]) -> usize {
    let mix = |h: u64, part: u64| (h.rotate_left(5) ^ part).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (parts.into_iter().fold(0, mix) >> (64 - BITS)) as usize
}

/// Up to four small numbers in one.
#[inline]
fn pack<const N: usize>(parts: [u64; N]) -> u64 {
    parts.into_iter().fold(0, |all, part| all << 16 | part)
}

/// The places of all contexts of the voxel of bit `at`.
#[inline]
fn places(words: &[u64], own: u64, at: u32, near: u32) -> [usize; CONTEXTS] {
    use row::*;
    let bit = |r: usize| words[r] >> at & 1;
    let bits = |r: usize, left: u32, count: u32| words[r] >> (at - left) & ((1 << count) - 1);
    let fine = far([own, words[Y1], words[Z1], words[Z1_UP2]], at) << 16 | near;
    let wide =
        [own >> (at - 4) & 1, bits(Y1, 3, 7), bits(Y2, 2, 5), bits(Z2, 1, 3), bits(Z1_UP2, 1, 3)];
    let single = [Y3, Z1_Y2, Z2_Y1, Z2_UP1, Z3].into_iter().fold(0, |all, r| all << 1 | bit(r));
    let wide = wide.into_iter().fold(single, |all, part| all << 7 | part);
    let [y1, y2, y3, y4, y5] = [Y1, Y2, Y3, Y4, Y5].map(|r| change(words[r], at));
    let [z1, z2, z3, z4, z5] = [Z1, Z2, Z3, Z4, Z5].map(|r| change(words[r], at));
    let [up, down, above, behind] = [Z1_UP1, Z1_Y1, Z1_UP2, Z2_UP1].map(|r| change(words[r], at));
    let columns = [Y1, Y2, Y3, Y4, Y5, Z1, Z2, Z3, Z4, Z5];
    let columns = columns.into_iter().fold(0, |all, r| all << 1 | bit(r));
    let current = own >> (at - 3) & 7;
    [
        near as usize,
        fine as usize,
        hash([1, u64::from(fine), wide]),
        hash([2, current, pack([y1, y2, z1, up])]),
        hash([3, current, pack([y1, y2, y3, y4]), pack([y5, z1])]),
        hash([4, current, pack([z1, z2, z3, z4]), pack([z5, y1])]),
        hash([5, columns << 7 | own >> (at - 7) & 127]),
        hash([6, current & 3, pack([y1, z1, up, down]), pack([z2, y2, above, behind])]),
    ]
}

impl Mixture {
    /// How often context `i` was told, at most `most`.
    fn trust(&self, i: usize, most: u32) -> usize {
        self.tables[i][self.places[i]].seen().min(most) as usize
    }

    /// What the contexts tell; what was never met takes over what fewer voxels tell.
    #[inline]
    fn ask_contexts(&mut self, near: u32) {
        let mut backed = self.logistic.chance(prior::odds(near));
        for i in 0..CONTEXTS {
            let counted = &mut self.tables[i][self.places[i]];
            if counted.is_unmet() {
                *counted = Counted::new(backed);
            }
            let chance = counted.chance();
            if i < 2 {
                backed = chance;
            }
            self.inputs[i] = self.logit.odds(chance);
            let trust = counted.seen().min(30) as i32;
            self.inputs[CONTEXTS + i] = (((chance >> 20) as i32 - 2048) * trust * 10) >> 10;
        }
    }

    /// The chance of odds as corrected by what happened at such odds before.
    #[inline]
    fn correct(&mut self, set: usize, odds: i32) -> u64 {
        let place = (odds.clamp(-2047, 2047) + 2048) as usize;
        let (step, part) = (place >> 7, place as u64 & 127);
        self.corrected = (set, step);
        let row = &self.corrections[set];
        (u64::from(row[step]) * (128 - part) + u64::from(row[step + 1]) * part) >> 7
    }
}

impl Model for Mixture {
    const ROWS: &'static [(usize, i64)] = &[
        (0, -1),
        (0, -2),
        (1, -1),
        (1, 0),
        (1, 1),
        (2, 0),
        (1, 2),
        (0, -3),
        (1, -2),
        (1, -3),
        (1, 3),
        (2, -1),
        (2, 1),
        (2, -2),
        (2, 2),
        (2, -3),
        (2, 3),
        (3, 0),
        (3, -1),
        (3, 1),
        (3, -2),
        (3, 2),
        (0, -4),
        (0, -5),
        (4, 0),
        (5, 0),
    ];

    fn predict(&mut self, words: &[u64], own: u64, at: u32, near: u32) -> u32 {
        self.places = places(words, own, at, near);
        self.ask_contexts(near);
        let bit = |word: u64, at: u32| (word >> at & 1) as usize;
        let (below, before) = (words[row::Y1], words[row::Z1]);
        let beside = bit(own, at - 1)
            | bit(below, at) << 1
            | bit(before, at) << 2
            | bit(words[row::Z1_UP1], at) << 3
            | bit(below, at + 1) << 4
            | bit(before, at + 1) << 5;
        let fit = self.regression.odds(beside, words, own, at, &self.logistic);
        self.inputs[2 * CONTEXTS] = fit.clamp(-2400, 2400);
        self.inputs[2 * CONTEXTS + 1] = 77;
        let by_count = near.count_ones() as usize * 8 + (beside & 7);
        let by_trust = self.trust(2, 3) | self.trust(7, 3) << 2 | self.trust(3, 3) << 4;
        let (inputs, logistic) = (&self.inputs, &self.logistic);
        let first = self.mixers[0].mix(by_count, inputs, logistic);
        let second = self.mixers[1].mix(by_trust << 6 | beside, inputs, logistic);
        let odds = (first + second) / 2;
        let mixed = u64::from(self.logistic.chance(odds));
        let corrected = self.correct(beside << 4 | self.trust(7, 15), odds);
        ((mixed * 5 + corrected * 3) >> 3).clamp(LEAST, (1 << 32) - LEAST) as u32
    }

    fn learn(&mut self, filled: bool) {
        let rate = RATES[usize::from(self.seen >= LATER)];
        self.seen = self.seen.saturating_add(1);
        let (set, step) = self.corrected;
        let aim = if filled { i64::from(u32::MAX) } else { 0 };
        for chance in &mut self.corrections[set][step..step + 2] {
            *chance = (i64::from(*chance) + (aim - i64::from(*chance)) / CORRECTION) as u32;
        }
        for mixer in &mut self.mixers {
            mixer.learn(filled, &self.inputs, rate);
        }
        self.regression.learn(filled);
        for (table, &place) in self.tables.iter_mut().zip(&self.places) {
            table[place].learn(filled, MEMORY);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_found_on_both_sides() {
        let at = 20;
        assert_eq!(change(0, at), 15 << 1);
        assert_eq!(change(u64::MAX, at), 15 << 1 | 1);
        for way in 1..=7u32 {
            assert_eq!(change(1 << (at + way), at), u64::from(way) << 1);
            assert_eq!(change(1 << (at - way), at), u64::from(15 + way) << 1);
        }
        assert_eq!(change(1 << (at + 8) | 1 << (at - 8), at), 15 << 1);
    }
}

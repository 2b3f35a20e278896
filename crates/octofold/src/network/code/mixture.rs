//! The archive model: eight contexts and a regression, mixed by their odds.
//!
//! The regression weighs about a hundred voxels before a voxel: a soft fit of a plane, which carries
//! most of the gain. Contexts are counted as in the fast model. What each of them tells is mixed in the
//! domain of odds by two sets of weights that follow what happens. All in integers. Source:
//! specification (D3.4, P-mix); Mahoney, "Adaptive weighing of context models", 2005.

use super::counted::Counted;
use super::direct::far;
use super::logistic::Logistic;
use super::walk::{Model, NEAR};

/// Contexts.
const CONTEXTS: usize = 8;

/// What is mixed: odds and trust of each context, odds of the regression, and a constant.
const INPUTS: usize = 2 * CONTEXTS + 2;

/// Bits of a place in a table of contexts.
const BITS: u32 = 22;

/// Voxels that the regression weighs, in words of eight and with the constant.
const WEIGHED: usize = 112;

/// Rows of the mixture, by their place in [`Model::ROWS`].
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
    pub const Z1_Y3: usize = 9;
    pub const Z1_UP3: usize = 10;
    pub const Z2_Y1: usize = 11;
    pub const Z2_UP1: usize = 12;
    pub const Z2_Y2: usize = 13;
    pub const Z2_UP2: usize = 14;
    pub const Z2_Y3: usize = 15;
    pub const Z2_UP3: usize = 16;
    pub const Z3: usize = 17;
    pub const Z3_Y1: usize = 18;
    pub const Z3_UP1: usize = 19;
    pub const Z3_Y2: usize = 20;
    pub const Z3_UP2: usize = 21;
    pub const Y4: usize = 22;
    pub const Y5: usize = 23;
    pub const Z4: usize = 24;
    pub const Z5: usize = 25;
}

/// How far to both sides the regression looks in each row, from the first: a ball of squared radius
/// 13.
const SIDES: [u32; 22] = [3, 3, 3, 3, 3, 3, 2, 2, 2, 1, 1, 2, 2, 2, 2, 0, 0, 2, 1, 1, 0, 0];

/// Signs of eight voxels: 0 for filled, -1 for empty.
const SIGNS: [[i32; 8]; 256] = {
    let mut signs = [[-1; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut bit = 0;
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                signs[byte][bit] = 0;
            }
            bit += 1;
        }
        byte += 1;
    }
    signs
};

/// A model that mixes.
pub struct Mixture {
    logistic: Logistic,
    tables: Vec<Vec<Counted>>,
    places: [usize; CONTEXTS],
    inputs: [i32; INPUTS],
    regression: Vec<[i32; WEIGHED]>,
    weighed: [u8; WEIGHED / 8],
    mixers: [Mixer; 2],
    corrections: Vec<[u32; 33]>,
    /// Which correction was looked up, and how far it is to the next.
    correction: (usize, usize),
    select: usize,
    /// What the regression told.
    fitted: u32,
    seen: u32,
}

/// Weights by context.
struct Mixer {
    weights: Vec<[i32; INPUTS]>,
    select: usize,
    chance: u32,
}

impl Mixer {
    fn new(contexts: usize) -> Self {
        let mut weights = [0; INPUTS];
        weights[..CONTEXTS].fill(ONE / 10);
        weights[2 * CONTEXTS] = ONE * 4 / 10;
        Self { weights: vec![weights; contexts], select: 0, chance: 0 }
    }

    fn mix(&mut self, select: usize, inputs: &[i32; INPUTS], logistic: &Logistic) -> i32 {
        self.select = select;
        let sum: i64 =
            self.weights[select].iter().zip(inputs).map(|(&w, &i)| i64::from(w) * i64::from(i)).sum();
        let odds = (sum >> 16).clamp(-4000, 4000) as i32;
        self.chance = logistic.chance(odds);
        odds
    }

    fn learn(&mut self, filled: bool, inputs: &[i32; INPUTS], rate: i64) {
        let error = error(filled, self.chance);
        for (weight, &input) in self.weights[self.select].iter_mut().zip(inputs) {
            let step = i64::from(error) * i64::from(input) * rate + (1 << 23) >> 24;
            *weight = (*weight + step as i32).clamp(-16 * ONE, 16 * ONE);
        }
    }
}

/// A weight of one.
const ONE: i32 = 1 << 16;

/// How wrong a chance was, in 2^16.
fn error(filled: bool, chance: u32) -> i32 {
    (i32::from(filled) << 16) - (chance >> 16) as i32
}

impl Default for Mixture {
    fn default() -> Self {
        let logistic = Logistic::default();
        let correction = std::array::from_fn(|i| logistic.chance((i as i32 - 16) * 128));
        Self {
            tables: (0..CONTEXTS).map(|i| vec![Counted::default(); if i == 0 { 1 << 16 } else { 1 << BITS }]).collect(),
            places: [0; CONTEXTS],
            inputs: [0; INPUTS],
            regression: vec![[0; WEIGHED]; 64],
            weighed: [0; WEIGHED / 8],
            mixers: [Mixer::new(512), Mixer::new(4096)],
            corrections: vec![correction; 1024],
            correction: (0, 0),
            select: 0,
            fitted: 0,
            seen: 0,
            logistic,
        }
    }
}

/// The way to the nearest change along a row, up to seven voxels, with its side and the value.
#[inline]
fn change(word: u64, at: u32) -> u64 {
    let value = word >> at & 1;
    let other = if value == 1 { !word } else { word };
    let up = (other >> (at + 1) | 1 << 7).trailing_zeros();
    let down = (other << (64 - at) | 1 << 56).leading_zeros();
    let way = if up >= 7 && down >= 7 {
        15
    } else if up <= down {
        up + 1
    } else {
        16 + down
    };
    u64::from(way) << 1 | value
}

#[inline]
fn hash(parts: &[u64]) -> u64 {
    parts.iter().fold(0, |h: u64, p| (h.rotate_left(5) ^ p).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

impl Model for Mixture {
    const ROWS: &'static [(usize, i64)] = &[
        (0, -1), (0, -2), (1, -1), (1, 0), (1, 1), (2, 0), (1, 2),
        (0, -3), (1, -2), (1, -3), (1, 3), (2, -1), (2, 1), (2, -2), (2, 2), (2, -3), (2, 3),
        (3, 0), (3, -1), (3, 1), (3, -2), (3, 2), (0, -4), (0, -5), (4, 0), (5, 0),
    ];

    fn predict(&mut self, words: &[u64], own: u64, at: u32, near: u32) -> u32 {
        use row::*;
        let bits = |r: usize, left: u32, count: u32| words[r] >> (at - left) & ((1 << count) - 1);
        let bit = |r: usize| words[r] >> at & 1;
        let before = far([own, words[Y1], words[Z1], words[Z1_UP2]], at);
        let wide = own >> (at - 4) & 1
            | bits(Y1, 3, 1) << 1 | bits(Y1, 0, 4) >> 3 << 2
            | bits(Y2, 2, 5) << 3
            | bit(Y3) << 8 | bit(Z1_Y2) << 9 | bit(Z2_Y1) << 10 | bit(Z2_UP1) << 11
            | bits(Z2, 1, 3) << 12 | bit(Z3) << 15 | bits(Z1_UP2, 1, 3) << 16;
        let edge = |r: usize| change(words[r], at);
        let (y1, y2, z1, z2) = (edge(Y1), edge(Y2), edge(Z1), edge(Z2));
        let (up, down) = (edge(Z1_UP1), edge(Z1_Y1));
        let current = own >> (at - 3) & 7;
        let history = |rows: [usize; 5]| rows.iter().fold(0, |h, &r| h << 1 | bit(r));
        let fine = u64::from(before) << 16 | u64::from(near);
        let contexts = [
            hash(&[1, fine, wide]),
            hash(&[2, current, y1 << 48 | y2 << 32 | z1 << 16 | up]),
            hash(&[3, current, y1 << 48 | y2 << 32 | edge(Y3) << 16 | edge(Y4), edge(Y5) << 8 | z1]),
            hash(&[4, current, z1 << 48 | z2 << 32 | edge(Z3) << 16 | edge(Z4), edge(Z5) << 8 | y1]),
            hash(&[5, history([Z1, Z2, Z3, Z4, Z5]) << 32 | history([Y1, Y2, Y3, Y4, Y5]) << 16 | own >> (at - 7) & 127]),
            hash(&[6, current & 3, y1 << 48 | z1 << 32 | up << 16 | down, z2 << 48 | y2 << 32 | edge(Z1_UP2) << 16 | edge(Z2_UP1)]),
        ];
        self.places[0] = near as usize;
        self.places[1] = fine as usize;
        for (place, hash) in self.places[2..].iter_mut().zip(contexts) {
            *place = (hash >> (64 - BITS)) as usize;
        }
        let mut backed = 1 << 31;
        for i in 0..CONTEXTS {
            let state = &mut self.tables[i][self.places[i]];
            if state.is_unmet() {
                *state = Counted::new(backed);
            }
            let chance = state.chance();
            if i <= 1 {
                backed = chance;
            }
            self.inputs[i] = self.logistic.odds(chance);
            let trust = state.seen().min(30) as i32;
            self.inputs[CONTEXTS + i] = ((chance >> 20) as i32 - 2048) * trust * 10 >> 10;
        }
        // Regression.
        let mut packed = u128::from(own >> (at - 3) & 7);
        let mut length = 3;
        for (r, &side) in SIDES.iter().enumerate() {
            packed |= u128::from(bits(r, side, 2 * side + 1)) << length;
            length += 2 * side + 1;
        }
        packed |= 1 << length;
        self.weighed.copy_from_slice(&packed.to_le_bytes()[..WEIGHED / 8]);
        let select = own >> (at - 1) & 1 | bit(Y1) << 1 | bit(Z1) << 2 | bit(Z1_UP1) << 3
            | (words[Y1] >> (at + 1) & 1) << 4 | (words[Z1] >> (at + 1) & 1) << 5;
        self.select = select as usize;
        let weights = &self.regression[self.select];
        let mut sums = [0i32; 8];
        for (w, &byte) in weights.chunks_exact(8).zip(&self.weighed) {
            let signs = &SIGNS[byte as usize];
            for l in 0..8 {
                sums[l] += (w[l] ^ signs[l]) - signs[l];
            }
        }
        let fit = sums.iter().sum::<i32>() >> 8;
        self.fitted = self.logistic.chance(fit);
        self.inputs[2 * CONTEXTS] = fit.clamp(-2400, 2400);
        self.inputs[2 * CONTEXTS + 1] = 77;
        // Mixing.
        let low = self.select & 7;
        let trust = |i: usize| self.tables[i][self.places[i]].seen().min(3) as usize;
        let sure = trust(2) | trust(7) << 2 | trust(3) << 4;
        let first = self.mixers[0].mix(near.count_ones() as usize * 8 + low, &self.inputs, &self.logistic);
        let second = self.mixers[1].mix(sure << 6 | self.select, &self.inputs, &self.logistic);
        let odds = (first + second) / 2;
        // Correction.
        let place = odds.clamp(-2022, 2022) + 2048;
        let set = self.select * 16 + self.tables[7][self.places[7]].seen().min(15) as usize;
        let (j, part) = ((place >> 7) as usize, u64::from(place as u32 & 127));
        self.correction = (set, j);
        let row = &self.corrections[set];
        let corrected = (u64::from(row[j]) * (128 - part) + u64::from(row[j + 1]) * part) >> 7;
        let mixed = u64::from(self.logistic.chance(odds));
        let chance = (mixed * 5 + corrected * 3) >> 3;
        chance.clamp(LEAST, (1 << 32) - LEAST) as u32
    }

    fn learn(&mut self, filled: bool) {
        self.seen += 1;
        let rate = if self.seen > 20000 { 328 } else { 820 };
        let (set, j) = self.correction;
        let aim = if filled { i64::from(u32::MAX) } else { 0 };
        for i in [j, j + 1] {
            let c = &mut self.corrections[set][i];
            *c = (i64::from(*c) + (aim - i64::from(*c)) / 50) as u32;
        }
        for mixer in &mut self.mixers {
            mixer.learn(filled, &self.inputs, rate);
        }
        let step = error(filled, self.fitted) * 393 >> 16;
        let weights = &mut self.regression[self.select];
        for (w, &byte) in weights.chunks_exact_mut(8).zip(&self.weighed) {
            let signs = &SIGNS[byte as usize];
            for l in 0..8 {
                w[l] += (step ^ signs[l]) - signs[l];
            }
        }
        for (i, (table, &place)) in self.tables.iter_mut().zip(&self.places).enumerate() {
            table[place].learn(filled, if i < 2 { 250 } else { 120 });
        }
    }
}

/// The least chance, in 2^32.
const LEAST: u64 = 1 << 16;

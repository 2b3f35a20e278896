//! A regression on the hundred voxels before a voxel: a soft fit of a plane.
//!
//! Its weights follow what happens, for each way in which six voxels next to it are filled. They
//! start from what is known of solids at large.

use super::prior;
use super::walk::NEAR;
use crate::range::logistic::Logistic;
use crate::range::mixer::error;

/// How far to both sides it looks in each row, from the first of the archive model's rows on: a ball
/// of squared radius 13.
const SIDES: [u32; 22] = [3, 3, 3, 3, 3, 3, 2, 2, 2, 1, 1, 2, 2, 2, 2, 0, 0, 2, 1, 1, 0, 0];

/// Voxels before it in its own row.
const OWN: u32 = 3;

/// What it weighs, in whole bytes: voxels, a constant, and nothing.
const WEIGHED: usize = 104;

/// Sets of weights.
pub const SETS: usize = 64;

/// How far weights move, in parts of 2^16.
const RATE: i32 = 393;

/// Eight voxels as signs: 0 for filled, -1 for empty.
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

/// Weights, and what they were last asked.
#[derive(Debug)]
pub struct Regression {
    /// In parts of 2^16.
    weights: Vec<[i32; WEIGHED]>,
    voxels: [u8; WEIGHED / 8],
    set: usize,
    chance: u32,
}

impl Default for Regression {
    fn default() -> Self {
        let weights = vec![known(); SETS];
        Self { weights, voxels: [0; WEIGHED / 8], set: 0, chance: 0 }
    }
}

/// The weights that are known beforehand.
fn known() -> [i32; WEIGHED] {
    let mut weights = [0; WEIGHED];
    let mut prior = prior::WEIGHTS.iter().map(|w| w << 8);
    let mut put = |at: u32| {
        if let Some(weight) = prior.next() {
            weights[at as usize] = weight;
        }
    };
    (1..OWN).for_each(&mut put);
    let mut start = OWN;
    for (r, side) in SIDES.iter().enumerate() {
        if let Some(&(.., reach)) = NEAR.get(r) {
            (0..=2 * reach).for_each(|i| put(start + side - reach + i));
        }
        start += 2 * side + 1;
    }
    weights[start as usize] = prior::CONSTANT << 8;
    weights
}

impl Regression {
    /// The odds of the voxel of bit `at`.
    #[inline]
    pub fn odds(
        &mut self,
        set: usize,
        words: &[u64],
        own: u64,
        at: u32,
        logistic: &Logistic,
    ) -> i32 {
        let mut voxels = u128::from(own >> (at - OWN) & ((1 << OWN) - 1));
        let mut length = OWN;
        for (word, side) in words.iter().zip(SIDES) {
            let width = 2 * side + 1;
            voxels |= u128::from(word >> (at - side) & ((1 << width) - 1)) << length;
            length += width;
        }
        voxels |= 1 << length;
        self.voxels.copy_from_slice(&voxels.to_le_bytes()[..WEIGHED / 8]);
        self.set = set;
        let mut sums = [0i32; 8];
        for (weights, &byte) in self.weights[set].chunks_exact(8).zip(&self.voxels) {
            let signs = &SIGNS[byte as usize];
            for i in 0..8 {
                sums[i] = sums[i].wrapping_add((weights[i] ^ signs[i]).wrapping_sub(signs[i]));
            }
        }
        let odds = sums.iter().fold(0, |sum: i32, &s| sum.wrapping_add(s)) >> 8;
        self.chance = logistic.chance(odds);
        odds
    }

    /// Moves the weights towards what would have told better.
    #[inline]
    pub fn learn(&mut self, filled: bool) {
        let step = (error(filled, self.chance) * RATE) >> 16;
        for (weights, &byte) in self.weights[self.set].chunks_exact_mut(8).zip(&self.voxels) {
            let signs = &SIGNS[byte as usize];
            for i in 0..8 {
                weights[i] = weights[i].wrapping_add((step ^ signs[i]) - signs[i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_with_what_is_known() {
        let logistic = Logistic::default();
        let mut regression = Regression::default();
        for seed in 0..1000u64 {
            let random = |i: u64| (seed * 31 + i + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 20;
            let words: Vec<u64> = (0..26).map(random).collect();
            let (own, at) = (random(40), 12);
            let bits =
                |word: u64, reach: u32| (word >> (at - reach)) as u32 & ((2 << (2 * reach)) - 1);
            let mut near = (own >> (at - 2)) as u32 & 3;
            let mut length = 2;
            for (word, (.., reach)) in words.iter().zip(NEAR) {
                near |= bits(*word, reach) << length;
                length += 2 * reach + 1;
            }
            assert_eq!(length, 16);
            assert_eq!(regression.odds(0, &words, own, at, &logistic), prior::odds(near));
        }
    }
}

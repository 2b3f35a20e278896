//! Mixing what several models tell: weighted sums of odds, whose weights follow what happens.
//!
//! Source: Mahoney, "Adaptive weighing of context models for lossless data compression", 2005.

use super::logistic::Logistic;

/// A weight of one.
pub const ONE: i32 = 1 << 16;

/// Weights of `N` inputs by context.
#[derive(Debug)]
pub struct Mixer<const N: usize> {
    weights: Vec<[i32; N]>,
    select: usize,
    chance: u32,
}

impl<const N: usize> Mixer<N> {
    /// The same weights in each of so many contexts.
    pub fn new(weights: [i32; N], contexts: usize) -> Self {
        Self { weights: vec![weights; contexts], select: 0, chance: 0 }
    }

    /// The odds that the inputs give in a context.
    #[inline]
    pub fn mix(&mut self, select: usize, inputs: &[i32; N], logistic: &Logistic) -> i32 {
        self.select = select;
        let pairs = self.weights[select].iter().zip(inputs);
        let sum: i64 = pairs.map(|(&w, &i)| i64::from(w) * i64::from(i)).sum();
        let odds = (sum >> 16).clamp(-4000, 4000) as i32;
        self.chance = logistic.chance(odds);
        odds
    }

    /// Moves the weights towards what would have told better, at a rate in 2^24 parts.
    #[inline]
    pub fn learn(&mut self, filled: bool, inputs: &[i32; N], rate: i64) {
        let error = i64::from(error(filled, self.chance));
        for (weight, &input) in self.weights[self.select].iter_mut().zip(inputs) {
            let step = (error * i64::from(input) * rate + (1 << 23)) >> 24;
            *weight = (*weight + step as i32).clamp(-16 * ONE, 16 * ONE);
        }
    }
}

/// How wrong a chance was, in parts of 2^16.
#[inline]
pub fn error(filled: bool, chance: u32) -> i32 {
    (i32::from(filled) << 16) - (chance >> 16) as i32
}

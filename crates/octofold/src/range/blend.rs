//! Small differences, told by several contexts at once that are mixed by their odds.
//!
//! A difference is told as whether there is one, its sign, how many bits it has, and these bits. Each of
//! these decisions is counted in every context; a context that never met one takes over what the first
//! tells. Source: Mahoney, "Adaptive weighing of context models for lossless data compression", 2005.

use super::Coder;
use super::counted::Counted;
use super::logistic::{Logistic, Logit};
use super::mixer::{Mixer, ONE};
use std::sync::LazyLock;

/// Contexts of a difference.
pub const CONTEXTS: usize = 6;

/// What is mixed: the odds of each context, and a constant.
const INPUTS: usize = CONTEXTS + 1;

/// Decisions that a difference may be told by: none, the sign, and for both signs seven lengths and
/// three times seven bits.
const SLOTS: usize = 64;

/// How many times a chance looks back over.
const MEMORY: u32 = 255;

/// How fast weights move, in parts of 2^24.
const RATE: i64 = 500;

/// The least chance, in 2^32.
const LEAST: u32 = 1 << 16;

/// Logarithms of odds, both ways.
#[derive(Debug)]
struct Odds {
    logistic: Logistic,
    logit: Logit,
}

static ODDS: LazyLock<Odds> = LazyLock::new(|| {
    let logistic = Logistic::default();
    Odds { logit: Logit::new(&logistic), logistic }
});

/// The chances of one kind of differences.
#[derive(Debug)]
pub struct Blend {
    tables: [Vec<[Counted; SLOTS]>; CONTEXTS],
    mixer: Mixer<INPUTS>,
    odds: &'static Odds,
}

impl Blend {
    /// Contexts of so many values each, and so many sets of weights.
    pub fn new(values: [usize; CONTEXTS], sets: usize) -> Self {
        let mut weights = [0; INPUTS];
        weights[..CONTEXTS].fill(ONE * 3 / 10);
        let mixer = Mixer::new(weights, SLOTS * sets);
        Self { tables: values.map(bytemuck::zeroed_vec), mixer, odds: &ODDS }
    }

    /// Codes a byte by its difference from what is expected.
    pub fn code(
        &mut self,
        coder: &mut impl Coder,
        byte: u8,
        expected: u8,
        contexts: [usize; CONTEXTS],
        set: usize,
    ) -> u8 {
        let told = byte.wrapping_sub(expected) as i8;
        let mut turn = Turn { blend: self, coder, contexts, set };
        if !turn.decide(0, told != 0) {
            return expected;
        }
        let is_less = turn.decide(1, told < 0);
        let slots = 2 + 31 * usize::from(is_less);
        let told = usize::from(told.unsigned_abs());
        let mut length = 0;
        while length < 7 && turn.decide(slots + length, told >> length > 1) {
            length += 1;
        }
        let mut found = 1;
        for bit in (0..length).rev() {
            let slot = match length - 1 - bit {
                0 => slots + 6 + 3 * length - 2,
                1 => slots + 6 + 3 * length - 1 + (found & 1),
                _ => 0,
            };
            let one = told >> bit & 1 == 1;
            let one = if slot > 0 { turn.decide(slot, one) } else { turn.coder.code(1 << 31, one) };
            found = found << 1 | usize::from(one);
        }
        let found = found as u8;
        expected.wrapping_add(if is_less { found.wrapping_neg() } else { found })
    }
}

/// A difference that is being told.
struct Turn<'a, C> {
    blend: &'a mut Blend,
    coder: &'a mut C,
    contexts: [usize; CONTEXTS],
    set: usize,
}

impl<C: Coder> Turn<'_, C> {
    #[inline]
    fn decide(&mut self, slot: usize, told: bool) -> bool {
        let Blend { tables, mixer, odds } = &mut *self.blend;
        let mut inputs = [0; INPUTS];
        let mut backed = 1 << 31;
        for (k, table) in tables.iter_mut().enumerate() {
            let counted = &mut table[self.contexts[k]][slot];
            if counted.is_unmet() {
                *counted = Counted::new(backed);
            }
            let chance = counted.chance();
            if k == 0 {
                backed = chance;
            }
            inputs[k] = odds.logit.odds(chance);
        }
        inputs[CONTEXTS] = 77;
        let mixed = mixer.mix(self.set * SLOTS + slot, &inputs, &odds.logistic);
        let chance = odds.logistic.chance(mixed).clamp(LEAST, u32::MAX - LEAST);
        let one = self.coder.code(chance, told);
        mixer.learn(one, &inputs, RATE);
        for (table, &context) in tables.iter_mut().zip(&self.contexts) {
            table[context][slot].learn(one, MEMORY);
        }
        one
    }
}

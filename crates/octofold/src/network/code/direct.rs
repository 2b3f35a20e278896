//! The fast model: the chance of a voxel as counted in one context of 22 voxels.
//!
//! A context that is met for the first time takes over what its sixteen nearest voxels tell, and
//! those take over what is known of solids at large. Source: specification (D3.3, P-fast).

use super::prior;
use super::walk::Model;
use crate::range::counted::Counted;
use crate::range::logistic::Logistic;

/// Chances by context.
#[derive(Debug)]
pub struct Direct {
    fine: Vec<Counted>,
    coarse: Vec<Counted>,
    logistic: Logistic,
    /// Bits of a place in the table of fine contexts.
    bits: u32,
    /// How many times what a context takes over counts for.
    trust: u32,
    /// How many times chances look back over, coarse ones and fine ones.
    memory: [u32; 2],
    place: usize,
    near: usize,
}

/// Bits of a context.
const CONTEXT: u32 = 22;

/// Bits of the place of a context for solids of few voxels.
const SMALL: u32 = 15;

/// How many times a chance looks back over: few, since a surface changes its slope.
const MEMORY: [u32; 2] = [20; 2];

/// The same in a part of few voxels, where what is coarse tells of all of it.
const MEMORY_OF_PART: [u32; 2] = [60, 16];

impl Direct {
    /// A model for any solid: each context for itself.
    pub fn large() -> Self {
        Self::new(CONTEXT, 0, MEMORY)
    }

    /// A model for few voxels, that is soon made and soon forgotten: a brick of the first versions.
    pub fn small() -> Self {
        Self::new(SMALL, 0, MEMORY)
    }

    /// A model for a part of a solid.
    pub fn of_part() -> Self {
        Self::new(SMALL, 1, MEMORY_OF_PART)
    }

    fn new(bits: u32, trust: u32, memory: [u32; 2]) -> Self {
        Self {
            fine: vec![Counted::default(); 1 << bits],
            coarse: vec![Counted::default(); 1 << 16],
            logistic: Logistic::default(),
            bits,
            trust,
            memory,
            place: 0,
            near: 0,
        }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.fine.fill(Counted::default());
        self.coarse.fill(Counted::default());
    }
}

/// The six voxels beyond the sixteen nearest that a context of 22 takes in; the rows are the own one,
/// the one below, the one in the slice before, and two above that.
#[inline]
pub fn far([own, below, before, above]: [u64; 4], at: u32) -> u32 {
    let bit = |word: u64, at: u32| (word >> at & 1) as u32;
    bit(own, at - 3)
        | bit(below, at - 2) << 1
        | bit(below, at + 2) << 2
        | bit(before, at - 2) << 3
        | bit(before, at + 2) << 4
        | bit(above, at) << 5
}

impl Model for Direct {
    const ROWS: &'static [(usize, i64)] =
        &[(0, -1), (0, -2), (1, -1), (1, 0), (1, 1), (2, 0), (1, 2)];

    #[inline]
    fn predict(&mut self, words: &[u64], own: u64, at: u32, near: u32) -> u32 {
        let context = far([own, words[0], words[3], words[6]], at) << 16 | near;
        self.place = if self.bits == CONTEXT {
            context as usize
        } else {
            (context.wrapping_mul(0x9E37_79B1) >> (32 - self.bits)) as usize
        };
        self.near = near as usize;
        let coarse = &mut self.coarse[self.near];
        if coarse.is_unmet() {
            *coarse = Counted::new(self.logistic.chance(prior::odds(near))).trusted(self.trust);
        }
        let fine = &mut self.fine[self.place];
        if fine.is_unmet() {
            *fine = Counted::new(coarse.chance()).trusted(coarse.seen().min(self.trust));
        }
        fine.chance()
    }

    #[inline]
    fn learn(&mut self, filled: bool) {
        self.coarse[self.near].learn(filled, self.memory[0]);
        self.fine[self.place].learn(filled, self.memory[1]);
    }
}

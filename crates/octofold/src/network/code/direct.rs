//! The fast model: the chance of a voxel as counted in one context of 22 voxels.
//!
//! A context that is met for the first time takes over what its sixteen nearest voxels tell.
//! Source: specification (D3.3, P-fast).

use super::counted::Counted;
use super::walk::Model;

/// Chances by context.
pub struct Direct {
    fine: Vec<Counted>,
    coarse: Vec<Counted>,
    context: usize,
    near: usize,
}

/// How many times a chance looks back over.
const MEMORY: u32 = 250;

impl Default for Direct {
    fn default() -> Self {
        Self {
            fine: vec![Counted::default(); 1 << 22],
            coarse: vec![Counted::default(); 1 << 16],
            context: 0,
            near: 0,
        }
    }
}

/// The six voxels beyond the sixteen nearest that a context of 22 takes in; `rows` are the own row,
/// the row below, the row in the slice before, and the row two above that.
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
        let far = far([own, words[0], words[3], words[6]], at);
        self.context = (far << 16 | near) as usize;
        self.near = near as usize;
        let coarse = &mut self.coarse[self.near];
        if coarse.is_unmet() {
            // The more of them are filled, the likelier.
            *coarse = Counted::new((2 * near.count_ones() + 1) * (u32::MAX / 34));
        }
        let fine = &mut self.fine[self.context];
        if fine.is_unmet() {
            *fine = Counted::new(coarse.chance());
        }
        fine.chance()
    }

    #[inline]
    fn learn(&mut self, filled: bool) {
        self.coarse[self.near].learn(filled, MEMORY);
        self.fine[self.context].learn(filled, MEMORY);
    }
}

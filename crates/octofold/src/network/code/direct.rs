//! The fast model: the chance of a voxel as counted in one context of 22 voxels.
//!
//! A context that is met for the first time takes over what its sixteen nearest voxels tell.
//! Source: specification (D3.3, P-fast).

use super::walk::Model;

/// Chances by context.
pub struct Direct {
    fine: Vec<State>,
    coarse: Vec<State>,
    context: usize,
    near: usize,
}

/// Chance in the upper 22 bits, how often it was seen in the lower 10.
#[derive(Debug, Clone, Copy, Default)]
struct State(u32);

impl State {
    fn new(chance: u32, seen: u32) -> Self {
        Self(chance >> 10 << 10 | seen)
    }

    fn chance(self) -> u32 {
        self.0 >> 10 << 10
    }

    fn seen(self) -> u32 {
        self.0 & 1023
    }

    #[inline]
    fn learn(&mut self, filled: bool, slow: u32, most: u32) {
        let aim = if filled { u32::MAX } else { 0 };
        let (chance, seen) = (self.chance(), self.seen());
        let way = i64::from(aim) - i64::from(chance);
        let next = i64::from(chance) + way * 2 / i64::from(2 * seen + slow);
        let next = next.clamp(LEAST, (1 << 32) - LEAST) as u32;
        *self = Self::new(next, (seen + 1).min(most));
    }
}

const LEAST: i64 = 1 << 16;

impl Default for Direct {
    fn default() -> Self {
        Self {
            fine: vec![State::default(); 1 << 22],
            coarse: vec![State::default(); 1 << 16],
            context: 0,
            near: 0,
        }
    }
}

fn env(name: &str, default: u32) -> u32 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

impl Model for Direct {
    const ROWS: &'static [(usize, i64)] =
        &[(0, -1), (0, -2), (1, -1), (1, 0), (1, 1), (2, 0), (1, 2)];

    #[inline]
    fn predict(&mut self, words: &[u64], own: u64, at: u32, near: u32) -> u32 {
        let bit = |word: u64, at: u32| (word >> at & 1) as u32;
        let far = bit(own, at - 3)
            | bit(words[0], at - 2) << 1
            | bit(words[0], at + 2) << 2
            | bit(words[3], at - 2) << 3
            | bit(words[3], at + 2) << 4
            | bit(words[6], at) << 5;
        self.context = (far << 16 | near) as usize;
        self.near = near as usize;
        let coarse = &mut self.coarse[self.near];
        if coarse.0 == 0 {
            let ones = i64::from(near.count_ones());
            *coarse = State::new((((ones * 2 + 1) << 32) / 34) as u32, 0);
        }
        let fine = &mut self.fine[self.context];
        if fine.0 == 0 {
            *fine = State::new(coarse.chance(), 0);
        }
        fine.chance()
    }

    #[inline]
    fn learn(&mut self, filled: bool) {
        self.coarse[self.near].learn(filled, 3, 250);
        self.fine[self.context].learn(filled, 3, 250);
    }
}

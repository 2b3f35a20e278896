//! Odds as logarithms, in integers: every platform gets the same.
//!
//! Logarithms of odds are in parts of 256, chances in parts of 2^32.

/// The largest logarithm of odds.
pub const MOST: i32 = 12 * 256 - 1;

/// Tables from odds to chances and back.
pub struct Logistic {
    chances: Vec<u32>,
    odds: Vec<i16>,
}

/// 2^32 times e^(1/256).
const STEP: u128 = 4_311_777_323;

impl Default for Logistic {
    fn default() -> Self {
        // Powers of e^(1/256), with 64 bits behind the point.
        let mut power = 1u128 << 64;
        let mut upper = Vec::with_capacity(MOST as usize + 1);
        for _ in 0..=MOST {
            upper.push(((power << 32) / (power + (1 << 64))) as u32);
            power = (power * STEP) >> 32;
        }
        let lower = upper.iter().skip(1).rev().map(|&c| u32::MAX - c + 1);
        let chances: Vec<u32> = lower.chain(upper.iter().copied()).collect();
        let mut odds = Vec::with_capacity(1 << 16);
        let mut at = 0;
        for chance in 0..1u32 << 16 {
            let chance = chance << 16 | 1 << 15;
            let nearer = |at: usize| {
                chances.get(at + 1).is_some_and(|c| c.abs_diff(chance) <= chances[at].abs_diff(chance))
            };
            while nearer(at) {
                at += 1;
            }
            odds.push((at as i32 - MOST) as i16);
        }
        Self { chances, odds }
    }
}

impl Logistic {
    /// The chance of odds.
    #[inline]
    pub fn chance(&self, odds: i32) -> u32 {
        self.chances[(odds.clamp(-MOST, MOST) + MOST) as usize]
    }

    /// The odds of a chance.
    #[inline]
    pub fn odds(&self, chance: u32) -> i32 {
        i32::from(self.odds[(chance >> 16) as usize])
    }
}

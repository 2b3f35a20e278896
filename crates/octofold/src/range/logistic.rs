//! Odds as logarithms, in integers: every platform gets the same.
//!
//! Logarithms of odds are in parts of 256, chances in parts of 2^32.

/// The largest logarithm of odds.
const MOST: i32 = 12 * 256 - 1;

/// 2^32 times e^(1/256).
const STEP: u128 = 4_311_777_323;

/// Chances by odds.
#[derive(Debug)]
pub struct Logistic(Vec<u32>);

/// Odds by chances.
#[derive(Debug)]
pub struct Logit(Vec<i16>);

impl Default for Logistic {
    fn default() -> Self {
        // Powers of e^(1/256), with 64 bits behind the point.
        let mut power = 1u128 << 64;
        let upper: Vec<u32> = (0..=MOST)
            .map(|_| {
                let chance = (power << 32) / (power + (1 << 64));
                power = (power * STEP) >> 32;
                chance as u32
            })
            .collect();
        let lower = upper.iter().skip(1).rev().map(|&chance| chance.wrapping_neg());
        Self(lower.chain(upper.iter().copied()).collect())
    }
}

impl Logistic {
    /// The chance of odds.
    #[inline]
    pub fn chance(&self, odds: i32) -> u32 {
        self.0[(odds.clamp(-MOST, MOST) + MOST) as usize]
    }
}

impl Logit {
    /// The inverse of `logistic`.
    pub fn new(logistic: &Logistic) -> Self {
        let chances = &logistic.0;
        let mut at = 0;
        let odds = (0..1u32 << 16).map(|chance| {
            let chance = chance << 16 | 1 << 15;
            let is_nearer = |at: usize| {
                let next = chances.get(at + 1);
                next.is_some_and(|c| c.abs_diff(chance) <= chances[at].abs_diff(chance))
            };
            while is_nearer(at) {
                at += 1;
            }
            (at as i32 - MOST) as i16
        });
        Self(odds.collect())
    }

    /// The odds of a chance.
    #[inline]
    pub fn odds(&self, chance: u32) -> i32 {
        i32::from(self.0[(chance >> 16) as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odds_and_chances_are_inverse() {
        let logistic = Logistic::default();
        let logit = Logit::new(&logistic);
        assert_eq!(logistic.chance(0), 1 << 31);
        for odds in -MOST..=MOST {
            let expected = 4_294_967_296.0 / (1.0 + (-f64::from(odds) / 256.0).exp());
            let chance = logistic.chance(odds);
            assert!((f64::from(chance) - expected).abs() < 64.0, "{odds}: {chance}, {expected}");
            // Beyond that a part of 2^16 is wider than a step.
            if odds.abs() < 1024 {
                assert!((logit.odds(chance) - odds).abs() <= 1, "{odds}");
            }
        }
        assert!((0..1 << 16).all(|c| logit.odds(c << 16) <= logit.odds((c << 16) + 0xFFFF)));
    }
}

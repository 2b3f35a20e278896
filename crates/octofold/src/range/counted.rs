//! Chances that are counted by context.

use bytemuck::Zeroable;

/// A chance in the upper 22 bits, and how often it was told right or wrong in the lower 10.
///
/// Zero stands for a context that was never met.
#[derive(Debug, Clone, Copy, Default, Zeroable)]
#[repr(transparent)]
pub struct Counted(u32);

/// The least chance, in 2^32.
const LEAST: i64 = 1 << 16;

/// Bits behind the point of a rate.
const POINT: u32 = 16;

/// How fast a chance moves after it was told so many times: 1 / (seen + 3/2).
const RATES: [u32; 256] = {
    let mut rates = [0; 256];
    let mut seen = 0;
    while seen < 256 {
        rates[seen] = (2 << POINT) / (2 * seen as u32 + 3);
        seen += 1;
    }
    rates
};

impl Counted {
    /// A chance that was not told yet.
    #[inline]
    pub fn new(chance: u32) -> Self {
        Self(chance.max(LEAST as u32) >> 10 << 10)
    }

    /// The same as if it had been told so many times.
    #[inline]
    pub fn trusted(self, seen: u32) -> Self {
        Self(self.0 | seen)
    }

    /// True where the context was never met.
    #[inline]
    pub fn is_unmet(self) -> bool {
        self.0 == 0
    }

    /// The chance in 2^32.
    #[inline]
    pub fn chance(self) -> u32 {
        self.0 >> 10 << 10
    }

    /// How often it was told.
    #[inline]
    pub fn seen(self) -> u32 {
        self.0 & 1023
    }

    /// Moves towards what happened; looks back over at most `most` times, 255 or fewer.
    #[inline]
    pub fn learn(&mut self, filled: bool, most: u32) {
        let aim = if filled { i64::from(u32::MAX) } else { 0 };
        let (chance, seen) = (i64::from(self.chance()), self.seen());
        let way = (aim - chance) * i64::from(RATES[(seen & 255) as usize]);
        let next = chance + (way >> POINT);
        let next = next.clamp(LEAST, (1 << 32) - LEAST) as u32;
        *self = Self(next >> 10 << 10 | (seen + 1).min(most));
    }
}

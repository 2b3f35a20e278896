//! A binary range coder.
//!
//! The range is 64 bits wide and never less than 2^56, so that even a chance of 2^-32 costs what it
//! should; carries run back into the bytes that were written. The last bytes say only what is needed:
//! the decoder reads zeros behind the end. Source: Martin, "Range encoding", 1979; Subbotin's
//! byte-wise renormalisation. Below it stand the parts that models of chances are made of.

pub mod blend;
pub mod counted;
pub mod logistic;
pub mod mixer;

/// Codes decisions, one after the other: one way of writing for both directions.
pub trait Coder {
    /// Codes a decision that is true with chance `chance` in 2^32. An encoder takes `bit`, a decoder
    /// finds it.
    fn code(&mut self, chance: u32, bit: bool) -> bool;

    /// Whether more was asked than the bytes can tell.
    fn is_overrun(&self) -> bool;
}

/// The least range.
const LEAST: u64 = 1 << 56;

/// Bytes that a decoder may read behind the end: those that an encoder need not write.
const BEHIND: usize = 8;

/// Writes decisions.
#[derive(Debug)]
pub struct Encoder {
    low: u64,
    range: u64,
    bytes: Vec<u8>,
}

impl Default for Encoder {
    fn default() -> Self {
        Self { low: 0, range: u64::MAX, bytes: Vec::new() }
    }
}

impl Encoder {
    /// The bytes, as few as tell all decisions.
    pub fn finish(mut self) -> Vec<u8> {
        // Any value in the range will do: the one with most zeros at its end.
        let last = self.low.wrapping_add(self.range - 1);
        let cut = |zeros: u32| last.checked_shr(zeros).map_or(0, |rest| rest << zeros);
        let fits = |&value: &u64| last.wrapping_sub(value) < self.range;
        let value = (0..=64).rev().map(cut).find(fits).unwrap_or(last);
        if value < self.low {
            self.carry();
        }
        let zeros = value.trailing_zeros() as usize / 8;
        self.bytes.extend(&value.to_be_bytes()[..8 - zeros]);
        self.bytes
    }

    fn carry(&mut self) {
        for byte in self.bytes.iter_mut().rev() {
            *byte = byte.wrapping_add(1);
            if *byte != 0 {
                break;
            }
        }
    }
}

impl Coder for Encoder {
    #[inline]
    fn code(&mut self, chance: u32, bit: bool) -> bool {
        let bound = (self.range >> 32) * u64::from(chance);
        if bit {
            self.range = bound;
        } else {
            let (low, carry) = self.low.overflowing_add(bound);
            if carry {
                self.carry();
            }
            self.low = low;
            self.range -= bound;
        }
        while self.range < LEAST {
            self.bytes.push((self.low >> 56) as u8);
            self.low <<= 8;
            self.range <<= 8;
        }
        bit
    }

    fn is_overrun(&self) -> bool {
        false
    }
}

/// Reads decisions.
#[derive(Debug)]
pub struct Decoder<'a> {
    value: u64,
    range: u64,
    bytes: &'a [u8],
    next: usize,
}

impl<'a> Decoder<'a> {
    /// Starts at the first byte.
    pub fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { value: 0, range: u64::MAX, bytes, next: 0 };
        for _ in 0..8 {
            decoder.value = decoder.value << 8 | decoder.byte();
        }
        decoder
    }

    fn byte(&mut self) -> u64 {
        let byte = self.bytes.get(self.next).copied().unwrap_or(0);
        self.next += 1;
        u64::from(byte)
    }
}

impl Coder for Decoder<'_> {
    #[inline]
    fn code(&mut self, chance: u32, _: bool) -> bool {
        let bound = (self.range >> 32) * u64::from(chance);
        let bit = self.value < bound;
        if bit {
            self.range = bound;
        } else {
            self.value -= bound;
            self.range -= bound;
        }
        while self.range < LEAST {
            self.value = self.value << 8 | self.byte();
            self.range <<= 8;
        }
        bit
    }

    fn is_overrun(&self) -> bool {
        self.next > self.bytes.len() + BEHIND
    }
}

/// What is left for the less likely.
const MARGIN: i64 = 1 << 10;

/// How many decisions a [`Chance`] looks back over, about.
const MOST_SEEN: u32 = 1 << 16;

/// A chance that follows what happens: fast at first, then ever slower.
#[derive(Debug, Clone, Copy)]
pub struct Chance {
    /// In 2^32.
    chance: u32,
    seen: u32,
}

impl Chance {
    /// True as often as not.
    pub const EVEN: Self = Self { chance: 1 << 31, seen: 0 };

    /// True once in 512 times, as far as is known.
    pub const RARE: Self = Self { chance: 1 << 23, seen: 8 };

    /// True so many times in a hundred, as was seen so often.
    pub const fn told(percent: u32, seen: u32) -> Self {
        Self { chance: u32::MAX / 100 * percent, seen }
    }

    /// Codes a decision and learns from it.
    pub fn code(&mut self, coder: &mut impl Coder, bit: bool) -> bool {
        let bit = coder.code(self.chance, bit);
        let aim = if bit { i64::from(u32::MAX) } else { 0 };
        let way = aim - i64::from(self.chance);
        // The first step goes two thirds of the way.
        let next = i64::from(self.chance) + 2 * way / i64::from(2 * self.seen + 3);
        self.chance = next.clamp(MARGIN, (1 << 32) - MARGIN) as u32;
        self.seen = (self.seen + 1).min(MOST_SEEN);
        bit
    }
}

/// Numbers: how many bits they have, and the bit behind the leading one, follow what happens.
#[derive(Debug)]
pub struct Number {
    length: [Chance; 32],
    second: [Chance; 32],
}

impl Default for Number {
    fn default() -> Self {
        Self { length: [Chance::EVEN; 32], second: [Chance::EVEN; 32] }
    }
}

impl Number {
    /// Codes a number that is at most `most`.
    pub fn code(&mut self, coder: &mut impl Coder, number: u32, most: u32) -> u32 {
        // Counted from 1, so that every number has a leading bit.
        let number = u64::from(number) + 1;
        let mut length = 0;
        while (2u64 << length) <= u64::from(most) + 1 {
            if !self.length[length].code(coder, number >> length > 1) {
                break;
            }
            length += 1;
        }
        let mut value = 1u64;
        for bit in (0..length).rev() {
            let told = number >> bit & 1 == 1;
            let one = if bit + 1 == length {
                self.second[length].code(coder, told)
            } else {
                coder.code(1 << 31, told)
            };
            value = value << 1 | u64::from(one);
        }
        // Only a damaged stream says more.
        ((value - 1) as u32).min(most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(200))]

        #[test]
        fn what_was_coded_is_read(
            decisions in prop::collection::vec((0u32..5, any::<u32>(), any::<u32>()), 0..400),
        ) {
            // Chances next to none and next to all, and everything between.
            let chance = |kind: u32, any: u32| match kind {
                0 => 1,
                1 => u32::MAX,
                2 => any >> 20 | 1,
                3 => !(any >> 20),
                _ => any.max(1),
            };
            let mut encoder = Encoder::default();
            let (mut adaptive, mut number) = (Chance::RARE, Number::default());
            for &(kind, any, bit) in &decisions {
                encoder.code(chance(kind, any), bit % 2 == 1);
                adaptive.code(&mut encoder, bit % 5 == 0);
                number.code(&mut encoder, any.min(bit), bit);
            }
            let bytes = encoder.finish();
            let mut decoder = Decoder::new(&bytes);
            let (mut adaptive, mut number) = (Chance::RARE, Number::default());
            for &(kind, any, bit) in &decisions {
                prop_assert_eq!(decoder.code(chance(kind, any), false), bit % 2 == 1);
                prop_assert_eq!(adaptive.code(&mut decoder, false), bit % 5 == 0);
                prop_assert_eq!(number.code(&mut decoder, 0, bit), any.min(bit));
            }
            prop_assert!(!decoder.is_overrun());
        }
    }

    #[test]
    fn what_is_certain_costs_nothing() {
        let mut encoder = Encoder::default();
        for _ in 0..1_000_000 {
            encoder.code(u32::MAX, true);
        }
        assert!(encoder.finish().is_empty());
    }
}

//! A binary range coder.
//!
//! The range is 64 bits wide and never less than 2^56, so that even a chance of 2^-32 costs what it
//! should; carries run back into the bytes that were written. The last bytes say only what is needed:
//! the decoder reads zeros behind the end. Source: Martin, "Range encoding", 1979; Subbotin's
//! byte-wise renormalisation.

/// Codes decisions, one after the other: one way of writing for both directions.
pub trait Coder {
    /// Codes a decision that is true with chance `chance` in 2^32. An encoder takes `bit`, a decoder
    /// finds it.
    fn code(&mut self, chance: u32, bit: bool) -> bool;
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
    /// How many bytes there are so far.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// The bytes, as few as tell all decisions.
    pub fn finish(mut self) -> Vec<u8> {
        // Any value in the range will do: the one with most zeros at its end.
        let last = self.low.wrapping_add(self.range - 1);
        let mut value = last;
        for zeros in (0..64).rev() {
            let cut = last >> zeros << zeros;
            if last.wrapping_sub(cut) <= self.range - 1 {
                value = cut;
                break;
            }
        }
        if value < self.low {
            self.carry();
        }
        self.bytes.extend(value.to_be_bytes());
        while self.bytes.last() == Some(&0) {
            self.bytes.pop();
        }
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

    /// Whether more was read than any encoder leaves out.
    pub fn is_overrun(&self) -> bool {
        self.next > self.bytes.len() + BEHIND
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
}

/// A chance that follows what happens: faster at first, then ever slower.
#[derive(Debug, Clone, Copy)]
pub struct Chance {
    /// In 2^32.
    chance: u32,
    seen: u32,
}

impl Chance {
    /// True as often as not.
    pub const EVEN: Self = Self { chance: 1 << 31, seen: 0 };

    /// Codes a decision and learns from it.
    pub fn code(&mut self, coder: &mut impl Coder, bit: bool) -> bool {
        let bit = coder.code(self.chance, bit);
        let aim = if bit { u32::MAX } else { 0 };
        let way = i64::from(aim) - i64::from(self.chance);
        // The first step goes two thirds of the way.
        let step = 2 * way / i64::from(2 * self.seen + 3);
        let next = i64::from(self.chance) + step;
        self.chance = next.clamp(MARGIN, (1 << 32) - MARGIN) as u32;
        self.seen = (self.seen + 1).min(MOST_SEEN);
        bit
    }
}

/// What is left for the less likely.
const MARGIN: i64 = 1 << 10;

/// How many decisions a [`Chance`] looks back over, about.
const MOST_SEEN: u32 = 1 << 16;

//! Rows of samples as words of bits, and the samples packed into them.

use crate::volume::Scalar;

/// Words that hold `len` bits.
pub const fn words(len: usize) -> usize {
    len.div_ceil(64)
}

/// A mask of the bits of word `word` that lie below `len`.
pub const fn below(len: usize, word: usize) -> u64 {
    let first = 64 * word;
    if first + 64 <= len {
        !0
    } else if first >= len {
        0
    } else {
        (1 << (len - first)) - 1
    }
}

/// The smallest value of type `T` that is at least `iso`; `None` where there is none.
pub fn at_least<T: Scalar>(iso: f64) -> Option<T> {
    let truncated = T::from_f64(iso);
    let up = if truncated.to_f64() >= iso { truncated } else { next_up(truncated)? };
    (up.to_f64() >= iso).then_some(up)
}

fn next_up<T: Scalar>(value: T) -> Option<T> {
    let v = value.to_f64();
    let up = T::from_f64(if T::TYPE.is_integer() {
        v.floor() + 1.0
    } else if T::TYPE == crate::volume::ScalarType::F32 {
        f64::from((v as f32).next_up())
    } else {
        v.next_up()
    });
    (up > value).then_some(up)
}

/// Sets bit `shift + i` of `row` where `samples[i]` is `inside`; all other bits are cleared.
/// `shift` is 0 or 1.
pub fn pack<T: Scalar>(samples: &[T], inside: impl Fn(T) -> bool, shift: usize, row: &mut [u64]) {
    fill(samples.len(), shift, row, |range| {
        let mut flags = [0; 64];
        for (flag, &s) in flags.iter_mut().zip(&samples[range]) {
            *flag = u8::from(inside(s));
        }
        gather(&flags)
    });
}

/// Sets bit `shift + i` of `row` where `a[i]` and `b[i]` differ; all other bits are cleared.
pub fn pack_unequal<T: Scalar>(a: &[T], b: &[T], shift: usize, row: &mut [u64]) {
    let len = a.len().min(b.len());
    let (a, b) = (&a[..len], &b[..len]);
    // Most stretches of neighbouring rows are equal, which is told faster at once.
    if a == b {
        row.fill(0);
        return;
    }
    fill(len, shift, row, |range| {
        let (a, b) = (&a[range.clone()], &b[range]);
        if a == b {
            return 0;
        }
        let mut flags = [0; 64];
        for (flag, (&s, &t)) in flags.iter_mut().zip(a.iter().zip(b)) {
            *flag = u8::from(s != t);
        }
        gather(&flags)
    });
}

fn fill(
    len: usize,
    shift: usize,
    row: &mut [u64],
    word_of: impl Fn(std::ops::Range<usize>) -> u64,
) {
    let mut carry = 0;
    for (w, out) in row.iter_mut().enumerate() {
        let start = 64 * w;
        let word = if start < len { word_of(start..(start + 64).min(len)) } else { 0 };
        *out = word << shift | carry;
        carry = if shift == 0 { 0 } else { word >> (64 - shift) };
    }
}

/// The word whose bit i is byte i, each of them 0 or 1. The comparisons that fill the bytes run many
/// at a time, and so does this: byte i times 2^(56 - 7 i) lands on bit i of the top byte.
fn gather(flags: &[u8; 64]) -> u64 {
    let (eights, _) = flags.as_chunks::<8>();
    eights.iter().rev().fold(0, |word, &eight| {
        let bits = u64::from_le_bytes(eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        word << 8 | bits
    })
}

/// Sets the bits from `start` up to `end` of a row.
pub fn set(row: &mut [u64], start: usize, end: usize) {
    for w in start / 64..words(end) {
        row[w] |= below(end, w) & !below(start, w);
    }
}

/// Calls `visit` with the position of every set bit, lowest first.
pub fn ones(mut word: u64, mut visit: impl FnMut(usize)) {
    while word != 0 {
        visit(word.trailing_zeros() as usize);
        word &= word - 1;
    }
}

/// Bit i of the result is bit i + 1 of `row` at word `w`.
pub fn next(row: &[u64], w: usize) -> u64 {
    row[w] >> 1 | row.get(w + 1).map_or(0, |n| n << 63)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_the_first_value_not_below() {
        assert_eq!(at_least::<u8>(0.5), Some(1));
        assert_eq!(at_least::<u8>(255.0), Some(255));
        assert_eq!(at_least::<u8>(255.5), None);
        assert_eq!(at_least::<u8>(-3.0), Some(0));
        assert_eq!(at_least::<i16>(-3.5), Some(-3));
        assert_eq!(at_least::<f64>(0.1), Some(0.1));
        let f = at_least::<f32>(0.1).map(f64::from);
        assert!(f.is_some_and(|f| (0.1..0.100_000_01).contains(&f)));
        assert_eq!(at_least::<i32>(1e300), None);
        assert_eq!(at_least::<f32>(1e300), Some(f32::INFINITY));
    }

    #[test]
    fn ranges_are_set() {
        for (start, end) in [(0, 0), (0, 64), (3, 9), (60, 70), (64, 128), (1, 191), (191, 192)] {
            let mut row = vec![0; 3];
            set(&mut row, start, end);
            for bit in 0..192 {
                assert_eq!(row[bit / 64] >> (bit % 64) & 1 == 1, (start..end).contains(&bit));
            }
        }
    }

    #[test]
    fn packed_rows_match_their_samples() {
        for len in [1, 63, 64, 65, 127, 128, 200] {
            let samples: Vec<i16> = (0..len as i16).map(|i| i * 37 % 11 - 5).collect();
            for shift in [0, 1] {
                let mut row = vec![!0; words(len + shift)];
                pack(&samples, |s| s >= 2, shift, &mut row);
                for bit in 0..64 * row.len() {
                    let inside = bit.checked_sub(shift).and_then(|i| samples.get(i));
                    let expected = inside.is_some_and(|&s| s >= 2);
                    assert_eq!(row[bit / 64] >> (bit % 64) & 1 == 1, expected);
                }
            }
        }
    }
}

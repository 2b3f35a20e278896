//! Numbers that damage files in tests, the same in every run (xorshift, Marsaglia 2003).

/// A sequence of numbers.
pub(crate) fn dice() -> impl FnMut() -> usize {
    let mut state = 0x2545_f491_4f6c_dd1du64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as usize
    }
}

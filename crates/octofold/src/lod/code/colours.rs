//! Colours, near those of the parent and of the octants beside.

use super::known::{Known, Turn};
use crate::range::{Chance, Coder};

/// The chances of colours.
pub(super) struct Colours(Vec<[Chance; 256]>);

impl Default for Colours {
    fn default() -> Self {
        Self(vec![[Chance::EVEN; 256]; 8])
    }
}

impl Colours {
    /// Codes the colour of an octant.
    pub(super) fn code(
        &mut self,
        coder: &mut impl Coder,
        known: &Known,
        turn: &Turn,
        told: [u8; 4],
    ) -> [u8; 4] {
        let mut colour = [0; 4];
        let mut off = 0u8;
        for k in 0..4 {
            let mut sum = turn.parent.map_or(0, |p| u32::from(known.colours[p][k]));
            let mut count = 1;
            for n in turn.before() {
                sum += 2 * u32::from(known.colours[n][k]);
                count += 2;
            }
            let mean = ((sum + count / 2) / count) as u8;
            // Channels mostly change together.
            let expected = if k == 1 || k == 2 { mean.wrapping_add(off) } else { mean };
            let context = k * 2 + usize::from(count > 3);
            colour[k] = near(&mut self.0[context], coder, told[k], expected);
            off = colour[k].wrapping_sub(mean);
        }
        colour
    }
}

/// A byte by its difference from what is expected, bit by bit: small ones of either sign first.
fn near(chances: &mut [Chance; 256], coder: &mut impl Coder, byte: u8, expected: u8) -> u8 {
    let off = byte.wrapping_sub(expected) as i8;
    let folded = ((off << 1) ^ (off >> 7)) as u8;
    let mut path = 1usize;
    for bit in (0..8).rev() {
        let one = chances[path].code(coder, folded >> bit & 1 == 1);
        path = path << 1 | usize::from(one);
    }
    let folded = path as u8;
    let off = (folded >> 1) as i8 ^ -((folded & 1) as i8);
    expected.wrapping_add(off as u8)
}

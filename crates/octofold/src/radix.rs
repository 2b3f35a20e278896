//! Radix sort of 64-bit names: cells by Morton key, spans by row.
//!
//! Blocks that were made in parallel are sorted each by itself, then the key range is cut into
//! equal shares and each share gathers its part of every block. The result depends on the keys
//! alone.

use crate::par;
use std::cmp::Ordering;

/// Shares of the key range; more than any machine has cores.
const SHARES: u64 = 64;

/// What becomes of equal keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Equal {
    /// All stay.
    Keep,
    /// One stays.
    Merge,
}

/// Sorts the keys of all blocks. The result is in shares, one after the other in order: keys with
/// the same `key >> tie_bits` are in the same share.
pub fn sort(mut blocks: Vec<Vec<u64>>, tie_bits: u32, equal: Equal) -> Vec<Vec<u64>> {
    par::chunks_mut(&mut blocks, 1, |_, block| sort_block(&mut block[0], equal));
    let highest = blocks.iter().filter_map(|b| b.last()).max().copied().unwrap_or(0);
    let step = ((highest >> tie_bits) / SHARES + 1) << tie_bits;
    let shares: Vec<u64> = (0..=highest / step).collect();
    par::map(&shares, |&share| {
        let mut all = Vec::new();
        for block in &blocks {
            let start = block.partition_point(|&k| k / step < share);
            let end = start + block[start..].partition_point(|&k| k / step == share);
            all.extend_from_slice(&block[start..end]);
        }
        sort_block(&mut all, equal);
        all
    })
}

/// Sorts one block by eleven bits at a time, lowest first; bits that all keys share cost nothing.
fn sort_block(keys: &mut Vec<u64>, equal: Equal) {
    const DIGIT: u32 = 11;
    let varying = keys.iter().fold(0, |v, k| v | (k ^ keys[0]));
    if keys.len() < 256 {
        keys.sort_unstable();
    } else if !keys.is_sorted() {
        let mut from = std::mem::take(keys);
        let mut to = vec![0; from.len()];
        for shift in (0..64).step_by(DIGIT as usize) {
            if varying >> shift & ((1 << DIGIT) - 1) == 0 {
                continue;
            }
            let digit = |k: u64| (k >> shift) as usize & ((1 << DIGIT) - 1);
            let mut at = [0usize; 1 << DIGIT];
            from.iter().for_each(|&k| at[digit(k)] += 1);
            let mut sum = 0;
            for count in &mut at {
                sum += std::mem::replace(count, sum);
            }
            for &k in &from {
                to[at[digit(k)]] = k;
                at[digit(k)] += 1;
            }
            std::mem::swap(&mut from, &mut to);
        }
        *keys = from;
    }
    debug_assert!(keys.windows(2).all(|w| w[0].cmp(&w[1]) != Ordering::Greater));
    if equal == Equal::Merge {
        keys.dedup();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(256))]

        #[test]
        fn shares_are_the_sorted_keys(
            blocks in prop::collection::vec(prop::collection::vec(any::<u64>(), 0..600), 0..5),
            bits in 1u32..64,
            tie in 0u32..20,
        ) {
            let blocks: Vec<Vec<u64>> = blocks
                .iter()
                .map(|b| b.iter().map(|k| k & ((1 << bits) - 1)).collect())
                .collect();
            let mut all = blocks.concat();
            all.sort_unstable();
            let tie = tie.min(bits);
            let shares = sort(blocks.clone(), tie, Equal::Keep);
            prop_assert_eq!(&shares.concat(), &all);
            for pair in shares.iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().windows(2) {
                prop_assert!(pair[0].last().unwrap() >> tie < pair[1][0] >> tie);
            }
            all.dedup();
            prop_assert_eq!(sort(blocks, tie, Equal::Merge).concat(), all);
        }
    }
}

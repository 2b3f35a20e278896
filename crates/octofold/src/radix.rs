//! Radix sort of 64-bit names, alone or with what rides along: cells by Morton key, spans by row.
//!
//! Blocks that were made in parallel are sorted each by itself, then the key range is cut into
//! equal shares and each share gathers its part of every block. The result depends on the items
//! alone: equal keys stay in the order in which they came.

use crate::par;

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

/// What is sorted by a 64-bit name.
pub trait Keyed: Copy + Default + Send + Sync {
    /// The name.
    fn key(&self) -> u64;
}

impl Keyed for u64 {
    fn key(&self) -> u64 {
        *self
    }
}

/// A name and what rides along.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tagged {
    /// The name.
    pub key: u64,
    /// What rides along.
    pub tag: u64,
}

impl Keyed for Tagged {
    fn key(&self) -> u64 {
        self.key
    }
}

/// Sorts the items of all blocks. The result is in shares, one after the other in order: keys with
/// the same `key >> tie_bits` are in the same share.
pub fn sort<T: Keyed>(mut blocks: Vec<Vec<T>>, tie_bits: u32, equal: Equal) -> Vec<Vec<T>> {
    par::chunks_mut(&mut blocks, 1, |_, block| sort_block(&mut block[0], equal));
    let highest = blocks.iter().filter_map(|b| b.last()).map(T::key).max().unwrap_or(0);
    let step = ((highest >> tie_bits) / SHARES + 1) << tie_bits;
    let shares: Vec<u64> = (0..=highest / step).collect();
    par::map(&shares, |&share| {
        let mut all = Vec::new();
        for block in &blocks {
            let start = block.partition_point(|k| k.key() / step < share);
            let end = start + block[start..].partition_point(|k| k.key() / step == share);
            all.extend_from_slice(&block[start..end]);
        }
        sort_block(&mut all, equal);
        all
    })
}

/// Sorts one block by eleven bits at a time, lowest first; bits that all keys share cost nothing.
fn sort_block<T: Keyed>(keys: &mut Vec<T>, equal: Equal) {
    const DIGIT: u32 = 11;
    let varying = keys.iter().fold(0, |v, k| v | (k.key() ^ keys[0].key()));
    if keys.len() < 256 {
        keys.sort_by_key(T::key);
    } else if !keys.is_sorted_by_key(T::key) {
        let mut from = std::mem::take(keys);
        let mut to = vec![T::default(); from.len()];
        for shift in (0..64).step_by(DIGIT as usize) {
            if varying >> shift & ((1 << DIGIT) - 1) == 0 {
                continue;
            }
            let digit = |k: &T| (k.key() >> shift) as usize & ((1 << DIGIT) - 1);
            let mut at = [0usize; 1 << DIGIT];
            from.iter().for_each(|k| at[digit(k)] += 1);
            let mut sum = 0;
            for count in &mut at {
                sum += std::mem::replace(count, sum);
            }
            for k in &from {
                let place = &mut at[digit(k)];
                to[*place] = *k;
                *place += 1;
            }
            std::mem::swap(&mut from, &mut to);
        }
        *keys = from;
    }
    debug_assert!(keys.is_sorted_by_key(T::key));
    if equal == Equal::Merge {
        keys.dedup_by_key(|k| k.key());
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

        #[test]
        fn what_rides_along_keeps_its_order(
            blocks in prop::collection::vec(prop::collection::vec(0u64..300, 0..600), 0..4),
        ) {
            let mut tag = 0;
            let tagged = blocks.iter().map(|block| {
                let item = |&key: &u64| {
                    tag += 1;
                    Tagged { key, tag }
                };
                block.iter().map(item).collect::<Vec<_>>()
            });
            let tagged: Vec<Vec<Tagged>> = tagged.collect();
            let mut all = tagged.concat();
            all.sort_by_key(|t| t.key);
            prop_assert_eq!(sort(tagged, 0, Equal::Keep).concat(), all);
        }
    }
}

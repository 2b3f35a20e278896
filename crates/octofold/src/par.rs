//! The only door to threads: ordered blocks, so that results never depend on how many there are.

use crate::run::{Cancelled, Run};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Runs `work` over `0..count` in blocks of `block` items and returns the results in order.
///
/// Blocks have a fixed size, whatever the number of threads. Cancel and progress are seen to once
/// per block.
pub fn blocks<T: Send>(
    run: &Run,
    count: usize,
    block: usize,
    work: impl Fn(Range<usize>) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let block = block.max(1);
    let total = count.div_ceil(block);
    let done = AtomicU64::new(0);
    (0..total)
        .into_par_iter()
        .map(|b| {
            run.check()?;
            let result = work(b * block..((b + 1) * block).min(count));
            run.progress(done.fetch_add(1, Ordering::Relaxed) + 1, total as u64);
            Ok(result)
        })
        .collect()
}

/// Maps every item in parallel and keeps the order.
pub fn map<T: Sync, U: Send>(items: &[T], work: impl Fn(&T) -> U + Sync + Send) -> Vec<U> {
    items.par_iter().map(work).collect()
}

/// Runs `work` on fixed-size chunks of `items`, in place.
pub fn chunks_mut<T: Send>(items: &mut [T], chunk: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    items.par_chunks_mut(chunk.max(1)).enumerate().for_each(|(i, c)| work(i, c));
}

/// Runs both closures, in parallel where a thread is free.
pub fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(a, b)
}

/// Runs `work` on each of `tasks`, which it consumes, with the task's number.
pub fn consume<T: Send, E: Send + From<Cancelled>>(
    run: &Run,
    tasks: Vec<T>,
    work: impl Fn(usize, T) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let total = tasks.len() as u64;
    let done = AtomicU64::new(0);
    tasks.into_par_iter().enumerate().try_for_each(|(number, task)| {
        run.check()?;
        work(number, task)?;
        run.progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
        Ok(())
    })
}

/// Cuts `items` into parts of the given lengths, for [`consume`].
pub fn split<T>(mut items: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let mut parts = Vec::new();
    for length in lengths {
        let (part, rest) = items.split_at_mut(length);
        parts.push(part);
        items = rest;
    }
    parts
}

/// Sorts items whose order is total: equal items cannot be told apart.
pub fn sort<T: Send + Ord>(items: &mut [T]) {
    items.par_sort_unstable();
}

/// Sorts by a key that is unique for distinct items, so that the order is the same every time.
pub fn sort_by_key<T: Send, K: Ord>(items: &mut [T], key: impl Fn(&T) -> K + Sync) {
    items.par_sort_unstable_by_key(key);
}

/// Runs `work` with exactly `threads` threads; 0 takes one per core.
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(work),
        // Without new threads the calling one still does the work.
        Err(_) => work(),
    }
}

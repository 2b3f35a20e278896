//! Edges in the order of their costs, in buckets of nearly equal cost.
//!
//! A cost is known as a bound from below: sums of quadrics only grow, so an edge whose ends have
//! changed costs at least what it did. Who takes an edge out computes its cost anew and puts it back
//! where it costs more. Within a bucket edges come by their numbers, which follow the places
//! where they lie.

/// Bits of the mantissa that tell buckets apart: costs in one differ by a half at most.
const MANTISSA: u32 = 1;

/// Costs below this are as good as none.
const LEAST: f32 = 1e-24;

/// The edges that wait, by number.
#[derive(Debug)]
pub struct Queue {
    buckets: Vec<Vec<u32>>,
    /// The bucket that is being emptied.
    lowest: usize,
    /// What is left of it, the next last.
    current: Vec<u32>,
}

/// The bucket of a cost; costs that are not finite are above all others.
pub fn bucket(cost: f32) -> usize {
    let drop = f32::MANTISSA_DIGITS - 1 - MANTISSA;
    let place = |x: f32| (x.to_bits() >> drop) as usize;
    if cost <= LEAST { 0 } else { place(cost.min(f32::MAX)) - place(LEAST) }
}

impl Queue {
    pub fn new() -> Self {
        Self { buckets: vec![Vec::new(); bucket(f32::MAX) + 1], lowest: 0, current: Vec::new() }
    }

    /// Adds an edge to the bucket, or to the lowest one that is not yet passed.
    pub fn push(&mut self, bucket: usize, edge: u32) {
        if bucket < self.lowest && self.current.is_empty() {
            self.lowest = bucket;
        }
        self.buckets[bucket.max(self.lowest)].push(edge);
    }

    /// The next edge, and its bucket.
    pub fn pop(&mut self) -> Option<(usize, u32)> {
        if self.current.is_empty() {
            let filled = |b: &Vec<u32>| !b.is_empty();
            self.lowest += self.buckets[self.lowest..].iter().position(filled)?;
            self.current = std::mem::take(&mut self.buckets[self.lowest]);
            self.current.sort_unstable_by(|a, b| b.cmp(a));
        }
        self.current.pop().map(|edge| (self.lowest, edge))
    }

    /// Renumbers what waits; edges without a new number are dropped.
    pub fn renumber(&mut self, number: impl Fn(u32) -> Option<u32>) {
        for edges in self.buckets.iter_mut().chain([&mut self.current]) {
            edges.retain_mut(|edge| number(*edge).map(|new| *edge = new).is_some());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_come_by_cost_and_then_by_number() {
        let mut queue = Queue::new();
        for (edge, cost) in [(7, 1.0), (3, 0.0), (9, 1e-30), (5, 1.01), (4, f32::INFINITY)] {
            queue.push(bucket(cost), edge);
        }
        let first: Vec<_> = (0..2).filter_map(|_| queue.pop()).map(|(_, e)| e).collect();
        assert_eq!(first, [3, 9]);
        queue.renumber(|e| (e != 4).then_some(e + 1));
        let (of_one, edge) = queue.pop().unwrap();
        assert_eq!((of_one, edge), (bucket(1.0), 6));
        // A lower one comes next, but not before what its bucket has left.
        queue.push(0, 1);
        let rest: Vec<_> = std::iter::from_fn(|| queue.pop()).map(|(_, e)| e).collect();
        assert_eq!(rest, [8, 1]);
    }

    #[test]
    fn buckets_follow_costs() {
        let costs = [0.0, 1e-20, 1e-12, 0.3, 0.5, 2.0, 1e30, f32::INFINITY];
        assert!(costs.is_sorted_by_key(|&c| bucket(c)));
        assert!(bucket(f32::NAN) <= bucket(f32::MAX));
    }
}

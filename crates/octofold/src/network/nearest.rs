//! The node that is nearest to a place.
//!
//! A k-d tree over the places of nodes. Distances are measured along the axes of the grid, each in
//! units of the world; of nodes that are equally near, the first in order is taken.

use super::Node;
use std::cmp::Ordering;

/// Nodes of a leaf, at most.
const LEAF: usize = 8;

/// A node by its place along z, y and x, and its number.
type Item = ([u16; 3], u32);

/// Places of nodes, in halves of halves.
pub struct Nearest {
    items: Vec<Item>,
    /// The axis that an item parts its share along, where it does.
    axes: Vec<u8>,
    /// Length of a voxel along z, y and x.
    sides: [f64; 3],
}

impl Nearest {
    /// Over nodes in order, with voxels of such sides along x, y and z.
    pub fn new(nodes: &[Node], [x, y, z]: [f64; 3]) -> Self {
        let mut items: Vec<Item> = nodes.iter().map(|n| n.zyx).zip(0..).collect();
        let mut axes = vec![0; items.len()];
        let sides = [z, y, x];
        part(&mut items, &mut axes, &sides);
        Self { items, axes, sides }
    }

    /// The number of the node nearest to a place in voxels; `None` where there are no nodes.
    pub fn find(&self, [x, y, z]: [f64; 3]) -> Option<u32> {
        let mut best = (f64::INFINITY, u32::MAX);
        self.search(0..self.items.len(), [z, y, x], &mut best);
        (best.1 != u32::MAX).then_some(best.1)
    }

    fn search(&self, share: std::ops::Range<usize>, at: [f64; 3], best: &mut (f64, u32)) {
        let mut look = |&(place, number): &Item| {
            let off: [f64; 3] =
                std::array::from_fn(|a| (f64::from(place[a]) - at[a]) * self.sides[a]);
            let distance = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
            if (distance, number) < *best {
                *best = (distance, number);
            }
        };
        if share.len() <= LEAF {
            self.items[share].iter().for_each(look);
            return;
        }
        let middle = share.start + share.len() / 2;
        look(&self.items[middle]);
        let axis = self.axes[middle] as usize;
        let off = (at[axis] - f64::from(self.items[middle].0[axis])) * self.sides[axis];
        let (low, high) = (share.start..middle, middle + 1..share.end);
        let (near, far) = if off < 0.0 { (low, high) } else { (high, low) };
        self.search(near, at, best);
        // One that is as far and comes before may lie there as well.
        if off * off <= best.0 {
            self.search(far, at, best);
        }
    }
}

/// Halves a share along its longest side, and its halves.
fn part(items: &mut [Item], axes: &mut [u8], sides: &[f64; 3]) {
    if items.len() <= LEAF {
        return;
    }
    let length = |a: usize| {
        let places = items.iter().map(|i| i.0[a]);
        let (low, high) = places.fold((u16::MAX, 0), |(l, h), x| (l.min(x), h.max(x)));
        f64::from(high - low) * sides[a]
    };
    let lengths = [0, 1, 2].map(length);
    let longest = |a: &usize, b: &usize| lengths[*a].partial_cmp(&lengths[*b]);
    let axis = (0..3).max_by(|a, b| longest(a, b).unwrap_or(Ordering::Equal)).unwrap_or(0);
    let middle = items.len() / 2;
    items.select_nth_unstable_by_key(middle, |i| (i.0[axis], i.1));
    axes[middle] = axis as u8;
    let ((low, rest), (low_axes, rest_axes)) =
        (items.split_at_mut(middle), axes.split_at_mut(middle));
    part(low, low_axes, sides);
    part(&mut rest[1..], &mut rest_axes[1..], sides);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(100))]

        #[test]
        fn the_nearest_is_that_of_all(
            places in prop::collection::vec((0u16..30, 0u16..9, 0u16..30), 0..200),
            queries in prop::collection::vec((-80i32..200, -80i32..200, -80i32..200), 20),
            sides in (1u32..4, 1u32..4, 1u32..4),
        ) {
            let mut places: Vec<[u16; 3]> = places.iter().map(|&(z, y, x)| [z, y, x]).collect();
            places.sort_unstable();
            places.dedup();
            let nodes: Vec<Node> = places.iter().map(|&zyx| Node { zyx, mask: 1 }).collect();
            let sides = [sides.0, sides.1, sides.2].map(f64::from);
            let nearest = Nearest::new(&nodes, sides);
            for (x, y, z) in queries {
                let at = [x, y, z].map(|i| f64::from(i) / 4.0);
                let distance = |n: &Node| {
                    let off = [0, 1, 2].map(|a| (f64::from(n.at()[a]) - at[a]) * sides[a]);
                    off.iter().map(|v| v * v).sum::<f64>()
                };
                let least = nodes.iter().map(distance).fold(f64::INFINITY, f64::min);
                let expected = nodes.iter().position(|n| distance(n) == least);
                prop_assert_eq!(nearest.find(at), expected.map(|i| i as u32));
            }
        }
    }
}

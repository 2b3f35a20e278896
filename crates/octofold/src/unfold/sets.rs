//! Disjoint sets, with a sign between each item and the others of its set.

/// Sets of items that are joined step by step (Tarjan 1975).
#[derive(Debug, Clone)]
pub(super) struct Sets {
    parent: Vec<u32>,
    /// Whether an item is turned against its parent.
    turned: Vec<bool>,
}

impl Sets {
    /// Each item alone.
    pub fn singles(count: usize) -> Self {
        Self { parent: (0..count as u32).collect(), turned: vec![false; count] }
    }

    /// The item that stands for the set of `item`, and whether `item` is turned against it.
    pub fn find(&mut self, item: u32) -> (u32, bool) {
        let (mut root, mut turned) = (item, false);
        while self.parent[root as usize] != root {
            turned ^= self.turned[root as usize];
            root = self.parent[root as usize];
        }
        let (mut at, mut rest) = (item, turned);
        while self.parent[at as usize] != root && at != root {
            let next = self.parent[at as usize];
            let own = std::mem::replace(&mut self.turned[at as usize], rest);
            self.parent[at as usize] = root;
            rest ^= own;
            at = next;
        }
        (root, turned)
    }

    /// Joins two sets so that `a` and `b` are `turned` against each other; false where they are in
    /// one set already. The lower item stands for both.
    pub fn join_turned(&mut self, a: u32, b: u32, turned: bool) -> bool {
        let ((ra, ta), (rb, tb)) = (self.find(a), self.find(b));
        if ra == rb {
            return false;
        }
        let (low, high) = (ra.min(rb), ra.max(rb));
        self.parent[high as usize] = low;
        self.turned[high as usize] = ta ^ tb ^ turned;
        true
    }

    /// Joins two sets; false where they are one already.
    pub fn join(&mut self, a: u32, b: u32) -> bool {
        self.join_turned(a, b, false)
    }

    /// The sets in order of their lowest items, their items in order.
    pub fn groups(&mut self) -> Vec<Vec<u32>> {
        let count = self.parent.len();
        let mut place = vec![u32::MAX; count];
        let mut groups: Vec<Vec<u32>> = Vec::new();
        for item in 0..count as u32 {
            let root = self.find(item).0 as usize;
            if place[root] == u32::MAX {
                place[root] = groups.len() as u32;
                groups.push(Vec::new());
            }
            groups[place[root] as usize].push(item);
        }
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::cases;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(cases(200))]

        #[test]
        fn signs_add_up(signs in prop::collection::vec(any::<bool>(), 20), joins in prop::collection::vec((0u32..20, 0u32..20), 0..40)) {
            let mut sets = Sets::singles(20);
            for (a, b) in joins {
                let turned = signs[a as usize] ^ signs[b as usize];
                sets.join_turned(a, b, turned);
                let ((ra, ta), (rb, tb)) = (sets.find(a), sets.find(b));
                prop_assert_eq!((ra, ta ^ tb), (rb, turned));
            }
            for group in sets.groups() {
                let first = group[0];
                for &item in &group {
                    let (root, turned) = sets.find(item);
                    prop_assert_eq!(root, sets.find(first).0);
                    let relative = turned ^ sets.find(first).1;
                    prop_assert_eq!(relative, signs[item as usize] ^ signs[first as usize]);
                }
            }
        }
    }
}

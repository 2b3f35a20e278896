//! Borders: the edges of a single triangle.

use crate::par;
use crate::radix::{self, Equal};
use crate::run::{Cancelled, Run};

/// Triangles of one block of work.
const BLOCK: usize = 1 << 14;

/// The edges with one triangle, each with its lower point first, in order.
pub fn borders(triangles: &[[u32; 3]], run: &Run) -> Result<Vec<[u32; 2]>, Cancelled> {
    let edges = par::blocks(run, triangles.len(), BLOCK, |block| {
        let sides = triangles[block].iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let proper = sides.filter(|[a, b]| a != b);
        proper.map(|[a, b]| u64::from(a.min(b)) << 32 | u64::from(a.max(b))).collect()
    })?;
    let shares = radix::sort(edges, 0, Equal::Keep);
    let single = |share: &Vec<u64>| -> Vec<[u32; 2]> {
        let groups = share.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
        groups.map(|same| [(same[0] >> 32) as u32, same[0] as u32]).collect()
    };
    Ok(par::map(&shares, single).concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Topology;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn as_many_as_the_topology_counts(
            triangles in prop::collection::vec(prop::array::uniform3(0u32..12), 0..30),
        ) {
            let run = Run::default();
            // What names a point twice is no triangle there.
            let proper = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
            let triangles: Vec<_> = triangles.into_iter().filter(proper).collect();
            let found = borders(&triangles, &run).unwrap();
            prop_assert!(found.is_sorted() && found.iter().all(|[a, b]| a < b));
            let counted = Topology::of(12, &triangles, &run).unwrap().boundary_edges;
            prop_assert_eq!(found.len(), counted.count);
            prop_assert!(counted.first.iter().all(|edge| found.contains(edge)));
        }
    }
}

//! Parts of a solid seen along another axis: what is drawn out along it has slices that are all the same.

use crate::network::combine::{Operation, merge};
use crate::rows::Rows;
use crate::spans::Spans;
use crate::volume::{Placement, Volume};

/// The solid with an axis and z exchanged, which is its own inverse; its placement is not kept.
pub fn turned(part: &Spans, axis: usize) -> Spans {
    let mut dims = part.dims();
    dims.swap(axis, 2);
    let rows = match axis {
        0 => exchanged_x(part),
        1 => exchanged_y(part),
        _ => return part.clone(),
    };
    Spans::from_rows(dims, Placement::default(), [rows])
}

fn exchanged_y(part: &Spans) -> Rows<[u32; 2]> {
    let [_, height, depth] = part.dims();
    let mut rows = Rows::default();
    for y in 0..height {
        for z in 0..depth {
            rows.extend(part.row(y, z));
            rows.end_row(z as u32);
        }
        rows.end_slice();
    }
    rows
}

/// The ends of runs along z are the voxels in which a slice differs from the one before.
fn exchanged_x(part: &Spans) -> Rows<[u32; 2]> {
    let [width, height, depth] = part.dims();
    let mut ends: Vec<Vec<[u32; 2]>> = vec![Vec::new(); width];
    for z in 0..=depth {
        for y in 0..height {
            let before = if z > 0 { part.row(y, z - 1) } else { &[] };
            let own = if z < depth { part.row(y, z) } else { &[] };
            if before != own {
                merge(Operation::SymmetricDifference, before, own, |[start, end]| {
                    for x in start..end {
                        ends[x as usize].push([y as u32, z as u32]);
                    }
                });
            }
        }
    }
    let mut rows = Rows::default();
    for mut slice in ends {
        slice.sort_unstable();
        for row in slice.chunk_by(|a, b| a[0] == b[0]) {
            row.chunks_exact(2).for_each(|run| rows.push([run[0][1], run[1][1]]));
            rows.end_row(row[0][0]);
        }
        rows.end_slice();
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::tests::noise;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(60))]

        #[test]
        fn voxels_change_places(
            dims in prop::array::uniform3(1usize..20),
            seed in any::<u64>(),
            coarse in 1usize..10,
            percent in 0u64..=100,
        ) {
            let solid = noise(dims, seed, coarse, percent);
            for axis in 0..3 {
                let other = turned(&solid, axis);
                for i in 0..dims.iter().product() {
                    let mut at = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
                    let filled = solid.contains(at.map(|i| i as u32));
                    at.swap(axis, 2);
                    prop_assert_eq!(other.contains(at.map(|i| i as u32)), filled);
                }
                let back = turned(&other, axis);
                prop_assert_eq!(back.rows(), solid.rows());
            }
        }
    }
}

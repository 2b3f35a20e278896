//! Linear octrees out of meshes and volumes.

use super::key::MAX_LEVEL;
use super::{CellKey, Class, Octree, key};
use crate::lattice::Lattice;
use crate::mesh::Mesh;
use crate::par;
use crate::radix::{self, Equal};
use crate::run::{Cancelled, Run};
use crate::scan;
use crate::volume::{Region, Volume, VolumeError};
use crate::voxelize;
use crate::with_samples;

/// Subtrees at this level are built in parallel.
const SPLIT_LEVEL: u32 = 3;

impl Octree {
    /// The octree of a mesh: gray where a triangle touches a finest cell, else black or white by
    /// the cell's centre as in [`voxelize::solid`].
    pub fn from_mesh(mesh: &Mesh, lattice: &Lattice, run: &Run) -> Result<Self, Cancelled> {
        let inside = voxelize::solid(mesh, lattice, run)?;
        run.stage("octree");
        let codes = touched_codes(mesh, lattice, run)?;
        let cells = lattice.cells();
        Ok(Self::from_gray(lattice.levels(), &codes, |low, size| {
            // Cells beyond the grid are outside. Where the mesh has holes, an octant that no
            // triangle touches may hold both.
            let start = low.map(|i| i as usize);
            let end = std::array::from_fn(|a| (low[a] + size).min(cells[a]) as usize);
            if (0..3).any(|a| start[a] >= end[a]) {
                return Some(false);
            }
            let whole = (0..3).all(|a| low[a] + size <= cells[a]);
            match inside.bounds(Region { start, end }) {
                Some([_, 0.0]) => Some(false),
                Some([1.0, _]) if whole => Some(true),
                _ => None,
            }
        }))
    }

    /// The octree over the cells between the samples of a volume and a ring of outside samples
    /// round them: gray where the eight samples differ, else black or white. Cell (0, 0, 0) is
    /// the one before the first sample.
    ///
    /// # Errors
    /// Where a block cannot be read, the work is interrupted, or an axis has more than 2^19 - 1
    /// samples.
    pub fn from_volume(volume: &dyn Volume, iso: f64, run: &Run) -> Result<Self, VolumeError> {
        const SLAB: usize = 16;
        run.stage("octree");
        let iso = if volume.is_binary() { 0.5 } else { iso };
        let dims = volume.dims();
        let longest = dims.into_iter().max().unwrap_or(0);
        if longest >= 1 << MAX_LEVEL {
            return Err(VolumeError::TooLong { samples: longest, most: (1 << MAX_LEVEL) - 1 });
        }
        let levels = (longest + 1).next_power_of_two().trailing_zeros();
        let layers = |z: std::ops::Range<usize>| Region {
            start: [0, 0, z.start],
            end: [dims[0], dims[1], z.end],
        };
        let codes = par::blocks(run, dims[2] + 1, SLAB, |cells| {
            let real = cells.start.saturating_sub(1)..cells.end.min(dims[2]);
            let block = volume.read(layers(real.clone()))?;
            Ok(with_samples!(&block, samples => {
                let inside = |s| crate::volume::Scalar::to_f64(s) >= iso;
                mixed_codes(samples, dims, real, cells, inside)
            }))
        })?;
        let codes = codes.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
        let codes = radix::sort(codes, 0, Equal::Merge).concat();
        let inside = |cell: [u32; 3]| {
            let sample = cell.map(|i| (i as usize).wrapping_sub(1));
            if (0..3).any(|a| sample[a] >= dims[a]) {
                return Ok(false);
            }
            let one = Region { start: sample, end: sample.map(|i| i + 1) };
            Ok(volume.read(one)?.value(0) >= iso)
        };
        // An octant without a mixed cell is as its first cell, and that as its low sample.
        let failed = std::sync::Mutex::new(None);
        let tree = Self::from_gray(levels, &codes, |low, _| {
            Some(inside(low).unwrap_or_else(|e: VolumeError| {
                if let Ok(mut slot) = failed.lock() {
                    slot.get_or_insert(e);
                }
                false
            }))
        });
        match failed.into_inner() {
            Ok(Some(e)) => Err(e),
            _ => Ok(tree),
        }
    }

    /// Completes sorted, distinct Morton codes of gray finest cells with the largest black and
    /// white octants between them. `inside` tells black from white for an octant without gray
    /// cells, by its low corner and size, or `None` where it holds both; for single cells it
    /// always tells.
    fn from_gray(
        levels: u32,
        gray: &[u64],
        inside: impl Fn([u32; 3], u32) -> Option<bool> + Sync,
    ) -> Self {
        let mut tops = Vec::new();
        split(CellKey::ROOT, gray, levels, SPLIT_LEVEL.min(levels), &mut |key, codes| {
            tops.push((key, codes));
        });
        let parts = par::map(&tops, |&(top, codes)| {
            let mut leaves = Vec::new();
            split(top, codes, levels, levels, &mut |key, codes| {
                if codes.is_empty() {
                    classify(key, levels, &inside, &mut leaves);
                } else {
                    leaves.push((key, Class::Gray));
                }
            });
            leaves
        });
        let (keys, classes) = parts.into_iter().flatten().unzip();
        Self { levels, keys, classes }
    }
}

/// Adds the black and white leaves of an octant without gray cells.
fn classify(
    key: CellKey,
    levels: u32,
    inside: &impl Fn([u32; 3], u32) -> Option<bool>,
    leaves: &mut Vec<(CellKey, Class)>,
) {
    match inside(key.corner(), key.size(levels)) {
        Some(true) => leaves.push((key, Class::Black)),
        Some(false) => leaves.push((key, Class::White)),
        None => (0..8).for_each(|o| classify(key.child(o, levels), levels, inside, leaves)),
    }
}

/// Visits, in order, the octants below `key` that are without gray cells or of level `stop`.
fn split<'a>(
    key: CellKey,
    codes: &'a [u64],
    levels: u32,
    stop: u32,
    visit: &mut impl FnMut(CellKey, &'a [u64]),
) {
    if codes.is_empty() || key.level() == stop {
        return visit(key, codes);
    }
    let mut rest = codes;
    for octant in 0..8 {
        let child = key.child(octant, levels);
        let end = child.morton() + (1 << (3 * (levels - child.level())));
        let (own, after) = rest.split_at(rest.partition_point(|&c| c < end));
        split(child, own, levels, stop, visit);
        rest = after;
    }
}

/// Morton codes of the cells that the mesh touches, sorted and distinct.
fn touched_codes(mesh: &Mesh, lattice: &Lattice, run: &Run) -> Result<Vec<u64>, Cancelled> {
    let facets = voxelize::facets(mesh, lattice);
    let codes = par::blocks(run, facets.len(), voxelize::block_of(facets.len()), |block| {
        let mut codes = Vec::new();
        for facet in &facets[block] {
            scan::cells(facet, lattice.sub_bits(), |cell| codes.push(key::morton(cell)));
        }
        codes
    })?;
    Ok(radix::sort(codes, 0, Equal::Merge).concat())
}

/// Morton codes of the mixed cells with z in `cells`; `real` are the layers in `samples`.
fn mixed_codes<T: crate::volume::Scalar>(
    samples: &[T],
    dims: [usize; 3],
    real: std::ops::Range<usize>,
    cells: std::ops::Range<usize>,
    inside: impl Fn(T) -> bool + Copy,
) -> Vec<u64> {
    use crate::bits;
    let [nx, ny, _] = dims;
    let words = bits::words(nx + 2);
    let pack = |y: usize, z: usize, row: &mut [u64]| match (y.checked_sub(1), z.checked_sub(1)) {
        (Some(y), Some(z)) if y < ny && real.contains(&z) => {
            let first = ((z - real.start) * ny + y) * nx;
            bits::pack(&samples[first..first + nx], inside, 1, row);
        }
        _ => row.fill(0),
    };
    let mut rows = vec![0; 4 * words];
    let mut codes = Vec::new();
    for z in cells {
        for y in 0..=ny {
            for (r, row) in rows.chunks_exact_mut(words).enumerate() {
                pack(y + (r & 1), z + (r >> 1), row);
            }
            for w in 0..words {
                let of = |r: usize| {
                    let row = &rows[r * words..(r + 1) * words];
                    [row[w], bits::next(row, w)]
                };
                let all = [of(0), of(1), of(2), of(3)];
                let any = all.iter().flatten().fold(0, |a, b| a | b);
                let every = all.iter().flatten().fold(!0, |a, b| a & b);
                bits::ones(any & !every & bits::below(nx + 1, w), |bit| {
                    codes.push(key::morton([64 * w + bit, y, z].map(|i| i as u32)));
                });
            }
        }
    }
    codes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Placement;
    use crate::volume::DenseVolume;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(64))]

        #[test]
        fn leaves_tile_the_root_and_tell_the_truth(
            dims in prop::array::uniform3(1usize..9),
            seed in any::<u64>(),
        ) {
            let mut state = seed;
            let samples: Vec<u8> = (0..dims.iter().product::<usize>()).map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                u8::from(state >> 33 & 7 > 0)
            }).collect();
            let sample = |i: [u32; 3]| {
                let i = i.map(|c| (c as usize).wrapping_sub(1));
                (0..3).all(|a| i[a] < dims[a])
                    && samples[(i[2] * dims[1] + i[1]) * dims[0] + i[0]] == 1
            };
            let volume = DenseVolume::new(dims, samples.clone(), Placement::default()).unwrap();
            let tree = Octree::from_volume(&volume, 1.0, &Run::default()).unwrap();
            prop_assert!(tree.keys().is_sorted());
            let size = 1u32 << tree.levels();
            let cells: u64 = tree.keys().iter().map(|k| u64::from(k.size(tree.levels())).pow(3)).sum();
            prop_assert_eq!(cells, u64::from(size).pow(3));
            for code in 0..u64::from(size).pow(3) {
                let cell = key::unmorton(code);
                let corners: Vec<bool> = (0..8)
                    .map(|c| sample([0, 1, 2].map(|a| cell[a] + (c >> a & 1))))
                    .collect();
                let expected = match (corners.contains(&true), corners.contains(&false)) {
                    (true, true) => Class::Gray,
                    (true, false) => Class::Black,
                    _ => Class::White,
                };
                let (leaf, class) = tree.leaf_at(cell);
                prop_assert!(leaf.contains(CellKey::new(cell, tree.levels()), tree.levels()));
                prop_assert_eq!(class, expected);
            }
        }
    }

    /// Small tetrahedra far apart, so that a deep tree stays small.
    fn far_apart() -> Mesh {
        let mut points = Vec::new();
        let mut triangles = Vec::new();
        for at in [[0.0; 3], [900.0, 500.0, 20.0], [1000.0; 3]] {
            let start = points.len() as u32;
            points.extend(
                [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
                    .map(|c| std::array::from_fn(|a| at[a] + 0.4 * f64::from(c[a]))),
            );
            let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
            triangles.extend(faces.map(|t| t.map(|p| p + start)));
        }
        Mesh::new(points, triangles).unwrap()
    }

    #[test]
    fn sixteen_levels_hold_what_their_surface_needs() {
        let mesh = far_apart();
        let lattice = Lattice::fit(mesh.bounds().unwrap(), 1 << 16).unwrap();
        let tree = Octree::from_mesh(&mesh, &lattice, &Run::default()).unwrap();
        assert_eq!(tree.levels(), 16);
        let volume: u128 = tree.keys().iter().map(|k| u128::from(k.size(16)).pow(3)).sum();
        assert_eq!(volume, 1 << 48);
        let [_, gray, _] = tree.census()[16];
        // Each is about 26 cells high.
        assert!((3 * 700..3 * 4000).contains(&gray), "{gray}");
        let black = tree.classes().iter().filter(|&&c| c == Class::Black).count();
        assert!(black > 0 && tree.keys().len() < 40_000);
        let octant = tree.leaf_at([0, 0, 0]).0.parent(16).unwrap();
        let below = tree.subtree(octant);
        assert!(tree.keys()[below].iter().all(|&k| octant.contains(k, 16)));
    }

    #[test]
    fn leaves_agree_with_the_cells_of_a_mesh_with_a_hole() {
        let mut mesh = crate::samples::Sample::Sphere.polygons(24).unwrap().triangulate();
        mesh.triangles.drain(0..60);
        let lattice = Lattice::fit(mesh.bounds().unwrap(), 40).unwrap();
        let tree = Octree::from_mesh(&mesh, &lattice, &Run::default()).unwrap();
        let cells = voxelize::solid(&mesh, &lattice, &Run::default()).unwrap();
        for code in 0..1 << (3 * tree.levels()) {
            let cell = key::unmorton(code);
            match tree.leaf_at(cell).1 {
                Class::Black => assert!(cells.contains(cell), "{cell:?}"),
                Class::White => assert!(!cells.contains(cell), "{cell:?}"),
                Class::Gray => {}
            }
        }
    }

    #[test]
    fn threads_do_not_change_a_leaf() {
        let mesh = crate::samples::Sample::Torus.polygons(40).unwrap().triangulate();
        let lattice = Lattice::fit(mesh.bounds().unwrap(), 64).unwrap();
        let volume = crate::samples::Sample::Kettle.voxels(50).unwrap();
        let trees = [1, 2, 3, 8].map(|threads| {
            par::with_threads(threads, || {
                (
                    Octree::from_mesh(&mesh, &lattice, &Run::default()).unwrap(),
                    Octree::from_volume(&volume, 0.5, &Run::default()).unwrap(),
                )
            })
        });
        assert!(trees.windows(2).all(|t| t[0] == t[1]));
        let [white, gray, black] = trees[0].0.census()[6];
        assert!(white > 0 && gray > 4000 && black > 0);
    }
}

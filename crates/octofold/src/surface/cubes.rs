//! Marching cubes, streamed over slabs of samples.
//!
//! Rows of samples become rows of bits; all that follows (mixed cells, crossings, the number of
//! every vertex) is read off whole words. A slab of layers is one unit of parallel work. A first
//! pass packs and counts, so that the mesh is allocated once and at its size; a second one writes
//! each slab's points and triangles where they belong. Vertices are numbered in the order in which
//! a slab meets them, layer by layer; the vertices on a slab's last layer are the first of the next
//! slab, so no slab waits for another and the result is the same for any number of threads.
//!
//! Source: Lorensen and Cline 1987; edge-based numbering after Schroeder, Maynard, Geveci 2015
//! (Flying Edges), here with bits in place of edge cases.
//!
//! The surface is closed, oriented and 2-manifold, unless the border was asked to stay open: see
//! [`super::cell`]. Vertices keep 1/1024 of an edge from both ends, so that no two coincide.

use super::cell::{PATCHES, Patch};
use super::slab::{Frame, Slab};
use crate::bits;
use crate::mesh::Mesh;
use crate::par;
use crate::run::Run;
use crate::volume::{Volume, VolumeError};

/// Layers of cells in one unit of work.
pub(super) const SLAB: usize = 32;

/// Bytes of bits that the first pass keeps for the second; slabs beyond are read again. Shares,
/// four bytes for each vertex, come on top.
const KEPT_BYTES: usize = 256 << 20;

/// Which samples are inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// At or above the isovalue: masks, densities, CT.
    #[default]
    Above,
    /// Below the isovalue: signed distances that are negative inside.
    Below,
}

/// What marching cubes needs to know beside the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubesOptions {
    /// The isovalue.
    pub iso: f64,
    /// Which side of it is inside.
    pub inside: Inside,
    /// Leave the surface open where it meets the volume's border, instead of closing it half a
    /// sample outside.
    pub open: bool,
}

/// Extracts the isosurface of a volume as a mesh in world coordinates.
pub fn marching_cubes(
    volume: &dyn Volume,
    options: &CubesOptions,
    run: &Run,
) -> Result<Mesh, VolumeError> {
    let frame = Frame::new(volume, options);
    let mut patches = *PATCHES;
    if frame.placement.determinant() < 0.0 {
        patches.iter_mut().for_each(Patch::reverse);
    }
    let layers = frame.cells(2);
    run.stage("count");
    let per_slab = (SLAB + 1) * frame.points(1) * frame.words() * size_of::<u64>();
    let kept = KEPT_BYTES / per_slab.max(1);
    let slabs = par::blocks(run, layers, SLAB, |range| {
        let keep = range.start / SLAB < kept;
        let slab = frame.slab(volume, range)?;
        Ok((slab.points, slab.triangles, keep.then_some(slab)))
    })?;
    let slabs = slabs.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
    let mut starts = Vec::with_capacity(slabs.len());
    let (mut points, mut triangles) = (0, 0);
    for slab in &slabs {
        starts.push(points as u32);
        points += slab.0;
        triangles += slab.1;
    }
    if points >= u32::MAX as usize {
        return Err(VolumeError::TooManyPoints);
    }
    // Zeroed memory is first touched by the thread that fills it.
    let mut mesh = Mesh {
        points: bytemuck::zeroed_vec(points),
        triangles: bytemuck::zeroed_vec(triangles),
        unit: frame.placement.unit,
        ..Mesh::default()
    };
    let points = par::split(&mut mesh.points, slabs.iter().map(|s| s.0));
    let triangles = par::split(&mut mesh.triangles, slabs.iter().map(|s| s.1));
    let work: Vec<_> = slabs.into_iter().zip(starts).zip(points).zip(triangles).collect();
    run.stage("march");
    par::consume(run, work, |number, ((((_, _, slab), start), points), triangles)| {
        let range = number * SLAB..((number + 1) * SLAB).min(layers);
        let slab = slab.map_or_else(|| frame.slab(volume, range), Ok)?;
        March {
            frame: &frame,
            patches: &patches,
            slab: &slab,
            points,
            triangles,
            start,
            made: 0,
            next: start,
            placed: 0,
        }
        .all();
        Ok::<(), VolumeError>(())
    })?;
    Ok(mesh)
}

/// The second pass over one slab: where it writes, and how far it has come.
struct March<'a> {
    frame: &'a Frame<'a>,
    /// Turned over where the placement mirrors.
    patches: &'a [Patch; 256],
    slab: &'a Slab,
    points: &'a mut [[f64; 3]],
    triangles: &'a mut [[u32; 3]],
    /// Number of the slab's first vertex.
    start: u32,
    /// Points written.
    made: usize,
    /// Number of the next vertex; runs on past the own points on the next slab's first layer.
    next: u32,
    /// Triangles written.
    placed: usize,
}

/// The number of the first vertex on each row of x and y edges of a layer.
struct Numbers {
    x: Vec<u32>,
    y: Vec<u32>,
}

impl March<'_> {
    fn all(mut self) {
        let slab = self.slab;
        let new = || Numbers { x: vec![0; slab.rows], y: vec![0; slab.rows] };
        let (mut low, mut high) = (new(), new());
        let mut vertical = vec![0; slab.rows];
        self.number_layer(slab.layers.start, &mut low);
        for z in slab.layers.clone() {
            for y in 0..slab.rows {
                vertical[y] = self.next;
                slab.crossed(2, y, z, |w, crossed| self.make(crossed, 2, [w, y, z]));
            }
            self.number_layer(z + 1, &mut high);
            for y in 0..slab.rows - 1 {
                self.place(y, z, [&low, &high], &vertical);
            }
            std::mem::swap(&mut low, &mut high);
        }
    }

    /// Numbers the vertices on the x and y edges of layer `z`, and makes those that are own.
    fn number_layer(&mut self, z: usize, numbers: &mut Numbers) {
        let slab = self.slab;
        for y in 0..slab.rows {
            for axis in 0..2 {
                let first = if axis == 0 { &mut numbers.x[y] } else { &mut numbers.y[y] };
                *first = self.next;
                slab.crossed(axis, y, z, |w, crossed| {
                    if slab.owns(z) {
                        self.make(crossed, axis, [w, y, z]);
                    } else {
                        self.next += crossed.count_ones();
                    }
                });
            }
        }
    }

    /// Makes a vertex for every set bit of a word of crossed edges along `axis`.
    fn make(&mut self, crossed: u64, axis: usize, [w, y, z]: [usize; 3]) {
        let pad = self.frame.pad as f64;
        bits::ones(crossed, |bit| {
            let mut index = [64 * w + bit, y, z].map(|i| i as f64 - pad);
            index[axis] += self.slab.shares.get(self.made).map_or(0.5, |&s| f64::from(s));
            self.points[self.made] = self.frame.placement.place(index);
            self.made += 1;
        });
        self.next = self.start + self.made as u32;
    }

    /// Places the triangles of row `y` of cells above layer `z`.
    fn place(&mut self, y: usize, z: usize, [low, high]: [&Numbers; 2], vertical: &[u32]) {
        // Number of the next vertex on each of the eight rows of edges beside the cells. Between
        // mixed cells no edge is crossed, so the numbers stand still there.
        let mut next_x = [low.x[y], low.x[y + 1], high.x[y], high.x[y + 1]];
        let mut next_y = [low.y[y], high.y[y]];
        let mut next_z = [vertical[y], vertical[y + 1]];
        self.slab.mixed(y, z, |_, mask| {
            let differ = |a: usize, b: usize| ((mask >> a ^ mask >> b) & 1) as u32;
            let on_y = [differ(0, 2), differ(4, 6)];
            let on_z = [differ(0, 4), differ(2, 6)];
            let ids = [
                next_x[0],
                next_x[1],
                next_x[2],
                next_x[3],
                next_y[0],
                next_y[0] + on_y[0],
                next_y[1],
                next_y[1] + on_y[1],
                next_z[0],
                next_z[0] + on_z[0],
                next_z[1],
                next_z[1] + on_z[1],
            ];
            for r in 0..4 {
                next_x[r] += differ(2 * r, 2 * r + 1);
            }
            for r in 0..2 {
                next_y[r] += on_y[r];
                next_z[r] += on_z[r];
            }
            for t in self.patches[mask].triangles() {
                self.triangles[self.placed] = t.map(|e| ids[e as usize]);
                self.placed += 1;
            }
        });
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::volume::{DenseVolume, Placement, Region};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// Every edge has two triangles that run along it in opposite ways, and the triangles round
    /// every point form one fan.
    pub fn assert_closed_manifold(mesh: &Mesh) {
        let mut half_edges = BTreeMap::new();
        let mut after: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
        for t in &mesh.triangles {
            for i in 0..3 {
                let (a, b, c) = (t[i], t[(i + 1) % 3], t[(i + 2) % 3]);
                assert_ne!(a, b);
                *half_edges.entry((a, b)).or_insert(0) += 1;
                assert!(after.entry(a).or_default().insert(b, c).is_none());
            }
        }
        for (&(a, b), &n) in &half_edges {
            assert_eq!(n, 1, "edge {a} {b}");
            assert!(half_edges.contains_key(&(b, a)), "edge {a} {b} is open");
        }
        assert_eq!(after.len(), mesh.points.len(), "a point has no triangle");
        for (point, ring) in after {
            let (&start, &(mut at)) = ring.iter().next().unwrap();
            let mut length = 1;
            while at != start {
                at = ring[&at];
                length += 1;
            }
            assert_eq!(length, ring.len(), "point {point} has several fans");
        }
    }

    fn mesh_of(dims: [usize; 3], samples: Vec<f32>, iso: f64, inside: Inside) -> Mesh {
        let volume = DenseVolume::new(dims, samples, Placement::default()).unwrap();
        let options = CubesOptions { iso, inside, open: false };
        marching_cubes(&volume, &options, &Run::default()).unwrap()
    }

    fn signed_volume(mesh: &Mesh) -> f64 {
        let six = |t: usize| {
            let [a, b, c] = mesh.corners(t).map(glam::DVec3::from_array);
            a.dot(b.cross(c))
        };
        (0..mesh.triangles.len()).map(six).sum::<f64>() / 6.0
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(64))]

        #[test]
        fn noise_gives_closed_manifolds(
            dims in (1usize..9, 1usize..9, 1usize..80),
            seed in any::<u64>(),
            levels in 2u64..6,
            below in any::<bool>(),
        ) {
            let (x, y, z) = dims;
            let mut state = seed;
            let samples = (0..x * y * z).map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                ((state >> 33) % levels) as f32
            });
            let inside = if below { Inside::Below } else { Inside::Above };
            // Samples often equal the isovalue.
            let mesh = mesh_of([x, y, z], samples.collect(), 1.0, inside);
            assert_closed_manifold(&mesh);
            prop_assert!(signed_volume(&mesh) >= 0.0);
        }
    }

    #[test]
    fn a_single_sample_becomes_an_octahedron() {
        let mesh = mesh_of([1; 3], vec![1.0], 0.5, Inside::Above);
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (6, 8));
        assert!((signed_volume(&mesh) - 1.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn mirrored_placements_keep_the_outside_out() {
        let placement = Placement {
            axes: [[-2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            ..Placement::default()
        };
        let volume = DenseVolume::new([2; 3], vec![1u8; 8], placement).unwrap();
        let options = CubesOptions { iso: 1.0, inside: Inside::Above, open: false };
        let mesh = marching_cubes(&volume, &options, &Run::default()).unwrap();
        assert_closed_manifold(&mesh);
        assert!(signed_volume(&mesh) > 1.0);
    }

    #[test]
    fn threads_do_not_change_a_byte() {
        let dims = [40, 30, 150];
        let samples: Vec<f32> = (0..dims.iter().product::<usize>())
            .map(|i| ((i as f32 * 0.37).sin() * 3.0 + (i as f32 * 0.011).cos()).fract())
            .collect();
        let meshes = [1, 2, 3, 8].map(|threads| {
            par::with_threads(threads, || mesh_of(dims, samples.clone(), 0.3, Inside::Above))
        });
        assert!(meshes[0].triangles.len() > 10_000);
        assert!(meshes.windows(2).all(|m| m[0] == m[1]));
    }

    #[test]
    fn flat_volumes_have_no_open_surface() {
        for dims in [[1, 5, 5], [5, 1, 5], [5, 5, 1]] {
            let samples = (0..25).map(|i| (i % 3) as f32).collect();
            let volume = DenseVolume::new(dims, samples, Placement::default()).unwrap();
            let options = CubesOptions { iso: 0.5, inside: Inside::Above, open: true };
            let mesh = marching_cubes(&volume, &options, &Run::default()).unwrap();
            assert!(mesh.points.is_empty() && mesh.triangles.is_empty(), "{dims:?}");
        }
    }

    #[test]
    fn bounds_spare_slabs_and_change_nothing() {
        let field = crate::samples::Sample::Torus.volume(80).unwrap();
        let samples = field.read(Region::all(field.dims())).unwrap();
        let samples = (0..samples.len()).map(|i| samples.value(i) as f32).collect();
        let dense = DenseVolume::new(field.dims(), samples, field.placement()).unwrap();
        let options = CubesOptions { iso: 0.0, inside: Inside::Below, open: false };
        let [pruned, whole] = [&field as &dyn Volume, &dense]
            .map(|v| marching_cubes(v, &options, &Run::default()).unwrap());
        assert!(pruned == whole && !whole.triangles.is_empty());
    }

    #[test]
    fn open_borders_stay_open() {
        let volume = DenseVolume::new([3; 3], vec![1f32; 27], Placement::default()).unwrap();
        let options = CubesOptions { iso: 0.5, inside: Inside::Above, open: true };
        assert!(marching_cubes(&volume, &options, &Run::default()).unwrap().triangles.is_empty());
        // A plane across the volume ends at its border: a square of four cells, no cap.
        let samples = (0..27).map(|i| if i < 9 { 1f32 } else { 0.0 }).collect();
        let volume = DenseVolume::new([3; 3], samples, Placement::default()).unwrap();
        let mesh = marching_cubes(&volume, &options, &Run::default()).unwrap();
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (9, 8));
    }

    #[test]
    fn samples_that_are_not_numbers_stay_outside() {
        for inside in [Inside::Above, Inside::Below] {
            let mut samples = vec![f32::NAN; 64];
            samples[21] = if inside == Inside::Above { 2.0 } else { -2.0 };
            let mesh = mesh_of([4; 3], samples, 0.0, inside);
            assert_closed_manifold(&mesh);
            assert_eq!(mesh.triangles.len(), 8);
            assert!(mesh.check().is_ok());
        }
    }
}

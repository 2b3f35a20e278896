//! Marching cubes, streamed over slabs of samples.
//!
//! Rows of samples become rows of bits; all that follows (mixed cells, crossings, the number of
//! every vertex) is read off whole words. A slab of layers is one unit of parallel work and holds
//! two layers of bits at a time. Vertices are numbered in the order in which a slab meets them,
//! layer by layer; the vertices on a slab's last layer are the first of the next slab, so slabs
//! join by adding offsets and the result is the same for any number of threads.
//!
//! Source: Lorensen and Cline 1987; edge-based numbering after Schroeder, Maynard, Geveci 2015
//! (Flying Edges), here with bits in place of edge cases.
//!
//! The surface is closed, oriented and 2-manifold, unless the border was asked to stay open: see
//! [`super::cell`]. Vertices keep 1/1024 of an edge from both ends, so that no two coincide.

use super::cell::{PATCHES, Patch};
use crate::bits;
use crate::mesh::Mesh;
use crate::par;
use crate::run::Run;
use crate::volume::{Placement, Region, Scalar, Volume, VolumeError};
use crate::with_samples;

/// Layers of cells in one unit of work.
const SLAB: usize = 32;

/// Least distance of a vertex from the ends of its edge, as a share of the edge.
const MARGIN: f64 = 1.0 / 1024.0;

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
    let frame = Frame::new(volume, options.open);
    let slabs = par::blocks(run, frame.cells(2), SLAB, |layers| {
        let last = layers.end == frame.cells(2);
        let real = frame.real_layers(layers.start, layers.end + 1);
        let block = volume.read(Region {
            start: [0, 0, real.start],
            end: [frame.dims[0], frame.dims[1], real.end],
        })?;
        Ok(with_samples!(&block, samples => {
            Slab::new(&frame, options, volume.is_binary(), samples, real.start)
                .march(layers, last)
        }))
    })?;
    let slabs = slabs.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
    join(slabs, volume.placement())
}

/// Adds up the slabs' numbers and puts their parts one after the other.
fn join(slabs: Vec<Part>, placement: Placement) -> Result<Mesh, VolumeError> {
    let mut starts = Vec::with_capacity(slabs.len());
    let mut total = 0u32;
    for slab in &slabs {
        starts.push(total);
        let count = u32::try_from(slab.points.len()).ok();
        let sum = count.and_then(|n| total.checked_add(n));
        total = sum.filter(|&t| t < u32::MAX).ok_or(VolumeError::TooManyPoints)?;
    }
    let (points, triangles): (Vec<_>, Vec<_>) =
        slabs.into_iter().map(|s| (s.points, s.triangles)).unzip();
    Ok(Mesh {
        points: par::concat(&points, |_, &p| p),
        triangles: par::concat(&triangles, |slab, t| t.map(|p| p + starts[slab])),
        unit: placement.unit,
        ..Mesh::default()
    })
}

/// The lattice of samples with its optional ring of outside samples.
struct Frame {
    /// Real samples.
    dims: [usize; 3],
    /// 1 where a ring of outside samples closes the border, else 0.
    pad: usize,
    placement: Placement,
    patches: [Patch; 256],
}

impl Frame {
    fn new(volume: &dyn Volume, open: bool) -> Self {
        let placement = volume.placement();
        let mut patches = *PATCHES;
        if placement.determinant() < 0.0 {
            patches.iter_mut().for_each(Patch::reverse);
        }
        Self { dims: volume.dims(), pad: usize::from(!open), placement, patches }
    }

    /// Lattice points along `axis`, ring included.
    fn points(&self, axis: usize) -> usize {
        self.dims[axis] + 2 * self.pad
    }

    /// Cells along `axis`.
    fn cells(&self, axis: usize) -> usize {
        if self.dims.contains(&0) { 0 } else { self.points(axis).saturating_sub(1) }
    }

    /// The real sample behind lattice index `i`; `None` in the ring.
    fn real(&self, i: usize, axis: usize) -> Option<usize> {
        i.checked_sub(self.pad).filter(|&r| r < self.dims[axis])
    }

    /// Real layers behind lattice layers `start..end`.
    fn real_layers(&self, start: usize, end: usize) -> std::ops::Range<usize> {
        start.saturating_sub(self.pad)..(end - self.pad).min(self.dims[2])
    }
}

/// What one slab gives: points, and triangles on them and on the first points of the next slab.
#[derive(Default)]
struct Part {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// One layer of lattice points: its bits, and the number of the first vertex on each row's edges.
struct Layer {
    bits: Vec<u64>,
    first_x: Vec<u32>,
    first_y: Vec<u32>,
}

impl Layer {
    fn row(&self, y: usize, words: usize) -> &[u64] {
        &self.bits[y * words..(y + 1) * words]
    }
}

struct Slab<'a, T> {
    frame: &'a Frame,
    samples: &'a [T],
    /// The real layer that `samples` begins with.
    first_layer: usize,
    threshold: Option<T>,
    options: &'a CubesOptions,
    binary: bool,
    words: usize,
    part: Part,
    /// Number of the next vertex; runs on past `part.points` on the next slab's first layer.
    next: u32,
}

impl<'a, T: Scalar> Slab<'a, T> {
    fn new(
        frame: &'a Frame,
        options: &'a CubesOptions,
        binary: bool,
        samples: &'a [T],
        first_layer: usize,
    ) -> Self {
        let iso = if binary { 0.5 } else { options.iso };
        Self {
            frame,
            samples,
            first_layer,
            threshold: bits::at_least(iso),
            options,
            binary,
            words: bits::words(frame.points(0)),
            part: Part::default(),
            next: 0,
        }
    }

    fn march(mut self, layers: std::ops::Range<usize>, last: bool) -> Part {
        let rows = self.frame.points(1);
        let new = || Layer {
            bits: vec![0; rows * self.words],
            first_x: vec![0; rows],
            first_y: vec![0; rows],
        };
        let (mut low, mut high) = (new(), new());
        let mut first_z = vec![0; rows];
        self.pack(layers.start, &mut low.bits);
        self.number_layer(layers.start, &mut low, true);
        for z in layers.clone() {
            self.pack(z + 1, &mut high.bits);
            self.number_verticals(z, &low, &high, &mut first_z);
            let own = z + 1 < layers.end || last;
            self.number_layer(z + 1, &mut high, own);
            for y in 0..self.frame.cells(1) {
                self.cells(y, &low, &high, &first_z);
            }
            std::mem::swap(&mut low, &mut high);
        }
        self.part
    }

    /// Packs lattice layer `z`.
    fn pack(&self, z: usize, layer: &mut [u64]) {
        let (frame, words) = (self.frame, self.words);
        let Some(z) = frame.real(z, 2) else {
            return layer.fill(0);
        };
        for (y, row) in layer.chunks_exact_mut(words).enumerate() {
            let Some(y) = frame.real(y, 1) else {
                row.fill(0);
                continue;
            };
            let first = self.sample(0, y, z);
            let samples = &self.samples[first..first + frame.dims[0]];
            // Samples that are not a number are outside in every case.
            match (self.options.inside, self.threshold) {
                (Inside::Above, Some(t)) => bits::pack(samples, |s| s >= t, frame.pad, row),
                (Inside::Above, None) => row.fill(0),
                (Inside::Below, Some(t)) => bits::pack(samples, |s| s < t, frame.pad, row),
                (Inside::Below, None) => {
                    bits::pack(samples, |s| !s.to_f64().is_nan(), frame.pad, row);
                }
            }
        }
    }

    fn sample(&self, x: usize, y: usize, z: usize) -> usize {
        ((z - self.first_layer) * self.frame.dims[1] + y) * self.frame.dims[0] + x
    }

    /// Numbers the vertices on the x and y edges of layer `z`, and makes those that are `own`.
    fn number_layer(&mut self, z: usize, layer: &mut Layer, own: bool) {
        let (rows, words) = (self.frame.points(1), self.words);
        for y in 0..rows {
            layer.first_x[y] = self.next;
            for w in 0..words {
                let row = layer.row(y, words);
                let crossed = (row[w] ^ bits::next(row, w)) & bits::below(self.frame.cells(0), w);
                self.make(crossed, w, y, z, 0, own);
            }
            layer.first_y[y] = self.next;
            if y + 1 < rows {
                for w in 0..words {
                    let crossed = layer.row(y, words)[w] ^ layer.row(y + 1, words)[w];
                    self.make(crossed, w, y, z, 1, own);
                }
            }
        }
    }

    /// Numbers and makes the vertices on the z edges between two layers.
    fn number_verticals(&mut self, z: usize, low: &Layer, high: &Layer, first_z: &mut [u32]) {
        let words = self.words;
        for y in 0..self.frame.points(1) {
            first_z[y] = self.next;
            for w in 0..words {
                self.make(low.bits[y * words + w] ^ high.bits[y * words + w], w, y, z, 2, true);
            }
        }
    }

    /// Makes a vertex for every set bit of `crossed`.
    fn make(&mut self, crossed: u64, word: usize, y: usize, z: usize, axis: usize, own: bool) {
        if crossed == 0 {
            return;
        }
        self.next += crossed.count_ones();
        if own {
            bits::ones(crossed, |bit| {
                let point = self.vertex([64 * word + bit, y, z], axis);
                self.part.points.push(point);
            });
        }
    }

    /// World position of the crossing on the lattice edge that leaves `low` along `axis`.
    fn vertex(&self, low: [usize; 3], axis: usize) -> [f64; 3] {
        let mut high = low;
        high[axis] += 1;
        let share = match (self.value(low), self.value(high)) {
            (Some(a), Some(b)) if !self.binary => {
                let t = (self.options.iso - a) / (b - a);
                // Not a number where a sample is not one.
                if t.is_nan() { 0.5 } else { t.clamp(MARGIN, 1.0 - MARGIN) }
            }
            _ => 0.5,
        };
        let pad = self.frame.pad as f64;
        let mut index = low.map(|i| i as f64 - pad);
        index[axis] += share;
        self.frame.placement.place(index)
    }

    /// The sample at a lattice point; `None` in the ring.
    fn value(&self, [x, y, z]: [usize; 3]) -> Option<f64> {
        let f = self.frame;
        let at = self.sample(f.real(x, 0)?, f.real(y, 1)?, f.real(z, 2)?);
        Some(self.samples[at].to_f64())
    }

    /// Makes the triangles of the mixed cells in row `y` between two layers.
    fn cells(&mut self, y: usize, low: &Layer, high: &Layer, first_z: &[u32]) {
        let words = self.words;
        let rows =
            [low.row(y, words), low.row(y + 1, words), high.row(y, words), high.row(y + 1, words)];
        // Number of the next vertex on each of the eight rows of edges beside the cells.
        let mut next_x = [low.first_x[y], low.first_x[y + 1], high.first_x[y], high.first_x[y + 1]];
        let mut next_y = [low.first_y[y], high.first_y[y]];
        let mut next_z = [first_z[y], first_z[y + 1]];
        for w in 0..words {
            let here = rows.map(|r| r[w]);
            let beside = rows.map(|r| bits::next(r, w));
            let any = here.iter().chain(&beside).fold(0, |a, b| a | b);
            let all = here.iter().chain(&beside).fold(!0, |a, b| a & b);
            let mixed = any & !all & bits::below(self.frame.cells(0), w);
            bits::ones(mixed, |bit| {
                let mask = (0..4).fold(0, |m, r| {
                    m | (here[r] >> bit & 1) << (2 * r) | (beside[r] >> bit & 1) << (2 * r + 1)
                }) as usize;
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
                let triangles = self.frame.patches[mask].triangles();
                self.part.triangles.extend(triangles.iter().map(|t| t.map(|e| ids[e as usize])));
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::DenseVolume;
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
        #![proptest_config(ProptestConfig::with_cases(64))]

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
    fn open_borders_stay_open() {
        let volume = DenseVolume::new([3; 3], vec![1f32; 27], Placement::default()).unwrap();
        let options = CubesOptions { iso: 0.5, inside: Inside::Above, open: true };
        assert!(marching_cubes(&volume, &options, &Run::default()).unwrap().triangles.is_empty());
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

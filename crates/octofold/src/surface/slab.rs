//! Slabs of a volume's sample lattice as rows of bits: what all methods read their cells from.
//!
//! Rows of samples become rows of bits; mixed cells and crossed edges are read off whole words. A
//! ring of outside samples closes the border, unless it was asked to stay open.

use super::cell::PATCHES;
use super::cubes::{CubesOptions, Inside};
use crate::bits;
use crate::volume::{Placement, Region, Scalar, Volume, VolumeError};
use crate::with_samples;
use std::ops::Range;

/// Least distance of a vertex from the ends of its edge, as a share of the edge.
pub(super) const MARGIN: f64 = 1.0 / 1024.0;

/// Where the isosurface cuts an edge between two samples, as a share of the edge from the first.
pub(super) fn share(iso: f64, from: f64, to: f64) -> f32 {
    let share = (iso - from) / (to - from);
    // Not a number where a sample is not one.
    if share.is_nan() { 0.5 } else { share.clamp(MARGIN, 1.0 - MARGIN) as f32 }
}

/// The lattice of samples with its optional ring of outside samples.
pub(super) struct Frame<'a> {
    options: &'a CubesOptions,
    /// Real samples.
    dims: [usize; 3],
    /// 1 where a ring of outside samples closes the border, else 0.
    pub pad: usize,
    pub placement: Placement,
    pub binary: bool,
}

impl<'a> Frame<'a> {
    pub fn new(volume: &dyn Volume, options: &'a CubesOptions) -> Self {
        Self {
            options,
            dims: volume.dims(),
            pad: usize::from(!options.open),
            placement: volume.placement(),
            binary: volume.is_binary(),
        }
    }

    /// Lattice points along `axis`, ring included.
    pub fn points(&self, axis: usize) -> usize {
        self.dims[axis] + 2 * self.pad
    }

    /// Words in a row of lattice points.
    pub fn words(&self) -> usize {
        bits::words(self.points(0))
    }

    /// Cells along `axis`.
    pub fn cells(&self, axis: usize) -> usize {
        let empty = self.dims.contains(&0) || (0..3).any(|a| self.points(a) < 2);
        if empty { 0 } else { self.points(axis) - 1 }
    }

    /// The real sample behind lattice index `i`; `None` in the ring.
    fn real(&self, i: usize, axis: usize) -> Option<usize> {
        i.checked_sub(self.pad).filter(|&r| r < self.dims[axis])
    }

    /// Reads the samples of a range of cell layers and makes their slab, counted.
    pub fn slab(&self, volume: &dyn Volume, layers: Range<usize>) -> Result<Slab, VolumeError> {
        let Some(region) = self.region(volume, &layers) else {
            return Ok(self.empty_slab(layers));
        };
        if let Some(bits) = self.pack_runs(volume, &layers) {
            let mut slab = self.new_slab(layers, bits);
            slab.count();
            return Ok(slab);
        }
        let block = volume.read(region)?;
        let first = region.start[2];
        Ok(with_samples!(&block, samples => {
            let mut slab = self.new_slab(layers.clone(), self.pack(samples, first, &layers));
            slab.count();
            if !self.binary {
                slab.shares = self.shares(&slab, samples, first);
            }
            slab
        }))
    }

    /// Calls `work` with the slab of a range of cell layers, not counted, and with the share of
    /// the edge between two lattice points at which the isosurface cuts it.
    pub fn with_slab<R>(
        &self,
        volume: &dyn Volume,
        layers: Range<usize>,
        work: impl FnOnce(&Slab, &dyn Fn([[usize; 3]; 2]) -> f32) -> R,
    ) -> Result<R, VolumeError> {
        let Some(region) = self.region(volume, &layers) else {
            return Ok(work(&self.empty_slab(layers), &|_| 0.5));
        };
        if let Some(bits) = self.pack_runs(volume, &layers) {
            return Ok(work(&self.new_slab(layers, bits), &|_| 0.5));
        }
        let block = volume.read(region)?;
        let first = region.start[2];
        let [nx, ny, _] = self.dims;
        Ok(with_samples!(&block, samples => {
            let slab = self.new_slab(layers.clone(), self.pack(samples, first, &layers));
            let value = |[x, y, z]: [usize; 3]| {
                let (x, y, z) = (self.real(x, 0)?, self.real(y, 1)?, self.real(z, 2)?);
                Some(samples[((z - first) * ny + y) * nx + x].to_f64())
            };
            work(&slab, &|[low, high]| self.share(value(low), value(high)))
        }))
    }

    /// The samples that a range of cell layers needs; `None` where all of them are known to be
    /// outside.
    fn region(&self, volume: &dyn Volume, layers: &Range<usize>) -> Option<Region> {
        let first = layers.start.saturating_sub(self.pad);
        let end = (layers.end + 1 - self.pad).min(self.dims[2]);
        let region = Region { start: [0, 0, first], end: [self.dims[0], self.dims[1], end] };
        (!volume.bounds(region).is_some_and(|b| self.is_outside(b))).then_some(region)
    }

    fn empty_slab(&self, layers: Range<usize>) -> Slab {
        let bits = self.no_bits(&layers);
        self.new_slab(layers, bits)
    }

    /// [`share`] of values of which one may lie in the ring: there, in the middle.
    fn share(&self, low: Option<f64>, high: Option<f64>) -> f32 {
        low.zip(high).map_or(0.5, |(a, b)| share(self.options.iso, a, b))
    }

    fn new_slab(&self, layers: Range<usize>, bits: Vec<u64>) -> Slab {
        Slab {
            rows: self.points(1),
            cells: self.cells(0),
            top: self.cells(2),
            layers,
            bits,
            shares: Vec::new(),
            points: 0,
            triangles: 0,
        }
    }

    /// The bits of lattice layers `layers.start..=layers.end` where nothing is inside.
    fn no_bits(&self, layers: &Range<usize>) -> Vec<u64> {
        vec![0; (layers.len() + 1) * self.points(1) * self.words()]
    }

    fn iso(&self) -> f64 {
        if self.binary { 0.5 } else { self.options.iso }
    }

    /// True where no value between two bounds is inside.
    fn is_outside(&self, [least, most]: [f64; 2]) -> bool {
        match self.options.inside {
            Inside::Above => most < self.iso(),
            Inside::Below => least >= self.iso(),
        }
    }

    /// Where the isosurface cuts each crossed edge, as a share of the edge from its low end.
    fn shares<T: Scalar>(&self, slab: &Slab, samples: &[T], first: usize) -> Vec<f32> {
        let [nx, ny, _] = self.dims;
        let mut shares = Vec::with_capacity(slab.points);
        slab.own_edges(|axis, y, z, word, crossed| {
            let mut high = [y, z];
            if let Some(other) = axis.checked_sub(1) {
                high[other] += 1;
            }
            // First sample of a lattice row; `None` in the ring.
            let row = |y: usize, z: usize| {
                Some(((self.real(z, 2)? - first) * ny + self.real(y, 1)?) * nx)
            };
            let (low, high) = (row(y, z), row(high[0], high[1]));
            let step = usize::from(axis == 0);
            bits::ones(crossed, |bit| {
                let x = 64 * word + bit;
                let value = |row: Option<usize>, x| Some(samples[row? + self.real(x, 0)?].to_f64());
                shares.push(self.share(value(low, x), value(high, x + step)));
            });
        });
        shares
    }

    /// The bits of lattice layers `layers.start..=layers.end` of a solid that is kept as runs: no
    /// sample is made.
    fn pack_runs(&self, volume: &dyn Volume, layers: &Range<usize>) -> Option<Vec<u64>> {
        if !self.binary || self.options.inside != Inside::Above {
            return None;
        }
        let (rows, words) = (self.points(1), self.words());
        let mut packed = self.no_bits(layers);
        for (r, row) in packed.chunks_exact_mut(words).enumerate() {
            let (y, z) = (self.real(r % rows, 1), self.real(layers.start + r / rows, 2));
            let (Some(y), Some(z)) = (y, z) else { continue };
            for run in volume.runs(y, z)? {
                let [start, end] = run.map(|x| x as usize + self.pad);
                bits::set(row, start, end);
            }
        }
        Some(packed)
    }

    /// The bits of lattice layers `layers.start..=layers.end`; `samples` begin with layer `first`.
    fn pack<T: Scalar>(&self, samples: &[T], first: usize, layers: &Range<usize>) -> Vec<u64> {
        let [nx, ny, _] = self.dims;
        let (rows, words) = (self.points(1), self.words());
        let threshold = bits::at_least::<T>(self.iso());
        let mut packed = self.no_bits(layers);
        for (r, row) in packed.chunks_exact_mut(words).enumerate() {
            let (Some(y), Some(z)) =
                (self.real(r % rows, 1), self.real(layers.start + r / rows, 2))
            else {
                continue;
            };
            let start = ((z - first) * ny + y) * nx;
            let samples = &samples[start..start + nx];
            // Samples that are not a number are outside in every case.
            match (self.options.inside, threshold) {
                (Inside::Above, Some(t)) => bits::pack(samples, |s| s >= t, self.pad, row),
                (Inside::Above, None) => {}
                (Inside::Below, Some(t)) => bits::pack(samples, |s| s < t, self.pad, row),
                (Inside::Below, None) => {
                    bits::pack(samples, |s| !s.to_f64().is_nan(), self.pad, row);
                }
            }
        }
        packed
    }
}

/// A range of cell layers, with all that is needed to mesh it without its samples.
pub(super) struct Slab {
    /// Rows of lattice points in a layer.
    pub rows: usize,
    /// Cells in a row.
    pub cells: usize,
    /// The last lattice layer of all.
    pub top: usize,
    pub layers: Range<usize>,
    /// Inside bits of lattice layers `layers.start..=layers.end`.
    pub bits: Vec<u64>,
    /// For each own vertex, its place on its edge; empty where all are in the middle.
    pub shares: Vec<f32>,
    pub points: usize,
    pub triangles: usize,
}

impl Slab {
    pub fn row(&self, y: usize, z: usize) -> &[u64] {
        let words = self.bits.len() / ((self.layers.len() + 1) * self.rows);
        let row = (z - self.layers.start) * self.rows + y;
        &self.bits[row * words..(row + 1) * words]
    }

    /// Whether the slab makes the vertices on the x and y edges of lattice layer `z`; those on its
    /// last layer are the next slab's.
    pub fn owns(&self, z: usize) -> bool {
        z < self.layers.end || z == self.top
    }

    fn count(&mut self) {
        let (mut points, mut triangles) = (0, 0);
        self.own_edges(|_, _, _, _, crossed| points += crossed.count_ones() as usize);
        for z in self.layers.clone() {
            for y in 0..self.rows - 1 {
                self.mixed(y, z, |_, mask| triangles += PATCHES[mask].triangles().len());
            }
        }
        (self.points, self.triangles) = (points, triangles);
    }

    /// Calls `visit` with axis, row, layer, word and bits of all own crossed edges, in the order
    /// of their vertices.
    pub fn own_edges(&self, mut visit: impl FnMut(usize, usize, usize, usize, u64)) {
        for z in self.layers.start..=self.layers.end {
            if self.owns(z) {
                for y in 0..self.rows {
                    for axis in 0..2 {
                        self.crossed(axis, y, z, |word, bits| visit(axis, y, z, word, bits));
                    }
                }
            }
            if z < self.layers.end {
                for y in 0..self.rows {
                    self.crossed(2, y, z, |word, bits| visit(2, y, z, word, bits));
                }
            }
        }
    }

    /// Calls `visit` with each word of edges along `axis` that leave row `y` of layer `z` and
    /// are crossed somewhere: its place in the row, and a bit for every crossed edge.
    pub fn crossed(&self, axis: usize, y: usize, z: usize, mut visit: impl FnMut(usize, u64)) {
        let row = self.row(y, z);
        let other = match axis {
            1 if y + 1 == self.rows => return,
            1 => self.row(y + 1, z),
            2 => self.row(y, z + 1),
            _ => row,
        };
        for w in 0..row.len() {
            let crossed = if axis == 0 {
                (row[w] ^ bits::next(row, w)) & bits::below(self.cells, w)
            } else {
                row[w] ^ other[w]
            };
            if crossed != 0 {
                visit(w, crossed);
            }
        }
    }

    /// Calls `visit` with place and mask of each mixed cell in row `y` above layer `z`.
    pub fn mixed(&self, y: usize, z: usize, mut visit: impl FnMut(usize, usize)) {
        let rows = [self.row(y, z), self.row(y + 1, z), self.row(y, z + 1), self.row(y + 1, z + 1)];
        for w in 0..rows[0].len() {
            let here = rows.map(|r| r[w]);
            let beside = rows.map(|r| bits::next(r, w));
            let any = here.iter().chain(&beside).fold(0, |a, b| a | b);
            let all = here.iter().chain(&beside).fold(!0, |a, b| a & b);
            bits::ones(any & !all & bits::below(self.cells, w), |bit| {
                let mask = (0..4).fold(0, |m, r| {
                    m | (here[r] >> bit & 1) << (2 * r) | (beside[r] >> bit & 1) << (2 * r + 1)
                });
                visit(64 * w + bit, mask as usize);
            });
        }
    }
}

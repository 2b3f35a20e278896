//! Where labels change: edges between samples of different labels, found by comparing rows as words,
//! and faces on which three labels or more meet.

use crate::bits;
use crate::volume::Scalar;
use std::ops::Range;

/// Samples with a ring of background, 0, round them.
pub struct Lattice<'a, T> {
    /// Real samples along x, y and z.
    pub dims: [usize; 3],
    samples: &'a [T],
    first: usize,
    background: Vec<T>,
}

impl<'a, T: Scalar + Into<u32>> Lattice<'a, T> {
    /// The lattice of a volume of `dims` samples, of which `samples` are there, from layer `first`
    /// on.
    pub fn new(dims: [usize; 3], samples: &'a [T], first: usize) -> Self {
        Self { dims, samples, first, background: vec![T::default(); dims[0]] }
    }

    /// The real samples of a lattice row.
    pub fn row(&self, y: usize, z: usize) -> &[T] {
        let [nx, ny, nz] = self.dims;
        match (y.checked_sub(1), z.checked_sub(1)) {
            (Some(y), Some(z)) if y < ny && z < nz => {
                let first = ((z - self.first) * ny + y) * nx;
                &self.samples[first..first + nx]
            }
            _ => &self.background,
        }
    }

    /// The label at a lattice point.
    fn label(&self, [x, y, z]: [usize; 3]) -> u32 {
        let row = self.row(y, z);
        x.checked_sub(1).and_then(|x| row.get(x)).map_or(0, |&s| s.into())
    }
}

/// A bit for every lattice point of some layers.
pub struct Grid {
    words: usize,
    rows: usize,
    bits: Vec<u64>,
}

impl Grid {
    /// The bits of a row of a layer, the slab's first layer being 0.
    pub fn row(&self, y: usize, layer: usize) -> &[u64] {
        let first = (layer * self.rows + y) * self.words;
        &self.bits[first..first + self.words]
    }

    fn row_mut(&mut self, y: usize, layer: usize) -> &mut [u64] {
        let first = (layer * self.rows + y) * self.words;
        &mut self.bits[first..first + self.words]
    }
}

/// The crossed edges of a slab, and the faces on which three labels or more meet, each by its low
/// corner.
pub struct Crossings {
    /// Layers of cells.
    pub layers: Range<usize>,
    /// Words in a row.
    pub words: usize,
    /// Lattice rows in a layer.
    pub rows: usize,
    /// Edges along each axis.
    pub edges: [Grid; 3],
    /// Faces across each axis.
    pub faces: [Grid; 3],
}

impl Crossings {
    /// Compares the rows of some layers of cells.
    pub fn of<T: Scalar + Into<u32>>(lattice: &Lattice<'_, T>, layers: Range<usize>) -> Self {
        let [nx, ny, _] = lattice.dims;
        let (words, rows) = (bits::words(nx + 2), ny + 2);
        let grid = |layers| Grid { words, rows, bits: vec![0; words * rows * layers] };
        let (between, on) = (layers.len(), layers.len() + 1);
        let mut all = Self {
            words,
            rows,
            edges: [grid(on), grid(on), grid(between)],
            faces: [grid(between), grid(between), grid(on)],
            layers: layers.clone(),
        };
        for z in layers.start..=layers.end {
            let layer = z - layers.start;
            for y in 0..rows {
                let row = lattice.row(y, z);
                let along = all.edges[0].row_mut(y, layer);
                bits::pack_unequal(&row[..nx - 1], &row[1..], 1, along);
                for (x, end) in [(0, 0), (nx, nx - 1)] {
                    along[x / 64] |= u64::from(row[end] != T::default()) << (x % 64);
                }
                if y + 1 < rows {
                    let across = all.edges[1].row_mut(y, layer);
                    bits::pack_unequal(row, lattice.row(y + 1, z), 1, across);
                }
                if z < layers.end {
                    let up = all.edges[2].row_mut(y, layer);
                    bits::pack_unequal(row, lattice.row(y, z + 1), 1, up);
                }
            }
        }
        all.find_junctions(lattice);
        all
    }

    /// Three crossed edges or more, and no label across a diagonal.
    fn find_junctions<T: Scalar + Into<u32>>(&mut self, lattice: &Lattice<'_, T>) {
        let Self { layers, words, rows, edges: [x, y, z], faces: [fx, fy, fz], .. } = self;
        let differ = |p: [usize; 3], axis: usize| {
            let step = |p: [usize; 3], a: usize| {
                let mut q = p;
                q[a] += 1;
                lattice.label(q)
            };
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut far = p;
            (far[u], far[v]) = (far[u] + 1, far[v] + 1);
            lattice.label(p) != lattice.label(far) && step(p, u) != step(p, v)
        };
        for layer in 0..=layers.len() {
            let high = layers.start + layer;
            for row in 0..*rows {
                for w in 0..*words {
                    // Both edges along one axis of the face, then both along the other.
                    let mark = |grid: &mut Grid, axis: usize, [a, b, c, d]: [u64; 4]| {
                        let three = a & b & (c | d) | c & d & (a | b);
                        let mut found = three;
                        bits::ones(a & b & c & d, |bit| {
                            if !differ([64 * w + bit, row, high], axis) {
                                found &= !(1 << bit);
                            }
                        });
                        if found != 0 {
                            grid.row_mut(row, layer)[w] = found;
                        }
                    };
                    let beside = |grid: &Grid| {
                        let row = grid.row(row, layer);
                        [row[w], bits::next(row, w)]
                    };
                    if row + 1 < *rows {
                        let [c, d] = beside(y);
                        mark(fz, 2, [x.row(row, layer)[w], x.row(row + 1, layer)[w], c, d]);
                    }
                    if layer == layers.len() {
                        continue;
                    }
                    let [c, d] = beside(z);
                    mark(fy, 1, [x.row(row, layer)[w], x.row(row, layer + 1)[w], c, d]);
                    if row + 1 < *rows {
                        let [a, b] = [y.row(row, layer)[w], y.row(row, layer + 1)[w]];
                        mark(fx, 0, [a, b, z.row(row, layer)[w], z.row(row + 1, layer)[w]]);
                    }
                }
            }
        }
    }
}

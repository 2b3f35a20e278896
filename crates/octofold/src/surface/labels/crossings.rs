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
    /// The last lattice layer of all.
    top: usize,
    /// Words in a row.
    pub words: usize,
    /// Lattice rows in a layer.
    pub rows: usize,
    /// Edges along each axis.
    pub edges: [Grid; 3],
    /// Faces across each axis.
    pub faces: [Grid; 3],
}

/// Up to 64 cells of a row, a bit for each.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    /// Not all corners hold the same label.
    pub mixed: u64,
    /// The crossed edges do not go with two labels.
    odd: u64,
    /// Corners that an odd number of crossed edges parts from the first.
    apart: [u64; 8],
    /// Edges along x at low y and z, high y, high z, and both high.
    pub on_x: [u64; 4],
    /// Edges along y at low z and high z, each at low x and high x.
    pub on_y: [[u64; 2]; 2],
    /// Edges along z at low y and high y, each at low x and high x.
    pub on_z: [[u64; 2]; 2],
}

/// The rows of edges round a row of cells, as in [`Cells`].
#[derive(Debug, Clone, Copy)]
pub struct RowOfCells<'a> {
    on_x: [&'a [u64]; 4],
    on_y: [&'a [u64]; 2],
    on_z: [&'a [u64]; 2],
}

impl RowOfCells<'_> {
    /// The cells of word `w`; `None` where none is mixed.
    #[inline]
    pub fn cells(&self, w: usize) -> Option<Cells> {
        let [a, b, c, d] = self.on_x;
        let on_x = [a[w], b[w], c[w], d[w]];
        let pair = |row: &[u64]| [row[w], bits::next(row, w)];
        let on_y = [pair(self.on_y[0]), pair(self.on_y[1])];
        let on_z = [pair(self.on_z[0]), pair(self.on_z[1])];
        let crossed = on_x.iter().chain(on_y.as_flattened()).chain(on_z.as_flattened());
        let mixed = crossed.fold(0, |all, word| all | word);
        if mixed == 0 {
            return None;
        }
        // Along the edges of a tree that reaches every corner; the other five edges must agree.
        let (c1, c2, c4) = (on_x[0], on_y[0][0], on_z[0][0]);
        let (c3, c5, c6) = (c2 ^ on_x[1], c4 ^ on_x[2], c4 ^ on_y[1][0]);
        let c7 = c6 ^ on_x[3];
        let odd = (c1 ^ c3 ^ on_y[0][1])
            | (c5 ^ c7 ^ on_y[1][1])
            | (c1 ^ c5 ^ on_z[0][1])
            | (c2 ^ c6 ^ on_z[1][0])
            | (c3 ^ c7 ^ on_z[1][1]);
        Some(Cells { mixed, odd, apart: [0, c1, c2, c3, c4, c5, c6, c7], on_x, on_y, on_z })
    }
}

impl Cells {
    /// Whether the crossed edges of a cell go with two labels.
    #[inline]
    pub fn is_even(&self, bit: usize) -> bool {
        self.odd >> bit & 1 == 0
    }

    /// The corners of a cell that an odd number of crossed edges parts from the first.
    #[inline]
    pub fn mask(&self, bit: usize) -> usize {
        (0..8).fold(0, |mask, c| mask | (self.apart[c] >> bit & 1) << c) as usize
    }
}

impl Crossings {
    /// Compares the rows of some layers of cells.
    pub fn of<T: Scalar + Into<u32>>(lattice: &Lattice<'_, T>, layers: Range<usize>) -> Self {
        let [nx, ny, nz] = lattice.dims;
        let (words, rows) = (bits::words(nx + 2), ny + 2);
        let grid = |layers| Grid { words, rows, bits: vec![0; words * rows * layers] };
        let (between, on) = (layers.len(), layers.len() + 1);
        let mut all = Self {
            top: nz + 1,
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

    /// Bytes for some layers of cells of a volume of `dims` samples.
    pub fn bytes([nx, ny, _]: [usize; 3], layers: usize) -> usize {
        6 * (layers + 1) * (ny + 2) * bits::words(nx + 2) * size_of::<u64>()
    }

    /// Whether the points on a lattice layer, the slab's first being 0, are the slab's own; those
    /// on its last layer are the next slab's.
    pub fn owns(&self, layer: usize) -> bool {
        layer < self.layers.len() || self.layers.end == self.top
    }

    /// How many points there are on own edges and faces.
    pub fn own_points(&self) -> usize {
        let grids = self.edges.iter().chain(&self.faces);
        grids
            .map(|grid| {
                let layers = grid.bits.chunks_exact(grid.words * grid.rows).enumerate();
                let own = layers.filter(|(layer, _)| self.owns(*layer)).flat_map(|(_, bits)| bits);
                own.map(|word| word.count_ones() as usize).sum::<usize>()
            })
            .sum()
    }

    /// Row and layer of every row of cells, the slab's first layer being 0.
    pub fn rows_of_cells(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let rows = self.rows - 1;
        (0..self.layers.len()).flat_map(move |layer| (0..rows).map(move |y| (y, layer)))
    }

    /// The samples of the four rows round a row of cells, in the order of the corners.
    pub fn samples<'a, T: Scalar + Into<u32>>(
        &self,
        lattice: &'a Lattice<'_, T>,
        y: usize,
        layer: usize,
    ) -> [&'a [T]; 4] {
        let z = self.layers.start + layer;
        [(y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)].map(|(y, z)| lattice.row(y, z))
    }

    /// The edges round a row of cells.
    pub fn row_of_cells(&self, y: usize, layer: usize) -> RowOfCells<'_> {
        let [x_edges, y_edges, z_edges] = &self.edges;
        RowOfCells {
            on_x: [
                x_edges.row(y, layer),
                x_edges.row(y + 1, layer),
                x_edges.row(y, layer + 1),
                x_edges.row(y + 1, layer + 1),
            ],
            on_y: [y_edges.row(y, layer), y_edges.row(y, layer + 1)],
            on_z: [z_edges.row(y, layer), z_edges.row(y + 1, layer)],
        }
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

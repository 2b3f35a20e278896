//! Where labels change: edges between samples of different labels, found by comparing rows as words,
//! and faces on which three labels or more meet.

use crate::bits;
use crate::volume::Scalar;

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

    /// Lattice rows in a layer.
    pub fn rows(&self) -> usize {
        self.dims[1] + 2
    }

    /// Words that hold a bit for every point of a lattice row.
    pub fn words(&self) -> usize {
        bits::words(self.dims[0] + 2)
    }

    /// Whether lattice layer `z` is the last one, so that no slab beyond has its points.
    pub fn is_top(&self, z: usize) -> bool {
        z == self.dims[2] + 1
    }

    /// The four rows round row `y` of the cells above layer `z`, in the order of the corners.
    pub fn rows_of_cells(&self, y: usize, z: usize) -> [&[T]; 4] {
        [(y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)].map(|(y, z)| self.row(y, z))
    }

    /// The label at a lattice point.
    fn label(&self, [x, y, z]: [usize; 3]) -> u32 {
        let row = self.row(y, z);
        x.checked_sub(1).and_then(|x| row.get(x)).map_or(0, |&s| s.into())
    }

    /// Whether both diagonals of the face across `axis` with low corner `p` part two labels.
    fn differ(&self, p: [usize; 3], axis: usize) -> bool {
        let corner = |u: usize, v: usize| {
            let mut at = p;
            at[(axis + 1) % 3] += u;
            at[(axis + 2) % 3] += v;
            self.label(at)
        };
        corner(0, 0) != corner(1, 1) && corner(1, 0) != corner(0, 1)
    }
}

/// Rows of bits, one for every lattice row of a layer.
pub struct Grid {
    words: usize,
    bits: Vec<u64>,
}

impl Grid {
    fn new(rows: usize, words: usize) -> Self {
        Self { words, bits: vec![0; rows * words] }
    }

    /// The bits of row `y`.
    pub fn row(&self, y: usize) -> &[u64] {
        &self.bits[y * self.words..][..self.words]
    }

    fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.bits[y * self.words..][..self.words]
    }

    fn count(&self) -> usize {
        let set = self.bits.iter().filter(|&&word| word != 0);
        set.map(|word| word.count_ones() as usize).sum()
    }
}

/// The crossed edges in a lattice layer, and the faces in it on which three labels or more meet,
/// each by its low corner.
pub struct Level {
    /// Edges along x and along y.
    pub edges: [Grid; 2],
    /// Faces across z.
    pub faces: Grid,
}

impl Level {
    /// How many points there are.
    pub fn points(&self) -> usize {
        self.edges.iter().chain([&self.faces]).map(Grid::count).sum()
    }
}

/// The crossed edges between a lattice layer and the next one, and the faces on which three labels
/// or more meet, each by its low corner.
pub struct Rise {
    /// Edges along z.
    pub edges: Grid,
    /// Faces across x and across y.
    pub faces: [Grid; 2],
}

impl Rise {
    /// How many points there are.
    pub fn points(&self) -> usize {
        self.faces.iter().chain([&self.edges]).map(Grid::count).sum()
    }
}

/// A layer of cells on its way up through the lattice.
pub struct Window<'a, T> {
    lattice: &'a Lattice<'a, T>,
    /// The lattice layer below.
    pub low: Level,
    /// The lattice layer above.
    pub high: Level,
    /// What is between the two.
    pub rise: Rise,
}

impl<'a, T: Scalar + Into<u32>> Window<'a, T> {
    /// The window below the cells above layer `z`: that layer is its high one.
    pub fn below(lattice: &'a Lattice<'a, T>, z: usize) -> Self {
        let grid = || Grid::new(lattice.rows(), lattice.words());
        let level = || Level { edges: [grid(), grid()], faces: grid() };
        let rise = Rise { edges: grid(), faces: [grid(), grid()] };
        let mut window = Self { lattice, low: level(), high: level(), rise };
        window.find_level(z);
        window
    }

    /// Goes up to the cells above layer `z`, which was the high one.
    pub fn raise(&mut self, z: usize) {
        std::mem::swap(&mut self.low, &mut self.high);
        self.find_level(z + 1);
        self.find_rise(z);
    }

    /// The edges round row `y` of the cells.
    pub fn row_of_cells(&self, y: usize) -> RowOfCells<'_> {
        let [low_x, low_y] = &self.low.edges;
        let [high_x, high_y] = &self.high.edges;
        let on_z = &self.rise.edges;
        RowOfCells {
            on_x: [low_x.row(y), low_x.row(y + 1), high_x.row(y), high_x.row(y + 1)],
            on_y: [low_y.row(y), high_y.row(y)],
            on_z: [on_z.row(y), on_z.row(y + 1)],
        }
    }

    fn find_level(&mut self, z: usize) {
        let Self { lattice, high: Level { edges: [along_x, along_y], faces }, .. } = self;
        let (nx, rows) = (lattice.dims[0], lattice.rows());
        for y in 0..rows {
            let row = lattice.row(y, z);
            let along = along_x.row_mut(y);
            bits::pack_unequal(&row[..nx - 1], &row[1..], 1, along);
            for (x, end) in [(0, 0), (nx, nx - 1)] {
                along[x / 64] |= u64::from(row[end] != T::default()) << (x % 64);
            }
            if y + 1 < rows {
                bits::pack_unequal(row, lattice.row(y + 1, z), 1, along_y.row_mut(y));
            }
        }
        for y in 0..rows - 1 {
            let across = along_y.row(y);
            let pairs = [[along_x.row(y), along_x.row(y + 1)], [across; 2]];
            find_junctions(lattice, pairs, 2, [y, z], faces.row_mut(y));
        }
    }

    fn find_rise(&mut self, z: usize) {
        let Self { lattice, low, high, rise: Rise { edges, faces: [across_x, across_y] } } = self;
        let rows = lattice.rows();
        for y in 0..rows {
            bits::pack_unequal(lattice.row(y, z), lattice.row(y, z + 1), 1, edges.row_mut(y));
        }
        for y in 0..rows {
            let on_x = [low.edges[0].row(y), high.edges[0].row(y)];
            find_junctions(lattice, [on_x, [edges.row(y); 2]], 1, [y, z], across_y.row_mut(y));
            if y + 1 < rows {
                let on_y = [low.edges[1].row(y), high.edges[1].row(y)];
                let on_z = [edges.row(y), edges.row(y + 1)];
                find_junctions(lattice, [on_y, on_z], 0, [y, z], across_x.row_mut(y));
            }
        }
    }
}

/// Marks the faces across `axis` in a row that have three crossed edges or more, and no label across
/// a diagonal. `edges`: both along one axis, then both along the other; where those are the same
/// row, one is a point further on.
fn find_junctions<T: Scalar + Into<u32>>(
    lattice: &Lattice<'_, T>,
    edges: [[&[u64]; 2]; 2],
    axis: usize,
    [y, z]: [usize; 2],
    found: &mut [u64],
) {
    let [[a, b], [c, d]] = edges.map(|pair| pair.map(|row| &row[..found.len()]));
    for w in 0..found.len() {
        let beside = if axis == 0 { d[w] } else { bits::next(d, w) };
        found[w] = a[w] & b[w] & (c[w] | beside) | c[w] & beside & (a[w] | b[w]);
    }
    for w in 0..found.len() {
        if found[w] == 0 {
            continue;
        }
        // A fourth crossed edge lets a label connect across a diagonal.
        let beside = if axis == 0 { d[w] } else { bits::next(d, w) };
        bits::ones(a[w] & b[w] & c[w] & beside, |bit| {
            if !lattice.differ([64 * w + bit, y, z], axis) {
                found[w] &= !(1 << bit);
            }
        });
    }
}

/// The rows of edges round a row of cells, as in [`Cells`].
#[derive(Debug, Clone, Copy)]
pub struct RowOfCells<'a> {
    on_x: [&'a [u64]; 4],
    on_y: [&'a [u64]; 2],
    on_z: [&'a [u64]; 2],
}

/// Up to 64 cells of a row, a bit for each.
#[derive(Debug, Clone, Copy)]
pub struct Cells {
    /// Two labels, and the corners of each hang together along edges: one loop parts them.
    pub simple: u64,
    /// Corners that an odd number of crossed edges parts from the first.
    apart: [u64; 8],
    /// Edges along x at low y and z, high y, high z, and both high.
    pub on_x: [u64; 4],
    /// Edges along y at low z and high z, each at low x and high x.
    pub on_y: [[u64; 2]; 2],
    /// Edges along z at low y and high y, each at low x and high x.
    pub on_z: [[u64; 2]; 2],
}

impl RowOfCells<'_> {
    /// Whether the corners of each cell of word `w` hold different labels.
    #[inline]
    pub fn mixed(&self, w: usize) -> u64 {
        let beside = |w: usize| {
            let [[a, b], [c, d]] = [self.on_y, self.on_z];
            if w < a.len() { a[w] | b[w] | c[w] | d[w] } else { 0 }
        };
        let (low, [a, b, c, d]) = (beside(w), self.on_x);
        a[w] | b[w] | c[w] | d[w] | low | low >> 1 | beside(w + 1) << 63
    }

    /// The cells of word `w`.
    #[inline]
    pub fn cells(&self, w: usize) -> Cells {
        let pair = |row: &[u64]| [row[w], bits::next(row, w)];
        Cells::new(self.on_x.map(|row| row[w]), self.on_y.map(pair), self.on_z.map(pair))
    }
}

impl Cells {
    fn new(on_x: [u64; 4], on_y: [[u64; 2]; 2], on_z: [[u64; 2]; 2]) -> Self {
        let ([x0, x1, x2, x3], [[y0, y1], [y2, y3]], [[z0, z1], [z2, z3]]) = (on_x, on_y, on_z);
        // Along the edges of a tree that reaches every corner; the other five edges must agree, or
        // there are more than two labels.
        let (c1, c2, c4) = (x0, y0, z0);
        let (c3, c5, c6) = (c2 ^ x1, c4 ^ x2, c4 ^ y2);
        let c7 = c6 ^ x3;
        let odd = c1 ^ c3 ^ y1 | c5 ^ c7 ^ y3 | c1 ^ c5 ^ z1 | c2 ^ c6 ^ z2 | c3 ^ c7 ^ z3;
        // Elsewhere a corner of either side is reached along edges from every other, but for faces
        // with four crossed edges, and for two corners opposite each other in the cell.
        let saddle = x0 & x1 & y0 | x2 & x3 & y2 | x0 & x2 & z0 | x1 & x3 & z2;
        let saddle = saddle | y0 & y2 & z0 | y1 & y3 & z1;
        let opposite = x0 & y0 & z0 & x3 & y3 & z3 | x0 & y1 & z1 & x3 & y2 & z2;
        let opposite = opposite | x1 & y0 & z2 & x2 & y3 & z1 | x1 & y1 & z3 & x2 & y2 & z0;
        let crossed = on_x.iter().chain(on_y.as_flattened()).chain(on_z.as_flattened());
        let simple = crossed.fold(0, |all, word| all | word) & !(odd | saddle | opposite);
        Self { simple, apart: [0, c1, c2, c3, c4, c5, c6, c7], on_x, on_y, on_z }
    }

    /// Triangles of the simple cells: two fewer than crossed edges.
    pub fn simple_triangles(&self) -> usize {
        let Self { simple, on_x, on_y, on_z, .. } = self;
        let crossed = on_x.iter().chain(on_y.as_flattened()).chain(on_z.as_flattened());
        let crossed: u32 = crossed.map(|word| (word & simple).count_ones()).sum();
        (crossed - 2 * simple.count_ones()) as usize
    }

    /// The corners parted from the first, of eight cells from `8 * group` on: a byte for each, bit
    /// c of which is set for corner c.
    #[inline]
    pub fn masks(&self, group: usize) -> [u8; 8] {
        // Byte c holds corner c of the eight cells: a square of bits, turned over its diagonal.
        let bytes = self.apart.map(|word| (word >> (8 * group)) as u8);
        let mut square = u64::from_le_bytes(bytes);
        for (shift, swapped) in
            [(7, 0x00aa_00aa_00aa_00aa), (14, 0x0000_cccc_0000_cccc), (28, 0x0000_0000_f0f0_f0f0)]
        {
            let differ = (square ^ square >> shift) & swapped;
            square ^= differ ^ differ << shift;
        }
        square.to_le_bytes()
    }

    /// For a cell, whether each edge is crossed.
    #[inline]
    pub fn crossed(&self, bit: usize) -> [u32; 12] {
        let here = |word: u64| (word >> bit & 1) as u32;
        let [x0, x1, x2, x3] = self.on_x.map(here);
        let [y0, y1, y2, y3] = [0, 1, 2, 3].map(|i| here(self.on_y[i / 2][i % 2]));
        let [z0, z1, z2, z3] = [0, 1, 2, 3].map(|i| here(self.on_z[i / 2][i % 2]));
        [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3]
    }
}

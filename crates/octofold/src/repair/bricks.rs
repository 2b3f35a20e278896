//! A sparse grid of cells: bricks of 8^3 cells, and runs of bricks between them.
//!
//! Only bricks in which cells differ are spelled out, in order of z, y and x. Between two of them in
//! a row lies a run of bricks whose cells are all alike, which is one thing: so memory and time grow
//! with the surface, and a flood crosses empty space in long steps. Source: specification of repair
//! (D.3).

use super::reach::Neighbours;
use std::ops::Range;

/// Cells along an edge of a brick.
pub const BRICK: u32 = 8;

/// The cells of a brick as bits: word z, byte y, bit x.
pub type Block = [u64; 8];

/// A block with all bits set.
pub const ALL: Block = [!0; 8];

/// A cell as the number of its brick, its place in that, and its place in the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Number of the brick.
    pub brick: u32,
    /// Place in the brick.
    pub cell: u32,
    /// Place in the grid.
    pub at: [u32; 3],
}

/// A brick, or a run of bricks that are not spelled out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// Number of the brick.
    Brick(u32),
    /// Number of the run.
    Run(u32),
}

/// Which bricks of a grid are spelled out.
#[derive(Debug, Clone, PartialEq)]
pub struct Bricks {
    dims: [u32; 3],
    at: Vec<[u16; 3]>,
    /// First brick of each row, and the end.
    starts: Vec<u32>,
    around: Vec<[u32; 27]>,
}

/// Marks a run among the numbers of [`Bricks::around`].
const RUN: u32 = 1 << 31;

impl Bricks {
    /// The bricks with the given [`Self::code`]s, in order; none lies at the border of the grid.
    pub fn new(dims: [u32; 3], codes: &[u64]) -> Self {
        let [nx, ny, nz] = dims.map(u64::from);
        let at: Vec<[u16; 3]> = codes
            .iter()
            .map(|&code| [code % nx, code / nx % ny, code / nx / ny].map(|x| x as u16))
            .collect();
        let mut starts = vec![0; (ny * nz) as usize + 1];
        codes.iter().for_each(|&code| starts[(code / nx) as usize + 1] += 1);
        for row in 1..starts.len() {
            starts[row] += starts[row - 1];
        }
        let mut bricks = Self { dims, at, starts, around: Vec::new() };
        bricks.around = crate::par::map(&bricks.at, |&at| bricks.slots_around(at));
        bricks
    }

    /// The number by which bricks are in order.
    pub fn code(dims: [u32; 3], brick: [u32; 3]) -> u64 {
        let [nx, ny, _] = dims.map(u64::from);
        let [x, y, z] = brick.map(u64::from);
        (z * ny + y) * nx + x
    }

    /// How many bricks are spelled out.
    pub fn len(&self) -> usize {
        self.at.len()
    }

    /// How many runs there are.
    pub fn runs(&self) -> usize {
        self.at.len() + self.starts.len() - 1
    }

    /// Bricks along x, y, z.
    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    /// Where a brick lies, in bricks.
    pub fn at(&self, brick: u32) -> [u32; 3] {
        self.at[brick as usize].map(u32::from)
    }

    /// The codes of all bricks, in order.
    pub fn codes(&self) -> impl Iterator<Item = u64> + '_ {
        (0..self.len() as u32).map(|b| Self::code(self.dims, self.at(b)))
    }

    /// Bricks that are spelled out in row `[y, z]`.
    fn row(&self, [y, z]: [u32; 2]) -> Range<usize> {
        let row = (z * self.dims[1] + y) as usize;
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    /// What holds the brick at `at`, which lies in the grid.
    pub fn slot(&self, at: [u32; 3]) -> Slot {
        let row = self.row([at[1], at[2]]);
        let before = self.at[row.clone()].partition_point(|b| u32::from(b[0]) < at[0]);
        let brick = row.start + before;
        if brick < row.end && u32::from(self.at[brick][0]) == at[0] {
            Slot::Brick(brick as u32)
        } else {
            // Each row has one run more than it has bricks.
            Slot::Run(brick as u32 + at[2] * self.dims[1] + at[1])
        }
    }

    fn slots_around(&self, at: [u16; 3]) -> [u32; 27] {
        std::array::from_fn(|n| {
            let step = [n % 3, n / 3 % 3, n / 9];
            let beside = std::array::from_fn(|a| u32::from(at[a]) + step[a] as u32 - 1);
            match self.slot(beside) {
                Slot::Brick(brick) => brick,
                Slot::Run(run) => RUN | run,
            }
        })
    }

    /// What lies beside a brick: neighbour `x + 3 y + 9 z`, each of them 0, 1 or 2.
    pub fn beside(&self, brick: u32, neighbour: usize) -> Slot {
        match self.around[brick as usize][neighbour] {
            run if run & RUN != 0 => Slot::Run(run & !RUN),
            brick => Slot::Brick(brick),
        }
    }

    /// The cell at `local` of a brick, each coordinate from -1 to 8; `None` where it lies in a run.
    pub fn place(&self, brick: u32, local: [i32; 3]) -> Option<Place> {
        let neighbour = neighbour_of(local);
        match self.beside(brick, neighbour) {
            Slot::Run(_) => None,
            Slot::Brick(other) => {
                let corner = self.at(other);
                let inside = local.map(|x| x as u32 & (BRICK - 1));
                let at = std::array::from_fn(|a| corner[a] * BRICK + inside[a]);
                Some(Place { brick: other, cell: cell_of(inside), at })
            }
        }
    }

    /// The row of a run, and its bricks along x.
    fn extent(&self, run: u32) -> ([u32; 2], Range<u32>) {
        // Run numbers grow with the rows: the row is the last that begins at or before the run.
        let (mut low, mut high) = (0, self.starts.len() - 1);
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            if self.starts[middle] as usize + middle <= run as usize {
                low = middle;
            } else {
                high = middle;
            }
        }
        let before = run as usize - low;
        let row = self.starts[low] as usize..self.starts[low + 1] as usize;
        let x = |brick: usize| u32::from(self.at[brick][0]);
        let first = if before > row.start { x(before - 1) + 1 } else { 0 };
        let last = if before < row.end { x(before) } else { self.dims[0] };
        let row = [low as u32 % self.dims[1], low as u32 / self.dims[1]];
        (row, first..last)
    }

    /// How many bricks a run has.
    pub fn run_length(&self, run: u32) -> u32 {
        self.extent(run).1.len() as u32
    }

    /// A cell in the middle of a run that is not empty.
    pub fn run_cell(&self, run: u32) -> [u32; 3] {
        let ([y, z], span) = self.extent(run);
        [u32::midpoint(span.start, span.end), y, z].map(|b| b * BRICK + BRICK / 2)
    }

    /// Calls `visit` for everything that touches a run, itself too.
    pub fn around_run(&self, run: u32, mut visit: impl FnMut(Slot)) {
        let ([y, z], span) = self.extent(run);
        if span.is_empty() {
            return;
        }
        let (first, last) = (span.start.saturating_sub(1), span.end);
        for z in z.saturating_sub(1)..=(z + 1).min(self.dims[2] - 1) {
            for y in y.saturating_sub(1)..=(y + 1).min(self.dims[1] - 1) {
                let row = self.row([y, z]);
                let x = |b: usize| u32::from(self.at[b][0]);
                let start =
                    row.start + self.at[row.clone()].partition_point(|b| u32::from(b[0]) < first);
                let shift = z * self.dims[1] + y;
                let mut brick = start;
                // The run before a brick touches unless the brick is the first place of all.
                if brick == row.end || x(brick) > first {
                    visit(Slot::Run(brick as u32 + shift));
                }
                while brick < row.end && x(brick) <= last {
                    visit(Slot::Brick(brick as u32));
                    brick += 1;
                    let next = if brick < row.end { x(brick) } else { self.dims[0] };
                    let gap = x(brick - 1) + 1;
                    if gap <= last && gap < next {
                        visit(Slot::Run(brick as u32 + shift));
                    }
                }
            }
        }
    }
}

/// The neighbour in which a cell lies whose coordinates in a brick run from -1 to 8.
fn neighbour_of(local: [i32; 3]) -> usize {
    let [x, y, z] = local.map(|x| (x.div_euclid(BRICK as i32) + 1) as usize);
    x + 3 * y + 9 * z
}

/// The place in its brick of a cell with coordinates below 8.
pub fn cell_of([x, y, z]: [u32; 3]) -> u32 {
    x | y << 3 | z << 6
}

/// The coordinates in its brick of the cell at a place.
pub fn coordinates(cell: u32) -> [u32; 3] {
    [cell & 7, cell >> 3 & 7, cell >> 6]
}

/// Whether the bit of a cell is set.
pub fn has(block: &Block, cell: u32) -> bool {
    block[cell as usize / 64] >> (cell % 64) & 1 == 1
}

/// Calls `visit` with the place of every set bit, lowest first.
pub fn each(block: &Block, mut visit: impl FnMut(u32)) {
    for (z, &word) in block.iter().enumerate() {
        crate::bits::ones(word, |bit| visit(64 * z as u32 + bit as u32));
    }
}

/// How many bits are set.
pub fn count(block: &Block) -> u32 {
    block.iter().map(|w| w.count_ones()).sum()
}

/// A brick's cells and the ring of cells round it: row `(z + 1) * 10 + y + 1`, bit `x + 1`.
pub type Halo = [u16; 100];

impl Bricks {
    /// The bits of a brick and round it; `runs` tells the bit of each run.
    pub fn halo(&self, brick: u32, blocks: &[Block], runs: &[bool]) -> Halo {
        // Words of the 27 neighbours, those that are runs spelled out.
        let uniform = [[0; 8], ALL];
        let near: [&Block; 27] = std::array::from_fn(|n| match self.beside(brick, n) {
            Slot::Brick(other) => &blocks[other as usize],
            Slot::Run(run) => &uniform[usize::from(runs[run as usize])],
        });
        let mut halo = [0; 100];
        for row in 0..100 {
            let (y, z) = (row % 10 + 7, row / 10 + 7);
            let base = 3 * (y / 8) + 9 * (z / 8);
            let byte = |n: usize| (near[base + n][z % 8] >> (8 * (y % 8))) as u8;
            halo[row] =
                u16::from(byte(0) >> 7) | u16::from(byte(1)) << 1 | u16::from(byte(2) & 1) << 9;
        }
        halo
    }
}

/// The cells of a brick that are set in its halo, or neighbours of a set one.
#[inline]
pub fn dilate(halo: &Halo, neighbours: Neighbours) -> Block {
    let wide = halo.map(|r| (r | r >> 1 | r >> 2) as u8);
    let own = halo.map(|r| (r >> 1) as u8);
    // Rows straight beside a row, and those across its edges.
    let (beside, across) = match neighbours {
        Neighbours::Faces => (&own, &[0; 100]),
        Neighbours::Edges => (&wide, &own),
        Neighbours::Corners => (&wide, &wide),
    };
    let mut block = [0; 8];
    for (z, word) in block.iter_mut().enumerate() {
        let middle = |at: usize| beside[at - 10] | wide[at] | beside[at + 10];
        let side = |at: usize| across[at - 10] | beside[at] | across[at + 10];
        for y in 0..8 {
            let at = 10 * (z + 1) + y + 1;
            *word |= u64::from(side(at - 1) | middle(at) | side(at + 1)) << (8 * y);
        }
    }
    block
}

/// The cells of a block that touch a set one, or are set, the block alone.
pub fn dilate_within(block: &Block) -> Block {
    const FIRST: u64 = 0x0101_0101_0101_0101;
    let layers = block.map(|w| {
        let x = w | (w << 1 & !FIRST) | (w >> 1 & !(FIRST << 7));
        x | x << 8 | x >> 8
    });
    std::array::from_fn(|z| {
        let below = if z > 0 { layers[z - 1] } else { 0 };
        let above = if z < 7 { layers[z + 1] } else { 0 };
        below | layers[z] | above
    })
}

/// The cells of a brick that touch each of its neighbours.
pub static FACING: [Block; 27] = {
    const FIRST: u64 = 0x0101_0101_0101_0101;
    let mut facing = [ALL; 27];
    let mut n = 0;
    while n < 27 {
        let mut word = !0;
        match n % 3 {
            0 => word &= FIRST,
            2 => word &= FIRST << 7,
            _ => {}
        }
        match n / 3 % 3 {
            0 => word &= 0xff,
            2 => word &= 0xff << 56,
            _ => {}
        }
        let mut z = 0;
        while z < 8 {
            let on = match n / 9 {
                0 => z == 0,
                2 => z == 7,
                _ => true,
            };
            facing[n][z] = if on { word } else { 0 };
            z += 1;
        }
        n += 1;
    }
    facing
};

/// Whether two blocks have a bit in common.
pub fn meet(a: &Block, b: &Block) -> bool {
    a.iter().zip(b).any(|(a, b)| a & b != 0)
}

//! The voxels of a solid by place, in memory that grows with the surface.
//!
//! A grid of bricks tells of each whether it is full, empty, or holds nodes; only those that hold nodes
//! have a bit for each voxel. Coarser grids tell the same of larger bricks, and whether one and all
//! round it are alike, so that one question settles a whole ball.

use super::Network;
use crate::spans::Spans;
use crate::volume::Volume;

/// Bricks that the finest grid may have while finer bricks would do.
const MOST_BRICKS: usize = 1 << 24;

/// Finest and coarsest bricks, as logarithms of their side: a row of one is within a word.
const FINEST: u32 = 2;
const COARSEST: u32 = 6;

/// Full or empty, as all 26 bricks round it are.
const FULL: u32 = 1;
/// Full or empty with this bit, where one of those is not.
const NEAR: u32 = 2;
/// Holds nodes; in the finest grid with the brick's number added.
const MIXED: u32 = 4;

/// The voxels of a solid.
pub struct Bricks {
    /// From the finest on.
    grids: Vec<Grid>,
    bits: Vec<u64>,
}

/// One state for each brick.
struct Grid {
    /// Logarithm of a brick's side.
    shift: u32,
    /// Bricks along each axis, with one more round all of them.
    dims: [usize; 3],
    states: Vec<u32>,
}

impl Grid {
    fn new(shift: u32, dims: [usize; 3]) -> Self {
        let dims = dims.map(|n| n.div_ceil(1 << shift) + 2);
        Self { shift, dims, states: vec![0; dims.iter().product()] }
    }

    /// The place of a brick among the states.
    fn place(&self, [x, y, z]: [usize; 3]) -> usize {
        ((z + 1) * self.dims[1] + y + 1) * self.dims[0] + x + 1
    }

    /// The state of the brick that holds a voxel; beyond the grid all is empty.
    fn state(&self, at: [i64; 3]) -> u32 {
        let brick = at.map(|i| ((i >> self.shift) + 1) as usize);
        if (0..3).any(|a| brick[a] >= self.dims[a]) {
            return 0;
        }
        self.states[(brick[2] * self.dims[1] + brick[1]) * self.dims[0] + brick[0]]
    }

    /// Marks what has a mixed brick beside it.
    fn mark(&mut self) {
        let [w, h, _] = self.dims;
        let around: [usize; 27] = std::array::from_fn(|i| (i / 9 * h + i / 3 % 3) * w + i % 3);
        for at in 0..self.states.len() {
            if self.states[at] >= MIXED {
                // Mixed bricks are never in the outermost ring.
                for by in around {
                    let state = &mut self.states[at - around[13] + by];
                    *state |= if *state < MIXED { NEAR } else { 0 };
                }
            }
        }
    }

    /// The grid of bricks twice as large.
    fn coarser(&self, dims: [usize; 3]) -> Self {
        let mut above = Self::new(self.shift + 1, dims);
        let inner = self.dims.map(|n| n - 2);
        for z in 0..above.dims[2] - 2 {
            for y in 0..above.dims[1] - 2 {
                for x in 0..above.dims[0] - 2 {
                    let mut seen = [false; 2];
                    for i in 0..8 {
                        let at = [2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2)];
                        let is_in = (0..3).all(|a| at[a] < inner[a]);
                        let state = if is_in { self.states[self.place(at)] } else { 0 };
                        if state >= MIXED {
                            seen = [true; 2];
                            break;
                        }
                        seen[(state & FULL) as usize] = true;
                    }
                    let place = above.place([x, y, z]);
                    above.states[place] =
                        if seen == [true; 2] { MIXED } else { u32::from(seen[1]) };
                }
            }
        }
        above
    }
}

impl Bricks {
    /// The voxels of a network, with grids of bricks up to `reach` voxels a side.
    pub fn new(network: &Network, solid: &Spans, reach: f64) -> Self {
        let dims = solid.dims();
        let count = |shift: u32| dims.iter().map(|n| n.div_ceil(1 << shift) + 2).product::<usize>();
        let shift = (FINEST..COARSEST).find(|&s| count(s) <= MOST_BRICKS).unwrap_or(COARSEST);
        let mut finest = Grid::new(shift, dims);
        network.for_each_row(|[y, z], stretches| {
            let row = finest.place([0, y as usize >> shift, z as usize >> shift]);
            for s in stretches {
                let bricks = s.start as usize >> shift..=(s.end as usize - 1) >> shift;
                bricks.for_each(|x| finest.states[row + x] = MIXED);
            }
        });
        let mut bricks = Self { grids: Vec::new(), bits: Vec::new() };
        for z in 0..finest.dims[2] - 2 {
            for y in 0..finest.dims[1] - 2 {
                bricks.fill(&mut finest, solid, [y, z]);
            }
        }
        finest.mark();
        bricks.grids.push(finest);
        while let Some(last) = bricks.grids.last()
            && f64::from(1u32 << last.shift) < reach
            && last.dims.iter().any(|&n| n > 3)
        {
            let mut above = last.coarser(dims);
            above.mark();
            bricks.grids.push(above);
        }
        bricks
    }

    /// Numbers the mixed bricks of a row of them and sets their bits, and tells which others are full.
    fn fill(&mut self, grid: &mut Grid, solid: &Spans, [y, z]: [usize; 2]) {
        let shift = grid.shift;
        let side = 1usize << shift;
        let words = 1usize << (3 * shift - 6);
        let first = grid.place([0, y, z]);
        let states = &mut grid.states[first..first + grid.dims[0] - 2];
        let mut mixed: Vec<(usize, usize)> = Vec::new();
        for (x, state) in states.iter_mut().enumerate().filter(|(_, s)| **s >= MIXED) {
            let number = self.bits.len() / words;
            *state = MIXED + number as u32;
            mixed.push((x, self.bits.len()));
            self.bits.resize(self.bits.len() + words, 0);
        }
        // A brick that holds no node is all of one kind, so its first row tells.
        for run in solid.row(y * side, z * side) {
            let inside = (run[0] as usize).div_ceil(side)..run[1] as usize >> shift;
            for state in states.get_mut(inside).into_iter().flatten() {
                *state |= if *state < MIXED { FULL } else { 0 };
            }
        }
        for i in 0..if mixed.is_empty() { 0 } else { side * side } {
            let (dy, dz) = (i % side, i / side);
            let runs = solid.row(y * side + dy, z * side + dz);
            let mut next = 0;
            for &(x, word) in &mixed {
                let low = (x * side) as u32;
                let high = low + side as u32;
                while runs.get(next).is_some_and(|run| run[1] <= low) {
                    next += 1;
                }
                for run in runs[next..].iter().take_while(|run| run[0] < high) {
                    let (start, end) = (run[0].max(low) - low, run[1].min(high) - low);
                    let line = (!0u64 >> (64 - (end - start))) << start;
                    let bit = i << shift;
                    self.bits[word + bit / 64] |= line << (bit % 64);
                }
            }
        }
    }

    /// Which grid tells of balls of a radius, if one does.
    pub fn grid_for(&self, radius: f64) -> Option<usize> {
        self.grids.iter().position(|g| f64::from(1u32 << g.shift) >= radius)
    }

    /// Whether a ball about a place in a voxel is full or empty, where that is known; its radius is no
    /// larger than bricks of the grid.
    pub fn ball(&self, grid: usize, at: [i64; 3]) -> Option<bool> {
        match self.grids[grid].state(at) {
            0 => Some(false),
            FULL => Some(true),
            _ => None,
        }
    }

    /// Whether a voxel is in the solid.
    pub fn contains(&self, at: [i64; 3]) -> bool {
        let grid = &self.grids[0];
        let state = grid.state(at);
        if state < MIXED {
            return state & FULL != 0;
        }
        let shift = grid.shift;
        let [x, y, z] = at.map(|i| i as usize & ((1 << shift) - 1));
        let bit = (((z << shift) | y) << shift) | x;
        let word = ((state - MIXED) as usize) << (3 * shift - 6);
        self.bits[word + bit / 64] >> (bit % 64) & 1 == 1
    }
}

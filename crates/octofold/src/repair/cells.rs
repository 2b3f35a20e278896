//! The cells through which the surface goes, with their loops numbered.

use super::bricks::{Block, Halo, each};
use super::labels::Labels;
use super::loops::{Config, Loops, Patterns};
use super::members::Members;
use crate::par;
use crate::run::{Cancelled, Run};
use crate::surface::cell::{edge_axis, edge_corner};

/// Bricks that are worked on together.
const BLOCK: usize = 64;

/// All cells that the surface goes through, in order of their bricks.
pub struct Cells<'a> {
    /// The cells.
    pub members: Members<'a>,
    configs: Vec<Config>,
    /// First loop of each cell, and the end.
    loops: Vec<u32>,
    patterns: Patterns,
}

impl<'a> Cells<'a> {
    /// Finds them; `None` where there are more loops than 32 bits can number.
    pub fn new(labels: &'a Labels, run: &Run) -> Result<Option<Self>, Cancelled> {
        run.stage("cells");
        let bricks = &labels.bricks;
        let parts = par::blocks(run, bricks.len(), BLOCK, |range| {
            let mut part = (Vec::new(), Vec::new());
            for brick in range {
                let halo = bricks.halo(brick as u32, &labels.outside, &labels.outside_runs);
                let corners = Corners::new(&halo);
                let block = corners.surface();
                part.0.push(block);
                each(&block, |cell| part.1.push(corners.config(cell)));
            }
            part
        })?;
        let count: usize = parts.iter().map(|p| p.1.len()).sum();
        let blocks = parts.iter().flat_map(|p| p.0.iter().copied()).collect();
        let Some(members) = Members::new(bricks, blocks) else { return Ok(None) };
        let mut cells = Self {
            members,
            configs: Vec::with_capacity(count),
            loops: Vec::with_capacity(count + 1),
            patterns: Patterns::new(parts.iter().flat_map(|p| p.1.iter().copied())),
        };
        let mut loops = 0u64;
        for (_, configs) in parts {
            for config in configs {
                cells.loops.push(loops as u32);
                loops += u64::from(cells.patterns.get(config).count);
                cells.configs.push(config);
            }
        }
        cells.loops.push(loops as u32);
        Ok((loops < u64::from(u32::MAX) / 4).then_some(cells))
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.configs.len()
    }

    /// How many loops there are in all.
    pub fn loop_count(&self) -> usize {
        self.loops[self.len()] as usize
    }

    /// The configuration of a cell.
    pub fn config(&self, cell: u32) -> Config {
        self.configs[cell as usize]
    }

    /// The loops of a cell.
    pub fn loops(&self, cell: u32) -> &Loops {
        self.patterns.get(self.config(cell))
    }

    /// The number of the first loop of a cell.
    pub fn first_loop(&self, cell: u32) -> u32 {
        self.loops[cell as usize]
    }

    /// The number of the loop through a piercing point of a cell.
    pub fn loop_at(&self, cell: u32, point: usize) -> u32 {
        let first = self.loops[cell as usize];
        if self.loops[cell as usize + 1] - first == 1 {
            return first;
        }
        first + u32::from(self.loops(cell).of[point])
    }

    /// Whether a cell has more loops than one.
    pub fn is_shared(&self, cell: u32) -> bool {
        self.loops[cell as usize + 1] - self.loops[cell as usize] > 1
    }
}

/// The open corners and uncut edges of a brick: bit x of row `9 z + y`.
struct Corners {
    open: [u16; 81],
    uncut: [[u16; 81]; 3],
}

impl Corners {
    fn new(outside: &Halo) -> Self {
        let row = |y: usize, z: usize| outside[10 * z + y];
        let mut corners = Self { open: [0; 81], uncut: [[0; 81]; 3] };
        for z in 0..9 {
            for y in 0..9 {
                let at = 9 * z + y;
                let all = row(y, z) | row(y + 1, z) | row(y, z + 1) | row(y + 1, z + 1);
                corners.open[at] = all | all >> 1;
                corners.uncut[0][at] = all >> 1;
                // Cell y lies in row y + 1.
                if y < 8 {
                    let two = row(y + 1, z) | row(y + 1, z + 1);
                    corners.uncut[1][at] = two | two >> 1;
                }
                if z < 8 {
                    let two = row(y, z + 1) | row(y + 1, z + 1);
                    corners.uncut[2][at] = two | two >> 1;
                }
            }
        }
        corners
    }

    /// Cells with a piercing point.
    fn surface(&self) -> Block {
        let mut pierced = [[0u16; 81]; 3];
        for at in 0..81 {
            let open = self.open[at];
            pierced[0][at] = !self.uncut[0][at] & (open | open >> 1);
            if at % 9 < 8 {
                pierced[1][at] = !self.uncut[1][at] & (open | self.open[at + 1]);
            }
            if at < 72 {
                pierced[2][at] = !self.uncut[2][at] & (open | self.open[at + 9]);
            }
        }
        let both = |row: u16| row | row >> 1;
        let mut block = [0; 8];
        for (z, word) in block.iter_mut().enumerate() {
            for y in 0..8 {
                let at = 9 * z + y;
                let [px, py, pz] = &pierced;
                let row = px[at]
                    | px[at + 1]
                    | px[at + 9]
                    | px[at + 10]
                    | both(py[at])
                    | both(py[at + 9])
                    | both(pz[at])
                    | both(pz[at + 1]);
                *word |= u64::from(row as u8) << (8 * y);
            }
        }
        block
    }

    fn config(&self, cell: u32) -> Config {
        let [x, y, z] = super::bricks::coordinates(cell).map(|c| c as usize);
        let bit = |rows: &[u16; 81], corner: usize| {
            let at = 9 * (z + (corner >> 2)) + y + (corner >> 1 & 1);
            u32::from(rows[at]) >> (x + (corner & 1)) & 1
        };
        let open = (0..8).fold(0, |bits, c| bits | bit(&self.open, c) << c);
        let uncut = (0..12)
            .fold(0, |bits, e| bits | bit(&self.uncut[edge_axis(e)], edge_corner(e)) << (8 + e));
        Config(open | uncut)
    }
}

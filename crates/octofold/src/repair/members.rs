//! The cells through which a surface goes, numbered in order of their bricks.

use super::bricks::{self, Block, Bricks, Place, has};
use super::labels::places;
use crate::par;
use crate::run::{Cancelled, Run};

/// Bricks that are worked on together.
const BLOCK: usize = 64;

/// Some cells (or low corners of cells) of a grid, numbered.
pub struct Members<'a> {
    /// The grid.
    pub bricks: &'a Bricks,
    blocks: Vec<Block>,
    /// First member of each brick, and the end.
    first: Vec<u32>,
}

impl<'a> Members<'a> {
    /// Numbers the set cells; `None` where 32 bits cannot.
    pub fn new(bricks: &'a Bricks, blocks: Vec<Block>) -> Option<Self> {
        let mut first = Vec::with_capacity(blocks.len() + 1);
        let mut count = 0u32;
        first.push(0);
        for block in &blocks {
            count = count.checked_add(bricks::count(block))?;
            first.push(count);
        }
        Some(Self { bricks, blocks, first })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.first[self.blocks.len()] as usize
    }

    /// The number of the cell at a place, where it is one of them.
    pub fn find(&self, place: Place) -> Option<u32> {
        let block = &self.blocks[place.brick as usize];
        if !has(block, place.cell) {
            return None;
        }
        let (word, bit) = (place.cell as usize / 64, place.cell % 64);
        let before: u32 = block[..word].iter().map(|w| w.count_ones()).sum();
        let rank = before + (block[word] & ((1 << bit) - 1)).count_ones();
        Some(self.first[place.brick as usize] + rank)
    }

    /// The cell at `local` of a brick, each coordinate from -8 to 15.
    pub fn beside(&self, brick: u32, local: [i32; 3]) -> Option<u32> {
        self.find(self.bricks.place(brick, local)?)
    }

    /// Calls `visit` for each cell of a brick, with its number.
    pub fn in_brick(&self, brick: u32, mut visit: impl FnMut(u32, Place)) {
        let mut cell = self.first[brick as usize];
        places(self.bricks, brick, &self.blocks[brick as usize], |place| {
            visit(cell, place);
            cell += 1;
        });
    }

    /// Works on all bricks in parallel and returns the results in order.
    pub fn per_brick<T: Send>(
        &self,
        run: &Run,
        work: impl Fn(std::ops::Range<u32>) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        par::blocks(run, self.blocks.len(), BLOCK, |range| {
            work(range.start as u32..range.end as u32)
        })
    }

    /// Works on all cells in parallel and returns the results in order.
    pub fn per_cell<T: Send + Clone>(
        &self,
        run: &Run,
        work: impl Fn(u32, Place) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        let parts = self.per_brick(run, |bricks| {
            let mut part = Vec::new();
            for brick in bricks {
                self.in_brick(brick, |cell, place| part.push(work(cell, place)));
            }
            part
        })?;
        Ok(parts.concat())
    }
}

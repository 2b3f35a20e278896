//! A flood of empty cells, 26-connected: from brick to brick, and over runs of bricks in one step.

use super::bricks::{ALL, BRICK, Block, Bricks, FACING, Slot, count, dilate, dilate_within, meet};
use super::reach::Neighbours;
use crate::run::{Cancelled, Run};
use std::collections::VecDeque;

/// What a flood has reached.
pub struct Flood<'a> {
    bricks: &'a Bricks,
    /// Cells that it cannot enter.
    pub closed: Vec<Block>,
    /// Reached cells of each brick.
    pub cells: Vec<Block>,
    /// Reached runs.
    pub runs: Vec<bool>,
    /// How many cells were reached.
    pub volume: u64,
    waiting: VecDeque<Slot>,
    queued: Vec<bool>,
}

/// Bricks and runs between two looks at the cancel flag.
const BLOCK: usize = 1 << 14;

impl<'a> Flood<'a> {
    /// A flood that has reached nothing and cannot enter the `closed` cells.
    pub fn new(bricks: &'a Bricks, closed: Vec<Block>) -> Self {
        Self {
            bricks,
            closed,
            cells: vec![[0; 8]; bricks.len()],
            runs: vec![false; bricks.runs()],
            volume: 0,
            waiting: VecDeque::new(),
            queued: vec![false; bricks.len()],
        }
    }

    /// Lets it in at a run.
    pub fn enter_run(&mut self, run: u32) {
        if !std::mem::replace(&mut self.runs[run as usize], true) {
            self.volume += u64::from(self.bricks.run_length(run)) * u64::from(BRICK.pow(3));
            self.waiting.push_back(Slot::Run(run));
        }
    }

    /// Lets it in at cells of a brick, all of them open.
    pub fn enter_cells(&mut self, brick: u32, cells: &Block) {
        self.reach(brick, *cells);
    }

    /// Opens closed cells of a brick.
    pub fn open(&mut self, brick: u32, cells: &Block) {
        self.closed[brick as usize].iter_mut().zip(cells).for_each(|(c, o)| *c &= !o);
        self.look_at(Slot::Brick(brick));
    }

    /// Floods all that can be reached.
    pub fn spread(&mut self, run: &Run) -> Result<(), Cancelled> {
        let mut steps = 0;
        while let Some(slot) = self.waiting.pop_front() {
            steps += 1;
            if steps % BLOCK == 0 {
                run.check()?;
            }
            match slot {
                Slot::Run(number) => {
                    let bricks = self.bricks;
                    bricks.around_run(number, |beside| self.look_at(beside));
                }
                Slot::Brick(brick) => {
                    self.queued[brick as usize] = false;
                    let halo = self.bricks.halo(brick, &self.cells, &self.runs);
                    let found = dilate(&halo, Neighbours::Corners);
                    self.reach(brick, found);
                }
            }
        }
        Ok(())
    }

    /// Takes the open cells among `found`, and all that they lead to in the brick.
    fn reach(&mut self, brick: u32, found: Block) {
        let closed = self.closed[brick as usize];
        let before = self.cells[brick as usize];
        let open = |block: &Block| -> Block { std::array::from_fn(|z| block[z] & !closed[z]) };
        let mut now = open(&found);
        now.iter_mut().zip(&before).for_each(|(n, b)| *n |= b);
        loop {
            let next = open(&dilate_within(&now));
            if next == now {
                break;
            }
            now = next;
        }
        self.cells[brick as usize] = now;
        let new: Block = std::array::from_fn(|z| now[z] & !before[z]);
        if new == [0; 8] {
            return;
        }
        self.volume += u64::from(count(&new));
        for n in (0..27).filter(|&n| n != 13) {
            if meet(&new, &FACING[n]) {
                self.look_at(self.bricks.beside(brick, n));
            }
        }
    }

    /// Something beside `slot` was reached.
    fn look_at(&mut self, slot: Slot) {
        match slot {
            Slot::Run(run) => self.enter_run(run),
            Slot::Brick(brick) => {
                let done = self.closed[brick as usize] == ALL;
                if !done && !std::mem::replace(&mut self.queued[brick as usize], true) {
                    self.waiting.push_back(slot);
                }
            }
        }
    }
}

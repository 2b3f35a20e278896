//! Which cells are outside, which are full and which are inside.
//!
//! Cells that the input touches are full. Cells near its boundary edges are closed by dilation, the
//! outside is flooded from the border of the grid, and what was dilated is given back from both sides,
//! but for a wall between them. So **no inside cell touches an outside cell, not even at a
//! corner** (invariant S), which is what the extraction rests on. Source: specification of repair
//! (A.1.4); Bischoff, Pavic and Kobbelt 2005.

use super::bricks::{ALL, Block, Bricks, Place, Slot, dilate, each, has};
use super::flood::Flood;
use super::reach::{Neighbours, Reach};
use crate::par;
use crate::run::{Cancelled, Run};

/// The cells of a grid and which of them are outside.
#[derive(Debug, Clone)]
pub struct Labels {
    /// The bricks in which cells may differ.
    pub bricks: Bricks,
    /// Outside cells of each brick.
    pub outside: Vec<Block>,
    /// Which runs are outside.
    pub outside_runs: Vec<bool>,
    /// Cells that are neither outside nor full.
    pub inside: Vec<Block>,
    /// Which runs are inside.
    pub inside_runs: Vec<bool>,
}

/// What became of the spaces that the outside does not reach, the insides of solids among them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Enclosed {
    /// How many there are.
    pub spaces: u64,
    /// Those that stay empty; all others are filled.
    pub kept: u64,
    /// Cells in those that are filled.
    pub filled_cells: u64,
}

/// Tells which enclosed spaces stay empty, by how many cells they have and one of these.
pub type Keep<'a> = &'a dyn Fn(u64, [u32; 3]) -> bool;

/// Cells in blocks of bricks that are worked on together.
const BLOCK: usize = 1024;

impl Labels {
    /// Labels the cells of a grid in which the input touches the cells `full`, and its boundary
    /// edges the cells `rims`. The bricks hold all cells within `reach` of these. Enclosed spaces that
    /// `keep` takes count as outside.
    pub fn new(
        bricks: Bricks,
        full: &[Block],
        rims: Vec<Block>,
        reach: Reach,
        keep: Keep<'_>,
        run: &Run,
    ) -> Result<(Self, Enclosed), Cancelled> {
        run.stage("close");
        let near = spread(&bricks, rims, reach, run)?;
        let closed: Vec<Block> = full.iter().zip(&near).map(|(a, b)| either(a, b)).collect();
        run.stage("flood");
        let mut flood = from_border(&bricks, closed, run)?;
        let cavities = enclosed(&bricks, &mut flood, keep, run)?;
        let Flood { closed, cells: outside, runs: outside_runs, .. } = flood;
        let inside: Vec<Block> = closed
            .iter()
            .zip(&outside)
            .map(|(c, o)| std::array::from_fn(|z| !c[z] & !o[z]))
            .collect();
        let inside_runs = outside_runs.iter().map(|o| !o).collect();
        let mut labels = Self { bricks, outside, outside_runs, inside, inside_runs };
        run.stage("give back");
        labels.give_back(full, &near, reach.rounds(), run)?;
        Ok((labels, cavities))
    }

    /// Lets the outside and the inside grow back into cells that only dilation closed, by turns and
    /// never so far that they touch: what stays between them is a wall half-way.
    fn give_back(
        &mut self,
        full: &[Block],
        near: &[Block],
        rounds: u32,
        run: &Run,
    ) -> Result<(), Cancelled> {
        let free: Vec<Block> =
            near.iter().zip(full).map(|(n, f)| std::array::from_fn(|z| n[z] & !f[z])).collect();
        let all: Vec<u32> = (0..self.bricks.len() as u32).collect();
        let mut front = Front::new(&self.bricks);
        // Neither side ever shrinks, so a cell that one could not enter opens only by its own growth.
        let [mut outer, mut inner] = [all.clone(), all];
        for _ in 0..rounds {
            let guard = (&self.inside[..], &self.inside_runs[..]);
            outer = front.grow(&mut self.outside, &self.outside_runs, &free, guard, &outer, run)?;
            let guard = (&self.outside[..], &self.outside_runs[..]);
            inner = front.grow(&mut self.inside, &self.inside_runs, &free, guard, &inner, run)?;
            if outer.is_empty() && inner.is_empty() {
                break;
            }
        }
        Ok(())
    }

    /// Whether a cell is outside.
    pub fn is_outside(&self, at: [u32; 3]) -> bool {
        match self.bricks.slot(at.map(|x| x / super::bricks::BRICK)) {
            Slot::Run(run) => self.outside_runs[run as usize],
            Slot::Brick(brick) => {
                let cell = super::bricks::cell_of(at.map(|x| x % super::bricks::BRICK));
                has(&self.outside[brick as usize], cell)
            }
        }
    }

    /// Makes outside cells full. Invariant S still holds: fewer cells are outside, and no more are
    /// inside.
    pub fn fill(&mut self, cells: &[[u32; 3]]) {
        let brick_of = |at: &[u32; 3]| at.map(|x| x / super::bricks::BRICK);
        let dims = self.bricks.dims();
        let mut codes: Vec<u64> = self.bricks.codes().collect();
        let known = codes.len();
        codes.extend(cells.iter().map(brick_of).map(|b| Bricks::code(dims, b)));
        codes.sort_unstable();
        codes.dedup();
        if codes.len() > known {
            self.spell_out(&codes);
        }
        for at in cells {
            if let Slot::Brick(brick) = self.bricks.slot(brick_of(at)) {
                let cell = super::bricks::cell_of(at.map(|x| x % super::bricks::BRICK));
                self.outside[brick as usize][cell as usize / 64] &= !(1 << (cell % 64));
            }
        }
    }

    /// Spells out more bricks.
    fn spell_out(&mut self, codes: &[u64]) {
        let bricks = Bricks::new(self.bricks.dims(), codes);
        let spelled = |blocks: &[Block], runs: &[bool]| -> Vec<Block> {
            let of = |brick| match self.bricks.slot(bricks.at(brick)) {
                Slot::Brick(old) => blocks[old as usize],
                Slot::Run(old) if runs[old as usize] => ALL,
                Slot::Run(_) => [0; 8],
            };
            (0..bricks.len() as u32).map(of).collect()
        };
        let outside = spelled(&self.outside, &self.outside_runs);
        let inside = spelled(&self.inside, &self.inside_runs);
        let [nx, ny, nz] = bricks.dims();
        let mut runs = vec![[false; 2]; bricks.runs()];
        // A run of the new grid lies in one of the old.
        let mut note = |at: [u32; 3]| {
            if let (Slot::Run(new), Slot::Run(old)) = (bricks.slot(at), self.bricks.slot(at)) {
                let old = old as usize;
                runs[new as usize] = [self.outside_runs[old], self.inside_runs[old]];
            }
        };
        for z in 0..nz {
            for y in 0..ny {
                note([0, y, z]);
            }
        }
        for brick in 0..bricks.len() as u32 {
            let [x, y, z] = bricks.at(brick);
            if x + 1 < nx {
                note([x + 1, y, z]);
            }
        }
        self.outside_runs = runs.iter().map(|r| r[0]).collect();
        self.inside_runs = runs.iter().map(|r| r[1]).collect();
        (self.outside, self.inside, self.bricks) = (outside, inside, bricks);
    }
}

/// What a flood from the border of the grid reaches.
pub fn from_border<'a>(
    bricks: &'a Bricks,
    closed: Vec<Block>,
    run: &Run,
) -> Result<Flood<'a>, Cancelled> {
    let mut flood = Flood::new(bricks, closed);
    if let Slot::Run(border) = bricks.slot([0; 3]) {
        flood.enter_run(border);
    }
    flood.spread(run)?;
    Ok(flood)
}

/// Finds the spaces that the flood has not reached, and lets it into those that are kept.
fn enclosed(
    bricks: &Bricks,
    flood: &mut Flood<'_>,
    keep: Keep<'_>,
    run: &Run,
) -> Result<Enclosed, Cancelled> {
    let mut found = Enclosed::default();
    let mut seen = Flood::new(bricks, flood.closed.clone());
    // A space may have all its cells in runs.
    for run_number in 0..bricks.runs() as u32 {
        let r = run_number as usize;
        if !flood.runs[r] && !seen.runs[r] && bricks.run_length(run_number) > 0 {
            let at = bricks.run_cell(run_number);
            let kept = found.note(&mut seen, |f| f.enter_run(run_number), at, keep, run)?;
            if kept {
                flood.enter_run(run_number);
                flood.spread(run)?;
            }
        }
    }
    for brick in 0..bricks.len() as u32 {
        let b = brick as usize;
        loop {
            let left: Block = std::array::from_fn(|z| {
                !flood.closed[b][z] & !flood.cells[b][z] & !seen.cells[b][z]
            });
            let Some(z) = left.iter().position(|&w| w != 0) else { break };
            let mut seed = [0; 8];
            seed[z] = left[z] & left[z].wrapping_neg();
            let mut at = [0; 3];
            places(bricks, brick, &seed, |place| at = place.at);
            let kept = found.note(&mut seen, |f| f.enter_cells(brick, &seed), at, keep, run)?;
            if kept {
                flood.enter_cells(brick, &seed);
                flood.spread(run)?;
            }
        }
    }
    Ok(found)
}

impl Enclosed {
    /// Floods one more space and tells whether it is kept.
    fn note(
        &mut self,
        seen: &mut Flood<'_>,
        enter: impl FnOnce(&mut Flood<'_>),
        at: [u32; 3],
        keep: Keep<'_>,
        run: &Run,
    ) -> Result<bool, Cancelled> {
        let before = seen.volume;
        enter(seen);
        seen.spread(run)?;
        let cells = seen.volume - before;
        let kept = keep(cells, at);
        self.spaces += 1;
        if kept {
            self.kept += 1;
        } else {
            self.filled_cells += cells;
        }
        Ok(kept)
    }
}

/// The cells within `reach` of `cells`.
pub fn spread(
    bricks: &Bricks,
    mut cells: Vec<Block>,
    reach: Reach,
    run: &Run,
) -> Result<Vec<Block>, Cancelled> {
    let nothing = vec![false; bricks.runs()];
    let mut front = Front::new(bricks);
    let mut changed: Vec<u32> =
        (0..bricks.len() as u32).filter(|&b| cells[b as usize] != [0; 8]).collect();
    for kind in reach.kinds() {
        changed = front.step(&mut cells, &changed, run, |brick, cells| {
            dilate(&bricks.halo(brick, cells, &nothing), kind)
        })?;
    }
    Ok(cells)
}

/// Growth of cells by rounds, in which only bricks beside a change are looked at: work grows with what
/// is reached, not with that times the rounds.
struct Front<'a> {
    bricks: &'a Bricks,
    marked: Vec<bool>,
}

impl<'a> Front<'a> {
    fn new(bricks: &'a Bricks) -> Self {
        Self { bricks, marked: vec![false; bricks.len()] }
    }

    /// Adds those of `free` that touch the cells, and nothing of `guard`, beside the bricks `changed`;
    /// returns the bricks that it changes.
    fn grow(
        &mut self,
        cells: &mut [Block],
        runs: &[bool],
        free: &[Block],
        guard: (&[Block], &[bool]),
        changed: &[u32],
        run: &Run,
    ) -> Result<Vec<u32>, Cancelled> {
        let bricks = self.bricks;
        self.step(cells, changed, run, |brick, cells| {
            let (own, free) = (cells[brick as usize], free[brick as usize]);
            if free.iter().zip(&own).all(|(f, o)| f & !o == 0) {
                return own;
            }
            let reached = dilate(&bricks.halo(brick, cells, runs), Neighbours::Corners);
            let guarded = dilate(&bricks.halo(brick, guard.0, guard.1), Neighbours::Corners);
            std::array::from_fn(|z| own[z] | reached[z] & free[z] & !guarded[z])
        })
    }

    /// Replaces the cells of all bricks beside `changed` that are not full by what `next` makes of
    /// them, all at once; returns the bricks whose cells are others now.
    fn step(
        &mut self,
        cells: &mut [Block],
        changed: &[u32],
        run: &Run,
        next: impl Fn(u32, &[Block]) -> Block + Sync,
    ) -> Result<Vec<u32>, Cancelled> {
        let mut active = Vec::new();
        for &brick in changed {
            for n in 0..27 {
                if let Slot::Brick(beside) = self.bricks.beside(brick, n)
                    && cells[beside as usize] != ALL
                    && !std::mem::replace(&mut self.marked[beside as usize], true)
                {
                    active.push(beside);
                }
            }
        }
        active.sort_unstable();
        let known: &[Block] = cells;
        let parts = par::blocks(run, active.len(), BLOCK, |range| {
            let brick = |i: usize| (active[i], next(active[i], known));
            range.map(brick).filter(|(b, new)| known[*b as usize] != *new).collect::<Vec<_>>()
        })?;
        active.iter().for_each(|&b| self.marked[b as usize] = false);
        let mut changed = Vec::new();
        for (brick, new) in parts.into_iter().flatten() {
            cells[brick as usize] = new;
            changed.push(brick);
        }
        Ok(changed)
    }
}

/// Makes something for every brick.
pub fn per_brick<T: Send + Clone>(
    bricks: &Bricks,
    run: &Run,
    work: impl Fn(u32) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let parts = par::blocks(run, bricks.len(), BLOCK, |range| {
        range.map(|b| work(b as u32)).collect::<Vec<_>>()
    })?;
    Ok(parts.concat())
}

fn either(a: &Block, b: &Block) -> Block {
    std::array::from_fn(|z| a[z] | b[z])
}

/// Calls `visit` for every set cell of a brick.
pub fn places(bricks: &Bricks, brick: u32, block: &Block, mut visit: impl FnMut(Place)) {
    let corner = bricks.at(brick).map(|x| x * super::bricks::BRICK);
    each(block, |cell| {
        let inside = super::bricks::coordinates(cell);
        visit(Place { brick, cell, at: std::array::from_fn(|a| corner[a] + inside[a]) });
    });
}

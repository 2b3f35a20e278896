//! Which parts of the complex are thick: those stay closed, all others become single sheets.
//!
//! Thick is what a ball of the sheet thickness fits into (an opening), and what reaches no further
//! from there than a few such balls: the sharp edges of a thick part belong to it. Source:
//! specification of repair (A.2, D.5).

use super::super::bricks::{ALL, Block, Bricks, dilate};
use super::super::labels::per_brick;
use super::super::reach::Neighbours;
use crate::run::{Cancelled, Run};

/// The most rounds of erosion: thicker parts have bricks within that are not spelled out.
pub const MOST_ROUNDS: u32 = 4;

/// How far a sharp edge may reach from where the ball fits, in rounds of erosion.
const EDGE: u32 = 8;

/// The vertices of thick parts, given those that are open.
pub fn thick(
    bricks: &Bricks,
    open: &[Block],
    open_runs: &[bool],
    inside_runs: &[bool],
    rounds: u32,
    run: &Run,
) -> Result<Vec<Block>, Cancelled> {
    let grow = |cells: Vec<Block>,
                runs: &[bool],
                within: &(dyn Fn(usize) -> Block + Sync),
                rounds: u32| {
        let mut cells = cells;
        for _ in 0..rounds {
            let next = grown(bricks, &cells, runs, within, run)?;
            if next == cells {
                break;
            }
            cells = next;
        }
        Ok::<_, Cancelled>(cells)
    };
    let closed = |b: usize| open[b].map(|w| !w);
    let near_open = grow(open.to_vec(), open_runs, &|_| ALL, rounds)?;
    let core = near_open.iter().map(|b| b.map(|w| !w)).collect();
    let fits = grow(core, inside_runs, &closed, rounds)?;
    let near = grow(fits.clone(), inside_runs, &closed, EDGE * rounds)?;
    let far = both(&near, &|b| closed(b), |near, closed| closed & !near);
    let rest = |b: usize| std::array::from_fn(|z| !open[b][z] & !fits[b][z]);
    let nothing = vec![false; bricks.runs()];
    let thin = grow(far, &nothing, &rest, EDGE * rounds)?;
    Ok(both(&thin, &|b| closed(b), |thin, closed| closed & !thin))
}

fn both(
    cells: &[Block],
    other: &(dyn Fn(usize) -> Block + Sync),
    mix: fn(u64, u64) -> u64,
) -> Vec<Block> {
    let mixed = |(b, cells): (usize, &Block)| {
        let other = other(b);
        std::array::from_fn(|z| mix(cells[z], other[z]))
    };
    cells.iter().enumerate().map(mixed).collect()
}

/// The cells, and those within `within` that touch them.
fn grown(
    bricks: &Bricks,
    cells: &[Block],
    runs: &[bool],
    within: &(dyn Fn(usize) -> Block + Sync),
    run: &Run,
) -> Result<Vec<Block>, Cancelled> {
    per_brick(bricks, run, |brick| {
        let (own, room) = (cells[brick as usize], within(brick as usize));
        if own.iter().zip(&room).all(|(o, r)| r & !o == 0) {
            return own;
        }
        let reached = dilate(&bricks.halo(brick, cells, runs), Neighbours::Corners);
        std::array::from_fn(|z| own[z] | reached[z] & room[z])
    })
}

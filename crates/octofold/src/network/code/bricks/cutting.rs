//! Cuts a solid into parts: bricks, and boxes of bricks where there is little to read.

use super::index::{Cell, counts};
use super::stream::{self, Packet};
use super::{BLOCK, SIDE};
use crate::network::code::direct::Direct;
use crate::par;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Volume};
use rustc_hash::FxHashMap;

/// What there may be to do to read a part of several bricks, in decisions: less than many a brick.
const MOST_WORK: u64 = 32_000;

/// What a box of bricks is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum State {
    Empty,
    Full,
    Part(Packet),
    Halved,
}

/// A box of bricks, and its halves among all boxes.
#[derive(Debug)]
struct Knot {
    cell: Cell,
    halves: Option<[usize; 2]>,
}

/// A run of voxels in a brick: z, y, start and end.
type Piece = [u8; 4];

/// The parts of a solid, in order.
pub fn parts(solid: &Spans, run: &Run) -> Result<Vec<(Cell, State)>, Cancelled> {
    let mut knots = Vec::new();
    let mut levels = Vec::new();
    divide(Cell::all(solid.dims()), 0, &mut knots, &mut levels);
    let mut states = single(solid, run)?;
    let [nx, ny, _] = counts(solid.dims());
    let mut all: Vec<State> = vec![State::Halved; knots.len()];
    for (knot, state) in knots.iter().zip(&mut all) {
        let [x, y, z] = knot.cell.start;
        if knot.halves.is_none() {
            *state = std::mem::replace(&mut states[(z * ny + y) * nx + x], State::Halved);
        }
    }
    for level in levels.iter().rev() {
        let joined = par::blocks(run, level.len(), BLOCK, |range| {
            let mut model = None;
            let level = level[range].iter().filter_map(|&i| {
                let halves = knots[i].halves?.map(|half| &all[half]);
                Some((i, join(solid, knots[i].cell, halves, &mut model)))
            });
            level.collect::<Vec<_>>()
        })?;
        for (i, state) in joined.into_iter().flatten() {
            all[i] = state;
        }
    }
    let mut parts = Vec::new();
    take(0, &knots, &mut all, &mut parts);
    Ok(parts)
}

/// All boxes that halving leads to, with their levels; the first is the box itself.
fn divide(cell: Cell, level: usize, knots: &mut Vec<Knot>, levels: &mut Vec<Vec<usize>>) -> usize {
    let own = knots.len();
    knots.push(Knot { cell, halves: None });
    if levels.len() == level {
        levels.push(Vec::new());
    }
    levels[level].push(own);
    let halves = cell.halves();
    knots[own].halves = halves.map(|halves| halves.map(|h| divide(h, level + 1, knots, levels)));
    own
}

/// The boxes that are not halved.
fn take(i: usize, knots: &[Knot], all: &mut [State], parts: &mut Vec<(Cell, State)>) {
    match (std::mem::replace(&mut all[i], State::Halved), knots[i].halves) {
        (State::Halved, Some(halves)) => {
            halves.into_iter().for_each(|half| take(half, knots, all, parts));
        }
        (state, _) => parts.push((knots[i].cell, state)),
    }
}

/// What two halves are together.
fn join(solid: &Spans, cell: Cell, halves: [&State; 2], model: &mut Option<Direct>) -> State {
    let (work, bytes) = match halves {
        [State::Empty, State::Empty] => return State::Empty,
        [State::Full, State::Full] => return State::Full,
        [State::Halved, _] | [_, State::Halved] => return State::Halved,
        // What is the same is kept once.
        [State::Part(a), State::Part(b)] if a == b => (2 * a.work, a.bytes.len()),
        [State::Part(a), State::Part(b)] => (a.work + b.work, a.bytes.len() + b.bytes.len()),
        [State::Part(a), _] | [_, State::Part(a)] => (a.work, a.bytes.len()),
        _ => (0, 2),
    };
    if !cell.is_part() || work > MOST_WORK {
        return State::Halved;
    }
    let (start, dims) = cell.voxels(solid.dims());
    let part = solid.framed(start.map(|i| i as i64), dims);
    let axis = |half: &State| if let State::Part(packet) = half { Some(packet.axis) } else { None };
    let mut axes: Vec<u8> = halves.into_iter().filter_map(axis).collect();
    axes.dedup();
    let model = model.get_or_insert_with(Direct::of_part);
    let packet = stream::write(model, &part, &axes, MOST_WORK);
    packet.filter(|p| p.bytes.len() <= bytes + 1).map_or(State::Halved, State::Part)
}

/// What every brick is, x fastest.
fn single(solid: &Spans, run: &Run) -> Result<Vec<State>, Cancelled> {
    let dims = solid.dims();
    let [nx, rows, layers] = counts(dims);
    let cut = par::blocks(run, rows * layers, 1, |range| {
        range.flat_map(|i| cut(solid, i % rows, i / rows)).collect::<Vec<_>>()
    })?;
    let cut: Vec<_> = cut.into_iter().flatten().collect();
    let mut numbers: FxHashMap<(&[Piece], [usize; 3]), usize> = FxHashMap::default();
    let mut different = Vec::new();
    let number = cut.iter().enumerate().map(|(i, brick)| {
        let Err(own) = brick else { return 0 };
        let start = [i % nx, i / nx % rows, i / nx / rows];
        let (_, voxels) = Cell { start, size: [1; 3] }.voxels(dims);
        let next = different.len();
        let number = *numbers.entry((own, voxels)).or_insert(next);
        if number == next {
            different.push((own, voxels));
        }
        number
    });
    let number: Vec<usize> = number.collect();
    let packets = par::blocks(run, different.len(), BLOCK, |range| {
        let mut model = Direct::of_part();
        let packets = different[range].iter().map(|(runs, voxels)| {
            let run =
                |&[z, y, start, end]: &Piece| ([y, z].map(u32::from), [start, end].map(u32::from));
            let part = Spans::from_runs(*voxels, Placement::default(), runs.iter().map(run));
            stream::write(&mut model, &part, &[2, 1, 0], u64::MAX)
        });
        packets.collect::<Vec<_>>()
    })?;
    let packets = packets.concat();
    let state = |(brick, i): (&Result<State, Vec<Piece>>, usize)| match brick {
        Ok(known) => known.clone(),
        Err(_) => packets[i].clone().map_or(State::Halved, State::Part),
    };
    Ok(cut.iter().zip(number).map(state).collect())
}

/// The bricks of one row of bricks: what is known of them, or their runs.
fn cut(solid: &Spans, row: usize, layer: usize) -> Vec<Result<State, Vec<Piece>>> {
    let dims = solid.dims();
    let [nx, ..] = counts(dims);
    let mut bricks: Vec<Vec<Piece>> = vec![Vec::new(); nx];
    let within = |i: usize, a: usize| i * SIDE..((i + 1) * SIDE).min(dims[a]);
    for z in within(layer, 2) {
        for y in within(row, 1) {
            for &[start, end] in solid.row(y, z) {
                let [start, end] = [start as usize, end as usize];
                for (i, brick) in
                    bricks.iter_mut().enumerate().take(end.div_ceil(SIDE)).skip(start / SIDE)
                {
                    let [from, to] = [start, end].map(|x| x.clamp(i * SIDE, (i + 1) * SIDE));
                    brick.push(
                        [z % SIDE, y % SIDE, from - i * SIDE, to - i * SIDE].map(|i| i as u8),
                    );
                }
            }
        }
    }
    let area = (within(layer, 2).len() * within(row, 1).len()) as u64;
    let known = |(i, brick): (usize, Vec<Piece>)| {
        let filled: u64 = brick.iter().map(|p| u64::from(p[3] - p[2])).sum();
        match filled {
            0 => Ok(State::Empty),
            _ if filled == area * within(i, 0).len() as u64 => Ok(State::Full),
            _ => Err(brick),
        }
    };
    bricks.into_iter().enumerate().map(known).collect()
}

//! The inside of meshes that are not closed: where the generalized winding number is one half or
//! more, either way round.
//!
//! The winding number is dear to evaluate and rarely needed: away from the surface it is smooth,
//! so octants without surface are taken whole where a few samples agree, and in a block that the
//! surface enters each connected set of free cells is. Across the surface it jumps by one for each
//! crossing, so a touched cell follows from a free one in its row. Only near the rims of holes,
//! where samples are not near a whole number, or where a row contradicts itself, is it evaluated
//! cell by cell.

use super::{X_BITS, border, row_major};
use crate::lattice::Lattice;
use crate::measure::Winding;
use crate::octree::key::morton;
use crate::par;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Block, Region, Volume};

/// Cells along a block that is looked at cell by cell if the surface enters it.
const BLOCK: u32 = 16;

/// Cells along one unit of work.
const TASK: u32 = 64;

/// Samples within this distance of a whole number stand for the smooth part round them.
const CLEAR: f64 = 0.25;

/// Samples of a connected set of free cells.
const SAMPLES: usize = 8;

/// What is known about the mesh on its lattice.
pub(super) struct Unclosed<'a> {
    pub lattice: &'a Lattice,
    /// Cells that the surface touches.
    pub touched: Spans,
    /// Where rows enter and leave the surface, sorted.
    pub borders: Vec<u64>,
    /// Names of the blocks near the rims of holes.
    pub rims: Vec<u64>,
    pub winding: Winding,
}

/// Names of the blocks within half a block of edges with an odd number of triangles, sorted.
pub(super) fn rims(edges: &[[[i32; 3]; 2]], lattice: &Lattice) -> Vec<u64> {
    let reach = i64::from(BLOCK / 2);
    let mut blocks = Vec::new();
    for [p, q] in edges {
        let [p, q] = [p, q].map(|c| c.map(|step| i64::from(step >> lattice.sub_bits())));
        let length = (0..3).map(|a| (q[a] - p[a]).abs()).max().unwrap_or(0);
        let steps = length / reach + 1;
        for i in 0..=steps {
            for corner in 0..8 {
                blocks.push(name(std::array::from_fn(|a| {
                    let along = p[a] + (q[a] - p[a]) * i / steps;
                    let cell = along + if corner >> a & 1 == 1 { reach } else { -reach };
                    cell.clamp(0, i64::from(lattice.cells()[a]) - 1) as u32
                })));
            }
        }
    }
    blocks.sort_unstable();
    blocks.dedup();
    blocks
}

/// Names of the blocks that hold touched cells, sorted.
fn occupied(touched: &Spans) -> Vec<u64> {
    let mut blocks = Vec::new();
    touched.for_each_row(|[y, z], runs| {
        for &[start, end] in runs {
            for x in start / BLOCK..=(end - 1) / BLOCK {
                blocks.push(name([x * BLOCK, y, z]));
            }
        }
    });
    blocks.sort_unstable();
    blocks.dedup();
    blocks
}

/// Morton code of the block of a cell: the blocks of an octant are one slice of a sorted list.
fn name(cell: [u32; 3]) -> u64 {
    morton(cell.map(|c| c / BLOCK))
}

/// Winding number of a cell as far as it is known.
#[derive(Clone, Copy, PartialEq)]
enum Value {
    Unknown,
    /// Near this whole number.
    Whole(i32),
    /// Evaluated, and near none: inside or not.
    Between(bool),
}

impl Value {
    fn of(winding: f64) -> Self {
        let whole = winding.round();
        if (winding - whole).abs() <= CLEAR {
            Self::Whole(whole as i32)
        } else {
            Self::Between(winding.abs() >= 0.5)
        }
    }

    fn is_inside(self) -> bool {
        matches!(self, Self::Between(true)) || matches!(self, Self::Whole(w) if w != 0)
    }

    fn plus(self, jump: i32) -> Self {
        match self {
            Self::Whole(w) => Self::Whole(w + jump),
            _ => Self::Unknown,
        }
    }
}

impl Unclosed<'_> {
    /// The borders of the runs of inside cells.
    pub fn fill(&self, run: &Run) -> Result<Vec<Vec<u64>>, Cancelled> {
        run.stage("winding number");
        let mut busy = [occupied(&self.touched), self.rims.clone()].concat();
        busy.sort_unstable();
        busy.dedup();
        let size = BLOCK << self.lattice.levels().saturating_sub(BLOCK.trailing_zeros());
        let mut octants = Vec::new();
        split([0; 3], size, &busy, &mut octants);
        par::blocks(run, octants.len(), 1, |range| {
            let mut borders = Vec::new();
            let mut fill = |[x, y, z]: [u32; 3], length: u32| {
                borders.push(border(self.lattice, [x, y, z], false));
                borders.push(border(self.lattice, [x + length, y, z], true));
            };
            for &(low, size) in &octants[range] {
                self.octant(low, size, &busy, &mut fill);
            }
            borders
        })
    }

    fn at(&self, cell: [u32; 3]) -> Value {
        let point = self.lattice.placement().place(cell.map(f64::from));
        Value::of(self.winding.at(point))
    }

    /// Fills one octant.
    fn octant(&self, low: [u32; 3], size: u32, busy: &[u64], fill: &mut impl FnMut([u32; 3], u32)) {
        let cells = self.lattice.cells();
        let high: [u32; 3] = std::array::from_fn(|a| (low[a] + size).min(cells[a]));
        if (0..3).any(|a| low[a] >= high[a]) {
            return;
        }
        let region = Region { start: low.map(|i| i as usize), end: high.map(|i| i as usize) };
        let busy = within(low, size, busy);
        if busy.is_empty() {
            let first = self.at(low);
            let same = |c: u32| {
                let sample = std::array::from_fn(|a| match c {
                    8 => (low[a] + high[a]) / 2,
                    c if c >> a & 1 == 1 => high[a] - 1,
                    _ => low[a],
                });
                self.at(sample) == first
            };
            if matches!(first, Value::Whole(_)) && (1..9).all(same) {
                if first.is_inside() {
                    for z in low[2]..high[2] {
                        (low[1]..high[1]).for_each(|y| fill([low[0], y, z], high[0] - low[0]));
                    }
                }
                return;
            }
        }
        if size == BLOCK {
            let rim = self.rims.binary_search(&name(low)).is_ok();
            return self.block(low, region, rim, fill);
        }
        for octant in 0..8 {
            let child = std::array::from_fn(|a| low[a] + (octant >> a & 1) * size / 2);
            self.octant(child, size / 2, busy, fill);
        }
    }

    /// Fills one block, cell by cell.
    fn block(
        &self,
        low: [u32; 3],
        region: Region,
        rim: bool,
        fill: &mut impl FnMut([u32; 3], u32),
    ) {
        let dims = region.dims();
        let Ok(Block::U8(touched)) = self.touched.read(region) else {
            return;
        };
        let cell = |i: usize| {
            let local = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
            std::array::from_fn(|a| low[a] + local[a] as u32)
        };
        let mut values = vec![Value::Unknown; touched.len()];
        if rim {
            let numbers: Vec<usize> = (0..values.len()).collect();
            values = par::map(&numbers, |&i| self.at(cell(i)));
        }
        let mut seen: Vec<bool> = touched.iter().map(|&t| rim || t == 1).collect();
        for start in 0..values.len() {
            if seen[start] {
                continue;
            }
            let set = connected(start, dims, &mut seen);
            let count = SAMPLES.min(set.len());
            let sample = |s: usize| self.at(cell(set[s * (set.len() - 1) / (count - 1).max(1)]));
            let first = sample(0);
            let agree = matches!(first, Value::Whole(_)) && (1..count).all(|s| sample(s) == first);
            for &i in &set {
                values[i] = if agree { first } else { self.at(cell(i)) };
            }
        }
        for (r, row) in values.chunks_exact_mut(dims[0]).enumerate() {
            let first = cell(r * dims[0]);
            self.touched_of_row(first, row);
            let mut x = 0;
            for run in row.chunk_by(|a, b| a.is_inside() == b.is_inside()) {
                if run[0].is_inside() {
                    fill([first[0] + x, first[1], first[2]], run.len() as u32);
                }
                x += run.len() as u32;
            }
        }
    }

    /// Finds the values of the touched cells of a row that begins with cell `first`.
    fn touched_of_row(&self, first: [u32; 3], row: &mut [Value]) {
        let touched: Vec<bool> = row.iter().map(|&v| v == Value::Unknown).collect();
        if !touched.contains(&true) {
            return;
        }
        // The jump between the centre of the cell before and that of each cell.
        let mut jumps = vec![0; row.len()];
        let start = row_major(self.lattice, first) << 1;
        let end = start + (row.len() as u64) * 2;
        let at = self.borders.partition_point(|&b| b < start);
        for b in self.borders[at..].iter().take_while(|&&b| b < end) {
            let x = (b >> 1 & ((1 << X_BITS) - 1)) as usize - first[0] as usize;
            jumps[x] += if b & 1 == 0 { 1 } else { -1 };
        }
        let mut forward = row.to_vec();
        for x in 1..row.len() {
            if touched[x] {
                forward[x] = forward[x - 1].plus(jumps[x]);
            }
        }
        let mut backward = row.to_vec();
        for x in (0..row.len() - 1).rev() {
            if touched[x] {
                backward[x] = backward[x + 1].plus(-jumps[x + 1]);
            }
        }
        for x in (0..row.len()).filter(|&x| touched[x]) {
            row[x] = match (forward[x], backward[x]) {
                (Value::Whole(f), Value::Whole(b)) if f == b => Value::Whole(f),
                (Value::Whole(w), Value::Unknown) | (Value::Unknown, Value::Whole(w)) => {
                    Value::Whole(w)
                }
                _ => self.at([first[0] + x as u32, first[1], first[2]]),
            };
        }
    }
}

/// The names among `busy` that lie in an octant.
fn within(low: [u32; 3], size: u32, busy: &[u64]) -> &[u64] {
    let first = name(low);
    let end = first + u64::from(size / BLOCK).pow(3);
    let start = busy.partition_point(|&b| b < first);
    let count = busy[start..].partition_point(|&b| b < end);
    &busy[start..start + count]
}

/// Cuts an octant into those that are not busy, as large as can be, and busy ones of the size of
/// one unit of work.
fn split(low: [u32; 3], size: u32, busy: &[u64], octants: &mut Vec<([u32; 3], u32)>) {
    let busy = within(low, size, busy);
    if busy.is_empty() || size <= TASK {
        return octants.push((low, size));
    }
    for octant in 0..8 {
        let child = std::array::from_fn(|a| low[a] + (octant >> a & 1) * size / 2);
        split(child, size / 2, busy, octants);
    }
}

/// The cells that are joined to `start` by faces over cells not yet seen; marks them as seen.
fn connected(start: usize, dims: [usize; 3], seen: &mut [bool]) -> Vec<usize> {
    let steps = [1, dims[0], dims[0] * dims[1]];
    let mut set = vec![start];
    seen[start] = true;
    let mut next = 0;
    while let Some(&i) = set.get(next) {
        next += 1;
        for (axis, &step) in steps.iter().enumerate() {
            let place = i / step % dims[axis];
            for other in [(place > 0).then(|| i - step), (place + 1 < dims[axis]).then(|| i + step)]
                .into_iter()
                .flatten()
            {
                if !std::mem::replace(&mut seen[other], true) {
                    set.push(other);
                }
            }
        }
    }
    set.sort_unstable();
    set
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use crate::measure::Nearest;
    use crate::samples::Sample;

    #[test]
    fn threads_do_not_change_a_byte() {
        let mut mesh = Sample::Torus.polygons(40).unwrap().triangulate();
        mesh.triangles.drain(40..90);
        let lattice = Lattice::fit(mesh.bounds().unwrap(), 150).unwrap();
        let all = [1, 2, 3, 8].map(|threads| {
            par::with_threads(threads, || solid(&mesh, &lattice, &Run::default()).unwrap())
        });
        assert!(all.windows(2).all(|s| s[0] == s[1]));
        assert!(all[0].count() > 100_000);
    }

    #[test]
    fn an_open_shell_turned_inside_out_keeps_its_inside() {
        let mut mesh = Sample::Sphere.polygons(24).unwrap().triangulate();
        mesh.triangles.drain(40..52);
        let lattice = Lattice::fit(mesh.bounds().unwrap(), 30).unwrap();
        let outward = solid(&mesh, &lattice, &Run::default()).unwrap();
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(outward.count(), solid(&mesh, &lattice, &Run::default()).unwrap().count());
    }

    #[test]
    fn a_nearly_closed_ball_is_filled_as_the_winding_number_says() {
        let mut mesh = Sample::Sphere.polygons(24).unwrap().triangulate();
        // A hole of a few triangles.
        mesh.triangles.drain(40..52);
        let lattice = Lattice::fit(mesh.bounds().unwrap(), 40).unwrap();
        let spans = solid(&mesh, &lattice, &Run::default()).unwrap();
        let (winding, nearest) = (Winding::new(&mesh), Nearest::new(&mesh));
        let mut wrong = 0;
        for i in 0..64_000u32 {
            let cell = [i % 40, i / 40 % 40, i / 1600];
            let centre = lattice.placement().place(cell.map(f64::from));
            let w = winding.at(centre);
            // Centres within a snap of the surface may go either way.
            let near = nearest.nearest_within(centre, 1e-4 * lattice.cell()).is_some();
            if !near && (w - 0.5).abs() > 1e-3 && spans.contains(cell) != (w >= 0.5) {
                wrong += 1;
            }
        }
        assert_eq!(wrong, 0);
        assert!(spans.count() > 25_000);
    }
}

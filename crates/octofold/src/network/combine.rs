//! Set operations, row by row.
//!
//! A row of the result follows from the same row of each operand, so an operation reads every run
//! once. Source: specification (A6, row-merge mode).

use crate::par;
use crate::rows::Rows;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::Volume;

/// Slices that one unit of work takes: many, since the tables of all but the first are moved.
const BLOCK: usize = 256;

/// A set operation. On more than two solids it takes in one after the other, which is what its
/// variants say of all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Operation {
    /// What is in any.
    Union,
    /// What is in all.
    Intersection,
    /// What is in the first and in no other.
    Difference,
    /// What is in an odd number of them.
    SymmetricDifference,
}

impl Operation {
    /// Whether a voxel is in the result for two solids, of which it is in the first or not, and in
    /// the second or not.
    pub fn keeps(self, first: bool, second: bool) -> bool {
        match self {
            Self::Union => first || second,
            Self::Intersection => first && second,
            Self::Difference => first && !second,
            Self::SymmetricDifference => first != second,
        }
    }
}

/// Combines solids on one grid, which is that of the first; `None` where there are none or their
/// grids differ in size.
pub fn combine(
    operation: Operation,
    solids: &[&Spans],
    run: &Run,
) -> Result<Option<Spans>, Cancelled> {
    let Some((first, others)) = solids.split_first() else { return Ok(None) };
    if others.iter().any(|s| s.dims() != first.dims()) {
        return Ok(None);
    }
    let mut whole = None;
    for other in others {
        whole = Some(two(operation, whole.as_ref().unwrap_or(first), other, run)?);
    }
    Ok(Some(whole.unwrap_or_else(|| (*first).clone())))
}

/// Combines two solids on one grid.
fn two(operation: Operation, a: &Spans, b: &Spans, run: &Run) -> Result<Spans, Cancelled> {
    let kept = [operation.keeps(true, false), operation.keeps(false, true)];
    let tables = [a.rows(), b.rows()];
    let parts = par::blocks(run, a.dims()[2], BLOCK, |slices| {
        let mut rows = Rows::default();
        // One table is filled without ever being moved.
        rows.reserve(&tables, slices.clone());
        for z in slices {
            rows.merge_slice(tables, z, kept, |a, b, out| match (a, b) {
                ([a], [b]) => merge_single(operation, *a, *b, out),
                _ => merge(operation, a, b, |run| out.push(run)),
            });
        }
        rows
    })?;
    Ok(Spans::from_rows(a.dims(), a.placement, parts))
}

/// Runs of the result in a row in which both solids have one run: most rows of most solids.
fn merge_single(operation: Operation, a: [u32; 2], b: [u32; 2], out: &mut Vec<[u32; 2]>) {
    let mut push = |start: u32, end: u32| {
        if start < end {
            out.push([start, end]);
        }
    };
    match operation {
        Operation::Union if a[0].max(b[0]) <= a[1].min(b[1]) => {
            push(a[0].min(b[0]), a[1].max(b[1]));
        }
        Operation::Intersection => push(a[0].max(b[0]), a[1].min(b[1])),
        Operation::Difference => {
            push(a[0], a[1].min(b[0]));
            push(a[0].max(b[1]), a[1]);
        }
        Operation::SymmetricDifference if a[0].max(b[0]) < a[1].min(b[1]) => {
            push(a[0].min(b[0]), a[0].max(b[0]));
            push(a[1].min(b[1]), a[1].max(b[1]));
        }
        _ => merge(operation, &[a], &[b], |[start, end]| push(start, end)),
    }
}

/// Runs of the result in one row.
pub(super) fn merge(
    operation: Operation,
    a: &[[u32; 2]],
    b: &[[u32; 2]],
    mut push: impl FnMut([u32; 2]),
) {
    // Ends of runs in order: even places begin one, odd ones end it.
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let (mut i, mut j) = (0, 0);
    let end = |row: &[u32], i: usize| row.get(i).copied().unwrap_or(u32::MAX);
    let (mut p, mut q) = (end(a, 0), end(b, 0));
    let keeps = [false, true].map(|in_b| [false, true].map(|in_a| operation.keeps(in_a, in_b)));
    let (mut inside, mut start) = (false, 0);
    while p.min(q) != u32::MAX {
        let x = p.min(q);
        if p == x {
            i += 1;
            p = end(a, i);
        }
        if q == x {
            j += 1;
            q = end(b, j);
        }
        let keep = keeps[j % 2][i % 2];
        if keep && !inside {
            start = x;
        } else if inside && !keep {
            push([start, x]);
        }
        inside = keep;
    }
}

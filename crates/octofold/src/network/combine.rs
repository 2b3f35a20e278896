//! Set operations, row by row.
//!
//! A row of the result follows from the same row of each operand, so an operation reads every run
//! once. Source: specification (A6, row-merge mode).

use crate::par;
use crate::rows::Rows;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::Volume;

/// Slices that one unit of work takes.
const BLOCK: usize = 16;

/// A set operation on two or more solids.
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
    /// Whether a voxel is in the result that is in `inside` of `all` operands, the first among them
    /// or not.
    pub fn keeps(self, inside: usize, first: bool, all: usize) -> bool {
        match self {
            Self::Union => inside > 0,
            Self::Intersection => inside == all,
            Self::Difference => first && inside == 1,
            Self::SymmetricDifference => inside % 2 == 1,
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
    let slices = first.dims()[2];
    let parts = par::blocks(run, slices, BLOCK, |range| {
        let mut rows = Rows::default();
        for z in range {
            match others {
                [second] => slice_of_two(operation, first, second, z, &mut rows),
                _ => slice_of_all(operation, solids, z, &mut rows),
            }
            rows.end_slice();
        }
        rows
    })?;
    Ok(Some(Spans::from_rows(first.dims(), first.placement, parts)))
}

/// One slice of the result for two solids.
fn slice_of_two(operation: Operation, a: &Spans, b: &Spans, z: usize, rows: &mut Rows<[u32; 2]>) {
    let [keeps_a, keeps_b] = [true, false].map(|first| operation.keeps(1, first, 2));
    let (mut a, mut b) = (a.of_slice(z), b.of_slice(z));
    let (mut next_a, mut next_b) = (a.next(), b.next());
    loop {
        let y = match (next_a, next_b) {
            (None, None) => return,
            (Some((y, own)), other) if other.is_none_or(|(other, _)| y < other) => {
                if keeps_a {
                    rows.extend(own);
                }
                next_a = a.next();
                y
            }
            (Some((y, one)), Some((other, two))) if y == other => {
                merge_two(operation, one, two, |run| rows.push(run));
                (next_a, next_b) = (a.next(), b.next());
                y
            }
            (_, Some((y, own))) => {
                if keeps_b {
                    rows.extend(own);
                }
                next_b = b.next();
                y
            }
            (Some(_), None) => return,
        };
        rows.end_row(y);
    }
}

/// One slice of the result for any number of solids.
fn slice_of_all(operation: Operation, solids: &[&Spans], z: usize, rows: &mut Rows<[u32; 2]>) {
    let mut slice: Vec<_> = solids.iter().map(|s| s.of_slice(z).peekable()).collect();
    while let Some(y) = slice.iter_mut().filter_map(|s| s.peek().map(|r| r.0)).min() {
        let row = |s: &mut std::iter::Peekable<_>| s.next_if(|r: &(u32, _)| r.0 == y);
        let runs: Vec<&[[u32; 2]]> =
            slice.iter_mut().map(|s| row(s).map_or(&[][..], |r| r.1)).collect();
        merge_all(operation, &runs, |run| rows.push(run));
        rows.end_row(y);
    }
}

/// Runs of the result of an operation on the same row of two solids.
fn merge_two(operation: Operation, a: &[[u32; 2]], b: &[[u32; 2]], mut push: impl FnMut([u32; 2])) {
    // Ends of runs in order: even places begin one, odd ones end it.
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let (mut i, mut j) = (0, 0);
    let end = |row: &[u32], i: usize| row.get(i).copied().unwrap_or(u32::MAX);
    let (mut p, mut q) = (end(a, 0), end(b, 0));
    let keeps = [false, true].map(|in_b| {
        [false, true].map(|in_a| operation.keeps(usize::from(in_a) + usize::from(in_b), in_a, 2))
    });
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

/// Runs of the result of an operation on the same row of any number of solids.
fn merge_all(operation: Operation, rows: &[&[[u32; 2]]], mut push: impl FnMut([u32; 2])) {
    let mut at = vec![0; rows.len()];
    let mut start = None;
    loop {
        let ends = rows.iter().zip(&at).filter_map(|(row, &i)| row.as_flattened().get(i));
        let Some(&x) = ends.min() else { return };
        let mut inside = 0;
        for (row, i) in rows.iter().zip(&mut at) {
            *i += usize::from(row.as_flattened().get(*i) == Some(&x));
            inside += *i % 2;
        }
        match (start, operation.keeps(inside, at[0] % 2 == 1, rows.len())) {
            (None, true) => start = Some(x),
            (Some(from), false) => {
                push([from, x]);
                start = None;
            }
            _ => {}
        }
    }
}

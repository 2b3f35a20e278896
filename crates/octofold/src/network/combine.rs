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
            let mut slice: Vec<_> = solids.iter().map(|s| s.of_slice(z).peekable()).collect();
            while let Some(y) = slice.iter_mut().filter_map(|s| s.peek().map(|r| r.0)).min() {
                let row = |s: &mut std::iter::Peekable<_>| s.next_if(|r: &(u32, _)| r.0 == y);
                if let [a, b] = &mut slice[..] {
                    let [a, b] = [row(a), row(b)].map(|r| r.map_or(&[][..], |r| r.1));
                    merge_two(operation, a, b, |run| rows.push(run));
                } else {
                    let runs: Vec<&[[u32; 2]]> =
                        slice.iter_mut().map(|s| row(s).map_or(&[][..], |r| r.1)).collect();
                    merge_all(operation, &runs, |run| rows.push(run));
                }
                rows.end_row(y);
            }
            rows.end_slice();
        }
        rows
    })?;
    Ok(Some(Spans::from_rows(first.dims(), first.placement, parts)))
}

/// Runs of the result of an operation on the same row of two solids.
fn merge_two(operation: Operation, a: &[[u32; 2]], b: &[[u32; 2]], mut push: impl FnMut([u32; 2])) {
    // Ends of runs in order: even places begin one, odd ones end it.
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let (mut i, mut j) = (0, 0);
    let mut start = None;
    let keeps = [false, true].map(|in_b| {
        [false, true].map(|in_a| operation.keeps(usize::from(in_a) + usize::from(in_b), in_a, 2))
    });
    while i < a.len() || j < b.len() {
        let x = match (a.get(i), b.get(j)) {
            (Some(&p), Some(&q)) => p.min(q),
            (Some(&p), None) => p,
            (None, Some(&q)) => q,
            (None, None) => return,
        };
        i += usize::from(a.get(i) == Some(&x));
        j += usize::from(b.get(j) == Some(&x));
        match (start, keeps[j % 2][i % 2]) {
            (None, true) => start = Some(x),
            (Some(from), false) => {
                push([from, x]);
                start = None;
            }
            _ => {}
        }
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

//! Solids from what is known of boxes.
//!
//! Whoever can tell of a cube of cells that it is full or empty need not be asked for each cell:
//! cubes that are neither are divided, and only what is left is asked for row by row. The work is
//! that of the surface.

use super::Spans;
use crate::par;
use crate::rows::Rows;
use crate::run::{Cancelled, Run};
use crate::volume::Placement;
use std::ops::Range;

/// Rows along y and z that are divided as one: the side of the largest cubes.
pub(crate) const TILE: u32 = 32;

/// A solid that is asked for boxes.
pub(crate) trait Boxes: Sync {
    /// Side of the smallest cubes that are looked at: a power of two up to [`TILE`].
    const LEAST: u32;

    /// Whether the cube of `side` cells from `at` on is full or empty, where that is known; it may
    /// reach beyond the grid.
    fn look(&self, at: [u32; 3], side: u32) -> Option<bool>;

    /// Calls `push` with the runs among some cells of row `[y, z]`, in order.
    fn row(&self, row: [u32; 2], cells: Range<u32>, push: impl FnMut([u32; 2]));
}

impl Spans {
    /// The cells of a solid that is asked for boxes.
    pub(crate) fn of_boxes(
        dims: [usize; 3],
        placement: Placement,
        boxes: &impl Boxes,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        let size = TILE as usize;
        let parts = par::blocks(run, dims[2], size, |slices| {
            let z = slices.start as u32;
            let tile = |y: usize| Tile::new(boxes, dims, [y as u32, z]);
            let tiles: Vec<Tile> = (0..dims[1]).step_by(size).map(tile).collect();
            let mut rows = Rows::default();
            for z in 0..slices.len() {
                for y in 0..dims[1] {
                    rows.extend(tiles[y / size].row([y % size, z]));
                    rows.end_row(y as u32);
                }
                rows.end_slice();
            }
            rows
        })?;
        Ok(Self::from_rows(dims, placement, parts))
    }
}

/// The rows of a square of [`TILE`] rows along y and z.
struct Tile {
    dims: [u32; 3],
    /// First row.
    from: [u32; 2],
    /// Where the runs of each row are.
    rows: Vec<Range<usize>>,
    runs: Vec<[u32; 2]>,
}

/// Cells of a column of rows of which the same is known.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    start: u32,
    end: u32,
    full: Option<bool>,
}

impl Tile {
    fn new(boxes: &impl Boxes, dims: [usize; 3], from: [u32; 2]) -> Self {
        let dims = dims.map(|n| n as u32);
        let rows = vec![0..0; (TILE * TILE) as usize];
        let mut tile = Self { dims, from, rows, runs: Vec::new() };
        let whole = [Piece { start: 0, end: dims[0], full: None }];
        tile.divide(boxes, from, TILE, &whole);
        tile
    }

    fn row(&self, [y, z]: [usize; 2]) -> &[[u32; 2]] {
        &self.runs[self.rows[z * TILE as usize + y].clone()]
    }

    /// Looks at the cubes of `side` cells in the open pieces of a column of rows, and divides those that
    /// stay open.
    fn divide<B: Boxes>(&mut self, boxes: &B, [y, z]: [u32; 2], side: u32, open: &[Piece]) {
        if y >= self.dims[1] || z >= self.dims[2] {
            return;
        }
        let mut pieces: Vec<Piece> = Vec::new();
        let mut push = |piece: Piece| match pieces.last_mut() {
            Some(last) if last.full == piece.full => last.end = piece.end,
            _ => pieces.push(piece),
        };
        for piece in open {
            if piece.full.is_some() {
                push(*piece);
                continue;
            }
            for start in (piece.start..piece.end).step_by(side as usize) {
                let full = boxes.look([start, y, z], side);
                push(Piece { start, end: (start + side).min(piece.end), full });
            }
        }
        if pieces.iter().all(|piece| piece.full == Some(false)) {
            return;
        }
        if side > B::LEAST {
            let half = side / 2;
            for [y, z] in [[y, z], [y + half, z], [y, z + half], [y + half, z + half]] {
                self.divide(boxes, [y, z], half, &pieces);
            }
            return;
        }
        for z in z..(z + side).min(self.dims[2]) {
            for y in y..(y + side).min(self.dims[1]) {
                self.fill(boxes, [y, z], &pieces);
            }
        }
    }

    /// Adds the runs of a row.
    fn fill(&mut self, boxes: &impl Boxes, row: [u32; 2], pieces: &[Piece]) {
        let first = self.runs.len();
        let runs = &mut self.runs;
        let mut push = |[start, end]: [u32; 2]| match runs[first..].last_mut() {
            Some(last) if last[1] == start => last[1] = end,
            _ => runs.push([start, end]),
        };
        for piece in pieces {
            match piece.full {
                Some(true) => push([piece.start, piece.end]),
                Some(false) => {}
                None => boxes.row(row, piece.start..piece.end, &mut push),
            }
        }
        let [y, z] = [row[0] - self.from[0], row[1] - self.from[1]];
        self.rows[(z * TILE + y) as usize] = first..self.runs.len();
    }
}

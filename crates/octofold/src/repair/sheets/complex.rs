//! The dual complex of the cells that are not outside, as bits.
//!
//! Its 3-cells are the grid vertices that touch no outside cell, its 2-cells ("quads") the grid edges
//! none of whose four cells is outside, its 1-cells the faces and its 0-cells the cells themselves. A
//! vertex stands in the place of the cell at whose low corner it is, an edge in that of its low end.
//! Source: specification of repair (A.2).

use super::super::apexes::owner;
use super::super::bricks::{Block, Bricks, Halo, Place, coordinates, has};
use super::super::labels::{Labels, per_brick};
use crate::run::{Cancelled, Run};
use crate::surface::cell::edge_axis;

/// Vertices by what they touch, and edges by whether their quads stand.
pub struct Complex<'a> {
    /// The grid.
    pub bricks: &'a Bricks,
    /// Vertices that touch an outside cell.
    pub open: Vec<Block>,
    /// Vertices in parts that stay closed.
    pub solid: Vec<Block>,
    /// Edges along x, y and z that touch no outside cell and do not run within solid parts, but for
    /// those whose quads were taken away.
    pub quads: [Vec<Block>; 3],
}

/// What a vertex is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vertex {
    /// It touches an outside cell.
    Open,
    /// It lies in a part that stays closed.
    Solid,
    /// It touches no outside cell, and its part is thin.
    Thin,
}

impl<'a> Complex<'a> {
    /// The complex of some labels, in which `solid` tells the vertices of parts that stay closed.
    pub fn new(
        labels: &'a Labels,
        open: Vec<Block>,
        solid: Vec<Block>,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        let bricks = &labels.bricks;
        let quads = per_brick(bricks, run, |brick| {
            let uncut = uncut(&bricks.halo(brick, &labels.outside, &labels.outside_runs));
            let solid_round = bricks.halo(brick, &solid, &labels.inside_runs);
            let own = &solid[brick as usize];
            std::array::from_fn::<Block, 3, _>(|axis| {
                let ahead = ahead(&solid_round, axis);
                std::array::from_fn(|z| !uncut[axis][z] & !(own[z] & ahead[z]))
            })
        })?;
        let quads = std::array::from_fn(|axis| quads.iter().map(|q| q[axis]).collect());
        Ok(Self { bricks, open, solid, quads })
    }

    /// What the vertex at a place is.
    pub fn vertex(&self, place: Place) -> Vertex {
        if has(&self.open[place.brick as usize], place.cell) {
            Vertex::Open
        } else if has(&self.solid[place.brick as usize], place.cell) {
            Vertex::Solid
        } else {
            Vertex::Thin
        }
    }

    /// The place `by` cells further along an axis; `None` in a run.
    pub fn step(&self, place: Place, axis: usize, by: i32) -> Option<Place> {
        let mut local = coordinates(place.cell).map(|x| x as i32);
        local[axis] += by;
        self.bricks.place(place.brick, local)
    }

    /// Whether the quad of an edge stands.
    pub fn stands(&self, edge: Edge) -> bool {
        has(&self.quads[edge.axis][edge.place.brick as usize], edge.place.cell)
    }

    /// Takes the quad of an edge away.
    pub fn remove(&mut self, Edge { place, axis }: Edge) {
        self.quads[axis][place.brick as usize][place.cell as usize / 64] &=
            !(1 << (place.cell % 64));
    }

    /// The four edges of the face at the low corner of a cell that is square to an axis.
    pub fn edges_of_face(&self, place: Place, axis: usize) -> [Option<Edge>; 4] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = |place: Option<Place>, axis| place.map(|place| Edge { place, axis });
        [
            at(Some(place), u),
            at(Some(place), v),
            at(self.step(place, v, 1), u),
            at(self.step(place, u, 1), v),
        ]
    }

    /// The four cells round an edge.
    pub fn cells_round(&self, Edge { place, axis }: Edge) -> [Option<Place>; 4] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let below = self.step(place, u, -1);
        let across = below.and_then(|p| self.step(p, v, -1));
        [Some(place), below, across, self.step(place, v, -1)]
    }

    /// The four faces round an edge, each by the cell at whose low corner it is and its axis.
    pub fn faces_round(&self, Edge { place, axis }: Edge) -> [Option<(Place, usize)>; 4] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        [
            Some((place, u)),
            Some((place, v)),
            self.step(place, v, -1).map(|p| (p, u)),
            self.step(place, u, -1).map(|p| (p, v)),
        ]
    }
}

/// An edge of the grid: the place of its low end, and its axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Of its low end.
    pub place: Place,
    /// Along which it runs.
    pub axis: usize,
}

impl Edge {
    /// Edge `e` of a cell.
    pub fn of_cell(bricks: &Bricks, cell: Place, e: usize) -> Option<Self> {
        Some(Self { place: owner(bricks, cell, e)?, axis: edge_axis(e) })
    }

    /// A number for each edge, in order of the bricks.
    pub fn key(self) -> u64 {
        let vertex = u64::from(self.place.brick) << 9 | u64::from(self.place.cell);
        3 * vertex + self.axis as u64
    }
}

/// The vertices that touch an outside cell.
pub fn open_vertices(labels: &Labels, run: &Run) -> Result<Vec<Block>, Cancelled> {
    per_brick(&labels.bricks, run, |brick| {
        let halo = labels.bricks.halo(brick, &labels.outside, &labels.outside_runs);
        block_of(|y, z| {
            let row = |y: usize, z: usize| halo[10 * z + y];
            let all = row(y, z) | row(y + 1, z) | row(y, z + 1) | row(y + 1, z + 1);
            all | all >> 1
        })
    })
}

/// The edges that touch an outside cell, along x, y and z.
fn uncut(halo: &Halo) -> [Block; 3] {
    // Cell y lies in row y + 1, cell x in bit x + 1.
    let row = |y: usize, z: usize| halo[10 * z + y];
    [
        block_of(|y, z| (row(y, z) | row(y + 1, z) | row(y, z + 1) | row(y + 1, z + 1)) >> 1),
        block_of(|y, z| {
            let two = row(y + 1, z) | row(y + 1, z + 1);
            two | two >> 1
        }),
        block_of(|y, z| {
            let two = row(y, z + 1) | row(y + 1, z + 1);
            two | two >> 1
        }),
    ]
}

/// The bits of a halo one further along an axis.
pub fn ahead(halo: &Halo, axis: usize) -> Block {
    let [dx, dy, dz] = [usize::from(axis == 0), usize::from(axis == 1), usize::from(axis == 2)];
    block_of(|y, z| halo[10 * (z + 1 + dz) + y + 1 + dy] >> (1 + dx))
}

/// The block whose rows have the low eight bits of `row(y, z)`.
fn block_of(row: impl Fn(usize, usize) -> u16) -> Block {
    std::array::from_fn(|z| (0..8).fold(0, |word, y| word | u64::from(row(y, z) as u8) << (8 * y)))
}

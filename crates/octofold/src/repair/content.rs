//! What the input does to the cells: which facets touch each, and where its boundary edges run.
//!
//! Facets are canonical: corners and facets in order, none twice. So it does not matter in which
//! order or which way round the input names them, nor how often.

use super::RepairError;
use super::bricks::{BRICK, Block, Bricks, Place, Slot, cell_of};
use super::frame::Frame;
use crate::mesh::Mesh;
use crate::par;
use crate::radix::{self, Equal};
use crate::run::Run;
use crate::scan::{self, Facet};
use crate::voxelize;
use std::ops::Range;

/// The input on its lattice, and the cells that it touches.
pub struct Content {
    /// Distinct facets in sub-steps, their corners in order.
    pub facets: Vec<Facet>,
    /// Cell and facet of each touch, in order: code of the brick, place in it, facet.
    touches: Vec<u64>,
    facet_bits: u32,
}

/// Bits of a place in a brick.
const PLACE_BITS: u32 = 9;

/// Touches that are taken on; sixteen bytes each while they are sorted.
const MOST_TOUCHES: f64 = 5e8;

impl Content {
    /// Scans the triangles of a mesh.
    pub fn new(mesh: &Mesh, frame: &Frame, run: &Run) -> Result<Self, RepairError> {
        run.stage("snap");
        let mut facets = voxelize::facets(mesh, &frame.lattice);
        facets.iter_mut().for_each(|f| f.sort_unstable());
        par::sort(&mut facets);
        facets.dedup();
        let cell = f64::from(1u32 << frame.lattice.sub_bits());
        let squares: f64 = facets.iter().map(|f| area(f) / (cell * cell)).sum();
        if squares + facets.len() as f64 > MOST_TOUCHES {
            return Err(RepairError::TooManyCells(squares));
        }
        run.stage("scan");
        let dims = frame.bricks();
        let bricks: u64 = dims.iter().map(|&d| u64::from(d)).product();
        let facet_bits = u64::BITS - (facets.len() as u64).leading_zeros();
        if u64::BITS - bricks.leading_zeros() + PLACE_BITS + facet_bits > u64::BITS {
            return Err(RepairError::TooManyCells(bricks as f64));
        }
        let block = voxelize::block_of(facets.len());
        let found = par::blocks(run, facets.len(), block, |range| {
            let mut touches = Vec::new();
            for number in range {
                scan::cells(&facets[number], frame.lattice.sub_bits(), |cell| {
                    let code = Bricks::code(dims, cell.map(|x| x / BRICK));
                    let place = code << PLACE_BITS | u64::from(cell_of(cell.map(|x| x % BRICK)));
                    touches.push(place << facet_bits | number as u64);
                });
            }
            touches
        })?;
        let touches = radix::sort(found, PLACE_BITS + facet_bits, Equal::Keep).concat();
        run.check()?;
        Ok(Self { facets, touches, facet_bits })
    }

    /// The codes of all bricks that a facet touches, in order.
    pub fn codes(&self) -> Vec<u64> {
        let code = |touch: &u64| touch >> (PLACE_BITS + self.facet_bits);
        self.touches.chunk_by(|a, b| code(a) == code(b)).map(|c| code(&c[0])).collect()
    }

    /// The cells that the input touches, for each brick.
    pub fn full(&self, bricks: &Bricks) -> (Vec<Block>, Vec<Range<usize>>) {
        let mut full = vec![[0; 8]; bricks.len()];
        let mut ranges = vec![0..0; bricks.len()];
        let code = |touch: &u64| touch >> (PLACE_BITS + self.facet_bits);
        let mut brick = 0;
        let mut start = 0;
        let codes: Vec<u64> = bricks.codes().collect();
        for chunk in self.touches.chunk_by(|a, b| code(a) == code(b)) {
            while codes[brick] < code(&chunk[0]) {
                brick += 1;
            }
            for touch in chunk {
                let place = (touch >> self.facet_bits) as usize & ((1 << PLACE_BITS) - 1);
                full[brick][place / 64] |= 1 << (place % 64);
            }
            ranges[brick] = start..start + chunk.len();
            start += chunk.len();
        }
        (full, ranges)
    }

    /// The facets that touch a cell of a brick, whose touches are `range`.
    pub fn facets_in(&self, range: Range<usize>, cell: u32) -> impl Iterator<Item = u32> + '_ {
        let touches = &self.touches[range];
        let place = |t: &u64| (t >> self.facet_bits) as u32 & ((1 << PLACE_BITS) - 1);
        let start = touches.partition_point(|t| place(t) < cell);
        let facet = |t: &u64| (t & ((1 << self.facet_bits) - 1)) as u32;
        touches[start..].iter().take_while(move |t| place(t) == cell).map(facet)
    }

    /// The edges with one facet, and the cells that they touch.
    pub fn rims(&self, frame: &Frame, run: &Run) -> Result<Rims, RepairError> {
        let dims = frame.bricks();
        let edges = rims(&self.facets);
        let found = par::blocks(run, edges.len(), 1024, |range| {
            let mut touches = Vec::new();
            for number in range {
                let [p, q] = edges[number];
                scan::cells(&[p, q, q], frame.lattice.sub_bits(), |cell| {
                    let code = Bricks::code(dims, cell.map(|x| x / BRICK));
                    touches.push((code, cell_of(cell.map(|x| x % BRICK)), number as u32));
                });
            }
            touches
        })?;
        let mut touches = found.concat();
        par::sort(&mut touches);
        Ok(Rims { edges, touches })
    }
}

/// The borders of the input: edges with one facet.
pub struct Rims {
    edges: Vec<[[i32; 3]; 2]>,
    /// Code of the brick, place in it, and edge of each touch, in order.
    touches: Vec<(u64, u32, u32)>,
}

impl Rims {
    /// The cells that they touch, in codes of bricks and places.
    pub fn cells(&self) -> Vec<(u64, u32)> {
        let alike = self.touches.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        alike.map(|c| (c[0].0, c[0].1)).collect()
    }

    /// Those through a cell, their ends in sub-steps.
    pub fn through(&self, bricks: &Bricks, place: Place) -> impl Iterator<Item = [[i32; 3]; 2]> {
        let cell = (Bricks::code(bricks.dims(), bricks.at(place.brick)), place.cell);
        let start = self.touches.partition_point(|t| (t.0, t.1) < cell);
        let own = self.touches[start..].iter().take_while(move |t| (t.0, t.1) == cell);
        own.map(|t| self.edges[t.2 as usize])
    }
}

/// The bricks with the given codes, those within `reach` of `near`, and blocks of the cells of `near`.
pub fn bricks_round(
    dims: [u32; 3],
    mut codes: Vec<u64>,
    near: &[(u64, u32)],
    reach: u32,
) -> (Bricks, Vec<Block>) {
    let [nx, ny, _] = dims.map(u64::from);
    for chunk in near.chunk_by(|a, b| a.0 == b.0) {
        let code = chunk[0].0;
        let at = [code % nx, code / nx % ny, code / nx / ny].map(|x| x as u32);
        // The ring of bricks at the border is further away than closing reaches.
        let span = |a: usize| at[a].saturating_sub(reach).max(1)..=(at[a] + reach).min(dims[a] - 2);
        for z in span(2) {
            for y in span(1) {
                codes.extend(span(0).map(|x| Bricks::code(dims, [x, y, z])));
            }
        }
    }
    par::sort(&mut codes);
    codes.dedup();
    let bricks = Bricks::new(dims, &codes);
    let mut blocks = vec![[0; 8]; bricks.len()];
    for &(code, cell) in near {
        let at = [code % nx, code / nx % ny, code / nx / ny].map(|x| x as u32);
        if let Slot::Brick(brick) = bricks.slot(at) {
            blocks[brick as usize][cell as usize / 64] |= 1u64 << (cell % 64);
        }
    }
    (bricks, blocks)
}

/// Edges with exactly one facet.
fn rims(facets: &[Facet]) -> Vec<[[i32; 3]; 2]> {
    let mut edges: Vec<[[i32; 3]; 2]> = Vec::with_capacity(3 * facets.len());
    for [a, b, c] in facets {
        if a != b && b != c {
            edges.extend([[*a, *b], [*b, *c], [*a, *c]]);
        }
    }
    par::sort(&mut edges);
    edges.chunk_by(|a, b| a == b).filter(|c| c.len() == 1).map(|c| c[0]).collect()
}

/// Area in square sub-steps.
fn area(facet: &Facet) -> f64 {
    let [a, b, c] = facet.map(|p| glam::DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a).length() / 2.0
}

//! The finest octants: those round crossed edges, and those that hold a vertex or a border.

use super::crossings::Crossings;
use super::edges::across;
use super::rim::Rim;
use super::sums::Sum;
use crate::octree::key::morton;
use crate::par;
use crate::radix::{self, Equal, Tagged};
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// Items of one block of work.
const BLOCK: usize = 1 << 14;

/// What a record says of its cell, in the lowest bits of its tag.
const EDGE: u64 = 0;
const VERTEX: u64 = 1;
const BORDER: u64 = 2;

/// The finest octants in Morton order.
#[derive(Debug, Default)]
pub(super) struct Leaves {
    pub codes: Vec<u64>,
    /// What was found in them: sorted records, and the first one of each octant.
    records: Vec<Tagged>,
    firsts: Vec<u32>,
}

/// Something that was found in a finest octant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// An edge of the octant, by its place among all crossed edges and its number in the octant.
    Edge(usize, usize),
    /// A vertex of the surface, by its number.
    Vertex(usize),
    /// A piece of the surface's border.
    Border,
}

impl From<Tagged> for Found {
    fn from(record: Tagged) -> Self {
        let what = (record.tag >> 8) as usize;
        match record.tag & 3 {
            EDGE => Self::Edge(what, (record.tag >> 2 & 15) as usize),
            VERTEX => Self::Vertex(what),
            _ => Self::Border,
        }
    }
}

impl Leaves {
    /// The finest octants of a surface with these crossings; `vertices` are in finest cells.
    pub(super) fn new(
        crossings: &Crossings,
        vertices: &[DVec3],
        rim: &Rim,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        run.stage("leaves");
        let mut found = par::blocks(run, crossings.edges.len(), BLOCK, |block| {
            let mut found = Vec::with_capacity(4 * block.len());
            for i in block {
                let edge = &crossings.edges[i];
                let [b, c] = across(edge.axis as usize);
                for side in 0..4u64 {
                    let mut cell = edge.low;
                    if side & 1 == 1 {
                        cell = before(cell, b);
                    }
                    if side & 2 == 2 {
                        cell = before(cell, c);
                    }
                    let local = u64::from(edge.axis) * 4 + side;
                    found.push(Tagged { key: cell, tag: (i as u64) << 8 | local << 2 | EDGE });
                }
            }
            found
        })?;
        found.extend(par::blocks(run, vertices.len(), BLOCK, |block| {
            let tagged = |i: usize| {
                let cell = vertices[i].to_array().map(|x| x as u32);
                Tagged { key: morton(cell), tag: (i as u64) << 8 | VERTEX }
            };
            block.map(tagged).collect::<Vec<_>>()
        })?);
        if !rim.cells.is_empty() {
            found.push(rim.cells.iter().map(|&key| Tagged { key, tag: BORDER }).collect());
        }
        let shares = radix::sort(found, 0, Equal::Keep);
        run.check()?;
        let parts = par::map(&shares, |share| {
            let groups = share.chunk_by(|a, b| a.key == b.key);
            groups.map(|group| (group[0].key, group.len() as u32)).collect::<Vec<_>>()
        });
        let mut all = Self { firsts: vec![0], records: shares.concat(), ..Self::default() };
        let mut end = 0;
        for (code, length) in parts.into_iter().flatten() {
            end += length;
            all.codes.push(code);
            all.firsts.push(end);
        }
        Ok(all)
    }

    /// What adds up in leaf `i`.
    pub(super) fn sum(&self, i: usize, crossings: &Crossings, vertices: &[DVec3]) -> Sum {
        let mut sum = Sum::NOTHING;
        for found in self.found(i) {
            match found {
                Found::Edge(i, local) => {
                    let edge = &crossings.edges[i];
                    let samples = crossings.of(i);
                    sum.edge(local, samples.len(), edge.inside);
                    for s in samples {
                        let sample = &crossings.samples[s];
                        let colour = crossings.colours.as_ref().map(|c| c[s]);
                        sum.crossing(sample, edge.at(sample), colour);
                    }
                }
                Found::Vertex(i) => sum.corner(vertices[i]),
                Found::Border => sum.border(),
            }
        }
        sum
    }

    /// What was found in leaf `i`.
    pub(super) fn found(&self, i: usize) -> impl Iterator<Item = Found> {
        let range = self.firsts[i] as usize..self.firsts[i + 1] as usize;
        self.records[range].iter().map(|&record| Found::from(record))
    }
}

/// The Morton code of the cell before another along an axis; there is one.
fn before(code: u64, axis: usize) -> u64 {
    const X: u64 = 0x1249_2492_4924_9249;
    let own = X << axis;
    ((code & own).wrapping_sub(1 << axis) & own) | (code & !own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::key::unmorton;

    #[test]
    fn the_cell_before_is_one_less() {
        for cell in [[1, 2, 3], [8, 16, 64], [65_535, 32_768, 1], [7, 1, 4096]] {
            for axis in 0..3 {
                let mut expected = cell;
                expected[axis] -= 1;
                assert_eq!(unmorton(before(morton(cell), axis)), expected);
            }
        }
    }
}

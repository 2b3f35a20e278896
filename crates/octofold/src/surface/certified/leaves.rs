//! The octants that carry a patch: the largest whose surface is a disc that a patch stands for.
//!
//! Octants of one size settle first, each for itself: the whole octant, or its children, down to
//! single cells, which carry the surface itself. Where all octants below a parent are settled whole,
//! the parent is tried. Neighbours of other sizes bring new break points to an octant's loop; its patch is
//! then made again, and where that fails the octant is split, until nothing changes.
//!
//! Source: the specification's A.8, step 5, and D.2; the driver of Nishio, Kobori and Kutsuwa
//! 1997, section 3.1, is top-down.

use super::cells::{BRICK, Cells};
use super::octant::{self, Octant, is_break};
use super::patch::{self, Patch};
use super::tube::Tube;
use crate::par;
use crate::run::{Cancelled, Run};
use std::ops::Range;

/// Octants that one unit of work tries.
const BLOCK: usize = 4;

/// Cells along an edge of the octants that are tried first: large enough that most of a smooth
/// surface is not tried on many levels.
const START: u32 = 2 * BRICK;

/// An octant with its mixed cells and its patch.
#[derive(Debug, Clone)]
pub struct Leaf {
    pub octant: Octant,
    pub cells: Range<u32>,
    pub patch: Patch,
}

/// How leaves are made.
pub struct Settler<'a> {
    pub tube: &'a Tube<'a>,
    /// Tolerance of the polylines.
    pub polyline: f64,
}

impl Settler<'_> {
    fn cells(&self) -> &Cells {
        self.tube.cells
    }

    /// The leaves of a volume, in Morton order.
    pub fn leaves(&self, run: &Run) -> Result<Vec<Leaf>, Cancelled> {
        run.stage("octants");
        let bricks = self.cells().bricks() as u32;
        let octant = |brick: u32| {
            Octant::new(self.cells().corner(self.cells().in_brick(brick).start), START)
        };
        let mut starts: Vec<(Octant, Range<u32>)> = Vec::new();
        for brick in 0..bricks {
            let cells = self.cells().in_brick(brick);
            match starts.last_mut() {
                Some((last, range)) if *last == octant(brick) => range.end = cells.end,
                _ => starts.push((octant(brick), cells)),
            }
        }
        let settled = par::blocks(run, starts.len(), BLOCK, |range| {
            let starts = &starts[range];
            starts
                .iter()
                .map(|(octant, cells)| self.settle(*octant, cells.clone()))
                .collect::<Vec<_>>()
        })?;
        let mut nodes: Vec<Vec<Leaf>> = settled.into_iter().flatten().collect();
        let mut size = START;
        while nodes.len() > 1 {
            size *= 2;
            let before = nodes.len();
            nodes = self.merge(nodes, size, run)?;
            if nodes.len() == before && size > self.largest() {
                break;
            }
        }
        self.conform(nodes.into_iter().flatten().collect(), run)
    }

    /// Cells along an edge of the root.
    fn largest(&self) -> u32 {
        let [low, high] = self.cells().bounds;
        let most = (0..3).map(|a| high[a] - low[a]).max().unwrap_or(1);
        most.next_power_of_two()
    }

    /// The largest certified octants within an octant.
    fn settle(&self, octant: Octant, range: Range<u32>) -> Vec<Leaf> {
        if octant.size == 1 {
            let patch = patch::of_cell(self.cells(), range.start);
            return vec![Leaf { octant, cells: range, patch }];
        }
        match self.certify(octant, range.clone(), false) {
            Some(leaf) => vec![leaf],
            None => self.split(octant, range),
        }
    }

    fn split(&self, octant: Octant, range: Range<u32>) -> Vec<Leaf> {
        let children = octant.children(self.cells(), range);
        children.into_iter().flat_map(|(child, cells)| self.settle(child, cells)).collect()
    }

    /// The leaf of an octant on its own; `discs` as for [`octant::disc`].
    fn certify(&self, octant: Octant, range: Range<u32>, discs: bool) -> Option<Leaf> {
        let steps = octant::disc(self.cells(), octant, range.clone(), discs)?;
        let polygon = patch::polygon(self.cells(), &steps, self.polyline, |_| false);
        let patch = patch::fill(self.tube, octant, range.clone(), polygon)?;
        Some(Leaf { octant, cells: range, patch })
    }

    /// Tries the parents, of `size`, whose children are all settled whole.
    fn merge(
        &self,
        nodes: Vec<Vec<Leaf>>,
        size: u32,
        run: &Run,
    ) -> Result<Vec<Vec<Leaf>>, Cancelled> {
        let parent = |leaves: &[Leaf]| Octant::new(leaves[0].octant.corner, size);
        let mut groups: Vec<Vec<Vec<Leaf>>> = Vec::new();
        for node in nodes {
            match groups.last_mut() {
                Some(group) if parent(&group[0]) == parent(&node) => group.push(node),
                _ => groups.push(vec![node]),
            }
        }
        let merged = par::blocks(run, groups.len(), BLOCK, |range| {
            groups[range]
                .iter()
                .map(|group| self.merged(group, parent(&group[0])))
                .collect::<Vec<_>>()
        })?;
        Ok(groups
            .into_iter()
            .zip(merged.into_iter().flatten())
            .map(|(group, leaf)| match leaf {
                Some(leaf) => vec![leaf],
                None => group.into_iter().flatten().collect(),
            })
            .collect())
    }

    fn merged(&self, group: &[Vec<Leaf>], parent: Octant) -> Option<Leaf> {
        let whole = |node: &Vec<Leaf>| node.len() == 1 && 2 * node[0].octant.size == parent.size;
        if !group.iter().all(whole) {
            return None;
        }
        let range = group.first()?[0].cells.start..group.last()?[0].cells.end;
        self.certify(parent, range, true)
    }

    /// Brings the polygons of neighbours into line, and splits leaves that do not stand it.
    fn conform(&self, mut leaves: Vec<Leaf>, run: &Run) -> Result<Vec<Leaf>, Cancelled> {
        run.stage("polylines");
        let mut sizes = vec![0; self.cells().len()];
        let note = |sizes: &mut [u8], leaf: &Leaf| {
            let cells = leaf.cells.start as usize..leaf.cells.end as usize;
            sizes[cells].fill(leaf.octant.size.trailing_zeros() as u8);
        };
        leaves.iter().for_each(|leaf| note(&mut sizes, leaf));
        loop {
            let found = par::blocks(run, leaves.len(), BLOCK, |range| {
                leaves[range].iter().map(|leaf| self.conformed(leaf, &sizes)).collect::<Vec<_>>()
            })?;
            let mut next = Vec::with_capacity(leaves.len());
            let mut changed = false;
            for (mut leaf, conformed) in leaves.into_iter().zip(found.into_iter().flatten()) {
                match conformed {
                    Conformed::Same => next.push(leaf),
                    Conformed::New(patch) => {
                        leaf.patch = patch;
                        next.push(leaf);
                    }
                    Conformed::Split(parts) => {
                        changed = true;
                        parts.iter().for_each(|part| note(&mut sizes, part));
                        next.extend(parts);
                    }
                }
            }
            leaves = next;
            if !changed {
                return Ok(leaves);
            }
        }
    }

    fn conformed(&self, leaf: &Leaf, sizes: &[u8]) -> Conformed {
        if leaf.octant.size == 1 {
            return Conformed::Same;
        }
        let split = || Conformed::Split(self.split(leaf.octant, leaf.cells.clone()));
        let cells = self.cells();
        let Some(steps) = octant::boundary(cells, leaf.octant, leaf.cells.clone()) else {
            return split();
        };
        let is_break = |step: &_| is_break(cells, sizes, step);
        let polygon = patch::polygon(cells, &steps, self.polyline, is_break);
        if polygon == leaf.patch.polygon {
            return Conformed::Same;
        }
        match patch::fill(self.tube, leaf.octant, leaf.cells.clone(), polygon) {
            Some(patch) => Conformed::New(patch),
            None => split(),
        }
    }
}

/// What becomes of a leaf beside its neighbours.
enum Conformed {
    Same,
    New(Patch),
    Split(Vec<Leaf>),
}

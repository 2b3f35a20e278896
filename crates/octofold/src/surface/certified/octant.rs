//! The disc test: whether the surface in an octant is one disc, and the loop that bounds it.
//!
//! In a closed box, the surface has V crossed lattice edges, E segments on unit faces and F cell
//! loops. On the box's boundary segments form closed loops, so V and E cancel there, and
//! V - E + F is a sum over cells: a cell has its loops, half of every segment and a quarter of
//! every crossing that is not on the boundary. One boundary loop, connected, and V - E + F = 1
//! means a disc.
//!
//! Source: the specification's A.8, steps 1 and 2; loops as edge loop chains in Nishio, Kobori and
//! Kutsuwa 1997, section 3.2.

use super::cells::{Cells, State};
use crate::octree::VertexName;
use crate::surface::cell::{
    NO_EDGE, ONWARD, crossed, edge_at, edge_axis, edge_corner, faces_of, loops,
};
use std::ops::Range;
use std::sync::LazyLock;

/// A cube of cells, cut off at the volume's border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Octant {
    /// Low corner, a multiple of the size.
    pub corner: [u32; 3],
    /// Cells along an edge, a power of two.
    pub size: u32,
}

impl Octant {
    pub fn new(at: [u32; 3], size: u32) -> Self {
        Self { corner: at.map(|x| x & !(size - 1)), size }
    }

    /// Lowest and highest lattice points within the border.
    pub fn bounds(&self, cells: &Cells) -> [[u32; 3]; 2] {
        let [low, high] = cells.bounds;
        [
            std::array::from_fn(|a| self.corner[a].max(low[a])),
            std::array::from_fn(|a| (self.corner[a] + self.size).min(high[a])),
        ]
    }

    /// Splits a slice of mixed cells in this octant among its eight children.
    pub fn children(self, cells: &Cells, range: Range<u32>) -> Vec<(Self, Range<u32>)> {
        let half = self.size / 2;
        let mut children = Vec::with_capacity(8);
        let mut start = range.start;
        while start < range.end {
            let child = Self::new(cells.corner(start), half);
            let inside = |cell: u32| Self::new(cells.corner(cell), half) == child;
            let (mut low, mut high) = (start + 1, range.end);
            while low < high {
                let middle = low.midpoint(high);
                if inside(middle) { low = middle + 1 } else { high = middle }
            }
            children.push((child, start..low));
            start = low;
        }
        children
    }
}

/// One step along a boundary loop: a crossed edge, and the octant's face on which the next
/// segment runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    pub cell: u32,
    pub edge: u8,
    pub face: u8,
}

impl Step {
    /// The crossing's name, equal in all cells around it.
    pub fn name(&self, cells: &Cells) -> VertexName {
        let (edge, at) = (self.edge as usize, cells.corner(self.cell));
        let corner = edge_corner(edge) as u32;
        let low = std::array::from_fn(|a| at[a] + (corner >> a & 1));
        VertexName::on_edge(low, edge_axis(edge))
    }
}

/// For the six faces of a cell as bits, and its mask: four times its share of V - E + F, where
/// those faces lie on the boundary.
static SHARES: LazyLock<Box<[[i8; 256]; 64]>> = LazyLock::new(|| {
    let mut shares = Box::new([[0; 256]; 64]);
    for faces in 0..64 {
        for mask in 0..256 {
            let discs = 4 * loops(mask).len() as i8;
            let segments: i8 = (0..6)
                .filter(|f| faces >> f & 1 == 0)
                .map(|f| ONWARD[mask][f].iter().filter(|&&e| e != NO_EDGE).count() as i8)
                .sum();
            let on_boundary = |e: &usize| faces & faces_of(*e) as usize != 0;
            let free = (0..12).filter(|e| crossed(mask) >> e & 1 == 1 && !on_boundary(e));
            shares[faces][mask] = discs - 2 * segments + free.count() as i8;
        }
    }
    shares
});

/// Number of segments on the faces `faces` of a cell.
static SEGMENTS: LazyLock<Box<[[u8; 256]; 64]>> = LazyLock::new(|| {
    let mut counts = Box::new([[0; 256]; 64]);
    for faces in 0..64 {
        for mask in 0..256 {
            let on = (0..6).filter(|f| faces >> f & 1 == 1);
            counts[faces][mask] =
                on.map(|f| ONWARD[mask][f].iter().filter(|&&e| e != NO_EDGE).count() as u8).sum();
        }
    }
    counts
});

/// The loop in which a disc leaves the octant; `None` where the surface in it is no disc.
///
/// `discs` tells that the surface in each child that has any is a disc.
pub fn disc(cells: &Cells, octant: Octant, range: Range<u32>, discs: bool) -> Option<Vec<Step>> {
    let bounds = octant.bounds(cells);
    let (shares, segment_counts) = (&**SHARES, &**SEGMENTS);
    let (mut sum, mut segments, mut start) = (0i64, 0usize, None);
    for cell in range.clone() {
        let faces = faces_on(bounds, cells.corner(cell));
        let mask = cells.mask(cell);
        sum += i64::from(shares[faces as usize][mask]);
        let here = segment_counts[faces as usize][mask];
        if here > 0 {
            segments += usize::from(here);
            start.get_or_insert((cell, faces));
        }
    }
    if sum != 4 {
        return None;
    }
    let (cell, faces) = start?;
    let first = first_step(cells, cell, faces)?;
    let found = trace(cells, bounds, first, segments)?;
    let is_connected = || {
        if discs {
            joins_children(cells, octant, range.clone())
        } else {
            is_simple(cells, octant, range.clone()) || is_connected(cells, octant, range)
        }
    };
    (found.len() == segments && is_connected()).then_some(found)
}

/// The loop through the first boundary segment of an octant that is known to hold one disc.
pub fn boundary(cells: &Cells, octant: Octant, range: Range<u32>) -> Option<Vec<Step>> {
    let bounds = octant.bounds(cells);
    let segment_counts = &**SEGMENTS;
    let (mut segments, mut start) = (0, None);
    for cell in range {
        let faces = faces_on(bounds, cells.corner(cell));
        let here = segment_counts[faces as usize][cells.mask(cell)];
        if here > 0 {
            segments += usize::from(here);
            start.get_or_insert((cell, faces));
        }
    }
    let (cell, faces) = start?;
    trace(cells, bounds, first_step(cells, cell, faces)?, segments)
}

/// The faces of a cell, as bits, that lie on the boundary of a box.
fn faces_on([low, high]: [[u32; 3]; 2], at: [u32; 3]) -> u8 {
    (0..3).fold(0, |faces, a| {
        faces | u8::from(at[a] == low[a]) << (2 * a) | u8::from(at[a] + 1 == high[a]) << (2 * a + 1)
    })
}

fn first_step(cells: &Cells, cell: u32, faces: u8) -> Option<Step> {
    let mask = cells.mask(cell);
    (0..6u8).filter(|f| faces >> f & 1 == 1).find_map(|face| {
        let edge = ONWARD[mask][face as usize].iter().position(|&to| to != NO_EDGE)?;
        Some(Step { cell, edge: edge as u8, face })
    })
}

/// Follows the segments on the boundary of a box from `first` until they close; `None` where
/// they take more than `most` steps.
fn trace(cells: &Cells, bounds: [[u32; 3]; 2], first: Step, most: usize) -> Option<Vec<Step>> {
    let onward = &**ONWARD;
    let mut steps = Vec::with_capacity(most);
    let mut at = first;
    loop {
        if steps.len() == most {
            return None;
        }
        steps.push(at);
        let mask = cells.mask(at.cell);
        let edge = onward[mask][at.face as usize][at.edge as usize];
        debug_assert_ne!(edge, NO_EDGE);
        let other = faces_of(edge.into()) & !(1 << at.face);
        let corner = cells.corner(at.cell);
        at = if faces_on(bounds, corner) & other != 0 {
            // Round an edge of the box, within the same cell.
            Step { cell: at.cell, edge, face: other.trailing_zeros() as u8 }
        } else {
            let (beside, edge) = across(corner, edge, other.trailing_zeros() as usize);
            Step { cell: cells.find(beside)?, edge, face: at.face }
        };
        if at == first {
            return Some(steps);
        }
    }
}

/// The cell behind `face`, and the number that `edge` on that face has there.
fn across(corner: [u32; 3], edge: u8, face: usize) -> ([u32; 3], u8) {
    let (axis, side) = (face / 2, face % 2);
    let mut beside = corner;
    beside[axis] = if side == 1 { beside[axis] + 1 } else { beside[axis].wrapping_sub(1) };
    let edge = edge as usize;
    (beside, edge_at(edge_corner(edge) ^ 1 << axis, edge_axis(edge)) as u8)
}

/// For each mask and edge, the number of the loop that the edge's crossing is on.
static LOOP_OF: LazyLock<Box<[[u8; 12]; 256]>> = LazyLock::new(|| {
    let mut numbers = Box::new([[NO_EDGE; 12]; 256]);
    for (mask, row) in numbers.iter_mut().enumerate() {
        for (number, ring) in loops(mask).iter().enumerate() {
            ring.iter().for_each(|&e| row[e as usize] = number as u8);
        }
    }
    numbers
});

/// Whether the discs in the children of an octant hang together across the faces between them.
fn joins_children(cells: &Cells, octant: Octant, range: Range<u32>) -> bool {
    let half = octant.size / 2;
    let child =
        |at: [u32; 3]| (0..3).map(|a| u32::from(at[a] & half != 0) << a).sum::<u32>() as usize;
    // For each child, those that it is joined to.
    let mut joined = [0u8; 8];
    let mut present = 0u8;
    for cell in range {
        let at = cells.corner(cell);
        let own = child(at);
        present |= 1 << own;
        for axis in 0..3 {
            let is_last = at[axis] & (octant.size - 1) == half - 1;
            if is_last && SEGMENTS[2 << (2 * axis)][cells.mask(cell)] > 0 {
                joined[own] |= 1 << (own | 1 << axis);
                joined[own | 1 << axis] |= 1 << own;
            }
        }
    }
    let mut reached = present & present.wrapping_neg();
    loop {
        let next = (0..8).filter(|i| reached >> i & 1 == 1).fold(reached, |r, i| r | joined[i]);
        if next == reached {
            return reached == present;
        }
        reached = next;
    }
}

/// Whether along some axis no lattice line in an octant of at most 16^3 cells is crossed twice:
/// then there is no closed surface in it, since that would enclose a lattice point.
fn is_simple(cells: &Cells, octant: Octant, range: Range<u32>) -> bool {
    let mut seen = [[0u16; 16]; 3];
    let mut twice = 0u8;
    for cell in range {
        let at = cells.corner(cell).map(|x| x & 15);
        let edges = crossed(cells.mask(cell));
        for axis in 0..3 {
            // The edge along the axis at the cell's low corner.
            if edges >> (4 * axis) & 1 == 1 {
                let line = 1 << at[(axis + 1) % 3];
                let row = &mut seen[axis][at[(axis + 2) % 3] as usize];
                twice |= u8::from(*row & line != 0) << axis;
                *row |= line;
            }
        }
    }
    octant.size <= 16 && twice != 7
}

/// Whether all cell loops of an octant hang together within it.
fn is_connected(cells: &Cells, octant: Octant, range: Range<u32>) -> bool {
    let bounds = octant.bounds(cells);
    let (onward, loop_of) = (&**ONWARD, &**LOOP_OF);
    let first = range.start;
    let mut seen = vec![0u8; range.len()];
    let mut stack = vec![(first, 0u8)];
    seen[0] = 1;
    while let Some((cell, number)) = stack.pop() {
        let (mask, corner) = (cells.mask(cell), cells.corner(cell));
        let boundary = faces_on(bounds, corner);
        for face in (0..6).filter(|f| boundary >> f & 1 == 0) {
            for edge in 0..12u8 {
                let leaves = onward[mask][face][edge as usize] != NO_EDGE;
                if leaves && loop_of[mask][edge as usize] == number {
                    let (beside, edge) = across(corner, edge, face);
                    let State::Mixed(other) = cells.state(beside) else { continue };
                    let number = loop_of[cells.mask(other)][edge as usize];
                    let slot = &mut seen[(other - first) as usize];
                    if *slot >> number & 1 == 0 {
                        *slot |= 1 << number;
                        stack.push((other, number));
                    }
                }
            }
        }
    }
    range.clone().zip(&seen).all(|(cell, &seen)| {
        let all = loop_of[cells.mask(cell)].iter().filter(|&&n| n != NO_EDGE).max();
        all.is_some_and(|&most| u32::from(seen).count_ones() == u32::from(most) + 1)
    })
}

/// Whether the octant behind a step's face has an edge on the step's crossing, which lies on no edge
/// of the octant that the loop belongs to; `sizes` holds the size of each cell's octant as a power
/// of two.
pub fn is_break(cells: &Cells, sizes: &[u8], step: &Step) -> bool {
    let (beside, edge) = across(cells.corner(step.cell), step.edge, step.face as usize);
    // Beyond the border there is no octant.
    let Some(other) = cells.find(beside) else { return false };
    let (axis, corner) = (edge_axis(edge.into()), edge_corner(edge.into()) as u32);
    let [low, high] = cells.bounds;
    let size = sizes[other as usize];
    (0..3).filter(|&a| a != axis).all(|a| {
        let at = beside[a] + (corner >> a & 1);
        at & ((1 << size) - 1) == 0 || at == low[a] || at == high[a]
    })
}

/// Bit 2 a of the result tells that a point lies on the low side of the box on axis a, bit 2 a + 1
/// that it lies on the high side.
pub fn planes([low, high]: [[u32; 3]; 2], point: [f64; 3]) -> u8 {
    (0..3).fold(0, |planes, a| {
        planes
            | u8::from(point[a] == f64::from(low[a])) << (2 * a)
            | u8::from(point[a] == f64::from(high[a])) << (2 * a + 1)
    })
}

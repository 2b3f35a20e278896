//! Planes: the first step of compression.
//!
//! Nodes whose surface goes on flat on all sides are grouped into regions of a plane; a region is
//! kept as the loops of its boundary, with the region on the right, seen from outside: the outer
//! loop runs clockwise, inner ones the other way. Loops follow the cracks between pixels, so that
//! they are closed and unique even where the region is one pixel wide. Source: paper, "plane
//! regions" 1 to 4; specification (A8, A2 nos. 9 to 11).

use super::links::tangents;
use super::numbered::Numbered;
use super::{Mask, Node};

/// What counts as a link: the paper does not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reading {
    /// Faces that meet at a side are linked.
    #[default]
    Faces,
    /// Surface voxels that share a face are linked: the reading that fits the paper's figures.
    Six,
    /// As [`Reading::Faces`], and planes of any direction besides those along the axes.
    Oblique,
}

impl Reading {
    /// Every reading.
    pub const ALL: [Self; 3] = [Self::Faces, Self::Six, Self::Oblique];

    /// Its name, as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Faces => "faces",
            Self::Six => "six",
            Self::Oblique => "oblique",
        }
    }
}

/// A region of a plane.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlaneNode {
    /// The axis that it is square to.
    pub axis: u8,
    /// Its place along that.
    pub place: u16,
    /// Where its voxels are exposed.
    pub mask: Mask,
    /// How many voxels it has.
    pub area: u32,
    /// Its boundary, the outer loop among them.
    pub loops: Vec<Loop>,
}

/// A closed chain of cracks between pixels of a region and others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loop {
    /// The pixel right of the first crack, along the plane's two axes.
    pub start: [u16; 2],
    /// The side of that pixel on which the first crack is: 0 up and 2 down along the first axis, 1
    /// and 3 along the second.
    pub side: u8,
    /// The turn after each crack.
    pub turns: Vec<Turn>,
}

/// How a loop goes on behind a crack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Round the corner of the same pixel.
    Right,
    /// On to the next pixel.
    Straight,
    /// Into the corner.
    Left,
}

impl PlaneNode {
    /// The two axes of the plane, seen from outside.
    pub fn axes(&self) -> [usize; 2] {
        axes_of(self.axis, self.mask)
    }

    /// Its voxels.
    pub fn nodes(&self) -> Vec<Node> {
        let [u, v] = self.axes();
        let mut nodes = Vec::with_capacity(self.area as usize);
        pixels(&self.loops, |[i, j]| {
            let mut at = [0; 3];
            (at[self.axis as usize], at[u], at[v]) = (u32::from(self.place), i, j);
            let [x, y, z] = at.map(|i| i as u16);
            nodes.push(Node { zyx: [z, y, x], mask: self.mask });
        });
        nodes
    }
}

impl Loop {
    /// The cracks, each as the pixel on its right and the side of that.
    pub fn cracks(&self) -> impl Iterator<Item = ([u32; 2], u8)> + '_ {
        let mut at = (self.start.map(u32::from), self.side);
        self.turns.iter().map(move |&turn| {
            let here = at;
            at = after(here, turn);
            here
        })
    }

    /// Steps of the chain of voxels that lies outside of the cracks: the paper's chain.
    pub fn chain(&self) -> usize {
        // In a corner both cracks have the same voxel outside.
        self.turns.iter().filter(|&&t| t != Turn::Left).count()
    }

    /// Whether the region lies within it.
    pub fn is_outer(&self) -> bool {
        let count = |turn| self.turns.iter().filter(|&&t| t == turn).count();
        count(Turn::Right) > count(Turn::Left)
    }
}

/// Calls `visit` with every pixel of the region that loops bound.
pub fn pixels(loops: &[Loop], mut visit: impl FnMut([u32; 2])) {
    // Where the boundary crosses each line along the first axis.
    let mut ends: Vec<[u32; 2]> = Vec::new();
    for chain in loops {
        for ([u, v], side) in chain.cracks() {
            match side {
                0 => ends.push([v, u + 1]),
                2 => ends.push([v, u]),
                _ => {}
            }
        }
    }
    ends.sort_unstable();
    for pair in ends.chunks_exact(2) {
        (pair[0][1]..pair[1][1]).for_each(|i| visit([i, pair[0][0]]));
    }
}

/// The pixel beyond a side; never below 0 where it is asked for.
fn beyond([u, v]: [u32; 2], side: u8) -> [u32; 2] {
    match side {
        0 => [u + 1, v],
        1 => [u, v + 1],
        2 => [u.wrapping_sub(1), v],
        _ => [u, v.wrapping_sub(1)],
    }
}

/// The crack that follows after a turn.
fn after((pixel, side): ([u32; 2], u8), turn: Turn) -> ([u32; 2], u8) {
    // The way runs with the pixel on its right.
    let way = (side + 3) % 4;
    match turn {
        Turn::Right => (pixel, way),
        Turn::Straight => (beyond(pixel, way), side),
        Turn::Left => (beyond(beyond(pixel, way), side), (side + 1) % 4),
    }
}

/// The two axes square to one, seen from where voxels of a mask are exposed.
pub fn axes_of(axis: u8, mask: Mask) -> [usize; 2] {
    let [u, v] = [(axis as usize + 1) % 3, (axis as usize + 2) % 3];
    // From below the plane is seen mirrored.
    if mask & 2 << (2 * axis) == 0 { [v, u] } else { [u, v] }
}

impl Numbered<'_> {
    /// The axis of the plane that a node may be of.
    fn plane_axis(&self, node: u32, reading: Reading) -> Option<u8> {
        let mask = self.nodes[node as usize].mask;
        match reading {
            Reading::Faces | Reading::Oblique => {
                let axis = (0..3).find(|a| mask & !(3 << (2 * a)) == 0)?;
                let flat = tangents(2 * axis).into_iter().all(|t| {
                    let beside = self.beside(node, t);
                    beside.is_some_and(|b| self.nodes[b as usize].mask & mask == mask)
                });
                flat.then_some(axis)
            }
            Reading::Six => {
                let linked: Vec<u8> = (0..6).filter(|&d| self.beside(node, d).is_some()).collect();
                let free = |axis: &u8| {
                    mask >> (2 * axis) & 3 != 0 && linked.iter().all(|d| d / 2 != *axis)
                };
                (linked.len() >= 3).then(|| (0..3).find(free)).flatten()
            }
        }
    }
}

/// No region.
pub const NONE: u32 = u32::MAX;

/// The regions of all planes.
pub struct Planes {
    pub nodes: Vec<PlaneNode>,
    /// The region of each node, or [`NONE`].
    pub of: Vec<u32>,
    /// Nodes with the loops that they are on, from outside; loops are numbered over all regions.
    pub on: Vec<(u32, u32)>,
}

impl Planes {
    /// Groups the nodes; regions of less than `least` voxels are left alone.
    pub fn new(numbered: &Numbered, reading: Reading, least: u32, cracks: &mut [u8]) -> Self {
        let count = numbered.nodes.len() as u32;
        let axes: Vec<Option<u8>> = (0..count).map(|n| numbered.plane_axis(n, reading)).collect();
        let mut planes = Self { nodes: Vec::new(), of: vec![NONE; count as usize], on: Vec::new() };
        let mut seen = vec![false; count as usize];
        let mut loops = 0;
        let mut region = Vec::new();
        for first in 0..count {
            let Some(axis) = axes[first as usize] else { continue };
            if seen[first as usize] {
                continue;
            }
            let mask = numbered.nodes[first as usize].mask;
            seen[first as usize] = true;
            region.clear();
            region.push(first);
            let mut next = 0;
            while next < region.len() {
                for t in tangents(2 * axis) {
                    let Some(beside) = numbered.beside(region[next], t) else { continue };
                    let same = axes[beside as usize] == Some(axis)
                        && numbered.nodes[beside as usize].mask == mask;
                    if same && !seen[beside as usize] {
                        seen[beside as usize] = true;
                        region.push(beside);
                    }
                }
                next += 1;
            }
            if region.len() < least as usize {
                continue;
            }
            let number = planes.nodes.len() as u32;
            region.iter().for_each(|&n| planes.of[n as usize] = number);
            let place = numbered.nodes[first as usize].at()[axis as usize] as u16;
            let area = region.len() as u32;
            let mut plane = PlaneNode { axis, place, mask, area, loops: Vec::new() };
            region.sort_unstable();
            let [u, v] = plane.axes();
            let find = |[i, j]: [u32; 2]| {
                let mut at = [0; 3];
                (at[axis as usize], at[u], at[v]) = (u32::from(place), i, j);
                numbered.find(at)
            };
            let (of, on) = (&planes.of, &mut planes.on);
            let is_in = |pixel| find(pixel).filter(|&n| of[n as usize] == number);
            plane.loops = trace(numbered, [u, v], &region, cracks, is_in, |own, outside| {
                on.extend(find(outside).map(|n| (n, loops + own as u32)));
            });
            loops += plane.loops.len() as u32;
            planes.nodes.push(plane);
        }
        planes.on.sort_unstable();
        planes.on.dedup();
        planes
    }
}

/// The loops of a region of nodes that is seen along two axes. `cracks` tells the sides of each node
/// that were seen, `is_in` the node of a pixel in the region; `meet` hears of the pixels outside of each
/// loop.
pub fn trace(
    numbered: &Numbered,
    [u, v]: [usize; 2],
    region: &[u32],
    cracks: &mut [u8],
    is_in: impl Fn([u32; 2]) -> Option<u32>,
    mut meet: impl FnMut(usize, [u32; 2]),
) -> Vec<Loop> {
    let mut loops: Vec<Loop> = Vec::new();
    for &node in region {
        let at = numbered.nodes[node as usize].at();
        let pixel = [at[u], at[v]];
        for side in 0..4u8 {
            if cracks[node as usize] >> side & 1 == 1 || is_in(beyond(pixel, side)).is_some() {
                continue;
            }
            let mut turns = Vec::new();
            let mut here = (pixel, side);
            loop {
                let (pixel, side) = here;
                meet(loops.len(), beyond(pixel, side));
                let Some(own) = is_in(pixel) else { break };
                if cracks[own as usize] >> side & 1 == 1 {
                    break;
                }
                cracks[own as usize] |= 1 << side;
                let ahead = beyond(pixel, (side + 3) % 4);
                let turn = if is_in(ahead).is_none() {
                    Turn::Right
                } else if is_in(beyond(ahead, side)).is_none() {
                    Turn::Straight
                } else {
                    Turn::Left
                };
                turns.push(turn);
                here = after(here, turn);
            }
            loops.push(Loop { start: pixel.map(|i| i as u16), side, turns });
        }
    }
    loops
}

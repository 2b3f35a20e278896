//! What is known of the octants, and whose turn it is.

use super::super::direction;
use super::super::tree::{Crossed, Node, place};
use glam::DVec3;

/// Stands for no octant.
pub(super) const NONE: u32 = u32::MAX;

/// An octant whose turn comes, or came.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub corner: [u16; 3],
    pub level: u8,
    pub parent: u32,
    /// Octants of the same level beside it, by way `2 axis + side`.
    pub beside: [u32; 6],
}

/// What is known, in columns by octant.
pub(super) struct Known {
    pub levels: u32,
    /// All octants whose parents are known.
    pub placed: Vec<Placed>,
    pub nodes: Vec<Node>,
    pub vertices: Vec<[u8; 3]>,
    pub normals: Vec<[u8; 2]>,
    pub errors: Vec<u8>,
    pub shapes: Vec<u8>,
    pub traits: Vec<u8>,
    pub colours: Vec<[u8; 4]>,
    /// How far normals were from what was expected.
    pub turned: Vec<u8>,
    /// How far vertices were from where they were expected.
    pub moved: Vec<u8>,
}

/// An octant whose turn it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    pub index: usize,
    pub own: Placed,
    /// None of the root.
    pub parent: Option<usize>,
    /// Its side, in finest cells.
    pub size: u32,
    /// Whether it is of the last level.
    pub is_last: bool,
}

impl Turn {
    pub(super) fn of(known: &Known, index: usize) -> Self {
        let own = known.placed[index];
        let below = known.levels - u32::from(own.level);
        let parent = (index > 0).then_some(own.parent as usize);
        Self { index, own, parent, size: 1 << below, is_last: below == 0 }
    }

    /// Octants beside it that came before: in Morton order those on its low sides.
    pub(super) fn before(&self) -> impl Iterator<Item = usize> + use<> {
        let [x, _, y, _, z, _] = self.own.beside;
        [x, y, z].into_iter().filter(|&n| n != NONE).map(|n| n as usize)
    }
}

impl Known {
    /// Only that there is a root.
    pub(super) fn new(levels: u32) -> Self {
        let root = Placed { corner: [0; 3], level: 0, parent: 0, beside: [NONE; 6] };
        Self {
            levels,
            placed: vec![root],
            nodes: vec![],
            vertices: vec![],
            normals: vec![],
            errors: vec![],
            shapes: vec![],
            traits: vec![],
            colours: vec![],
            turned: vec![],
            moved: vec![],
        }
    }

    /// The vertex of an octant, in finest cells.
    pub(super) fn vertex(&self, i: usize) -> DVec3 {
        let of = &self.placed[i];
        let size = 1 << (self.levels - u32::from(of.level));
        place(self.vertices[i], of.corner.map(u32::from), size)
    }

    /// The normal of an octant.
    pub(super) fn normal(&self, i: usize) -> DVec3 {
        direction::unpacked(self.normals[i])
    }

    /// The mean of a column over the parent and, twice each, the octants beside that came before; in
    /// quarters.
    pub(super) fn mean(&self, turn: &Turn, column: &[u8]) -> usize {
        let (mut sum, mut count) = (0, 0);
        for n in turn.before() {
            sum += 2 * usize::from(column[n]);
            count += 2;
        }
        if let Some(parent) = turn.parent {
            sum += usize::from(column[parent]);
            count += 1;
        }
        4 * sum / count.max(1)
    }

    /// Keeps the node of an octant, and puts its children into the queue with the octants beside them.
    pub(super) fn enqueue(&mut self, turn: &Turn, mask: u8, crossed: Crossed) {
        let own = &turn.own;
        let first = if mask == 0 { 0 } else { self.placed.len() as u32 };
        self.nodes.push(Node::new(first, mask, crossed));
        let (i, half) = (turn.index as u32, (turn.size / 2) as u16);
        for octant in (0..8u32).filter(|o| mask >> o & 1 == 1) {
            let corner = [0, 1, 2].map(|a| own.corner[a] + (octant >> a & 1) as u16 * half);
            let level = own.level + 1;
            self.placed.push(Placed { corner, level, parent: i, beside: [NONE; 6] });
        }
        for octant in (0..8u32).filter(|o| mask >> o & 1 == 1) {
            let place = self.child(i, octant);
            for way in 0..6 {
                let bit = 1 << (way / 2);
                let inside = (octant & bit != 0) != (way & 1 == 1);
                let other = self.child(if inside { i } else { own.beside[way] }, octant ^ bit);
                if other != NONE {
                    // Those beside it that came before are told of it now.
                    self.placed[place as usize].beside[way] = other;
                    self.placed[other as usize].beside[way ^ 1] = place;
                }
            }
        }
    }

    fn child(&self, of: u32, octant: u32) -> u32 {
        match self.nodes.get(of as usize) {
            Some(node) if node.children() >> octant & 1 == 1 => node.child(octant),
            _ => NONE,
        }
    }
}

/// Numbers in steps of half octaves, at most `most`.
pub(super) fn rank(number: usize, most: usize) -> usize {
    let bits = (usize::BITS - number.leading_zeros()) as usize;
    let rank = if bits < 2 { bits } else { 2 * bits - 2 + (number >> (bits - 2) & 1) };
    rank.min(most)
}

/// Which of `count` steps of width `1 / fine` a length is in.
pub(super) fn step(length: f64, fine: f64, count: usize) -> usize {
    ((length * fine).clamp(0.0, 1e6) as usize).min(count - 1)
}

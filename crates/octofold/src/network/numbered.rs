//! Nodes by number, and numbers by place.

use super::links::step;
use super::{Direction, Network, Node, Stretch};

/// The nodes of a network with their numbers.
pub struct Numbered<'a> {
    network: &'a Network,
    /// All nodes in order.
    pub nodes: Vec<Node>,
    /// Number of the first node of each stretch.
    firsts: Vec<u32>,
}

impl<'a> Numbered<'a> {
    /// Numbers all nodes in order.
    pub fn new(network: &'a Network) -> Self {
        let mut next = 0;
        let firsts = network.rows.items().iter().map(|s| {
            next += s.end - s.start;
            next - (s.end - s.start)
        });
        Self { network, firsts: firsts.collect(), nodes: network.nodes() }
    }

    /// The number of the node at a place, where there is one.
    pub fn find(&self, [x, y, z]: [u32; 3]) -> Option<u32> {
        let (first, row) = self.network.rows.row(y as usize, z as usize);
        let before = row.partition_point(|s| s.start <= x).checked_sub(1)?;
        (x < row[before].end).then(|| self.firsts[first + before] + x - row[before].start)
    }

    /// The stretches of a row, and the number of the first node.
    pub fn row(&self, y: u32, z: u32) -> (u32, &[Stretch]) {
        let (first, row) = self.network.rows.row(y as usize, z as usize);
        (self.firsts.get(first).copied().unwrap_or(0), row)
    }

    /// Whether a voxel is in the solid.
    pub fn contains(&self, at: [u32; 3]) -> bool {
        self.network.contains(at)
    }

    /// The node one step on, where there is one.
    pub fn beside(&self, node: u32, direction: Direction) -> Option<u32> {
        step(self.nodes[node as usize].at(), direction).and_then(|at| self.find(at))
    }
}

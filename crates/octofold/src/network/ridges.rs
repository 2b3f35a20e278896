//! Ridges: the second step of compression.
//!
//! A node that is left after the planes and lies between two of their loops is on a ridge; straight
//! runs of such nodes between the same two loops become one edge node. Source: paper, "ridge parts"
//! 1 to 3; specification (A9, A2 nos. 13 to 15).

use super::links::{Face, Rule, link, tangents};
use super::numbered::Numbered;
use super::planes::{NONE, Planes, Reading};
use super::{Mask, Node};

/// A straight run of nodes between two loops.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EdgeNode {
    /// Its first node.
    pub start: Node,
    /// Step from node to node, along x, y and z; the first in order of z, y and x comes first.
    pub step: [i8; 3],
    /// How many nodes it has.
    pub length: u32,
    /// The two loops, numbered over all planes.
    pub loops: [u32; 2],
}

impl EdgeNode {
    /// Its nodes.
    pub fn nodes(&self) -> impl Iterator<Item = Node> + '_ {
        let at = self.start.at();
        (0..self.length).map(move |i| {
            let [x, y, z]: [u16; 3] = std::array::from_fn(|a| {
                (i64::from(at[a]) + i64::from(i) * i64::from(self.step[a])) as u16
            });
            Node { zyx: [z, y, x], mask: self.start.mask }
        })
    }
}

/// The steps to half of the 26 voxels around one: those that come later.
fn steps() -> impl Iterator<Item = [i8; 3]> {
    (14..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1])
}

/// The edge nodes, and the nodes that are left.
pub fn ridges(
    numbered: &Numbered,
    planes: &Planes,
    reading: Reading,
) -> (Vec<EdgeNode>, Vec<Node>) {
    let count = numbered.nodes.len();
    let keys: Vec<Option<[u32; 2]>> =
        (0..count as u32).map(|n| pair(numbered, planes, reading, n)).collect();
    let mut taken = vec![false; count];
    let (mut edges, mut rest) = (Vec::new(), Vec::new());
    for n in 0..count {
        if taken[n] || planes.of[n] != NONE {
            continue;
        }
        let start = numbered.nodes[n];
        let follow = |step: [i8; 3]| {
            let mut run = vec![n as u32];
            let mut at = start.at();
            loop {
                let next: [i64; 3] = std::array::from_fn(|a| i64::from(at[a]) + i64::from(step[a]));
                if next.iter().any(|&i| i < 0) {
                    return run;
                }
                at = next.map(|i| i as u32);
                let Some(node) = numbered.find(at) else { return run };
                let same: (Option<[u32; 2]>, Mask) =
                    (keys[node as usize], numbered.nodes[node as usize].mask);
                if taken[node as usize] || same != (keys[n], start.mask) {
                    return run;
                }
                run.push(node);
            }
        };
        let best = keys[n].and_then(|loops| {
            let runs = steps().map(|step| (step, follow(step)));
            let (step, run) = runs.max_by_key(|(_, run)| run.len())?;
            (run.len() > 1).then_some((loops, step, run))
        });
        match best {
            Some((loops, step, run)) => {
                run.iter().for_each(|&n| taken[n as usize] = true);
                edges.push(EdgeNode { start, step, length: run.len() as u32, loops });
            }
            None => rest.push(start),
        }
    }
    (edges, rest)
}

/// The two loops that a node lies between, where there are just two.
fn pair(numbered: &Numbered, planes: &Planes, reading: Reading, node: u32) -> Option<[u32; 2]> {
    if planes.of[node as usize] != NONE {
        return None;
    }
    let on = |node: u32| {
        let first = planes.on.partition_point(|m| m.0 < node);
        planes.on[first..].iter().take_while(move |m| m.0 == node).map(|m| m.1)
    };
    let mut loops: Vec<u32> = on(node).collect();
    if reading != Reading::Six {
        let Node { mask, .. } = numbered.nodes[node as usize];
        let at = numbered.nodes[node as usize].at();
        let contains = |at| numbered.contains(at);
        for direction in (0..6).filter(|d| mask >> d & 1 == 1) {
            for tangent in tangents(direction) {
                let face = link(Face { at, direction }, tangent, Rule::Split, contains);
                if face.at != at
                    && let Some(other) = numbered.find(face.at)
                {
                    loops.extend(on(other));
                }
            }
        }
    }
    loops.sort_unstable();
    loops.dedup();
    <[u32; 2]>::try_from(loops).ok()
}

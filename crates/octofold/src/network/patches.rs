//! Set operations on links, as the network model was made for.
//!
//! Nodes of either solid that touch a node of the other are near the curve where the surfaces cross.
//! Taken away, they leave patches, each of which lies wholly inside or wholly outside of the other
//! solid: one inside test tells whether all of a patch stays, goes or is turned over. Near the curve
//! each face is told for itself. Source: specification (A6, patch mode).

use super::combine::Operation;
use super::links::{Face, Rule, link, step, tangents};
use super::numbered::Numbered;
use super::{Network, Node};

/// What becomes of a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    Keep,
    Drop,
    /// Its outer voxel is in the result instead.
    Turn,
}

/// Combines two networks of one grid, which is that of the first; `None` where their grids differ
/// in size.
pub fn combine_patches(operation: Operation, a: &Network, b: &Network) -> Option<Network> {
    if a.dims() != b.dims() {
        return None;
    }
    let mut faces = Vec::new();
    take(operation, true, a, b, &mut faces);
    take(operation, false, b, a, &mut faces);
    faces.sort_unstable();
    let mut nodes: Vec<Node> = Vec::new();
    for Face { at: [z, y, x], direction } in faces {
        let zyx = [z, y, x].map(|i| i as u16);
        match nodes.last_mut() {
            Some(last) if last.zyx == zyx => last.mask |= 1 << direction,
            _ => nodes.push(Node { zyx, mask: 1 << direction }),
        }
    }
    Some(Network::from_nodes(a.dims(), a.placement, nodes))
}

/// What becomes of a face of one solid whose inner and outer voxels are in the other or not; `first`
/// tells that it is of the first.
fn fate(operation: Operation, first: bool, inner: bool, outer: bool) -> Fate {
    use Operation::{Difference, Intersection, SymmetricDifference, Union};
    match (operation, first) {
        (Union, _) if !outer => Fate::Keep,
        (Intersection, _) if inner => Fate::Keep,
        (Difference, true) if !inner => Fate::Keep,
        (Difference, false) if outer => Fate::Turn,
        (SymmetricDifference, _) if !inner && !outer => Fate::Keep,
        (SymmetricDifference, _) if inner && outer => Fate::Turn,
        _ => Fate::Drop,
    }
}

/// Adds the faces of the result that come from one solid, their voxels as z, y and x.
fn take(operation: Operation, first: bool, own: &Network, other: &Network, out: &mut Vec<Face>) {
    let numbered = Numbered::new(own);
    let count = numbered.nodes.len();
    let near: Vec<bool> = numbered.nodes.iter().map(|n| is_near(other, n.at())).collect();
    let mut put = |Face { at, direction }: Face, fate: Fate| {
        let (at, direction) = match fate {
            Fate::Drop => return,
            Fate::Keep => (at, direction),
            // The outer voxel is in the other solid, and so in the grid.
            Fate::Turn => match step(at, direction) {
                Some(outer) => (outer, direction ^ 1),
                None => return,
            },
        };
        let [x, y, z] = at;
        out.push(Face { at: [z, y, x], direction });
    };
    let faces = |n: u32| {
        let node = numbered.nodes[n as usize];
        let exposed = (0..6).filter(move |d| node.mask >> d & 1 == 1);
        exposed.map(move |direction| Face { at: node.at(), direction })
    };
    let contains = |at| own.contains(at);
    let mut seen = near.clone();
    let mut stack = Vec::new();
    for start in 0..count as u32 {
        if near[start as usize] {
            for face in faces(start) {
                let inner = other.contains(face.at);
                let outer = step(face.at, face.direction).is_some_and(|at| other.contains(at));
                put(face, fate(operation, first, inner, outer));
            }
        }
        if seen[start as usize] {
            continue;
        }
        // All of a patch is on the side where one of its nodes is.
        let inside = other.contains(numbered.nodes[start as usize].at());
        let fate = fate(operation, first, inside, inside);
        seen[start as usize] = true;
        stack.push(start);
        while let Some(node) = stack.pop() {
            for face in faces(node) {
                put(face, fate);
                for tangent in tangents(face.direction) {
                    let beside = link(face, tangent, Rule::Split, contains).at;
                    if let Some(next) = numbered.find(beside)
                        && !seen[next as usize]
                    {
                        seen[next as usize] = true;
                        stack.push(next);
                    }
                }
            }
        }
    }
}

/// Whether a node of a network lies in the 27 voxels about one.
fn is_near(network: &Network, [x, y, z]: [u32; 3]) -> bool {
    let about = |i: u32| i.saturating_sub(1)..=i + 1;
    about(z).any(|z| {
        about(y).any(|y| {
            let row = network.row(y, z);
            let first = row.partition_point(|s| s.end < x);
            row.get(first).is_some_and(|s| s.start <= x + 1)
        })
    })
}

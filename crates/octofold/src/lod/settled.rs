//! Patches that cross their edges: the rule of the paper's Fig. 8, as a constraint on the cut.
//!
//! A patch that does not cross the edge that it stands on may enter an octant that has nothing to do
//! with it. The paper replaces a vertex of such a patch; but other patches share that vertex, and would
//! no longer fit. Here the largest octant of the patch is divided instead, until every patch crosses
//! its edge. Only patches between octants of different levels are looked at: on one level all do.
//! Decided in integers. Source: specification of LOD, A.5 and A.9 no. 8.

use super::LodError;
use super::cut::{Cut, NONE};
use super::edges::LOCAL;
use super::patches::{Mode, Patch, patches};
use super::tree::{Lod, STEPS};
use crate::run::Run;
use glam::I64Vec3;

/// A cut whose patches cross their edges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settled {
    /// The cut.
    pub cut: Cut,
    /// Its patches.
    pub patches: Vec<Patch>,
    /// Octants that were divided.
    pub divided: u64,
    /// Times that patches were made.
    pub rounds: u32,
    /// Patches that still miss their edge, round octants that all have no children.
    pub missing: u64,
}

/// Divides octants of a cut until its patches cross their edges.
///
/// # Errors
/// Where the work is interrupted.
pub fn settled(lod: &Lod, cut: Cut, mode: Mode, run: &Run) -> Result<Settled, LodError> {
    let mut settled = Settled { cut, ..Settled::default() };
    loop {
        let cut = &settled.cut;
        let found = patches(lod, cut, mode, run)?;
        let mut divided = vec![false; cut.entries.len()];
        let (mut count, mut missing) = (0, 0);
        for patch in found.iter().filter(|patch| misses(lod, cut, patch)) {
            let has_children = |place: &u32| {
                lod.nodes()[cut.entries[*place as usize].node as usize].children() != 0
            };
            // The first of the largest: places are in the order of levels.
            match patch.ring.into_iter().filter(has_children).min() {
                Some(place) if !divided[place as usize] => {
                    divided[place as usize] = true;
                    count += 1;
                }
                Some(_) => {}
                None => missing += 1,
            }
        }
        let mut front = vec![false; lod.nodes().len()];
        for (entry, divided) in cut.entries.iter().zip(&divided) {
            if entry.first == NONE && !divided {
                front[entry.node as usize] = true;
            } else if *divided {
                let node = lod.nodes()[entry.node as usize];
                let children =
                    node.first_child()..node.first_child() + node.children().count_ones();
                children.for_each(|child| front[child as usize] = true);
            }
        }
        settled.rounds += 1;
        settled.missing = missing;
        if count == 0 {
            settled.patches = found;
            return Ok(settled);
        }
        settled.divided += count;
        settled.cut = Cut::by(lod, |o| front[o.node as usize]);
    }
}

/// Whether a patch between octants of different levels does not cross its edge, with either diagonal.
pub fn misses(lod: &Lod, cut: &Cut, patch: &Patch) -> bool {
    let octants = patch.ring.map(|place| cut.octant(place));
    if octants.iter().all(|o| o.size == octants[0].size) {
        return false;
    }
    // In units of which a finest cell has twice as many as its vertex has steps.
    let unit = i64::from(2 * STEPS);
    let vertices = octants.map(|o| {
        let steps = lod.parts().vertices[o.node as usize];
        let at = |a: usize| {
            i64::from(o.corner[a]) * unit
                + i64::from(2 * u32::from(steps[a]) + 1) * i64::from(o.size)
        };
        I64Vec3::new(at(0), at(1), at(2))
    });
    let owner = cut.octant(patch.owner);
    let local = &LOCAL[patch.edge as usize];
    let mut low = I64Vec3::from(owner.corner.map(|c| i64::from(c) * unit));
    for (way, side) in local.ways.into_iter().zip(local.sides) {
        low[way / 2] += i64::from(side * owner.size) * unit;
    }
    let length = i64::from(owner.size) * unit;
    let [a, b, c, d] = vertices;
    let crosses = |t: [I64Vec3; 3]| crosses(t.map(|p| p - low), local.axis, length);
    !(crosses([a, b, c]) || crosses([a, c, d]) || crosses([b, c, d]) || crosses([b, d, a]))
}

/// Whether a triangle meets the segment from the origin along an axis.
fn crosses(triangle: [I64Vec3; 3], axis: usize, length: i64) -> bool {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let area = |p: I64Vec3, q: I64Vec3| {
        i128::from(p[u]) * i128::from(q[v]) - i128::from(p[v]) * i128::from(q[u])
    };
    let [p, q, r] = triangle;
    let shares = [area(q, r), area(r, p), area(p, q)];
    let whole: i128 = shares.iter().sum();
    if whole == 0 || !(shares.iter().all(|&s| s >= 0) || shares.iter().all(|&s| s <= 0)) {
        return false;
    }
    let height: i128 = (0..3).map(|i| shares[i] * i128::from(triangle[i][axis])).sum();
    let (height, whole) = (height * whole.signum(), whole.abs());
    0 <= height && height <= i128::from(length) * whole
}

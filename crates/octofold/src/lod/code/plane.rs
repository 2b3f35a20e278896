//! A plane through an octant, and where it meets edges.

use super::super::direction;
use super::super::edges::{LOCAL, Local, across};
use super::super::tree::STEPS;
use super::known::{Known, Turn};
use glam::DVec3;

/// A plane through an octant: a unit normal, and the height of the octant's middle above it in sides of
/// the octant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub normal: DVec3,
    pub middle: f64,
}

impl Plane {
    /// The plane of an octant's normal that is as high as those of the octants beside it and its parent
    /// tell.
    pub(super) fn beside(known: &Known, turn: &Turn, normal: [u8; 2]) -> Self {
        let size = f64::from(turn.size);
        let middle = DVec3::from(turn.own.corner.map(f64::from)) + size / 2.0;
        let height = |of: usize| known.normal(of).dot(middle - known.vertex(of)) / size;
        let (mut sum, mut count) = (0.0, 0.0);
        for n in turn.before() {
            sum += 2.0 * height(n);
            count += 2.0;
        }
        if let Some(parent) = turn.parent {
            sum += height(parent);
            count += 1.0;
        }
        Self { normal: direction::unpacked(normal), middle: sum / f64::max(count, 1.0) }
    }

    /// The plane through the vertex of an octant.
    pub(super) fn through(normal: [u8; 2], vertex: [u8; 3]) -> Self {
        let normal = direction::unpacked(normal);
        let at = (DVec3::from(vertex.map(f64::from)) + 0.5) / f64::from(STEPS) - 0.5;
        Self { normal, middle: -normal.dot(at) }
    }

    /// The height of a place in the octant, in sides from its middle.
    pub(super) fn height(&self, at: DVec3) -> f64 {
        self.normal.dot(at) + self.middle
    }

    /// The middle of where it meets some edges of the octant, in sides from the octant's middle.
    pub(super) fn centre(&self, edges: u16) -> DVec3 {
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for edge in (0..12).filter(|e| edges >> e & 1 == 1) {
            let [low, high] = ENDS[edge];
            let (from, to) = (self.height(low), self.height(high));
            let share = if from == to { 0.5 } else { (from / (from - to)).clamp(0.0, 1.0) };
            sum += low + (high - low) * share;
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { DVec3::ZERO }
    }
}

/// Both ends of each edge, in sides from the octant's middle.
pub(super) const ENDS: [[DVec3; 2]; 12] = {
    let mut ends = [[DVec3::ZERO; 2]; 12];
    let mut edge = 0;
    while edge < 12 {
        let Local { axis, sides, .. } = LOCAL[edge];
        let [b, c] = across(axis);
        let mut low = [-0.5; 3];
        low[b] += sides[0] as f64;
        low[c] += sides[1] as f64;
        let mut high = low;
        high[axis] = 0.5;
        ends[edge] = [DVec3::from_array(low), DVec3::from_array(high)];
        edge += 1;
    }
    ends
};

//! Normals, near those of the parent and of the octants beside.

use super::super::direction;
use super::known::{Known, NONE, Turn, rank, step};
use crate::range::Coder;
use crate::range::blend::Blend;
use glam::DVec3;

/// How far the remainder of the parent's normal is told from what is expected, at most.
const APART: i8 = 16;

/// The chances of normals.
pub(super) struct Normals(Blend);

impl Default for Normals {
    fn default() -> Self {
        Self(Blend::new([32, 2 * 256, 2 * 512, 8 * 33 * 16, 2 * 1024, 2 * 33 * 33], 4))
    }
}

impl Normals {
    /// Codes the normal of an octant and keeps it.
    pub(super) fn code(
        &mut self,
        coder: &mut impl Coder,
        known: &mut Known,
        turn: &Turn,
        told: [u8; 2],
    ) -> [u8; 2] {
        let (mut mean, mut weight) = (DVec3::ZERO, 1.0);
        for n in turn.before() {
            mean += known.normal(n) * 2.0;
            weight += 2.0;
        }
        if let Some(parent) = turn.parent {
            mean += known.normal(parent);
        }
        let spread = step((1.0 - mean.length() / weight).max(0.0).sqrt(), 12.0, 8);
        let expected = direction::packed(mean);
        let (rest, left) = rest(known, turn);
        let rest = direction::packed(if rest.length() > 0.5 { rest } else { mean });
        let ahead = direction::packed(ahead(known, turn, mean));
        let turned = rank(known.mean(turn, &known.turned), 15);
        let above = turn.parent.map_or(0, |p| rank(usize::from(known.turned[p]), 15));
        let (number, last) = (turn.before().count(), usize::from(turn.is_last));
        let (mut normal, mut before, mut off) = ([0; 2], 0, 0);
        for k in 0..2 {
            let apart = |other: [u8; 2]| {
                let apart = other[k].wrapping_sub(expected[k]) as i8;
                (apart.clamp(-APART, APART) + APART) as usize
            };
            let contexts = [
                (usize::from(number > 1) * 8 + spread) * 2 + k,
                k * 256 + turned * 16 + before,
                (k * 16 + above) * 32 + last * 16 + before,
                ((k * 4 + left) * 33 + apart(rest)) * 16 + before,
                k * 1024 + ((number * 8 + spread) * 16 + before) * 2 + last,
                (k * 33 + apart(rest)) * 33 + apart(ahead),
            ];
            let set = k * 2 + last;
            normal[k] = self.0.code(coder, told[k], expected[k], contexts, set);
            let by = (normal[k].wrapping_sub(expected[k]) as i8).unsigned_abs();
            before = rank(by.into(), 15);
            off += u32::from(by);
        }
        known.normals.push(normal);
        known.turned.push(off.min(255) as u8);
        normal
    }
}

/// What the normals of its siblings leave for it of its parent's normal, and how many siblings come
/// later: three or more count as three.
fn rest(known: &Known, turn: &Turn) -> (DVec3, usize) {
    let Some(parent) = turn.parent else {
        return (DVec3::ZERO, 0);
    };
    let node = known.nodes[parent];
    let first = node.first_child() as usize;
    let later = first + node.children().count_ones() as usize - turn.index;
    let (mut rest, mut sum) = (DVec3::ZERO, 4.0 * later as f64);
    for sibling in first..turn.index {
        let weight = f64::from(known.nodes[sibling].any().count_ones()).max(1.0);
        rest -= known.normal(sibling) * weight;
        sum += weight;
    }
    (rest + known.normal(parent) * sum, later.clamp(1, 4) - 1)
}

/// What is expected with the octants beside the parent on the octant's high sides.
fn ahead(known: &Known, turn: &Turn, mean: DVec3) -> DVec3 {
    let Some(parent) = turn.parent else {
        return mean;
    };
    let (own, above) = (&turn.own, &known.placed[parent]);
    let mut ahead = mean;
    for axis in 0..3 {
        let n = above.beside[2 * axis + 1];
        if own.corner[axis] != above.corner[axis] && n != NONE {
            ahead += known.normal(n as usize);
        }
    }
    ahead
}

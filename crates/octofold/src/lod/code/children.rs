//! Which children an octant has: those along its own plane.

use super::super::tree::Crossed;
use super::known::{Known, Turn, rank, step};
use super::plane::Plane;
use crate::range::{Chance, Coder};
use glam::DVec3;

/// The chances of children.
pub(super) struct Children {
    none: [Chance; 17 * 3 * 8],
    one: [Chance; 32 * 8],
}

impl Default for Children {
    fn default() -> Self {
        Self { none: [Chance::EVEN; 17 * 3 * 8], one: [Chance::EVEN; 32 * 8] }
    }
}

impl Children {
    /// Codes the children of an octant.
    pub(super) fn code(
        &mut self,
        coder: &mut impl Coder,
        known: &Known,
        turn: &Turn,
        told: u8,
        plane: &Plane,
        crossed: &Crossed,
    ) -> u8 {
        if turn.is_last {
            return 0;
        }
        let moved = rank(usize::from(known.moved[turn.index]), 15) / 2;
        let is_bare = usize::from(crossed.any == 0);
        let context = (usize::from(turn.own.level) * 3 + is_bare) * 8 + moved;
        if self.none[context].code(coder, told == 0) {
            return 0;
        }
        let grain = plane.normal.abs().element_sum() / 4.0;
        let mut mask = 0u8;
        for octant in 0..8u32 {
            let side = |a: u32| f64::from(octant >> a & 1) / 2.0 - 0.25;
            let height = plane.height(DVec3::new(side(0), side(1), side(2))) / grain;
            let beside = (0..3).filter(|a| octant >> a & 1 == 1);
            let full = beside.filter(|a| mask >> (octant ^ 1 << a) & 1 == 1).count();
            let place = (octant.count_ones() as usize) * 2 + usize::from(full > 0);
            let context = step(height.abs(), 12.0, 32) * 8 + place.min(7);
            let there = self.one[context].code(coder, told >> octant & 1 == 1);
            mask |= u8::from(there) << octant;
        }
        mask
    }
}

//! Which edges of an octant the surface crosses: those of the octants beside, the rest by a plane.

use super::super::edges::LOCAL;
use super::super::tree::{Crossed, Node};
use super::known::{Known, NONE, Turn, step};
use super::plane::{ENDS, Plane};
use crate::range::{Chance, Coder};

/// The chances of edges.
pub(super) struct Edges {
    known: [Chance; 5 * 5],
    crossed: [Chance; 2 * 16 * 16],
    odd: [Chance; 2],
    signs: [Chance; 2],
}

impl Default for Edges {
    fn default() -> Self {
        Self {
            known: [Chance::EVEN; 5 * 5],
            crossed: [Chance::EVEN; 2 * 16 * 16],
            odd: [Chance::EVEN; 2],
            signs: [Chance::EVEN; 2],
        }
    }
}

impl Edges {
    /// Codes how the surface crosses the edges of an octant.
    pub(super) fn code(
        &mut self,
        coder: &mut impl Coder,
        known: &Known,
        turn: &Turn,
        told: Node,
        plane: &Plane,
    ) -> Crossed {
        let mut crossed = Crossed::default();
        let grain = plane.normal.abs().element_sum() / 2.0;
        for edge in 0..12 {
            let local = &LOCAL[edge];
            let [first, second] = local.ways.map(|way| turn.own.beside[way]);
            let third = known.placed.get(first as usize).map_or(NONE, |q| q.beside[local.ways[1]]);
            let round = [(first, edge ^ 1), (second, edge ^ 2), (third, edge ^ 3)];
            let same = round.iter().find(|(n, _)| (*n as usize) < turn.index);
            let same = same.map(|&(n, edge)| state(known.nodes[n as usize], edge));
            let told = state(told, edge);
            let found = if let Some(same) = same {
                let is_same = self.known[same].code(coder, told == same);
                if is_same { same } else { self.other(coder, told, 5 + same * 4) }
            } else {
                let [low, high] = ENDS[edge].map(|end| plane.height(end) / grain);
                let opposite = usize::from((low < 0.0) != (high < 0.0));
                let nearest = step(low.abs().min(high.abs()), 10.0, 16);
                let length = step((low - high).abs(), 8.0, 16);
                let context = ((opposite * 16) + nearest) * 16 + length;
                if !self.crossed[context].code(coder, told != 0) {
                    0
                } else if !self.odd[opposite].code(coder, told != 1) {
                    1
                } else {
                    let against = usize::from(plane.normal[local.axis] < 0.0);
                    2 + usize::from(self.signs[against].code(coder, told == 3))
                }
            };
            let bit = 1 << edge;
            crossed.any |= if found > 0 { bit } else { 0 };
            crossed.odd |= if found > 1 { bit } else { 0 };
            crossed.negative |= if found > 2 { bit } else { 0 };
        }
        crossed
    }

    /// One of four states with its own chances.
    fn other(&mut self, coder: &mut impl Coder, told: usize, context: usize) -> usize {
        let high = self.known[context].code(coder, told > 1);
        let low = self.known[context + 1 + usize::from(high)].code(coder, told % 2 == 1);
        2 * usize::from(high) + usize::from(low)
    }
}

/// No crossing, an even number, an odd number along, and against the axis.
fn state(node: Node, edge: usize) -> usize {
    let bit = |bits: u16| usize::from(bits >> edge & 1);
    match (bit(node.any()), bit(node.odd())) {
        (0, _) => 0,
        (_, 0) => 1,
        _ => 2 + bit(node.negative()),
    }
}

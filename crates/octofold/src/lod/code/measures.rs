//! Bounds and flatness, once all else is known of all octants: by what is known of those below and of
//! those beside that come later, and by how far vertices and normals are from what they would be on a
//! plane.

use super::super::direction;
use super::super::tree::{leaf_error, leaf_shape};
use super::known::{Known, NONE, rank};
use crate::range::Coder;
use crate::range::blend::Blend;

/// The chances of bounds and flatness.
pub(super) struct Measures {
    errors: Blend,
    shapes: Blend,
}

impl Default for Measures {
    fn default() -> Self {
        Self {
            errors: Blend::new([3 * 256, 3 * 64 * 32, 3 * 1024, 3 * 512, 3 * 4096, 3 * 1024], 3),
            shapes: Blend::new([3 * 256, 3 * 1024, 3 * 1024, 3 * 1024, 3 * 2048, 3 * 1024], 3),
        }
    }
}

impl Measures {
    /// Codes the bound and the flatness of octant `i`, both in steps.
    pub(super) fn code(
        &mut self,
        coder: &mut impl Coder,
        known: &Known,
        i: usize,
        told: (u8, u8),
    ) -> (u8, u8) {
        let own = &known.placed[i];
        let size = f64::from(1u32 << (known.levels - u32::from(own.level)));
        let node = known.nodes[i];
        let kind = match node.children() {
            0 => usize::from(u32::from(own.level) == known.levels),
            _ => 2,
        };
        let (normal, at) = (known.normal(i), known.vertex(i));
        let (mut bend, mut turn) = (0.0f64, 0.0f64);
        let (mut errors, mut shapes, mut later) = (0usize, 0usize, 0);
        for n in own.beside.into_iter().filter(|&n| n != NONE).map(|n| n as usize) {
            bend = bend.max(normal.dot(known.vertex(n) - at).abs());
            turn = turn.max(1.0 - normal.dot(known.normal(n)));
            if n > i {
                errors += usize::from(known.errors[n]);
                shapes += usize::from(known.shapes[n]);
                later += 1;
            }
        }
        let (mut worst, mut flattest) = (0, 255);
        let (mut apart, mut turn_below) = (0.0f64, 0.0f64);
        for c in (0..8).filter(|c| node.children() >> c & 1 == 1).map(|c| node.child(c) as usize) {
            worst = worst.max(known.errors[c]);
            flattest = flattest.min(known.shapes[c]);
            apart = apart.max(normal.dot(known.vertex(c) - at).abs());
            turn_below = turn_below.max(1.0 - normal.dot(direction::unpacked(known.normals[c])));
        }
        let [bend, apart] = [bend, apart].map(|length| quarter(length / size));
        let [turn, turn_below] = [turn, turn_below].map(quarter);
        let mean = |sum: usize, or: u8| sum.checked_div(later).map_or(or, |mean| mean as u8);
        let (beside, beside_flat) = (mean(errors, worst), mean(shapes, flattest));
        let crossings = node.any().count_ones() as usize;
        let turned = rank(known.turned[i].into(), 15);
        let moved = rank(known.moved[i].into(), 15);
        let flat = |shape: u8| rank(usize::from(255 - shape), 15);
        let below = if kind == 2 { flattest } else { beside_flat };
        let contexts = [
            kind * 256 + usize::from(below),
            (kind * 64 + if kind == 2 { turn_below } else { turn }) * 16 + flat(beside_flat),
            (kind * 64 + turn) * 16 + crossings,
            (kind * 64 + bend) * 16 + flat(below),
            ((kind * 16 + turned) * 16 + crossings) * 8 + turn / 8,
            (kind * 64 + turn) * 16 + flat(below),
        ];
        let expected = if kind == 2 { below } else { leaf_shape(below.saturating_add(8)) };
        let shape = self.shapes.code(coder, told.1, expected, contexts, kind);
        let below = if kind == 2 { worst } else { beside };
        let contexts = [
            kind * 256 + usize::from(below),
            (kind * 64 + if kind == 2 { apart } else { bend }) * 32 + usize::from(below / 8),
            (kind * 64 + bend) * 16 + flat(shape),
            (kind * 32 + usize::from(beside / 8)) * 16 + flat(shape),
            ((kind * 16 + moved) * 16 + crossings) * 16 + flat(shape),
            (kind * 32 + usize::from(below / 8)) * 32 + turn / 2,
        ];
        let expected = if kind == 2 { below } else { leaf_error(below) };
        let error = self.errors.code(coder, told.0, expected, contexts, kind);
        (error, shape)
    }
}

/// A positive number in quarters of octaves, from 2^-10.
fn quarter(number: f64) -> usize {
    ((number.to_bits() >> 50) as i64 - (1023 - 10) * 4).clamp(0, 63) as usize
}

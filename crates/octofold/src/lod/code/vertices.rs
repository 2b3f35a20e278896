//! Vertices, near to the middle of where a plane meets the crossed edges.

use super::super::tree::{Crossed, STEPS};
use super::known::{Known, Turn, rank, step};
use super::plane::Plane;
use crate::range::Coder;
use crate::range::blend::Blend;

/// The chances of vertices.
pub(super) struct Vertices(Blend);

impl Default for Vertices {
    fn default() -> Self {
        Self(Blend::new([3 * 16, 3 * 4096, 3 * 512, 3 * 512, 3 * 1024, 3 * 1024], 6))
    }
}

impl Vertices {
    /// Codes the vertex of an octant and keeps it: along the steepest axis first, which tells how high
    /// the plane is.
    pub(super) fn code(
        &mut self,
        coder: &mut impl Coder,
        known: &mut Known,
        turn: &Turn,
        mut plane: Plane,
        crossed: &Crossed,
        told: [u8; 3],
    ) -> [u8; 3] {
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| plane.normal[b].abs().total_cmp(&plane.normal[a].abs()));
        let moved = rank(known.mean(turn, &known.moved), 15);
        let turned = rank(usize::from(known.turned[turn.index]), 15);
        let (last, is_even) = (usize::from(turn.is_last), usize::from(crossed.any != crossed.odd));
        let crossings = crossed.any.count_ones() as usize;
        let (mut vertex, mut before, mut sum) = ([0; 3], 0, 0);
        for (k, axis) in axes.into_iter().enumerate() {
            let centre = plane.centre(crossed.any)[axis];
            let steps = (centre + 0.5) * f64::from(STEPS);
            let expected = steps.clamp(2.0, f64::from(STEPS) - 3.0) as u8;
            let steep = step(plane.normal[axis].abs(), 16.0, 16);
            let contexts = [
                (k * 2 + last) * 8 + is_even * 4 + turned / 4,
                k * 4096 + usize::from(crossed.any),
                (k * 2 + last) * 256 + turned * 16 + before,
                k * 512 + moved * 32 + last * 16 + before,
                k * 1024 + (crossings * 16 + steep) * 4 + usize::from(expected / 32),
                (k * 16 + turned) * 64 + moved / 2 * 8 + before / 2,
            ];
            let set = k * 2 + last;
            vertex[axis] = self.0.code(coder, told[axis], expected, contexts, set);
            let by = (vertex[axis].wrapping_sub(expected) as i8).unsigned_abs();
            before = rank(by.into(), 15);
            sum += u32::from(by);
            if k == 0 {
                let found = (f64::from(vertex[axis]) + 0.5) / f64::from(STEPS) - 0.5;
                plane.middle -= plane.normal[axis] * (found - centre);
            }
        }
        known.vertices.push(vertex);
        known.moved.push((sum / 2).min(255) as u8);
        vertex
    }
}

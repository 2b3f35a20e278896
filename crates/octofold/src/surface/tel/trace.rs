//! Edge loop chains: the closed walks of gray voxels on the faces of an octant (section 3.2).
//!
//! A walk keeps white on its left, seen from outside the octant. It tries left first after every
//! step (G1), turns clockwise at white, goes straight over the edges of the cube, and ends where it
//! comes back to a side (a gray voxel and a white neighbour on the same face) that it has seen (G2);
//! sides that no walk has seen belong to further loops (G3).
//!
//! No black voxel has a corner sample in common with a white one, so that a walk along white meets
//! gray and white voxels only: what is not gray on its way is white.

use super::Voxel;
use crate::surface::digital::DigitalSurface;

/// A direction along an axis: the axis, and whether it leads up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Direction {
    axis: usize,
    up: bool,
}

/// A part of a loop that lies on one face.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// The face: 2 axis + side.
    pub face: u8,
    /// The voxels along it, at least one; the last is the first of the next piece.
    pub voxels: Vec<Voxel>,
}

impl Direction {
    const ALL: [Self; 6] = [
        Self { axis: 0, up: false },
        Self { axis: 0, up: true },
        Self { axis: 1, up: false },
        Self { axis: 1, up: true },
        Self { axis: 2, up: false },
        Self { axis: 2, up: true },
    ];

    fn face(self) -> u8 {
        (2 * self.axis + usize::from(self.up)) as u8
    }

    fn back(self) -> Self {
        Self { up: !self.up, ..self }
    }

    /// The cross product with a direction along another axis.
    fn cross(self, other: Self) -> Self {
        let forward = (self.axis + 1) % 3 == other.axis;
        Self { axis: 3 - self.axis - other.axis, up: (self.up == other.up) == forward }
    }

    /// The neighbour of `voxel`; `None` outside the box from `low` to `low + size`.
    fn step(self, voxel: Voxel, low: Voxel, size: u32) -> Option<Voxel> {
        let mut next = voxel;
        let (at, start) = (&mut next[self.axis], low[self.axis]);
        if *at == if self.up { start + size } else { start } {
            return None;
        }
        *at = if self.up { *at + 1 } else { *at - 1 };
        Some(next)
    }
}

/// A gray voxel and the direction to a white one on the same face.
type Side = (Voxel, Direction);

/// The voxels on the faces of one octant.
struct Shell<'a> {
    surface: &'a DigitalSurface<'a>,
    low: Voxel,
    size: u32,
    /// Gray voxels, sorted.
    gray: Vec<Voxel>,
}

/// All loops on the faces of the box from `low` to `low + size`, as pieces in their order.
pub fn loops(surface: &DigitalSurface, low: Voxel, size: u32) -> Vec<Vec<Piece>> {
    let shell = Shell::of(surface, low, size);
    let sides = shell.sides();
    let mut seen = vec![false; sides.len()];
    let mut found = Vec::new();
    for at in 0..sides.len() {
        if !seen[at] {
            found.push(shell.walk(sides[at], &sides, &mut seen));
        }
    }
    found
}

impl<'a> Shell<'a> {
    fn of(surface: &'a DigitalSurface, low: Voxel, size: u32) -> Self {
        let mut gray = Vec::new();
        for face in Direction::ALL {
            let (mut start, mut end) = (low, low.map(|i| i + size));
            let fixed = if face.up { end[face.axis] } else { start[face.axis] };
            (start[face.axis], end[face.axis]) = (fixed, fixed);
            surface.all_between(start, end, |cell| {
                gray.push(cell.low);
                true
            });
        }
        gray.sort_unstable();
        gray.dedup();
        Self { surface, low, size, gray }
    }

    fn is_gray(&self, voxel: Voxel) -> bool {
        self.gray.binary_search(&voxel).is_ok()
    }

    fn is_white(&self, voxel: Voxel) -> bool {
        !self.is_gray(voxel) && !self.surface.is_inside(voxel)
    }

    fn is_on(&self, voxel: Voxel, face: Direction) -> bool {
        face.step(voxel, self.low, self.size).is_none()
    }

    /// All sides, sorted, each with one of the faces that show it.
    fn sides(&self) -> Vec<(Side, Direction)> {
        let mut sides = Vec::new();
        for &voxel in &self.gray {
            for towards in Direction::ALL {
                let Some(next) = towards.step(voxel, self.low, self.size) else { continue };
                let shows = |f: &Direction| f.axis != towards.axis && self.is_on(voxel, *f);
                if let Some(face) = Direction::ALL.into_iter().find(shows)
                    && self.is_white(next)
                {
                    sides.push(((voxel, towards), face));
                }
            }
        }
        sides
    }

    /// Walks once round from a side, and marks the sides that it meets as seen.
    fn walk(
        &self,
        (start, mut face): (Side, Direction),
        sides: &[(Side, Direction)],
        seen: &mut [bool],
    ) -> Vec<Piece> {
        let (mut voxel, mut towards) = start;
        let mut pieces = vec![Piece { face: face.face(), voxels: vec![voxel] }];
        loop {
            match towards.step(voxel, self.low, self.size) {
                None => {
                    (face, towards) = (towards, face.back());
                    pieces.push(Piece { face: face.face(), voxels: vec![voxel] });
                }
                Some(next) if self.is_gray(next) => {
                    voxel = next;
                    towards = face.cross(towards);
                    if let Some(piece) = pieces.last_mut() {
                        piece.voxels.push(voxel);
                    }
                }
                Some(_) => {
                    let side = sides.binary_search_by_key(&(voxel, towards), |s| s.0);
                    let new = side.is_ok_and(|at| !std::mem::replace(&mut seen[at], true));
                    if !new {
                        break;
                    }
                    towards = towards.cross(face);
                }
            }
        }
        joined(pieces)
    }
}

/// Joins the last piece with the first where the walk began within a face.
fn joined(mut pieces: Vec<Piece>) -> Vec<Piece> {
    if pieces.len() > 1
        && pieces.first().map(|p| p.face) == pieces.last().map(|p| p.face)
        && let Some(mut last) = pieces.pop()
    {
        last.voxels.pop();
        last.voxels.append(&mut pieces[0].voxels);
        pieces[0] = last;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use crate::surface::{CubesOptions, Inside, noise};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(64))]

        #[test]
        fn loops_are_closed_walks_of_gray_on_their_faces(
            dims in prop::array::uniform3(2usize..11),
            seed in any::<u64>(),
            smooth in 1u64..4,
            size in 1u32..9,
            at in prop::array::uniform3(0u32..4),
        ) {
            let volume = noise(dims, seed, smooth);
            let options = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };
            let surface = DigitalSurface::of(&volume, &options, 1, &Run::default()).unwrap();
            let shell = Shell::of(&surface, at, size);
            let sides = shell.sides();
            let found = loops(&surface, at, size);
            prop_assert!(found.len() <= sides.len());
            prop_assert_eq!(found.is_empty(), sides.is_empty());
            for pieces in &found {
                for (i, piece) in pieces.iter().enumerate() {
                    let next = &pieces[(i + 1) % pieces.len()];
                    prop_assert_eq!(piece.voxels.last(), next.voxels.first());
                    let axis = usize::from(piece.face / 2);
                    let plane = at[axis] + size * u32::from(piece.face % 2);
                    for pair in piece.voxels.windows(2) {
                        let apart: u32 = (0..3).map(|a| pair[0][a].abs_diff(pair[1][a])).sum();
                        prop_assert_eq!(apart, 1);
                    }
                    for &voxel in &piece.voxels {
                        prop_assert!(surface.is_mixed(voxel) && voxel[axis] == plane);
                    }
                }
            }
        }
    }
}

//! Pieces of the surface: blocks of cells, cells, triangles and parts of triangles.
//!
//! What is proved of a convex set around a piece is proved of the piece. Blocks have an oriented
//! box around their surface, so that most of the surface is spoken for by few corners; where that
//! is too coarse, a piece falls into its parts.

use super::cells::{BRICK, Cells};
use super::octant::Octant;
use crate::par;
use crate::surface::cell::PATCHES;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// How often a triangle of the surface may be cut in four.
const CUTS: u32 = 3;

/// A piece of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Piece {
    /// Number of the cell, the block of half a brick, or the brick.
    number: u32,
    /// What it is, as below; for triangles their number in the low three bits, and above them a
    /// one followed by two bits for each cut.
    part: u16,
}

const CELL: u16 = 0;
const WORD: u16 = 1;
const BRICK_PART: u16 = 2;

/// An oriented box around the surface in a block of cells.
#[derive(Debug, Clone, Copy, Default)]
pub struct Block {
    pub middle: DVec3,
    /// Half its edges.
    pub axes: [Vec3; 3],
}

/// The boxes of all blocks.
pub struct Pieces {
    words: Vec<Block>,
    bricks: Vec<Block>,
}

impl Pieces {
    pub fn new(cells: &Cells) -> Self {
        let numbers: Vec<u32> = (0..cells.bricks() as u32).collect();
        let found = par::map(&numbers, |&brick| {
            let words: [Block; 8] =
                std::array::from_fn(|w| Block::around(cells, cells.in_word(8 * brick + w as u32)));
            (words, Block::around(cells, cells.in_brick(brick)))
        });
        let words = found.iter().flat_map(|f| f.0).collect();
        Self { words, bricks: found.iter().map(|f| f.1).collect() }
    }

    /// The box around the surface in one block of half a brick.
    pub fn word(&self, word: u32) -> &Block {
        &self.words[word as usize]
    }

    /// The box around a piece that is a block.
    pub fn block(&self, piece: Piece) -> Option<&Block> {
        match piece.part {
            WORD => Some(&self.words[piece.number as usize]),
            BRICK_PART => Some(&self.bricks[piece.number as usize]),
            _ => None,
        }
    }
}

impl Block {
    fn around(cells: &Cells, range: Range<u32>) -> Self {
        if range.is_empty() {
            return Self::default();
        }
        let mut normal = Vec3::ZERO;
        for cell in range.clone() {
            normal += OUTWARD[cells.mask(cell)];
        }
        let normal = normal.try_normalize().unwrap_or(Vec3::Z).as_dvec3();
        let (right, up) = normal.any_orthonormal_pair();
        let frame = [normal, right, up];
        let home = DVec3::from(cells.corner(range.start).map(f64::from));
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for cell in range {
            for p in cells.crossings(cell) {
                let p = p - home;
                let along = DVec3::new(normal.dot(p), right.dot(p), up.dot(p));
                low = low.min(along);
                high = high.max(along);
            }
        }
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        Self {
            middle: home + normal * middle.x + right * middle.y + up * middle.z,
            // Grown by more than single precision takes.
            axes: std::array::from_fn(|i| (frame[i] * (half[i] + 1e-5)).as_vec3()),
        }
    }

    /// Its eight corners.
    pub fn corners(&self) -> [DVec3; 8] {
        let axes = self.axes.map(|a| a.as_dvec3());
        std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            self.middle + axes[0] * sign(0) + axes[1] * sign(1) + axes[2] * sign(2)
        })
    }
}

/// For each mask, the way from its inside corners to its outside ones.
static OUTWARD: [Vec3; 256] = {
    let mut outward = [Vec3::ZERO; 256];
    let mut mask = 0;
    while mask < 256 {
        let mut sum = [0.0f32; 3];
        let mut c = 0;
        while c < 8 {
            let sign = if mask >> c & 1 == 1 { -1.0 } else { 1.0 };
            let mut a = 0;
            while a < 3 {
                sum[a] += if c >> a & 1 == 1 { sign } else { -sign };
                a += 1;
            }
            c += 1;
        }
        outward[mask] = Vec3::from_array(sum);
        mask += 1;
    }
    outward
};

impl Piece {
    /// One triangle of a cell.
    pub fn triangle(cell: u32, number: usize) -> Self {
        Self { number: cell, part: number as u16 | 1 << 3 }
    }

    /// The few largest pieces that make up the surface in an octant.
    pub fn of_octant(cells: &Cells, octant: Octant, range: Range<u32>) -> Vec<Self> {
        let brick = |cell| cells.brick_of(cell);
        if octant.size >= BRICK
            && let (Some(first), Some(last)) = (brick(range.start), brick(range.end - 1))
        {
            return (first..=last).map(|number| Self { number, part: BRICK_PART }).collect();
        }
        range.map(|number| Self { number, part: CELL }).collect()
    }

    /// Calls `visit` with the parts of the piece while it gives true; tells whether it always did.
    /// There are none where it was cut often enough.
    pub fn parts(self, cells: &Cells, mut visit: impl FnMut(Self) -> bool) -> bool {
        let number = self.number;
        match self.part {
            BRICK_PART => (8 * number..8 * number + 8)
                .filter(|&word| !cells.in_word(word).is_empty())
                .all(|number| visit(Self { number, part: WORD })),
            WORD => cells.in_word(number).all(|number| visit(Self { number, part: CELL })),
            CELL => {
                let count = PATCHES[cells.mask(number)].triangles().len();
                (0..count).all(|t| visit(Self::triangle(number, t)))
            }
            part => {
                let (triangle, code) = (part & 7, part >> 3);
                code >> (2 * CUTS) != 0
                    || (0..4).all(|i| visit(Self { number, part: triangle | (code << 2 | i) << 3 }))
            }
        }
    }

    /// The cell, where the piece is all of its surface.
    pub fn whole_cell(self) -> Option<u32> {
        (self.part == CELL).then_some(self.number)
    }

    /// Whether the piece is a triangle or a part of one.
    pub fn is_part(self) -> bool {
        self.part > BRICK_PART
    }

    /// Corners of a piece that is a triangle or a part of one.
    pub fn corners(self, cells: &Cells) -> [DVec3; 3] {
        let number = (self.part & 7) as usize;
        let edges = PATCHES[cells.mask(self.number)].triangles()[number];
        let mut corners = edges.map(|e| DVec3::from(cells.crossing(self.number, e.into())));
        let code = self.part >> 3;
        let mut depth = (15 - code.leading_zeros()) / 2;
        while depth > 0 {
            depth -= 1;
            let [a, b, c] = corners;
            let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
            corners = match code >> (2 * depth) & 3 {
                0 => [a, ab, ca],
                1 => [ab, b, bc],
                2 => [ca, bc, c],
                _ => [ab, bc, ca],
            };
        }
        corners
    }

    /// Sorts pieces, and puts the whole in the place of parts where all of them are there.
    pub fn merge(cells: &Cells, pieces: &mut Vec<Self>) {
        pieces.sort_unstable_by_key(|p| (p.cells(cells).start, p.part));
        let mut whole = Vec::with_capacity(pieces.len());
        for parts in pieces.chunk_by(|a, b| a.number == b.number && a.is_part() && b.is_part()) {
            let share = |p: &Self| 1u32 << (2 * CUTS - (15 - (p.part >> 3).leading_zeros()));
            let cell = parts[0].number;
            if parts[0].is_part()
                && parts.iter().map(share).sum::<u32>()
                    == (PATCHES[cells.mask(cell)].triangles().len() as u32) << (2 * CUTS)
            {
                whole.push(Self { number: cell, part: CELL });
            } else {
                whole.extend_from_slice(parts);
            }
        }
        pieces.clear();
        let mut i = 0;
        while i < whole.len() {
            let Some(word) =
                (whole[i].part == CELL).then(|| cells.word_of(whole[i].number)).flatten()
            else {
                pieces.push(whole[i]);
                i += 1;
                continue;
            };
            let range = cells.in_word(word);
            let rest = &whole[i..];
            let inside = |p: &&Self| (p.part == CELL || p.is_part()) && p.number < range.end;
            let parts = &rest[..rest.iter().take_while(inside).count()];
            let is_whole = parts.len() == range.len()
                && parts.iter().zip(range).all(|(p, cell)| p.part == CELL && p.number == cell);
            if is_whole {
                pieces.push(Self { number: word, part: WORD });
            } else {
                pieces.extend_from_slice(parts);
            }
            i += parts.len();
        }
        whole.clear();
        let mut i = 0;
        while i < pieces.len() {
            let Self { number, part } = pieces[i];
            if part == WORD {
                let brick = number / 8;
                let all = (8 * brick..8 * brick + 8).filter(|&w| !cells.in_word(w).is_empty());
                let count = all.clone().count();
                let there = pieces[i..]
                    .iter()
                    .zip(all)
                    .take_while(|(p, word)| p.part == WORD && p.number == *word);
                if there.count() == count {
                    whole.push(Self { number: brick, part: BRICK_PART });
                    i += count;
                    continue;
                }
            }
            whole.push(pieces[i]);
            i += 1;
        }
        std::mem::swap(pieces, &mut whole);
    }

    /// The mixed cells that the piece is in.
    pub fn cells(self, cells: &Cells) -> Range<u32> {
        match self.part {
            BRICK_PART => cells.in_brick(self.number),
            WORD => cells.in_word(self.number),
            _ => self.number..self.number + 1,
        }
    }
}

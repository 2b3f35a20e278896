//! The octants of all levels, from the finest up: each from the sums of its children.

use super::build::VertexRule;
use super::crossings::Crossings;
use super::direction;
use super::leaves::Leaves;
use super::sums::Sum;
use super::tree::{Crossed, STEPS, Traits, place};
use crate::light::srgb;
use crate::octree::key::unmorton;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::{DVec3, Vec4Swizzles};

/// Octants of one block of work.
const BLOCK: usize = 1 << 12;

/// The octants of one level in Morton order.
#[derive(Debug, Default)]
pub(super) struct Level {
    /// Morton codes among the octants of the level.
    pub codes: Vec<u64>,
    /// Children; 0 on the finest level.
    pub masks: Vec<u8>,
    pub crossed: Vec<Crossed>,
    pub vertices: Vec<[u8; 3]>,
    pub normals: Vec<[u8; 2]>,
    pub shapes: Vec<u8>,
    pub traits: Vec<u8>,
    pub colours: Vec<[u8; 4]>,
}

impl Level {
    fn push(&mut self, code: u64, mask: u8, sum: &Sum, size: u32, finish: &Finish<'_>) {
        let crossed = sum.crossed();
        let low = unmorton(code).map(|i| i * size);
        self.codes.push(code);
        self.masks.push(mask);
        self.crossed.push(crossed);
        self.vertices.push(finish.vertex(sum, low, size));
        self.normals.push(direction::packed((finish.turn)(sum.normal())));
        self.shapes.push(if crossed.any == 0 { 0 } else { (sum.flatness() * 255.0).round() as u8 });
        self.traits.push(if sum.is_border() { Traits::BORDER } else { 0 });
        if finish.coloured {
            let colour = sum.colour().unwrap_or_default();
            let [r, g, b] = srgb(colour.xyz());
            self.colours.push([r, g, b, (colour.w * 255.0).round() as u8]);
        }
    }

    fn append(&mut self, other: Self) {
        self.codes.extend(other.codes);
        self.masks.extend(other.masks);
        self.crossed.extend(other.crossed);
        self.vertices.extend(other.vertices);
        self.normals.extend(other.normals);
        self.shapes.extend(other.shapes);
        self.traits.extend(other.traits);
        self.colours.extend(other.colours);
    }

    /// The vertex of octant `i` of a level whose octants have side `size`, in finest cells.
    pub(super) fn vertex(&self, i: usize, size: u32) -> DVec3 {
        place(self.vertices[i], unmorton(self.codes[i]).map(|c| c * size), size)
    }
}

/// The first child of each octant, on the level below.
pub(super) fn firsts(level: &Level) -> Vec<u32> {
    let mut next = 0;
    let first = |mask: &u8| {
        let first = next;
        next += mask.count_ones();
        first
    };
    level.masks.iter().map(first).collect()
}

/// How sums become octants.
pub(super) struct Finish<'a> {
    pub rule: VertexRule,
    /// Turns a normal of the grid into one of the world.
    pub turn: &'a (dyn Fn(DVec3) -> DVec3 + Sync),
    pub coloured: bool,
}

impl Finish<'_> {
    /// The vertex in steps of its octant, never on its faces: patches do not degenerate.
    fn vertex(&self, sum: &Sum, low: [u32; 3], size: u32) -> [u8; 3] {
        const MARGIN: f64 = 2.0;
        let [low, side] = [DVec3::from(low.map(f64::from)), DVec3::splat(f64::from(size))];
        let found = match self.rule {
            VertexRule::Mean => sum.mean(),
            VertexRule::Quadric => sum.lowest(low, low + side),
        };
        let within = (found.unwrap_or(low + side * 0.5) - low) / side * f64::from(STEPS);
        let most = f64::from(STEPS) - 1.0 - MARGIN;
        within.to_array().map(|x| x.floor().clamp(MARGIN, most) as u8)
    }
}

/// All levels, the root's first.
pub(super) fn pyramid(
    leaves: &Leaves,
    crossings: &Crossings,
    vertices: &[DVec3],
    levels: u32,
    finish: &Finish<'_>,
    run: &Run,
) -> Result<Vec<Level>, Cancelled> {
    run.stage("octants");
    // Sums of the finest octants take more room than all else: each goes once its parent has it.
    let leaf = |i: usize, own: &mut Level| {
        let sum = leaves.sum(i, crossings, vertices);
        own.push(leaves.codes[i], 0, &sum, 1, finish);
        sum
    };
    let (finest, mut above, mut sums) = families(&leaves.codes, leaf, 2, finish, run)?;
    let mut all = vec![finest];
    for height in 2..=levels {
        let known = |i: usize, _: &mut Level| sums[i];
        let (_, next, totals) = families(&above.codes, known, 1 << height, finish, run)?;
        all.push(std::mem::replace(&mut above, next));
        sums = totals;
    }
    all.push(above);
    all.reverse();
    Ok(all)
}

/// The parents of octants, of side `size`, and their sums; `child` tells the sum of an octant and may
/// add it to a level, which comes first.
fn families(
    codes: &[u64],
    child: impl Fn(usize, &mut Level) -> Sum + Sync,
    size: u32,
    finish: &Finish<'_>,
    run: &Run,
) -> Result<(Level, Level, Vec<Sum>), Cancelled> {
    let parts = par::blocks(run, codes.len(), BLOCK, |block| {
        // A block takes the families that begin in it.
        let begin = |at: usize| {
            let family = |i: usize| codes[i] >> 3;
            let mut at = at;
            while 0 < at && at < codes.len() && family(at) == family(at - 1) {
                at += 1;
            }
            at
        };
        let (mut own, mut above, mut totals) = (Level::default(), Level::default(), Vec::new());
        let mut at = begin(block.start);
        let end = begin(block.end);
        while at < end {
            let code = codes[at] >> 3;
            let (mut total, mut mask) = (Sum::NOTHING, 0);
            while at < end && codes[at] >> 3 == code {
                let octant = (codes[at] & 7) as u32;
                total.child(octant, &child(at, &mut own));
                mask |= 1 << octant;
                at += 1;
            }
            above.push(code, mask, &total, size, finish);
            totals.push(total);
        }
        (own, above, totals)
    })?;
    let (mut own, mut above, mut sums) = (Level::default(), Level::default(), Vec::new());
    for (children, parents, totals) in parts {
        own.append(children);
        above.append(parents);
        sums.extend(totals);
    }
    Ok((own, above, sums))
}

//! Models as few bytes.
//!
//! Octants are told breadth-first, each from what is known before: its parent, and the octants beside it
//! on its level that came earlier. First its normal, near theirs; then its edges, of which most are
//! theirs too, and the rest lie on a plane through theirs; then its vertex, which is near to the middle
//! of where that plane meets the crossed edges, along the steepest axis first; then its children, which
//! lie along its own plane. All chances follow what happens.

use super::direction;
use super::edges::{LOCAL, across};
use super::tree::{Crossed, Lod, Node, Parts, STEPS};
use super::{LodError, MOST_LEVELS};
use crate::range::{Chance, Coder, Decoder, Encoder};
use crate::run::Run;
use crate::volume::Placement;
use glam::DVec3;

/// Octants that one byte may stand for, at most: real ones take two bytes and more each.
const MOST_OF_BYTE: u64 = 16;

/// Octants between two looks at the cancel flag.
const BLOCK: usize = 1 << 14;

const NONE: u32 = u32::MAX;

impl Lod {
    /// The model as a stream of bytes, without its levels, place and counts.
    ///
    /// # Errors
    /// Where the work is interrupted.
    pub fn encoded(&self, run: &Run) -> Result<Vec<u8>, crate::Cancelled> {
        let mut encoder = Encoder::default();
        let parts = self.parts();
        let mut walk = Walk::new(parts.levels, parts.colours.is_some());
        let mut place = 0;
        while place < walk.queue.len() {
            if place.is_multiple_of(BLOCK) {
                run.check()?;
            }
            walk.octant(&mut encoder, place, Some(parts));
            place += 1;
        }
        Ok(encoder.finish())
    }

    /// The model of `octants` octants that a stream tells.
    ///
    /// # Errors
    /// Where the stream is damaged, or the work is interrupted.
    pub fn decoded(
        stream: &[u8],
        levels: u32,
        frame: Placement,
        octants: u64,
        coloured: bool,
        run: &Run,
    ) -> Result<Self, LodError> {
        if levels == 0 || levels > MOST_LEVELS {
            return Err(LodError::Damaged("it has no levels or too many"));
        }
        if octants > MOST_OF_BYTE * (stream.len() as u64 + 1) {
            return Err(LodError::Damaged("it names more octants than its bytes can tell"));
        }
        let mut decoder = Decoder::new(stream);
        let mut walk = Walk::new(levels, coloured);
        let mut place = 0;
        while place < walk.queue.len() {
            if place.is_multiple_of(BLOCK) {
                run.check()?;
            }
            if walk.queue.len() as u64 > octants || decoder.is_overrun() {
                return Err(LodError::Damaged("its stream tells of too many octants"));
            }
            walk.octant(&mut decoder, place, None);
            place += 1;
        }
        if place as u64 != octants || decoder.is_overrun() {
            return Err(LodError::Damaged("its stream does not tell of all octants"));
        }
        Lod::from_parts(Parts {
            levels,
            frame,
            nodes: walk.nodes.into(),
            errors: walk.errors.into(),
            shapes: walk.shapes.into(),
            traits: walk.traits.into(),
            vertices: walk.vertices.into(),
            normals: walk.normals.into(),
            colours: coloured.then(|| walk.colours.into()),
        })
    }
}

/// An octant whose turn comes, or came.
#[derive(Debug, Clone, Copy)]
struct Queued {
    corner: [u16; 3],
    level: u8,
    parent: u32,
    /// Octants of the same level beside it, by way `2 axis + side`.
    beside: [u32; 6],
}

/// A byte by its bits, the highest first.
struct Byte([Chance; 256]);

impl Byte {
    fn code(&mut self, coder: &mut impl Coder, byte: u8) -> u8 {
        let mut path = 1usize;
        for bit in (0..8).rev() {
            let one = self.0[path].code(coder, byte >> bit & 1 == 1);
            path = path << 1 | usize::from(one);
        }
        path as u8
    }

    /// A byte by its difference from what is expected: small ones of either sign first.
    fn near(&mut self, coder: &mut impl Coder, byte: u8, expected: u8) -> u8 {
        let off = byte.wrapping_sub(expected) as i8;
        let folded = self.code(coder, ((off << 1) ^ (off >> 7)) as u8);
        let off = (folded >> 1) as i8 ^ -((folded & 1) as i8);
        expected.wrapping_add(off as u8)
    }
}

/// As many contexts of bytes.
fn bytes(count: usize) -> Vec<Byte> {
    (0..count).map(|_| Byte([Chance::EVEN; 256])).collect()
}

/// Everything that is known so far, and all chances.
struct Walk {
    levels: u32,
    coloured: bool,
    queue: Vec<Queued>,
    nodes: Vec<Node>,
    vertices: Vec<[u8; 3]>,
    normals: Vec<[u8; 2]>,
    errors: Vec<u8>,
    shapes: Vec<u8>,
    traits: Vec<u8>,
    colours: Vec<[u8; 4]>,
    of_normals: Vec<Byte>,
    of_vertices: Vec<Byte>,
    of_errors: Vec<Byte>,
    of_shapes: Vec<Byte>,
    of_colours: Vec<Byte>,
    of_traits: Vec<Chance>,
    of_known: Vec<Chance>,
    of_edges: Vec<Chance>,
    of_odd: Vec<Chance>,
    of_signs: Vec<Chance>,
    of_leaves: Vec<Chance>,
    of_children: Vec<Chance>,
}

/// A plane through an octant: a unit normal, and the distance of the octant's middle from it in sides
/// of the octant.
#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: DVec3,
    middle: f64,
}

impl Plane {
    /// The height of a place in the octant, in sides from its middle.
    fn height(&self, at: DVec3) -> f64 {
        self.normal.dot(at) + self.middle
    }

    /// The middle of where it meets some edges of the octant, in sides from the octant's middle.
    fn centre(&self, edges: u16) -> DVec3 {
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for edge in (0..12).filter(|e| edges >> e & 1 == 1) {
            let [low, high] = ends(edge);
            let (from, to) = (self.height(low), self.height(high));
            let share = if from == to { 0.5 } else { (from / (from - to)).clamp(0.0, 1.0) };
            sum += low + (high - low) * share;
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { DVec3::ZERO }
    }
}

/// Both ends of an edge, in sides from the octant's middle.
fn ends(edge: usize) -> [DVec3; 2] {
    let local = &LOCAL[edge];
    let mut low = DVec3::splat(-0.5);
    for (axis, side) in across(local.axis).into_iter().zip(local.sides) {
        low[axis] += f64::from(side);
    }
    let mut high = low;
    high[local.axis] = 0.5;
    [low, high]
}

/// Which of `count` steps of width `1 / fine` a length is in.
fn step(length: f64, fine: f64, count: usize) -> usize {
    ((length * fine).clamp(0.0, 1e6) as usize).min(count - 1)
}

impl Walk {
    fn new(levels: u32, coloured: bool) -> Self {
        let root = Queued { corner: [0; 3], level: 0, parent: 0, beside: [NONE; 6] };
        Self {
            levels,
            coloured,
            queue: vec![root],
            nodes: vec![],
            vertices: vec![],
            normals: vec![],
            errors: vec![],
            shapes: vec![],
            traits: vec![],
            colours: vec![],
            of_normals: bytes(2 * 2 * 8),
            of_vertices: bytes(2 * 3 * 8),
            of_errors: bytes(2 * 64),
            of_shapes: bytes(2 * 64),
            of_colours: bytes(8),
            of_traits: vec![Chance::RARE; 2],
            of_known: vec![Chance::EVEN; 5 * 5],
            of_edges: vec![Chance::EVEN; 2 * 2 * 16 * 16],
            of_odd: vec![Chance::EVEN; 2],
            of_signs: vec![Chance::EVEN; 3],
            of_leaves: vec![Chance::EVEN; 17 * 3 * 8],
            of_children: vec![Chance::EVEN; 32 * 8 * 2],
        }
    }

    /// Tells octant `i`, or hears of it, and puts its children into the queue.
    fn octant(&mut self, coder: &mut impl Coder, i: usize, told: Option<&Parts>) {
        let own = self.queue[i];
        let is_root = i == 0;
        let parent = own.parent as usize;
        let size = 1u32 << (self.levels - u32::from(own.level));
        let last = usize::from(u32::from(own.level) == self.levels);
        let known: Vec<usize> = own.beside.iter().map(|&n| n as usize).filter(|&n| n < i).collect();
        let told_node = told.map_or(Node::new(0, 0, Crossed::default()), |p| p.nodes[i]);

        // The normal.
        let mut mean = DVec3::ZERO;
        for &n in &known {
            mean += direction::unpacked(self.normals[n]) * 2.0;
        }
        if !is_root {
            mean += direction::unpacked(self.normals[parent]);
        }
        let weight = 2.0 * known.len() as f64 + 1.0;
        let spread = step((1.0 - mean.length() / weight).max(0.0).sqrt(), 12.0, 8);
        let expected = direction::packed(mean);
        let told_normal = told.map_or([0; 2], |p| p.normals[i]);
        let context = (usize::from(known.len() > 1) * 8 + spread) * 2;
        let normal =
            [0, 1].map(|k| self.of_normals[context + k].near(coder, told_normal[k], expected[k]));
        let facing = direction::unpacked(normal);

        // A plane through those beside it and its parent.
        let middle = DVec3::from(own.corner.map(f64::from)) + f64::from(size) / 2.0;
        let height = |walk: &Self, of: usize| {
            let at = walk.place(of);
            direction::unpacked(walk.normals[of]).dot(middle - at) / f64::from(size)
        };
        let (mut sum, mut count) = (0.0, 0.0);
        for &n in &known {
            sum += 2.0 * height(self, n);
            count += 2.0;
        }
        if !is_root {
            sum += height(self, parent);
            count += 1.0;
        }
        let mut plane = Plane { normal: facing, middle: sum / f64::max(count, 1.0) };

        // Its edges.
        let crossed = self.edges(coder, i, &own, told_node, &plane);

        // Its vertex, along the steepest axis first.
        let told_vertex = told.map_or([0; 3], |p| p.vertices[i]);
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| facing[b].abs().total_cmp(&facing[a].abs()));
        let mut vertex = [0; 3];
        let bend = spread.min(3) + 4 * usize::from(crossed.any != crossed.odd);
        for (turn, axis) in axes.into_iter().enumerate() {
            let centre = plane.centre(crossed.any)[axis];
            let steps = (centre + 0.5) * f64::from(STEPS);
            let expected = steps.clamp(2.0, f64::from(STEPS) - 3.0) as u8;
            let context = (last * 3 + turn) * 8 + bend;
            vertex[axis] = self.of_vertices[context].near(coder, told_vertex[axis], expected);
            if turn == 0 {
                let found = (f64::from(vertex[axis]) + 0.5) / f64::from(STEPS) - 0.5;
                plane.middle -= facing[axis] * (found - centre);
            }
        }

        // What else is known.
        let above = |column: &[u8]| if is_root { 255 } else { column[parent] };
        let beside = |column: &[u8]| {
            let sum: usize = known.iter().map(|&n| usize::from(column[n])).sum();
            if known.is_empty() { usize::from(above(column)) } else { sum / known.len() }
        };
        let near_error = (beside(&self.errors) + usize::from(above(&self.errors))) / 2;
        let error =
            self.of_errors[last * 64 + near_error / 4].code(coder, told.map_or(0, |p| p.errors[i]));
        let near_shape = (beside(&self.shapes) + usize::from(above(&self.shapes))) / 2;
        let shape =
            self.of_shapes[last * 64 + near_shape / 4].code(coder, told.map_or(0, |p| p.shapes[i]));
        let context = usize::from(!is_root && self.traits[parent] != 0);
        let plain = self.of_traits[context].code(coder, told.is_some_and(|p| p.traits[i] != 0));
        let traits = if plain { told.map_or(1, |p| p.traits[i].min(1)) } else { 0 };

        if self.coloured {
            let colour = self.colour(coder, i, parent, &known, told);
            self.colours.push(colour);
        }

        // Its children.
        let at = (DVec3::from(vertex.map(f64::from)) + 0.5) / f64::from(STEPS) - 0.5;
        let plane = Plane { normal: facing, middle: -facing.dot(at) };
        let mask = self.children(coder, &own, told_node.children(), &plane, &crossed, error);
        let first = if mask == 0 { 0 } else { self.queue.len() as u32 };
        self.nodes.push(Node::new(first, mask, crossed));
        self.vertices.push(vertex);
        self.normals.push(normal);
        self.errors.push(error);
        self.shapes.push(shape);
        self.traits.push(traits);
        self.enqueue(i, &own, mask, size);
    }

    /// The vertex of an octant that is known, in finest cells.
    fn place(&self, i: usize) -> DVec3 {
        let of = &self.queue[i];
        let size = 1 << (self.levels - u32::from(of.level));
        super::tree::place(self.vertices[i], of.corner.map(u32::from), size)
    }

    fn edges(
        &mut self,
        coder: &mut impl Coder,
        i: usize,
        own: &Queued,
        told: Node,
        plane: &Plane,
    ) -> Crossed {
        // No crossing, an even number, an odd number along, and against the axis.
        let state = |node: Node, edge: usize| {
            let bit = |bits: u16| usize::from(bits >> edge & 1);
            match (bit(node.any()), bit(node.odd())) {
                (0, _) => 0,
                (_, 0) => 1,
                _ => 2 + bit(node.negative()),
            }
        };
        let mut crossed = Crossed::default();
        let grain = plane.normal.abs().element_sum() / 2.0;
        for edge in 0..12 {
            let local = &LOCAL[edge];
            let [first, second] = local.ways.map(|way| own.beside[way]);
            let third = self.queue.get(first as usize).map_or(NONE, |q| q.beside[local.ways[1]]);
            let round = [(first, edge ^ 1), (second, edge ^ 2), (third, edge ^ 3)];
            let known = round.iter().find(|(n, _)| (*n as usize) < i);
            let known = known.map(|&(n, edge)| state(self.nodes[n as usize], edge));
            let told = state(told, edge);
            let found = if let Some(known) = known {
                let same = self.of_known[known].code(coder, told == known);
                if same { known } else { self.state(coder, told, 5 + known * 4) }
            } else {
                let [low, high] = ends(edge).map(|end| plane.height(end) / grain);
                let opposite = usize::from((low < 0.0) != (high < 0.0));
                let nearest = step(low.abs().min(high.abs()), 10.0, 16);
                let length = step((low - high).abs(), 8.0, 16);
                let context = ((opposite * 16) + nearest) * 16 + length;
                if !self.of_edges[context].code(coder, told != 0) {
                    0
                } else if !self.of_odd[opposite].code(coder, told != 1) {
                    1
                } else {
                    let against = usize::from(plane.normal[local.axis] < 0.0);
                    2 + usize::from(self.of_signs[against].code(coder, told == 3))
                }
            };
            let bit = 1 << edge;
            if found > 0 {
                crossed.any |= bit;
            }
            if found > 1 {
                crossed.odd |= bit;
            }
            if found > 2 {
                crossed.negative |= bit;
            }
        }
        crossed
    }

    /// One of four states with its own chances.
    fn state(&mut self, coder: &mut impl Coder, told: usize, context: usize) -> usize {
        let high = self.of_known[context].code(coder, told > 1);
        let low = self.of_known[context + 1 + usize::from(high)].code(coder, told % 2 == 1);
        2 * usize::from(high) + usize::from(low)
    }

    fn children(
        &mut self,
        coder: &mut impl Coder,
        own: &Queued,
        told: u8,
        plane: &Plane,
        crossed: &Crossed,
        error: u8,
    ) -> u8 {
        if u32::from(own.level) == self.levels {
            return 0;
        }
        let exact = step(f64::from(error) / 255.0, 64.0, 64).saturating_sub(12).min(7);
        let bare =
            usize::from(crossed.any == 0) + usize::from(crossed.any == 0 && crossed.odd != 0);
        let context = (usize::from(own.level) * 3 + bare) * 8 + exact;
        if self.of_leaves[context].code(coder, told == 0) {
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
            let there = self.of_children[context].code(coder, told >> octant & 1 == 1);
            mask |= u8::from(there) << octant;
        }
        mask
    }

    fn colour(
        &mut self,
        coder: &mut impl Coder,
        i: usize,
        parent: usize,
        known: &[usize],
        told: Option<&Parts>,
    ) -> [u8; 4] {
        let told = told.and_then(|p| p.colours.as_ref()).map_or([0; 4], |c| c[i]);
        let mut colour = [0; 4];
        let mut off = 0u8;
        for k in 0..4 {
            let mut sum = if i == 0 { 0 } else { u32::from(self.colours[parent][k]) };
            let mut count = 1;
            for &n in known {
                sum += 2 * u32::from(self.colours[n][k]);
                count += 2;
            }
            let mean = ((sum + count / 2) / count) as u8;
            // Channels mostly change together.
            let expected = if k == 1 || k == 2 { mean.wrapping_add(off) } else { mean };
            let context = k * 2 + usize::from(known.len() > 1);
            colour[k] = self.of_colours[context].near(coder, told[k], expected);
            off = colour[k].wrapping_sub(mean);
        }
        colour
    }

    /// Puts the children of octant `i` into the queue, with the octants beside them.
    fn enqueue(&mut self, i: usize, own: &Queued, mask: u8, size: u32) {
        let half = (size / 2) as u16;
        for octant in (0..8u32).filter(|o| mask >> o & 1 == 1) {
            let corner = [0, 1, 2].map(|a| own.corner[a] + (octant >> a & 1) as u16 * half);
            let level = own.level + 1;
            self.queue.push(Queued { corner, level, parent: i as u32, beside: [NONE; 6] });
        }
        if mask == 0 {
            return;
        }
        let child = |of: u32, octant: u32| match self.nodes.get(of as usize) {
            Some(node) if node.children() >> octant & 1 == 1 => node.child(octant),
            _ => NONE,
        };
        let mut pairs = Vec::new();
        for octant in (0..8u32).filter(|o| mask >> o & 1 == 1) {
            let place = child(i as u32, octant);
            for way in 0..6 {
                let bit = 1 << (way / 2);
                let inside = (octant & bit != 0) != (way & 1 == 1);
                let of = if inside { i as u32 } else { own.beside[way] };
                let other = child(of, octant ^ bit);
                if other != NONE {
                    pairs.push((place, way, other));
                }
            }
        }
        // Those beside it that come later are told of it now.
        for (place, way, other) in pairs {
            self.queue[place as usize].beside[way] = other;
            self.queue[other as usize].beside[way ^ 1] = place;
        }
    }
}

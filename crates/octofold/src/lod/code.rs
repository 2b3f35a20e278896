//! Models as few bytes.
//!
//! Octants are told breadth-first, each from what is known before: its parent, and the octants beside it
//! on its level that came earlier. First its normal, near theirs; then its edges, of which most are
//! theirs too, and the rest lie on a plane through theirs; then its vertex, which is near to the middle
//! of where that plane meets the crossed edges, along the steepest axis first; then its children, which
//! lie along its own plane. Once all octants are known, their bounds and flatness are told from the last
//! to the first: those of children, and how vertices and normals differ, tell most of them. All chances
//! follow what happens; those of normals, vertices, bounds and flatness are mixed out of several
//! contexts.

mod children;
mod colours;
mod crossed;
mod known;
mod measures;
mod normals;
mod plane;
#[cfg(test)]
mod tests;
mod vertices;

use super::tree::{Lod, Node, Parts};
use super::{LodError, MOST_LEVELS};
use crate::range::{Chance, Coder, Decoder, Encoder};
use crate::run::{Cancelled, Run};
use crate::volume::Placement;
use children::Children;
use colours::Colours;
use crossed::Edges;
use known::{Known, Turn};
use measures::Measures;
use normals::Normals;
use plane::Plane;
use vertices::Vertices;

/// Octants that one byte may stand for, at most: real ones take two bytes and more each.
const MOST_OF_BYTE: u64 = 16;

/// Octants between two looks at the cancel flag.
const BLOCK: usize = 1 << 14;

impl Lod {
    /// The model as a stream of bytes, without its levels, place and counts.
    ///
    /// # Errors
    /// Where the work is interrupted.
    pub fn encoded(&self, run: &Run) -> Result<Vec<u8>, Cancelled> {
        let parts = self.parts();
        let mut encoder = Encoder::default();
        let mut walk = Walk::new(parts.levels, parts.colours.is_some());
        let mut place = 0;
        while place < walk.known.placed.len() {
            if place.is_multiple_of(BLOCK) {
                run.check()?;
            }
            walk.octant(&mut encoder, place, Some(parts));
            place += 1;
        }
        walk.measures(&mut encoder, Some(parts), run)?;
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
        while place < walk.known.placed.len() {
            if place.is_multiple_of(BLOCK) {
                run.check()?;
            }
            if walk.known.placed.len() as u64 > octants || decoder.is_overrun() {
                return Err(LodError::Damaged("its stream tells of too many octants"));
            }
            walk.octant(&mut decoder, place, None);
            place += 1;
        }
        let missing = LodError::Damaged("its stream does not tell of all octants");
        if place as u64 != octants {
            return Err(missing);
        }
        walk.measures(&mut decoder, None, run)?;
        if decoder.is_overrun() {
            return Err(missing);
        }
        let known = walk.known;
        Lod::from_parts(Parts {
            levels,
            frame,
            nodes: known.nodes.into(),
            errors: known.errors.into(),
            shapes: known.shapes.into(),
            traits: known.traits.into(),
            vertices: known.vertices.into(),
            normals: known.normals.into(),
            colours: coloured.then(|| known.colours.into()),
        })
    }
}

/// Everything that is known so far, and all chances.
struct Walk {
    known: Known,
    coloured: bool,
    normals: Normals,
    edges: Edges,
    vertices: Vertices,
    traits: [Chance; 2],
    colours: Colours,
    children: Children,
    measures: Measures,
}

impl Walk {
    fn new(levels: u32, coloured: bool) -> Self {
        Self {
            known: Known::new(levels),
            coloured,
            normals: Normals::default(),
            edges: Edges::default(),
            vertices: Vertices::default(),
            traits: [Chance::RARE; 2],
            colours: Colours::default(),
            children: Children::default(),
            measures: Measures::default(),
        }
    }

    /// Tells octant `i`, or hears of it, and puts its children into the queue.
    fn octant(&mut self, coder: &mut impl Coder, i: usize, told: Option<&Parts>) {
        let turn = Turn::of(&self.known, i);
        let told_node = told.map_or(Node::default(), |p| p.nodes[i]);
        let told_normal = told.map_or([0; 2], |p| p.normals[i]);
        let normal = self.normals.code(coder, &mut self.known, &turn, told_normal);
        let plane = Plane::beside(&self.known, &turn, normal);
        let crossed = self.edges.code(coder, &self.known, &turn, told_node, &plane);
        let told_vertex = told.map_or([0; 3], |p| p.vertices[i]);
        let vertex =
            self.vertices.code(coder, &mut self.known, &turn, plane, &crossed, told_vertex);
        let context = usize::from(turn.parent.is_some_and(|p| self.known.traits[p] != 0));
        let is_border = self.traits[context].code(coder, told.is_some_and(|p| p.traits[i] != 0));
        self.known.traits.push(u8::from(is_border));
        if self.coloured {
            let told = told.and_then(|p| p.colours.as_ref()).map_or([0; 4], |c| c[i]);
            let colour = self.colours.code(coder, &self.known, &turn, told);
            self.known.colours.push(colour);
        }
        let plane = Plane::through(normal, vertex);
        let told = told_node.children();
        let mask = self.children.code(coder, &self.known, &turn, told, &plane, &crossed);
        self.known.enqueue(&turn, mask, crossed);
    }

    /// Tells the bounds and the flatness of all octants, or hears of them, once all else is known.
    fn measures(
        &mut self,
        coder: &mut impl Coder,
        told: Option<&Parts>,
        run: &Run,
    ) -> Result<(), Cancelled> {
        let count = self.known.nodes.len();
        self.known.errors = vec![0; count];
        self.known.shapes = vec![0; count];
        for i in (0..count).rev() {
            if i.is_multiple_of(BLOCK) {
                run.check()?;
            }
            let told = told.map_or((0, 0), |p| (p.errors[i], p.shapes[i]));
            let found = self.measures.code(coder, &self.known, i, told);
            (self.known.errors[i], self.known.shapes[i]) = found;
        }
        Ok(())
    }
}

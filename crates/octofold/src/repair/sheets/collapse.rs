//! Thin parts become single sheets: elementary collapses of the dual complex.
//!
//! A thin 3-cell and a quad of its that no other 3-cell has vanish together, until no thin 3-cell is
//! left; then quads with a free side vanish where the input does not hold them. Neither changes the
//! homotopy type: no hole opens, nothing falls apart. Which quad goes first decides where the sheet
//! runs: between two parallel walls that on the canonical side, in the corner of a fold those that the
//! input does not pierce. Source: specification of repair (A.2, "collapse, not dedupe").

use super::super::bricks::{Block, Place};
use super::complex::{Complex, Edge, Vertex, ahead};
use super::guide::{Piercing, SheetGuide};
use super::pockets::{Beyond, Pockets, edge_from, vertex_from};
use crate::run::{Cancelled, Run};
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A wall of a pair of parallel ones, and no flange between them, has a normal nearer than this.
const ALONG: f64 = 0.7;

/// What was collapsed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Collapsed {
    /// Thin 3-cells that vanished.
    pub cells: u64,
    /// Among them those between parallel walls.
    pub between_walls: u64,
    /// Quads with a free side that vanished.
    pub dangling: u64,
}

/// Makes single sheets of all thin parts; `rounds` is how many 3-cells they are thick at most.
pub fn collapse<'a, G: SheetGuide>(
    complex: &mut Complex<'a>,
    guide: &G,
    rounds: u32,
    run: &Run,
) -> Result<Option<(Collapsed, Pockets<'a>)>, Cancelled> {
    run.stage("collapse");
    let thin: Vec<Block> = complex
        .open
        .iter()
        .zip(&complex.solid)
        .map(|(o, s)| std::array::from_fn(|z| !o[z] & !s[z]))
        .collect();
    let Some(pockets) = Pockets::new(complex, thin, guide, rounds, run)? else { return Ok(None) };
    let between_walls = pockets.up.iter().flatten().count() as u64;
    let mut told = Collapsed { between_walls, ..Collapsed::default() };
    let mut known = FxHashMap::default();
    let gone = pockets.collapse(complex, &mut known, run)?;
    told.cells = gone.iter().filter(|&&g| g).count() as u64;
    let left = pockets.places.iter().zip(&gone).filter(|(_, gone)| !**gone);
    bury(complex, &left.map(|(&place, _)| place).collect::<Vec<_>>());
    told.dangling = prune(complex, Holds { guide, pockets: &pockets, known }, run)?;
    Ok(Some((told, pockets)))
}

fn direction(d: usize) -> DVec3 {
    let sign = if d % 2 == 1 { 1.0 } else { -1.0 };
    DVec3::AXES[d / 2] * sign
}

impl Pockets<'_> {
    /// Collapses all that can be, and tells which 3-cells are gone. Which pierced quads round them stay
    /// though they have a free side is noted in `holds`: not those of discarded walls.
    fn collapse(
        &self,
        complex: &mut Complex<'_>,
        holds: &mut FxHashMap<u64, bool>,
        run: &Run,
    ) -> Result<Vec<bool>, Cancelled> {
        let mut gone = vec![false; self.places.len()];
        let mut heap = BinaryHeap::new();
        for pocket in 0..self.places.len() as u32 {
            for d in 0..6 {
                let rank = self.rank(pocket, d);
                if let Some(edge) = edge_from(complex, self.places[pocket as usize], d)
                    && self.piercings[pocket as usize][d].odd
                    && self.up[pocket as usize].is_some()
                {
                    let yields = rank.0 <= Rank::Flange;
                    *holds.entry(edge.key()).or_insert(true) &= !yields;
                }
                if self.beyond(complex, pocket, d) == Beyond::Open {
                    heap.push(Reverse((rank, pocket, d)));
                }
            }
        }
        let mut turns = 0u32;
        while let Some(Reverse((_, pocket, d))) = heap.pop() {
            turns += 1;
            if turns.is_multiple_of(1 << 14) {
                run.check()?;
            }
            let Some(edge) = edge_from(complex, self.places[pocket as usize], d) else { continue };
            if gone[pocket as usize] || !complex.stands(edge) {
                continue;
            }
            gone[pocket as usize] = true;
            complex.remove(edge);
            for d in 0..6 {
                if let Beyond::Pocket(next) = self.beyond(complex, pocket, d)
                    && !gone[next as usize]
                {
                    let back = d ^ 1;
                    heap.push(Reverse((self.rank(next, back), next, back)));
                }
            }
        }
        Ok(gone)
    }

    /// When the quad of a 3-cell in direction `d` goes: lower ranks first, steeper ones first.
    fn rank(&self, pocket: u32, d: usize) -> (Rank, u32) {
        let piercing = &self.piercings[pocket as usize][d];
        let Some(up) = self.up[pocket as usize] else {
            return match piercing {
                Piercing { odd: true, .. } => (Rank::Other, 0),
                Piercing { at: Some(_), .. } => (Rank::Tip, 0),
                _ => (Rank::Unpierced, 0),
            };
        };
        let steep = direction(d).dot(up);
        let order = ((1.0 - steep) * 1024.0) as u32;
        let rank = match piercing.odd {
            true if piercing.normal.dot(up).abs() < ALONG => Rank::Flange,
            true if steep > 0.0 => Rank::Discarded,
            true => Rank::Kept,
            false if steep > 0.5 => Rank::Discarded,
            false => Rank::Unpierced,
        };
        (rank, order)
    }
}

/// The order in which quads go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Of the wall on the canonical side, or on the way to it.
    Discarded,
    /// Not pierced.
    Unpierced,
    /// Pierced an even number of times, as at the tip of a fold.
    Tip,
    /// Of what joins two walls.
    Flange,
    /// Pierced, away from parallel walls.
    Other,
    /// Of the wall that is kept.
    Kept,
}

/// Makes 3-cells solid that nothing could collapse, since solid parts enclose them, and takes away the
/// quads that lie between two solid vertices now.
fn bury(complex: &mut Complex<'_>, left: &[Place]) {
    for place in left {
        complex.solid[place.brick as usize][place.cell as usize / 64] |= 1 << (place.cell % 64);
    }
    for &place in left {
        for d in 0..6 {
            let beyond = vertex_from(complex, place, d);
            if beyond.is_none_or(|p| complex.vertex(p) == Vertex::Solid)
                && let Some(edge) = edge_from(complex, place, d)
            {
                complex.remove(edge);
            }
        }
    }
}

/// Which quads stay though they have a free side.
struct Holds<'a, G> {
    guide: &'a G,
    pockets: &'a Pockets<'a>,
    /// By edge, as far as it is known.
    known: FxHashMap<u64, bool>,
}

impl<G: SheetGuide> Holds<'_, G> {
    fn holds(&mut self, edge: Edge) -> bool {
        let (guide, pockets) = (self.guide, self.pockets);
        let found = || guide.holds(edge, pockets.near(edge.place));
        *self.known.entry(edge.key()).or_insert_with(found)
    }

    /// Whether a quad joins two others that stay, on opposite sides, where one of two walls ends:
    /// taken away from its free side on, a strip that joins two sheets would leave them apart.
    fn bridges(&mut self, complex: &Complex<'_>, edge: Edge) -> bool {
        if self.pockets.near(edge.place).is_none() {
            return false;
        }
        let mut stays = |face: Option<(Place, usize)>| {
            let Some((place, axis)) = face else { return false };
            let round = complex.edges_of_face(place, axis).into_iter().flatten();
            round.filter(|&e| e != edge && complex.stands(e)).any(|e| self.holds(e))
        };
        // Faces along the same axis lie opposite each other.
        let [a, b, c, d] = complex.faces_round(edge);
        (stays(a) && stays(c)) || (stays(b) && stays(d))
    }
}

/// Takes away quads with a free side that nothing holds, until there is none.
fn prune<G: SheetGuide>(
    complex: &mut Complex<'_>,
    mut holds: Holds<'_, G>,
    run: &Run,
) -> Result<u64, Cancelled> {
    run.stage("prune");
    let mut waiting = free_quads(complex, run)?;
    waiting.reverse();
    let mut gone = 0u64;
    let mut turns = 0u32;
    while let Some(edge) = waiting.pop() {
        turns += 1;
        if turns.is_multiple_of(1 << 14) {
            run.check()?;
        }
        if !complex.stands(edge) || !is_free(complex, edge) {
            continue;
        }
        let stays = holds.holds(edge) || holds.bridges(complex, edge);
        if stays && !is_crumb(complex, edge) {
            continue;
        }
        complex.remove(edge);
        gone += 1;
        for (place, axis) in complex.faces_round(edge).into_iter().flatten() {
            waiting.extend(complex.edges_of_face(place, axis).into_iter().flatten());
        }
    }
    Ok(gone)
}

/// Whether a face round an edge has no other quad.
fn is_free(complex: &Complex<'_>, edge: Edge) -> bool {
    complex.faces_round(edge).into_iter().flatten().any(|(place, axis)| {
        let round = complex.edges_of_face(place, axis);
        round.into_iter().flatten().filter(|&e| complex.stands(e)).count() == 1
    })
}

/// Whether a quad hangs on the rest by a corner alone, as where the corner of a sheet pokes through one
/// more edge.
fn is_crumb(complex: &Complex<'_>, edge: Edge) -> bool {
    let alone = complex.faces_round(edge).into_iter().flatten().all(|(place, axis)| {
        let round = complex.edges_of_face(place, axis).into_iter().flatten();
        round.filter(|&e| complex.stands(e)).count() == 1
    });
    alone
        && complex.cells_round(edge).into_iter().flatten().any(|cell| {
            (0..12).any(|e| {
                let other = Edge::of_cell(complex.bricks, cell, e);
                other.is_some_and(|other| other != edge && complex.stands(other))
            })
        })
}

/// All edges whose quads have a free side.
fn free_quads(complex: &Complex<'_>, run: &Run) -> Result<Vec<Edge>, Cancelled> {
    let nothing = vec![false; complex.bricks.runs()];
    let parts = super::super::labels::per_brick(complex.bricks, run, |brick| {
        let mut found = Vec::new();
        let quads = [0, 1, 2].map(|a| complex.quads[a][brick as usize]);
        let halos = [0, 1, 2].map(|a| complex.bricks.halo(brick, &complex.quads[a], &nothing));
        let mut candidates = [[0; 8]; 3];
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let four = [quads[u], quads[v], ahead(&halos[u], v), ahead(&halos[v], u)];
            for z in 0..8 {
                let [a, b, c, d] = four.map(|f| f[z]);
                let two = (a & b) | (c & d) | ((a | b) & (c | d));
                let one = (a | b | c | d) & !two;
                candidates[axis][z] = one;
            }
        }
        for axis in 0..3 {
            super::super::labels::places(complex.bricks, brick, &candidates[axis], |place| {
                let round = complex.edges_of_face(place, axis);
                found.extend(round.into_iter().flatten().filter(|&e| complex.stands(e)));
            });
        }
        found
    })?;
    Ok(parts.concat())
}

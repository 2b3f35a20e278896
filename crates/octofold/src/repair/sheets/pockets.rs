//! Thin 3-cells, and the parallel walls between which they lie.
//!
//! Of two parallel walls that are nearer than the sheet thickness one is kept, that away from the
//! *canonical side*. Which side that is spreads from pocket to pocket, so that a bent wall keeps it.
//! Source: specification of repair (A.2).

use super::super::bricks::{Block, Place, coordinates};
use super::super::members::Members;
use super::complex::{Complex, Edge, Vertex};
use super::guide::{CANONICAL, PARALLEL, Piercing, SheetGuide};
use crate::run::{Cancelled, Run};
use glam::DVec3;
use std::collections::VecDeque;

/// Pockets of one wall have normals nearer to each other than this.
const ALONG: f64 = 0.7;

/// How far apart pockets between the same walls may be, in cells.
const REACH: i32 = 2;

/// The edge that leaves a vertex in direction `d`: along axis `d / 2`, upwards where `d` is odd.
pub fn edge_from(complex: &Complex<'_>, place: Place, d: usize) -> Option<Edge> {
    let axis = d / 2;
    let place = if d % 2 == 1 { Some(place) } else { complex.step(place, axis, -1) };
    place.map(|place| Edge { place, axis })
}

/// The vertex at the other end of that edge.
pub fn vertex_from(complex: &Complex<'_>, place: Place, d: usize) -> Option<Place> {
    complex.step(place, d / 2, if d % 2 == 1 { 1 } else { -1 })
}

/// Thin 3-cells, and how the input goes through the six edges of each.
pub struct Pockets<'a> {
    members: Members<'a>,
    /// Where each is.
    pub places: Vec<Place>,
    /// How the input goes through its edges, those downwards first along each axis.
    pub piercings: Vec<[Piercing; 6]>,
    /// For each between two parallel walls their normal, towards the canonical side.
    pub up: Vec<Option<DVec3>>,
}

/// What lies beyond an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beyond {
    /// A vertex that touches an outside cell.
    Open,
    /// A vertex of a part that stays closed.
    Solid,
    /// Another pocket, by its number.
    Pocket(u32),
}

impl<'a> Pockets<'a> {
    /// The thin 3-cells of a complex, and the parallel walls round them, which are as thick together as
    /// `rounds` rounds of erosion at most. `None` where there are more than 32 bits can number.
    pub fn new<G: SheetGuide>(
        complex: &Complex<'a>,
        thin: Vec<Block>,
        guide: &G,
        rounds: u32,
        run: &Run,
    ) -> Result<Option<Self>, Cancelled> {
        let Some(members) = Members::new(complex.bricks, thin) else { return Ok(None) };
        let piercings = members.per_cell(run, |_, place| {
            std::array::from_fn::<_, 6, _>(|d| {
                let edge = edge_from(complex, place, d);
                edge.map_or(Piercing::NONE, |edge| guide.piercing(edge))
            })
        })?;
        let places = members.per_cell(run, |_, place| place)?;
        let mut pockets = Self { members, places, piercings, up: Vec::new() };
        pockets.up = pockets.between_walls(complex, rounds);
        Ok(Some(pockets))
    }

    /// What lies beyond the edge of a pocket in direction `d`.
    pub fn beyond(&self, complex: &Complex<'_>, pocket: u32, d: usize) -> Beyond {
        let Some(place) = vertex_from(complex, self.places[pocket as usize], d) else {
            // A 3-cell never lies in a run of outside cells, nor touches one.
            return Beyond::Solid;
        };
        match complex.vertex(place) {
            Vertex::Open => Beyond::Open,
            Vertex::Solid => Beyond::Solid,
            Vertex::Thin => self.members.find(place).map_or(Beyond::Solid, Beyond::Pocket),
        }
    }

    /// The first wall from a 3-cell on in direction `d`: its normal.
    fn wall(&self, complex: &Complex<'_>, mut pocket: u32, d: usize, rounds: u32) -> Option<DVec3> {
        for _ in 0..=2 * rounds + 1 {
            let piercing = &self.piercings[pocket as usize][d];
            if piercing.odd {
                return Some(piercing.normal);
            }
            let Beyond::Pocket(next) = self.beyond(complex, pocket, d) else { return None };
            pocket = next;
        }
        None
    }

    /// For each 3-cell between two parallel walls their normal, towards the canonical side.
    fn between_walls(&self, complex: &Complex<'_>, rounds: u32) -> Vec<Option<DVec3>> {
        let normals = crate::par::map(&(0..self.places.len() as u32).collect::<Vec<_>>(), |&i| {
            let pairs = (0..3).filter_map(|axis| {
                let low = self.wall(complex, i, 2 * axis, rounds)?;
                let high = self.wall(complex, i, 2 * axis + 1, rounds)?;
                let high = if low.dot(high) < 0.0 { -high } else { high };
                (low.dot(high) > PARALLEL).then(|| ((low + high).normalize(), axis))
            });
            let steepness = |&(n, axis): &(DVec3, usize)| n[axis].abs();
            let best = pairs.max_by(|a, b| steepness(a).total_cmp(&steepness(b)));
            best.filter(|b| steepness(b) > 0.5).map(|b| b.0)
        });
        let mut signed: Vec<Option<DVec3>> = vec![None; normals.len()];
        for seed in 0..normals.len() {
            let Some(normal) = normals[seed].filter(|_| signed[seed].is_none()) else { continue };
            let up = if normal.dot(CANONICAL) < 0.0 { -normal } else { normal };
            signed[seed] = Some(up);
            let mut waiting = VecDeque::from([(seed, up)]);
            while let Some((i, own)) = waiting.pop_front() {
                self.round(self.places[i], |j| {
                    if let (Some(other), None) = (normals[j], signed[j])
                        && other.dot(own).abs() > ALONG
                    {
                        let other = if other.dot(own) < 0.0 { -other } else { other };
                        signed[j] = Some(other);
                        waiting.push_back((j, other));
                    }
                });
            }
        }
        signed
    }

    /// The normal of the parallel walls nearest to the middle of a cell, towards the canonical side,
    /// where there are some within reach.
    pub fn near(&self, place: Place) -> Option<DVec3> {
        if self.places.is_empty() {
            return None;
        }
        let mut best: Option<(u32, DVec3)> = None;
        self.round(place, |j| {
            let at = self.places[j].at;
            // Twice the distance from the low corner of the cell to its middle is one along each axis.
            let away = |a: usize| (2 * i64::from(at[a]) - 2 * i64::from(place.at[a]) - 1).pow(2);
            let distance = (away(0) + away(1) + away(2)) as u32;
            if let Some(up) = self.up[j]
                && best.is_none_or(|b| distance < b.0)
            {
                best = Some((distance, up));
            }
        });
        best.map(|b| b.1)
    }

    /// Calls `visit` for the pockets within reach of a place.
    fn round(&self, place: Place, mut visit: impl FnMut(usize)) {
        let inside = coordinates(place.cell).map(|x| x as i32);
        for z in -REACH..=REACH {
            for y in -REACH..=REACH {
                for x in -REACH..=REACH {
                    let local = [inside[0] + x, inside[1] + y, inside[2] + z];
                    if let Some(j) = self.members.beside(place.brick, local) {
                        visit(j as usize);
                    }
                }
            }
        }
    }
}

//! A patchwork: the part of the joined mesh that lies in one box, and the collapse within it.

use super::bins::Bins;
use super::collapse::{Tile, Tiling};
use super::piece::Piece;
use super::tube::{Face, Tube};
use crate::quadric::Quadric;
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// New vertices lie on multiples of one part in this many of a sample's distance.
const STEPS: f64 = super::cells::STEPS;

/// Least cosine between the normals of a triangle before and after.
const TURN: f64 = 0.2;

/// Edges are tried where the mean squared distance of their planes from the new point is at most
/// this share of the squared tolerance.
const GATE: f64 = 0.4;

/// How much more the plane of even volume counts than all others.
const BALANCE: f64 = 10.0;

/// How many pieces are tried before all of them are.
const PROBES: usize = 16;

/// A vertex within a box.
struct Spot {
    /// Its number in the mesh.
    point: u32,
    quadric: Quadric,
    /// Triangles round it, those of others that touch the box too.
    tiles: Vec<u32>,
    /// Not all triangles round it are own, or the mesh ends at it.
    frozen: bool,
    moved: bool,
    version: u32,
    /// The piece for which the last move failed.
    witness: Option<Piece>,
}

/// A triangle within a box.
struct Scrap {
    corners: [u32; 3],
    face: Face,
    /// Another box's triangle, which is only in the way.
    foreign: bool,
    pieces: Vec<Piece>,
    lack: f64,
    alive: bool,
    settled: u8,
}

/// What lies in one box.
pub struct Patchwork<'a> {
    tube: &'a Tube<'a>,
    spots: Vec<Spot>,
    at: Vec<[f64; 3]>,
    scraps: Vec<Scrap>,
    corner: DVec3,
    size: f64,
    bins: Bins,
}

/// What became of a box.
pub struct Reduced {
    pub tiles: Vec<Tile>,
    /// Vertices that moved, with their places and quadrics.
    pub moved: Vec<(u32, DVec3, Quadric)>,
    /// For vertices of this box alone, the piece for which their last move failed.
    pub witnesses: Vec<(u32, Piece)>,
}

/// An edge that may give way; the least cost comes first.
#[derive(Debug, PartialEq)]
struct Candidate {
    cost: f64,
    ends: [u32; 2],
    versions: [u32; 2],
}

impl Eq for Candidate {}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.ends.cmp(&self.ends))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The neighbours of a vertex, sorted, from the corners of the triangles round it.
fn ring(spot: u32, around: impl Iterator<Item = [u32; 3]>) -> Vec<u32> {
    let mut ring: Vec<u32> = around.flatten().filter(|&c| c != spot).collect();
    ring.sort_unstable();
    ring.dedup();
    ring
}

impl<'a> Patchwork<'a> {
    pub fn new(
        tube: &'a Tube<'a>,
        tiling: &Tiling,
        incident: &[u32],
        group: &[([i32; 3], bool, u32)],
        corner: DVec3,
        size: f64,
    ) -> Self {
        let mut points: Vec<u32> =
            group.iter().flat_map(|m| tiling.tiles[m.2 as usize].corners).collect();
        points.sort_unstable();
        points.dedup();
        let local = |p: u32| points.partition_point(|&q| q < p) as u32;
        let mut spots: Vec<Spot> = points
            .iter()
            .map(|&point| Spot {
                point,
                quadric: tiling.quadrics[point as usize],
                tiles: Vec::new(),
                frozen: false,
                moved: false,
                version: 0,
                witness: tiling.witnesses[point as usize],
            })
            .collect();
        let at: Vec<[f64; 3]> =
            points.iter().map(|&p| tiling.points[p as usize].to_array()).collect();
        let mut scraps = Vec::with_capacity(group.len());
        for &(_, others, t) in group {
            let tile = &tiling.tiles[t as usize];
            let corners = tile.corners.map(local);
            let face = Face::new(corners.map(|c| at[c as usize].into()));
            let number = scraps.len() as u32;
            corners.iter().for_each(|&c| spots[c as usize].tiles.push(number));
            scraps.push(Scrap {
                corners,
                face,
                foreign: others,
                pieces: if others { Vec::new() } else { tile.pieces.clone() },
                lack: tile.lack,
                alive: true,
                settled: tile.settled,
            });
        }
        for (number, spot) in spots.iter_mut().enumerate() {
            let around = spot.tiles.iter().map(|&t| &scraps[t as usize]);
            let own = around.clone().filter(|s| !s.foreign).count() as u32;
            let closed = ring(number as u32, around.map(|s| s.corners)).len() == spot.tiles.len();
            spot.frozen = own != incident[spot.point as usize] || !closed;
        }
        let extents = scraps.iter().map(|s| {
            let [low, high] = s.face.span();
            (high - low).max_element()
        });
        let extent = extents.sum::<f64>() / scraps.len() as f64;
        let bins = Bins::new(corner, size, extent);
        let mut patchwork = Self { tube, spots, at, scraps, corner, size, bins };
        for (number, scrap) in patchwork.scraps.iter().enumerate() {
            patchwork.bins.enter(number as u32, scrap.face.span());
        }
        patchwork
    }

    /// The box as it has become.
    pub fn finish(self) -> Reduced {
        let name = |c: u32| self.spots[c as usize].point;
        let tiles = self
            .scraps
            .iter()
            .filter(|s| s.alive && !s.foreign)
            .map(|s| Tile {
                corners: s.corners.map(name),
                pieces: s.pieces.clone(),
                lack: s.lack,
                settled: s.settled,
            })
            .collect();
        let moved = self.spots.iter().zip(&self.at).filter(|(s, _)| s.moved);
        let moved = moved.map(|(s, &at)| (s.point, at.into(), s.quadric)).collect();
        let free = self.spots.iter().filter(|s| !s.frozen);
        let witnesses = free.filter_map(|s| Some((s.point, s.witness?))).collect();
        Reduced { tiles, moved, witnesses }
    }

    fn point(&self, spot: u32) -> DVec3 {
        self.at[spot as usize].into()
    }

    /// Collapses edges, cheapest first, until none gives way.
    pub fn reduce(&mut self) {
        let mut heap = BinaryHeap::new();
        for scrap in 0..self.scraps.len() {
            let Scrap { corners, settled, foreign, .. } = self.scraps[scrap];
            if foreign {
                continue;
            }
            for i in 0..3 {
                let ends = [corners[i], corners[(i + 1) % 3]];
                if settled >> i & 1 == 0 || ends[0] > ends[1] {
                    self.offer(ends, &mut heap);
                }
            }
        }
        while let Some(Candidate { ends, versions, .. }) = heap.pop() {
            if ends.map(|e| self.spots[e as usize].version) != versions {
                continue;
            }
            if self.collapse(ends) {
                let [kept, _] = ends;
                for other in self.ring(kept) {
                    self.offer([kept, other], &mut heap);
                }
            } else if !ends.iter().any(|&e| self.spots[e as usize].frozen) {
                self.settle(ends);
            }
        }
    }

    /// Notes that an edge does not give way.
    fn settle(&mut self, ends: [u32; 2]) {
        for t in self.spots[ends[0] as usize].tiles.clone() {
            let scrap = &mut self.scraps[t as usize];
            for i in 0..3 {
                let side = [scrap.corners[i], scrap.corners[(i + 1) % 3]];
                if side == ends || side == [ends[1], ends[0]] {
                    scrap.settled |= 1 << i;
                }
            }
        }
    }

    /// Puts an edge on the heap, the end that stays first.
    fn offer(&self, ends: [u32; 2], heap: &mut BinaryHeap<Candidate>) {
        let mut ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        if self.spots[ends[1] as usize].frozen {
            ends.swap(0, 1);
        }
        let [kept, gone] = ends.map(|e| &self.spots[e as usize]);
        if gone.frozen {
            return;
        }
        let mut sum = kept.quadric;
        sum += gone.quadric;
        let Some(p) = self.place(ends, sum) else { return };
        let cost = sum.at(p);
        let reach = self.tube.tolerance;
        if cost <= GATE * reach * reach * sum.weight() {
            heap.push(Candidate { cost, ends, versions: [kept.version, gone.version] });
        }
    }

    /// The neighbours of a vertex, sorted.
    fn ring(&self, spot: u32) -> Vec<u32> {
        let tiles = self.spots[spot as usize].tiles.iter();
        ring(spot, tiles.map(|&t| self.scraps[t as usize].corners))
    }

    /// Where the point may lie that an edge becomes: at the least of a quadric, or where the end
    /// is that must stay.
    fn place(&self, [kept, gone]: [u32; 2], sum: Quadric) -> Option<DVec3> {
        let [p, q] = [kept, gone].map(|e| self.point(e));
        if self.spots[kept as usize].frozen {
            return Some(p);
        }
        let best = sum.lowest(p.midpoint(q), 1e-3)?;
        let best = (best * STEPS).round() / STEPS;
        let from = best - self.corner;
        (from.min_element() >= 0.0 && from.max_element() < self.size).then_some(best)
    }

    /// The plane on which the point must lie for the volume to come out right, as a quadric.
    fn balance(
        &self,
        kept: u32,
        old: &[u32],
        becomes: &[Option<[u32; 3]>],
        weight: f64,
    ) -> Option<Quadric> {
        let home = self.point(kept);
        let mut wanted = 0.0;
        let mut area = 0.0;
        for &t in old {
            let scrap = &self.scraps[t as usize];
            let [a, b, c] = scrap.corners.map(|c| self.point(c) - home);
            wanted += scrap.lack + a.dot(b.cross(c)) / 6.0;
            area += (b - a).cross(c - a).length();
        }
        // The new volume is this times the point.
        let mut slope = DVec3::ZERO;
        for corners in becomes.iter().flatten() {
            let i = corners.iter().position(|&c| c == kept)?;
            let [a, b] = [1, 2].map(|k| self.point(corners[(i + k) % 3]) - home);
            slope += a.cross(b) / 6.0;
        }
        let length = slope.length();
        // Where the star is rolled up, no way out changes the volume much.
        (length > 0.05 * area).then(|| {
            let normal = slope / length;
            Quadric::plane(normal, home + normal * (wanted / length), BALANCE * weight)
        })
    }

    /// Tries to collapse an edge.
    fn collapse(&mut self, ends: [u32; 2]) -> bool {
        let [kept, gone] = ends;
        let (ring_kept, ring_gone) = (self.ring(kept), self.ring(gone));
        let common: Vec<u32> =
            ring_kept.iter().copied().filter(|c| ring_gone.binary_search(c).is_ok()).collect();
        let thin = |&c: &u32| self.spots[c as usize].tiles.len() <= 3;
        if common.len() != 2 || common.iter().any(thin) {
            return false;
        }
        let mut old = self.spots[gone as usize].tiles.clone();
        if !self.spots[kept as usize].frozen {
            old.extend(&self.spots[kept as usize].tiles);
        }
        old.sort_unstable();
        old.dedup();
        // Each old triangle with what it becomes; the two along the edge become nothing.
        let becomes: Vec<Option<[u32; 3]>> = old
            .iter()
            .map(|&t| {
                let corners = self.scraps[t as usize].corners;
                let both = corners.contains(&kept) && corners.contains(&gone);
                (!both).then(|| corners.map(|c| if c == gone { kept } else { c }))
            })
            .collect();
        let mut sum = self.spots[kept as usize].quadric;
        sum += self.spots[gone as usize].quadric;
        if let Some(plane) = self.balance(kept, &old, &becomes, sum.weight()) {
            sum += plane;
        }
        let Some(place) = self.place(ends, sum) else { return false };
        let home = std::mem::replace(&mut self.at[kept as usize], place.to_array());
        match self.try_star(ends, &old, &becomes) {
            Some((faces, shared)) => {
                self.take(ends, home.into(), &old, &becomes, faces, shared);
                true
            }
            None => {
                self.at[kept as usize] = home;
                false
            }
        }
    }

    /// Proves the triangles that a star would become; gives their faces and pieces.
    fn try_star(
        &mut self,
        ends: [u32; 2],
        old: &[u32],
        becomes: &[Option<[u32; 3]>],
    ) -> Option<(Vec<Face>, Vec<Vec<Piece>>)> {
        let mut faces = Vec::with_capacity(old.len());
        for (i, corners) in becomes.iter().enumerate() {
            if let Some(corners) = corners {
                let face = Face::stout(corners.map(|c| self.point(c)))?;
                let before = &self.scraps[old[i] as usize].face;
                if face.normal.dot(before.normal) < TURN {
                    return None;
                }
                faces.push(face);
            }
        }
        if faces.is_empty() || faces.len() > 64 {
            return None;
        }
        let mut found = Vec::new();
        let mut pieces: Vec<Piece> = Vec::new();
        for &t in old {
            pieces.extend_from_slice(&self.scraps[t as usize].pieces);
        }
        // Where the star is bad, what failed the last time or a few pieces all over it tell at once.
        let witnesses = ends.map(|e| self.spots[e as usize].witness);
        let known = witnesses.into_iter().flatten().filter(|w| pieces.contains(w));
        let probes = pieces.iter().step_by(pieces.len() / PROBES + 1).copied();
        let mut failed = None;
        let mut is_near = |piece: Piece| {
            let near = self.tube.attach(piece, &faces, &mut found);
            failed = (!near).then_some(piece);
            near
        };
        if !known.chain(probes).all(&mut is_near) {
            ends.iter().for_each(|&e| self.spots[e as usize].witness = failed);
            return None;
        }
        found.clear();
        for &piece in &pieces {
            if !self.tube.attach(piece, &faces, &mut found) {
                ends.iter().for_each(|&e| self.spots[e as usize].witness = Some(piece));
                return None;
            }
        }
        if !self.is_clear(old, becomes, &faces) || !faces.iter().all(|f| self.tube.holds(f)) {
            return None;
        }
        let mut shared = vec![Vec::new(); faces.len()];
        for (piece, face) in found {
            shared[face as usize].push(piece);
        }
        shared.iter_mut().for_each(|pieces| Piece::merge(self.tube.cells, pieces));
        Some((faces, shared))
    }

    /// Whether the triangles that a star would become meet no other and not one another.
    fn is_clear(&mut self, old: &[u32], becomes: &[Option<[u32; 3]>], faces: &[Face]) -> bool {
        let new: Vec<[u32; 3]> = becomes.iter().flatten().copied().collect();
        for b in 1..new.len() {
            for a in 0..b {
                if faces[a].meets(new[a], &faces[b], new[b], &self.at) {
                    return false;
                }
            }
        }
        let Self { bins, scraps, at, .. } = self;
        new.iter().zip(faces).all(|(&corners, face)| {
            let [low, high] = face.span();
            let mut asked: Vec<u32> = Vec::new();
            bins.near(
                [low, high],
                |t| scraps[t as usize].alive,
                |t| {
                    let scrap = &scraps[t as usize];
                    let [other_low, other_high] = scrap.face.span();
                    if other_low.cmpgt(high).any() || low.cmpgt(other_high).any() {
                        return true;
                    }
                    if asked.contains(&t) || old.binary_search(&t).is_ok() {
                        return true;
                    }
                    asked.push(t);
                    !face.meets(corners, &scrap.face, scrap.corners, at)
                },
            )
        })
    }

    /// Puts the new star in the place of the old one.
    fn take(
        &mut self,
        [kept, gone]: [u32; 2],
        home: DVec3,
        old: &[u32],
        becomes: &[Option<[u32; 3]>],
        faces: Vec<Face>,
        shared: Vec<Vec<Piece>>,
    ) {
        let mut lack = 0.0;
        for &t in old {
            let scrap = &self.scraps[t as usize];
            let [a, b, c] =
                scrap.corners.map(|c| if c == kept { home } else { self.point(c) } - home);
            lack += scrap.lack + a.dot(b.cross(c)) / 6.0;
        }
        let mut area = 0.0;
        for corners in becomes.iter().flatten() {
            let [a, b, c] = corners.map(|c| self.point(c) - home);
            lack -= a.dot(b.cross(c)) / 6.0;
            area += (b - a).cross(c - a).length();
        }
        for &t in old {
            self.scraps[t as usize].alive = false;
            for c in self.scraps[t as usize].corners {
                self.spots[c as usize].tiles.retain(|&other| other != t);
            }
        }
        let new = becomes.iter().flatten().zip(faces).zip(shared);
        for ((&corners, face), pieces) in new {
            let t = self.scraps.len() as u32;
            let [a, b, c] = face.corners;
            self.bins.enter(t, face.span());
            self.scraps.push(Scrap {
                corners,
                face,
                foreign: false,
                pieces,
                lack: lack * (b - a).cross(c - a).length() / area,
                alive: true,
                settled: 0,
            });
            corners.iter().for_each(|&c| self.spots[c as usize].tiles.push(t));
        }
        let quadric = self.spots[gone as usize].quadric;
        self.spots[gone as usize].version += 1;
        let spot = &mut self.spots[kept as usize];
        spot.quadric += quadric;
        spot.version += 1;
        spot.moved = true;
    }
}

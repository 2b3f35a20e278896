//! The guarded collapse: edges of the joined mesh give way as long as the certificate holds.
//!
//! An edge becomes a point only where the link condition holds, no triangle turns over, every
//! piece of the surface that lay near the old triangles lies near one of the new ones, every new
//! triangle lies near the surface, and no new triangle meets another. So every guarantee of the
//! mesh outlives each step, and so does its Euler number.
//!
//! Work is done box by box. A box owns the triangles that lie within it, and moves only vertices
//! all of whose triangles it owns; a box is convex, so new triangles stay in it, and boxes do not
//! see one another. Boxes of the next round are larger and lie across the borders of this one's.
//!
//! Source: the specification's D.3; edge collapse and its cost from Garland and Heckbert 1997; the
//! link condition from Dey et al. 1999.

use super::piece::Piece;
use super::tube::{Face, Tube};
use crate::par;
use crate::quadric::Quadric;
use crate::run::{Cancelled, Run};
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// New vertices lie on multiples of one part in this many of a sample's distance.
const STEPS: f64 = super::cells::STEPS;

/// Least cosine between the normals of a triangle before and after.
const TURN: f64 = 0.2;

/// How many pieces are tried before all of them are.
const PROBES: usize = 16;

/// A triangle with the pieces of the surface that are proved to lie near it.
#[derive(Debug, Clone)]
pub struct Tile {
    pub corners: [u32; 3],
    pub pieces: Vec<Piece>,
    /// Bit i tells that the side from corner i on was tried as it is, and does not give way.
    settled: u8,
}

impl Tile {
    pub fn new(corners: [u32; 3], pieces: Vec<Piece>) -> Self {
        Self { corners, pieces, settled: 0 }
    }
}

/// The joined mesh.
pub struct Tiling {
    pub points: Vec<DVec3>,
    pub tiles: Vec<Tile>,
    quadrics: Vec<Quadric>,
}

impl Tiling {
    pub fn new(tube: &Tube, points: Vec<DVec3>, tiles: Vec<Tile>) -> Self {
        let mut quadrics = vec![Quadric::default(); points.len()];
        let planes = par::map(&tiles, |tile| {
            let [a, b, c] = tile.corners.map(|p| points[p as usize]);
            let area = (b - a).cross(c - a) / 2.0;
            let normal = area.normalize_or_zero();
            // The plane lies as high as the surface does in the middle.
            let (mut sum, mut count) = (0.0, 0);
            for cell in tile.pieces.iter().flat_map(|p| p.cells(tube.cells)) {
                for p in tube.cells.crossings(cell) {
                    sum += normal.dot(p - a);
                    count += 1;
                }
            }
            let rise = if count > 0 { sum / count as f64 } else { 0.0 };
            Quadric::plane(normal, a + normal * rise, area.length())
        });
        for (tile, plane) in tiles.iter().zip(planes) {
            tile.corners.iter().for_each(|&p| quadrics[p as usize] += plane);
        }
        Self { points, tiles, quadrics }
    }

    /// The vertices that are left, and the triangles on them.
    pub fn into_mesh(self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let mut numbers = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        let mut number = |p: u32| {
            let number = &mut numbers[p as usize];
            if *number == u32::MAX {
                *number = points.len() as u32;
                points.push(self.points[p as usize]);
            }
            *number
        };
        let triangles = self.tiles.iter().map(|t| t.corners.map(&mut number)).collect();
        (points, triangles)
    }

    /// Collapses what can be.
    pub fn reduce(&mut self, tube: &Tube, run: &Run) -> Result<(), Cancelled> {
        run.stage("collapse");
        let [low, high] = tube.cells.bounds;
        let most = (0..3).map(|a| high[a] - low[a]).max().unwrap_or(1);
        let mut size = 64;
        let mut offset = 0;
        loop {
            let last = size >= 2 * most;
            self.round(tube, low, size, offset, run)?;
            if last {
                return Ok(());
            }
            size *= 2;
            offset = if offset == 0 { size / 4 } else { 0 };
        }
    }

    /// One round over boxes of `size` cells.
    fn round(
        &mut self,
        tube: &Tube,
        low: [u32; 3],
        size: u32,
        offset: u32,
        run: &Run,
    ) -> Result<(), Cancelled> {
        let origin = DVec3::from(low.map(f64::from)) - f64::from(offset);
        let place = |p: DVec3| ((p - origin) / f64::from(size)).floor().as_ivec3();
        let mut incident = vec![0u32; self.points.len()];
        let spans: Vec<_> = par::map(&self.tiles, |tile| {
            let [a, b, c] = tile.corners.map(|p| self.points[p as usize]);
            (place(a.min(b).min(c)), place(a.max(b).max(c)))
        });
        self.tiles.iter().flat_map(|t| t.corners).for_each(|p| incident[p as usize] += 1);
        // The box of each tile, and whether it lies within it; tiles across borders are in all
        // boxes that they touch.
        let mut members: Vec<([i32; 3], bool, u32)> = Vec::new();
        for (t, &(first, last)) in spans.iter().enumerate() {
            for z in first.z..=last.z {
                for y in first.y..=last.y {
                    for x in first.x..=last.x {
                        members.push(([x, y, z], first != last, t as u32));
                    }
                }
            }
        }
        par::sort(&mut members);
        let groups: Vec<&[([i32; 3], bool, u32)]> =
            members.chunk_by(|a, b| a.0 == b.0).filter(|g| !g[0].1).collect();
        let results = par::blocks(run, groups.len(), 1, |range| {
            let group = groups[range.start];
            let corner = origin + glam::IVec3::from(group[0].0).as_dvec3() * f64::from(size);
            let mut patchwork = Patchwork::new(tube, self, &incident, group, corner, f64::from(size));
            patchwork.reduce();
            patchwork.finish()
        })?;
        let mut taken = vec![false; self.tiles.len()];
        for group in &groups {
            group.iter().filter(|m| !m.1).for_each(|m| taken[m.2 as usize] = true);
        }
        let mut tiles = Vec::with_capacity(self.tiles.len());
        for (tile, taken) in std::mem::take(&mut self.tiles).into_iter().zip(taken) {
            if !taken {
                tiles.push(tile);
            }
        }
        for (own, moved) in results {
            tiles.extend(own);
            for (point, at, quadric) in moved {
                self.points[point as usize] = at;
                self.quadrics[point as usize] = quadric;
            }
        }
        self.tiles = tiles;
        Ok(())
    }
}

/// A vertex within a box.
struct Spot {
    /// Its number in the mesh.
    point: u32,
    quadric: Quadric,
    /// Own triangles round it.
    tiles: Vec<u32>,
    /// Triangles of others lie round it too.
    frozen: bool,
    moved: bool,
    version: u32,
}

/// A triangle within a box.
struct Scrap {
    corners: [u32; 3],
    face: Face,
    /// Another box's triangle, which is only in the way.
    foreign: bool,
    pieces: Vec<Piece>,
    alive: bool,
    settled: u8,
    /// Number of the last question that met it.
    asked: u32,
}

/// What lies in one box.
struct Patchwork<'a> {
    tube: &'a Tube<'a>,
    spots: Vec<Spot>,
    at: Vec<[f64; 3]>,
    scraps: Vec<Scrap>,
    corner: DVec3,
    size: f64,
    /// Triangles by the cell of a coarse grid that their boxes touch.
    grid: Vec<Vec<u32>>,
    question: u32,
}

/// Cells of the coarse grid along an edge of the box.
const GRID: usize = 8;

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

impl<'a> Patchwork<'a> {
    fn new(
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
            })
            .collect();
        let at: Vec<[f64; 3]> =
            points.iter().map(|&p| tiling.points[p as usize].to_array()).collect();
        let mut scraps = Vec::with_capacity(group.len());
        for &(_, others, t) in group {
            let tile = &tiling.tiles[t as usize];
            let corners = tile.corners.map(local);
            // Every triangle was a face before.
            let Some(face) = Face::new(corners.map(|c| at[c as usize].into())) else { continue };
            if !others {
                let number = scraps.len() as u32;
                corners.iter().for_each(|&c| spots[c as usize].tiles.push(number));
            }
            scraps.push(Scrap {
                corners,
                face,
                foreign: others,
                pieces: if others { Vec::new() } else { tile.pieces.clone() },
                alive: true,
                settled: tile.settled,
                asked: 0,
            });
        }
        for spot in &mut spots {
            spot.frozen = spot.tiles.len() as u32 != incident[spot.point as usize];
        }
        let mut patchwork = Self {
            tube,
            spots,
            at,
            scraps,
            corner,
            size,
            grid: vec![Vec::new(); GRID * GRID * GRID],
            question: 0,
        };
        for scrap in 0..patchwork.scraps.len() {
            patchwork.enter(scrap as u32);
        }
        patchwork
    }

    /// The own triangles as tiles of the mesh, and the vertices that moved.
    fn finish(self) -> (Vec<Tile>, Vec<(u32, DVec3, Quadric)>) {
        let name = |c: u32| self.spots[c as usize].point;
        let tiles = self
            .scraps
            .iter()
            .filter(|s| s.alive && !s.foreign)
            .map(|s| Tile {
                corners: s.corners.map(name),
                pieces: s.pieces.clone(),
                settled: s.settled,
            })
            .collect();
        let moved = self.spots.iter().zip(&self.at).filter(|(s, _)| s.moved);
        (tiles, moved.map(|(s, &at)| (s.point, at.into(), s.quadric)).collect())
    }

    fn point(&self, spot: u32) -> DVec3 {
        self.at[spot as usize].into()
    }

    /// Collapses edges, cheapest first, until none gives way.
    fn reduce(&mut self) {
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
                let mut ring: Vec<u32> = self.spots[kept as usize]
                    .tiles
                    .iter()
                    .flat_map(|&t| self.scraps[t as usize].corners)
                    .filter(|&c| c != kept)
                    .collect();
                ring.sort_unstable();
                ring.dedup();
                for other in ring {
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
        let Some(p) = self.places(ends).first().copied() else { return };
        let cost = sum.at(p);
        let reach = self.tube.tolerance;
        if cost <= reach * reach * sum.weight() * std::env::var("GATE").map_or(1.0, |s| s.parse::<f64>().unwrap()) {
            heap.push(Candidate { cost, ends, versions: [kept.version, gone.version] });
        }
    }

    /// Where the point may lie that an edge becomes, best first.
    fn places(&self, [kept, gone]: [u32; 2]) -> Vec<DVec3> {
        let [p, q] = [kept, gone].map(|e| self.point(e));
        if self.spots[kept as usize].frozen {
            return vec![p];
        }
        let mut sum = self.spots[kept as usize].quadric;
        sum += self.spots[gone as usize].quadric;
        let best = sum.lowest(p.midpoint(q), 1e-3).map(|p| (p * STEPS).round() / STEPS);
        let within = |p: &DVec3| {
            let from = *p - self.corner;
            from.min_element() >= 0.0 && from.max_element() < self.size
        };
        let mut places: Vec<DVec3> = best.into_iter().filter(within).collect();
        let mut ends = [p, q];
        if sum.at(q) < sum.at(p) {
            ends.swap(0, 1);
        }
        if std::env::var("ENDS").is_ok() || places.is_empty() { places.extend(ends); }
        places
    }

    /// Tries to collapse an edge.
    fn collapse(&mut self, ends: [u32; 2]) -> bool {
        super::patch::stat(8);
        let [kept, gone] = ends;
        let around = |spot: u32| {
            let mut ring: Vec<u32> = self.spots[spot as usize]
                .tiles
                .iter()
                .flat_map(|&t| self.scraps[t as usize].corners)
                .filter(|&c| c != spot)
                .collect();
            ring.sort_unstable();
            ring.dedup();
            ring
        };
        let (ring_kept, ring_gone) = (around(kept), around(gone));
        let common: Vec<u32> =
            ring_kept.iter().copied().filter(|c| ring_gone.binary_search(c).is_ok()).collect();
        let thin = |&c: &u32| {
            let spot = &self.spots[c as usize];
            !spot.frozen && spot.tiles.len() <= 3
        };
        if common.len() != 2 || common.iter().any(thin) {
            return false;
        }
        let mut old: Vec<u32> = self.spots[kept as usize].tiles.clone();
        old.extend(&self.spots[gone as usize].tiles);
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
        let home = self.at[kept as usize];
        for place in self.places(ends) {
            super::patch::stat(10);
            self.at[kept as usize] = place.to_array();
            if let Some((faces, shared)) = self.try_star(&old, &becomes) {
                super::patch::stat(9);
                self.take(ends, &old, &becomes, faces, shared);
                return true;
            }
        }
        self.at[kept as usize] = home;
        false
    }

    /// Proves the triangles that a star would become; gives their faces and pieces.
    fn try_star(
        &mut self,
        old: &[u32],
        becomes: &[Option<[u32; 3]>],
    ) -> Option<(Vec<Face>, Vec<Vec<Piece>>)> {
        let mut faces = Vec::with_capacity(old.len());
        for (i, corners) in becomes.iter().enumerate() {
            if let Some(corners) = corners {
                let face = Face::new(corners.map(|c| self.point(c)))?;
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
        super::patch::stat(13);
        let t0 = std::time::Instant::now();
        let lap = |i: usize| { super::patch::STAT[i].fetch_add(t0.elapsed().as_nanos() as usize, std::sync::atomic::Ordering::Relaxed); };
        let mut found = Vec::new();
        let mut pieces: Vec<Piece> = Vec::new();
        for &t in old {
            pieces.extend_from_slice(&self.scraps[t as usize].pieces);
        }
        // A few pieces tell at once where a star is bad.
        let probes = pieces.iter().step_by(pieces.len() / PROBES + 1);
        if !probes.into_iter().all(|&piece| self.tube.attach(piece, &faces, &mut found)) {
            return None;
        }
        lap(19);
        super::patch::stat(15);
        lap(20);super::patch::STAT[30].fetch_add(pieces.len(), std::sync::atomic::Ordering::Relaxed);super::patch::STAT[31].fetch_add(faces.len(), std::sync::atomic::Ordering::Relaxed);
        found.clear();
        if !pieces.iter().all(|&piece| self.tube.attach(piece, &faces, &mut found)) {
            return None;
        }
        lap(21);super::patch::STAT[32].fetch_add(found.len(), std::sync::atomic::Ordering::Relaxed);super::patch::STAT[33].fetch_add(found.iter().map(|f| f.0.cells(self.tube.cells).len()).sum::<usize>(), std::sync::atomic::Ordering::Relaxed);
        super::patch::stat(11);
        if !faces.iter().all(|f| self.tube.holds(f)) { return None; }
        lap(22);super::patch::stat(12);
        if !self.is_clear(old, becomes, &faces) {
            return None;
        }
        lap(23);super::patch::stat(14);
        let mut shared = vec![Vec::new(); faces.len()];
        for (piece, face) in found {
            shared[face as usize].push(piece);
        }
        shared.iter_mut().for_each(|pieces| Piece::merge(self.tube.cells, pieces));
        lap(24);
        Some((faces, shared))
    }

    /// Whether the triangles that a star would become meet no other and not one another.
    fn is_clear(
        &mut self,
        old: &[u32],
        becomes: &[Option<[u32; 3]>],
        faces: &[Face],
    ) -> bool {
        let new: Vec<[u32; 3]> = becomes.iter().flatten().copied().collect();
        for b in 1..new.len() {
            for a in 0..b {
                if faces[a].meets(new[a], &faces[b], new[b], &self.at) {
                    return false;
                }
            }
        }
        for (&corners, face) in new.iter().zip(faces) {
            self.question += 1;
            let [low, high] = self.span(corners);
            let [first, last] = self.slots([low, high]);
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        let slot = (z * GRID + y) * GRID + x;
                        let mut i = 0;
                        while i < self.grid[slot].len() {
                            let t = self.grid[slot][i];
                            let scrap = &mut self.scraps[t as usize];
                            if !scrap.alive {
                                self.grid[slot].swap_remove(i);
                                continue;
                            }
                            i += 1;
                            if scrap.asked == self.question || old.binary_search(&t).is_ok() {
                                continue;
                            }
                            scrap.asked = self.question;
                            let other = scrap.corners;
                            let [other_low, other_high] = self.span(other);
                            let apart =
                                other_low.cmpgt(high).any() || low.cmpgt(other_high).any();
                            let beside = &self.scraps[t as usize].face;
                            if !apart && face.meets(corners, beside, other, &self.at) {
                                return false;
                            }
                        }
                    }
                }
            }
        }
        true
    }

    /// Puts the new star in the place of the old one.
    fn take(
        &mut self,
        [kept, gone]: [u32; 2],
        old: &[u32],
        becomes: &[Option<[u32; 3]>],
        faces: Vec<Face>,
        shared: Vec<Vec<Piece>>,
    ) {
        for &t in old {
            self.scraps[t as usize].alive = false;
            for c in self.scraps[t as usize].corners {
                self.spots[c as usize].tiles.retain(|&other| other != t);
            }
        }
        let new = becomes.iter().flatten().zip(faces).zip(shared);
        for ((&corners, face), pieces) in new {
            let t = self.scraps.len() as u32;
            self.scraps.push(Scrap {
                corners,
                face,
                foreign: false,
                pieces,
                alive: true,
                settled: 0,
                asked: 0,
            });
            corners.iter().for_each(|&c| self.spots[c as usize].tiles.push(t));
            self.enter(t);
        }
        let quadric = self.spots[gone as usize].quadric;
        self.spots[gone as usize].version += 1;
        let spot = &mut self.spots[kept as usize];
        spot.quadric += quadric;
        spot.version += 1;
        spot.moved = true;
    }

    fn span(&self, corners: [u32; 3]) -> [DVec3; 2] {
        let [a, b, c] = corners.map(|c| self.point(c));
        [a.min(b).min(c), a.max(b).max(c)]
    }

    /// The first and last cells of the coarse grid that a box touches.
    fn slots(&self, span: [DVec3; 2]) -> [[usize; 3]; 2] {
        let scale = GRID as f64 / self.size;
        span.map(|p| {
            ((p - self.corner) * scale)
                .to_array()
                .map(|x| (x.floor().max(0.0) as usize).min(GRID - 1))
        })
    }

    fn enter(&mut self, t: u32) {
        let span = self.span(self.scraps[t as usize].corners);
        let [first, last] = self.slots(span);
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    self.grid[(z * GRID + y) * GRID + x].push(t);
                }
            }
        }
    }
}

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

use super::patchwork::Patchwork;
use super::piece::Piece;
use super::tube::Tube;
use crate::par;
use crate::quadric::Quadric;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// A triangle with the pieces of the surface that are proved to lie near it.
#[derive(Debug, Clone)]
pub struct Tile {
    pub corners: [u32; 3],
    pub pieces: Vec<Piece>,
    /// Volume that the surface has outside of the triangle, less what it lacks inside.
    pub lack: f64,
    /// Bit i tells that the side from corner i on was tried as it is, and does not give way.
    pub settled: u8,
}

impl Tile {
    pub fn new(corners: [u32; 3], pieces: Vec<Piece>) -> Self {
        Self { corners, pieces, lack: 0.0, settled: 0 }
    }
}

/// The joined mesh.
pub struct Tiling {
    pub points: Vec<DVec3>,
    pub tiles: Vec<Tile>,
    pub quadrics: Vec<Quadric>,
    /// For each vertex the piece for which the last try of an edge at it failed.
    pub witnesses: Vec<Option<Piece>>,
}

impl Tiling {
    /// `volume` is that within the surface.
    pub fn new(tube: &Tube, points: Vec<DVec3>, mut tiles: Vec<Tile>, volume: f64) -> Self {
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
            let rise = if count > 0 { sum / f64::from(count) } else { 0.0 };
            (Quadric::plane(normal, a + normal * rise, area.length()), rise)
        });
        let (mut area, mut lack) = (0.0, 0.0);
        for (tile, (plane, rise)) in tiles.iter_mut().zip(planes) {
            tile.corners.iter().for_each(|&p| quadrics[p as usize] += plane);
            tile.lack = rise * plane.weight();
            area += plane.weight();
            lack += tile.lack;
        }
        // The sum is known exactly.
        let rest = (volume - volume_within(&points, &tiles) - lack) / area;
        for tile in &mut tiles {
            let [a, b, c] = tile.corners.map(|p| points[p as usize]);
            tile.lack += rest * (b - a).cross(c - a).length() / 2.0;
        }
        let witnesses = vec![None; points.len()];
        Self { points, tiles, quadrics, witnesses }
    }

    /// Volume within the mesh.
    pub fn volume(&self) -> f64 {
        volume_within(&self.points, &self.tiles)
    }

    /// Area of the mesh.
    pub fn area(&self) -> f64 {
        let area = |tile: &Tile| {
            let [a, b, c] = tile.corners.map(|p| self.points[p as usize]);
            (b - a).cross(c - a).length() / 2.0
        };
        self.tiles.iter().map(area).sum()
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

    /// Collapses what can be, first in boxes of `size` cells.
    pub fn reduce(&mut self, tube: &Tube, mut size: u32, run: &Run) -> Result<(), Cancelled> {
        run.stage("collapse");
        let [low, high] = tube.cells.bounds;
        let most = (0..3).map(|a| high[a] - low[a]).max().unwrap_or(1);
        let mut offset = 0;
        loop {
            let last = size > most + offset;
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
            let mut patchwork =
                Patchwork::new(tube, self, &incident, group, corner, f64::from(size));
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
        for reduced in results {
            tiles.extend(reduced.tiles);
            for (point, at, quadric) in reduced.moved {
                self.points[point as usize] = at;
                self.quadrics[point as usize] = quadric;
            }
            for (point, piece) in reduced.witnesses {
                self.witnesses[point as usize] = Some(piece);
            }
        }
        self.tiles = tiles;
        Ok(())
    }
}

/// Volume on the inner side of triangles.
fn volume_within(points: &[DVec3], tiles: &[Tile]) -> f64 {
    let home = points.first().copied().unwrap_or_default();
    let part = |tile: &Tile| {
        let [a, b, c] = tile.corners.map(|p| points[p as usize] - home);
        a.dot(b.cross(c)) / 6.0
    };
    tiles.iter().map(part).sum()
}

//! Which triangle is seen at which sample, by tile.
//!
//! Corners are rounded to 1/256 of a sample; edges are then decided in integers, so that two
//! triangles along an edge neither overlap nor leave a gap.

use super::view::{Camera, Projected};
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec2;

/// Samples along the side of a pixel.
pub(super) const SAMPLES: usize = 2;
/// Steps along the side of a sample.
const STEPS: i64 = 256;
/// Positions beyond this many steps are drawn at it; products then stay within 64 bits.
const FARTHEST: f64 = (1 << 28) as f64;
/// Half the width of boundary lines, in pixels.
const HALF_LINE: f64 = 1.1;
/// Triangles in one unit of work.
const BLOCK: usize = 1 << 14;
/// The entry of a sample where nothing is seen.
pub(super) const NOTHING: u32 = u32::MAX;

/// A corner in steps.
type Corner = [i64; 2];

/// What is seen at the samples of a square of the picture.
pub(super) struct Tile {
    column: usize,
    row: usize,
    nearest: Vec<f32>,
    /// The triangle that is seen, or [`NOTHING`].
    pub seen: Vec<u32>,
    /// How much of each sample a boundary line covers.
    pub lined: Vec<f32>,
}

impl Tile {
    /// Pixels along the side of a tile.
    pub const SIDE: usize = 32;
    /// Samples along the side of a tile.
    pub const ACROSS: usize = Self::SIDE * SAMPLES;

    fn new(column: usize, row: usize) -> Self {
        let samples = Self::ACROSS * Self::ACROSS;
        Self {
            column,
            row,
            nearest: vec![f32::NEG_INFINITY; samples],
            seen: vec![NOTHING; samples],
            lined: Vec::new(),
        }
    }

    /// Its first pixel.
    pub fn origin(&self) -> [usize; 2] {
        [self.column * Self::SIDE, self.row * Self::SIDE]
    }

    /// Position of a sample in pixels of the picture.
    pub fn position(&self, x: usize, y: usize) -> DVec2 {
        let [column, row] = self.origin();
        let at = |first: usize, i: usize| first as f64 + (i as f64 + 0.5) / SAMPLES as f64;
        DVec2::new(at(column, x), at(row, y))
    }
}

/// Triangles and lines by tile.
pub(super) struct Tiles<'a> {
    mesh: &'a Mesh,
    camera: &'a Camera,
    columns: usize,
    rows: usize,
    /// Tile and triangle, sorted.
    triangles: Vec<[u32; 2]>,
    /// Ends of boundary lines.
    lines: Vec<[u32; 2]>,
    /// Tile and line, sorted.
    line_tiles: Vec<[u32; 2]>,
}

impl<'a> Tiles<'a> {
    /// Finds what each tile has to draw: triangles, and boundary lines between two points.
    pub fn new(
        mesh: &'a Mesh,
        lines: Vec<[u32; 2]>,
        camera: &'a Camera,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        let [columns, rows] = camera.size.map(|s| (s as usize).div_ceil(Tile::SIDE));
        let mut tiles = Self {
            mesh,
            camera,
            columns,
            rows,
            triangles: Vec::new(),
            lines,
            line_tiles: Vec::new(),
        };
        tiles.triangles = tiles.sorted(mesh.triangles.len(), 0.0, |t| mesh.triangles[t], run)?;
        let ends = |l: usize| {
            let [a, b]: [u32; 2] = tiles.lines[l];
            [a, b, b]
        };
        tiles.line_tiles = tiles.sorted(tiles.lines.len(), HALF_LINE + 1.0, ends, run)?;
        Ok(tiles)
    }

    /// Number of tiles.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// Pairs of tile and item, for all tiles that the items' boxes meet.
    fn sorted(
        &self,
        count: usize,
        widened: f64,
        corners: impl Fn(usize) -> [u32; 3] + Sync,
        run: &Run,
    ) -> Result<Vec<[u32; 2]>, Cancelled> {
        let blocks = par::blocks(run, count, BLOCK, |range| {
            let mut pairs = Vec::new();
            for item in range {
                let Some([low, high]) = self.bounds(corners(item)) else { continue };
                let first = ((low - widened) / Tile::SIDE as f64).floor().max(DVec2::ZERO);
                let last = ((high + widened) / Tile::SIDE as f64).floor();
                if last.min_element() < 0.0 {
                    continue;
                }
                for row in first.y as usize..=(last.y as usize).min(self.rows.saturating_sub(1)) {
                    for column in
                        first.x as usize..=(last.x as usize).min(self.columns.saturating_sub(1))
                    {
                        pairs.push([(row * self.columns + column) as u32, item as u32]);
                    }
                }
            }
            pairs
        })?;
        let mut pairs = blocks.concat();
        par::sort(&mut pairs);
        Ok(pairs)
    }

    /// The box around points on the picture; `None` where one of them is behind the eye.
    fn bounds(&self, corners: [u32; 3]) -> Option<[DVec2; 2]> {
        let [a, b, c] = self.projected(corners)?.map(|p| p.at);
        Some([a.min(b).min(c), a.max(b).max(c)])
    }

    fn projected(&self, corners: [u32; 3]) -> Option<[Projected; 3]> {
        let points = corners.map(|p| self.camera.points[p as usize]);
        points.iter().all(|p| p.weight > 0.0).then_some(points)
    }

    /// What is seen in one tile.
    pub fn draw(&self, index: usize) -> Tile {
        let mut tile = Tile::new(index % self.columns, index / self.columns);
        for &[_, t] in of_tile(&self.triangles, index) {
            if let Some(corners) = self.projected(self.mesh.triangles[t as usize]) {
                draw_triangle(&mut tile, t, corners);
            }
        }
        let lines = of_tile(&self.line_tiles, index);
        if !lines.is_empty() {
            tile.lined = vec![0.0; tile.seen.len()];
        }
        for &[_, l] in lines {
            let [a, b] = self.lines[l as usize];
            if let Some([a, b, _]) = self.projected([a, b, b]) {
                draw_line(&mut tile, a, b, 4.0 * self.camera.pixel_depth());
            }
        }
        tile
    }
}

/// The pairs of one tile.
fn of_tile(pairs: &[[u32; 2]], tile: usize) -> &[[u32; 2]] {
    let first = pairs.partition_point(|p| (p[0] as usize) < tile);
    let end = pairs.partition_point(|p| p[0] as usize <= tile);
    &pairs[first..end]
}

/// A position in steps.
pub(super) fn corner(at: DVec2) -> Corner {
    let steps = (at * (SAMPLES as f64 * STEPS as f64)).round();
    [steps.x.clamp(-FARTHEST, FARTHEST) as i64, steps.y.clamp(-FARTHEST, FARTHEST) as i64]
}

/// Twice the signed area of a triangle; positive where it turns right on the picture, whose y
/// axis points down.
pub(super) fn area(a: Corner, b: Corner, c: Corner) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn draw_triangle(tile: &mut Tile, index: u32, points: [Projected; 3]) {
    let mut corners = points.map(|p| corner(p.at));
    let mut near = points.map(|p| p.near);
    let mut twice = area(corners[0], corners[1], corners[2]);
    if twice == 0 {
        return;
    }
    if twice < 0 {
        corners.swap(1, 2);
        near.swap(1, 2);
        twice = -twice;
    }
    let [a, b, c] = corners;
    let origin = tile.origin().map(|o| (o * SAMPLES) as i64);
    // Samples of the tile whose middles lie within the triangle's box.
    let range = |axis: usize| {
        let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
        let first = (low - STEPS / 2 + STEPS - 1).div_euclid(STEPS) - origin[axis];
        let last = (high - STEPS / 2).div_euclid(STEPS) - origin[axis];
        (first.max(0), last.min(Tile::ACROSS as i64 - 1))
    };
    let ((x0, x1), (y0, y1)) = (range(0), range(1));
    if x0 > x1 || y0 > y1 {
        return;
    }
    let middle =
        |x: i64, y: i64| [(x + origin[0]) * STEPS + STEPS / 2, (y + origin[1]) * STEPS + STEPS / 2];
    let edges = [(b, c), (c, a), (a, b)];
    // A sample on an edge belongs to the triangle for which the edge is at the left or the top.
    let least = edges.map(|(p, q)| {
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        i64::from(!(dy < 0 || (dy == 0 && dx > 0)))
    });
    let step = edges.map(|(p, q)| -(q[1] - p[1]) * STEPS);
    let share = 1.0 / twice as f64;
    for y in y0..=y1 {
        let mut w = edges.map(|(p, q)| area(p, q, middle(x0, y)));
        let row = y as usize * Tile::ACROSS;
        for x in x0..=x1 {
            if (0..3).all(|i| w[i] >= least[i]) {
                let depth = (0..3).map(|i| w[i] as f64 * near[i]).sum::<f64>() * share;
                let at = row + x as usize;
                if depth as f32 > tile.nearest[at] {
                    tile.nearest[at] = depth as f32;
                    tile.seen[at] = index;
                }
            }
            (0..3).for_each(|i| w[i] += step[i]);
        }
    }
}

/// Covers samples along a segment where nothing lies more than `lift` in front of it.
fn draw_line(tile: &mut Tile, a: Projected, b: Projected, lift: f64) {
    let along = b.at - a.at;
    let length = along.length_squared();
    let [column, row] = tile.origin();
    let first = DVec2::new(column as f64, row as f64);
    let range = |p: f64, q: f64, first: f64| {
        let low = (p.min(q) - HALF_LINE - 1.0 - first) * SAMPLES as f64;
        let high = (p.max(q) + HALF_LINE + 1.0 - first) * SAMPLES as f64;
        // Conversions saturate: what lies left of the tile begins at 0.
        low as usize..(high as usize).min(Tile::ACROSS)
    };
    for y in range(a.at.y, b.at.y, first.y) {
        for x in range(a.at.x, b.at.x, first.x) {
            let p = tile.position(x, y);
            let t =
                if length > 0.0 { ((p - a.at).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (p - a.at - t * along).length();
            let cover = ((HALF_LINE - distance) * SAMPLES as f64 + 0.5).clamp(0.0, 1.0) as f32;
            let at = y * Tile::ACROSS + x;
            let near = a.near + t * (b.near - a.near);
            if cover > tile.lined[at] && near + lift >= f64::from(tile.nearest[at]) {
                tile.lined[at] = cover;
            }
        }
    }
}

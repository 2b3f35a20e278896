//! The tube around the surface: both distances between a patch and the surface, proved.
//!
//! The surface is that of marching cubes. From the surface to the patch: distance to a convex set
//! is convex, so a piece of the surface whose corners all lie within the tolerance of one face lies
//! there whole; pieces that do not are cut. From the patch to the surface: a face is pushed out and
//! in by vectors no longer than the tolerance. Where the one copy lies wholly outside and the other
//! wholly inside, the way from copy to copy through any point of the face meets the surface, and
//! does so within the tolerance. A copy lies on one side where it meets only cells of that side and mixed
//! cells whose surface it misses.

use super::cells::{Cells, State};
use crate::exact;
use crate::measure::intersect::meet_outside_shared;
use crate::surface::cell::PATCHES;
use glam::DVec3;

/// Kept off all bounds, so that rounding cannot matter.
const ROUNDING: f64 = 1e-6;

/// How often a face is cut in four to be proved near the surface.
const CUTS: u32 = 3;

/// How often a triangle of the surface is cut in four to be proved near a face.
const PIECE_CUTS: u32 = 3;

/// A triangle with what distances to it need.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// Corners, counter-clockwise seen from outside.
    pub corners: [DVec3; 3],
    /// Unit normal.
    pub normal: DVec3,
    offset: f64,
    /// Unit normals of the sides, in the plane, pointing away from the face.
    sides: [(DVec3, f64); 3],
}

impl Face {
    /// `None` where the corners lie nearly on one line.
    pub fn new(corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let cross = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - a).length_squared());
        // Twice the area over the longest side is the height.
        let height = cross.length() / longest.max((c - b).length_squared()).sqrt();
        if height.is_nan() || height < 1e-3 {
            return None;
        }
        let normal = cross.normalize();
        let side = |p: DVec3, q: DVec3| {
            let out = (q - p).cross(normal).normalize();
            (out, out.dot(p))
        };
        let sides = [side(a, b), side(b, c), side(c, a)];
        Some(Self { corners, normal, offset: normal.dot(a), sides })
    }

    /// Signed height of a point over the plane.
    pub fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }

    /// Squared distance of a point.
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        let h = self.height(p);
        let mut least = f64::INFINITY;
        for i in 0..3 {
            let (out, offset) = self.sides[i];
            if out.dot(p) > offset {
                let (a, b) = (self.corners[i], self.corners[(i + 1) % 3]);
                let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                least = least.min(p.distance_squared(a + (b - a) * along));
            }
        }
        if least.is_finite() { least } else { h * h }
    }

    /// Whether two faces, each with the numbers of its corners, meet outside the corners that they
    /// share; `points` are the positions of all numbers.
    pub fn meets(&self, own: [u32; 3], other: &Self, others: [u32; 3], points: &[[f64; 3]]) -> bool {
        let shared = own.iter().filter(|c| others.contains(c)).count();
        // Neighbours that do not turn back cannot lie on each other.
        if shared == 2 && self.normal.dot(other.normal) > -0.5 {
            return false;
        }
        if shared < 2 && (self.clears(own, other, others) || other.clears(others, self, own)) {
            return false;
        }
        meet_outside_shared(points, own, others)
    }

    /// Whether the plane of this face, or one square to it through a side, has the other face
    /// strictly on its far side, but for the corners that they share.
    fn clears(&self, own: [u32; 3], other: &Self, others: [u32; 3]) -> bool {
        let beyond = |height: &dyn Fn(DVec3) -> f64, on_plane: [bool; 3]| {
            (0..3).all(|i| match own.iter().position(|&c| c == others[i]) {
                Some(at) => on_plane[at],
                None => height(other.corners[i]) > ROUNDING,
            })
        };
        let flat = [true; 3];
        beyond(&|p| self.height(p), flat)
            || beyond(&|p| -self.height(p), flat)
            || (0..3).any(|i| {
                let (out, offset) = self.sides[i];
                beyond(&|p| out.dot(p) - offset, std::array::from_fn(|c| c != (i + 2) % 3))
            })
    }

    fn is_within(&self, p: DVec3, distance: f64) -> bool {
        let h = self.height(p);
        if h.abs() > distance {
            return false;
        }
        let e = self.sides.map(|(out, offset)| out.dot(p) - offset);
        if e[0] <= 0.0 && e[1] <= 0.0 && e[2] <= 0.0 {
            return true;
        }
        let most = e[0].max(e[1]).max(e[2]);
        h * h + most * most <= distance * distance
            && self.distance_squared(p) <= distance * distance
    }
}

/// A piece of the surface: a whole cell's, one of its triangles, or a part of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Piece {
    /// Number of the cell.
    pub cell: u32,
    /// 0 for the whole cell; else the triangle in the low three bits, and above them a one
    /// followed by two bits for each cut.
    part: u16,
}

impl Piece {
    /// All of a cell's surface.
    pub fn whole(cell: u32) -> Self {
        Self { cell, part: 0 }
    }

    /// One triangle of a cell.
    pub fn triangle(cell: u32, number: usize) -> Self {
        Self { cell, part: number as u16 | 1 << 3 }
    }

    /// The four parts of a triangle; `None` where it was cut often enough.
    fn cut(self) -> Option<[Self; 4]> {
        let (number, code) = (self.part & 7, self.part >> 3);
        let cut = |i: u16| Self { cell: self.cell, part: number | (code << 2 | i) << 3 };
        (code >> (2 * PIECE_CUTS) == 0).then(|| [0, 1, 2, 3].map(cut))
    }

    /// Corners of the piece, at most twelve.
    pub fn corners(self, cells: &Cells, out: &mut [DVec3; 12]) -> usize {
        if self.part == 0 {
            let mut points = [[0.0; 3]; 12];
            let count = cells.crossings(self.cell, &mut points);
            for i in 0..count {
                out[i] = points[i].into();
            }
            return count;
        }
        let number = (self.part & 7) as usize;
        let edges = PATCHES[cells.mask(self.cell)].triangles()[number];
        let mut corners = edges.map(|e| DVec3::from(cells.crossing(self.cell, e.into())));
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
        out[..3].copy_from_slice(&corners);
        3
    }
}

/// The points within a tolerance of the surface.
pub struct Tube<'a> {
    pub cells: &'a Cells,
    /// The tolerance, in samples.
    pub tolerance: f64,
    bounds: [DVec3; 2],
}

impl<'a> Tube<'a> {
    pub fn new(cells: &'a Cells, tolerance: f64) -> Self {
        let bounds = cells.bounds.map(|b| DVec3::from(b.map(f64::from)));
        Self { cells, tolerance, bounds }
    }

    /// The tolerance without what rounding may take.
    fn reach(&self) -> f64 {
        self.tolerance - ROUNDING
    }

    /// Finds for a piece, or for all parts of it, a face that it lies within the tolerance of:
    /// first tries face `hint`. Adds pairs of piece and face, and tells whether all were found.
    pub fn attach(
        &self,
        piece: Piece,
        faces: &[Face],
        hint: usize,
        out: &mut Vec<(Piece, u32)>,
    ) -> bool {
        let mut corners = [DVec3::ZERO; 12];
        let count = piece.corners(self.cells, &mut corners);
        let corners = &corners[..count];
        let reach = self.reach();
        let fits = |f: &Face| corners.iter().all(|&p| f.is_within(p, reach));
        if fits(&faces[hint]) {
            out.push((piece, hint as u32));
            return true;
        }
        for (i, face) in faces.iter().enumerate() {
            if i != hint && fits(face) {
                out.push((piece, i as u32));
                return true;
            }
        }
        // Cutting cannot help a corner that lies too far from every face.
        let near = |&p: &DVec3| faces.iter().any(|f| f.is_within(p, reach));
        if !corners.iter().all(near) {
            return false;
        }
        if piece.part == 0 {
            let triangles = PATCHES[self.cells.mask(piece.cell)].triangles().len();
            return (0..triangles)
                .all(|t| self.attach(Piece::triangle(piece.cell, t), faces, hint, out));
        }
        piece.cut().is_some_and(|parts| parts.iter().all(|&p| self.attach(p, faces, hint, out)))
    }

    /// Proves that every point of a face lies within the tolerance of the surface.
    pub fn holds(&self, face: &Face) -> bool {
        self.holds_part(face.corners, face.normal, CUTS)
    }

    fn holds_part(&self, corners: [DVec3; 3], normal: DVec3, cuts: u32) -> bool {
        let reach = self.reach();
        let mut leaning = None;
        let mut sided = |inside: bool| {
            let sign = if inside { -1.0 } else { 1.0 };
            let moved = |by: [DVec3; 3], far: f64| {
                std::array::from_fn(|i| corners[i] + by[i] * (sign * far * reach))
            };
            if self.is_on_side(moved([normal; 3], 1.0), inside) {
                return true;
            }
            let lean = *leaning.get_or_insert_with(|| corners.map(|p| self.outward(p, normal)));
            self.is_on_side(moved(lean, 1.0), inside)
                || self.is_on_side(moved(lean, 0.5), inside)
                || self.is_on_side(moved([normal; 3], 0.5), inside)
        };
        if sided(false) && sided(true) {
            return true;
        }
        if cuts == 0 {
            return false;
        }
        let [a, b, c] = corners;
        let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            .iter()
            .all(|&part| self.holds_part(part, normal, cuts - 1))
    }

    /// The direction out of the shape near `p`: away from the middle of the inside samples round
    /// it. `normal` where they tell nothing.
    pub fn outward(&self, p: DVec3, normal: DVec3) -> DVec3 {
        let low = p.floor().as_ivec3() - 1;
        let mut sum = DVec3::ZERO;
        for z in low.z..low.z + 4 {
            for y in low.y..low.y + 4 {
                for x in low.x..low.x + 4 {
                    let q = glam::IVec3::new(x, y, z);
                    let away = p - q.as_dvec3();
                    let sign = if self.cells.is_inside(q.to_array().map(|i| i as u32)) {
                        1.0
                    } else {
                        -1.0
                    };
                    sum += away * (sign / (0.25 + away.length_squared()));
                }
            }
        }
        sum.try_normalize().unwrap_or(normal)
    }

    /// Proves that a triangle lies wholly inside, or wholly outside.
    fn is_on_side(&self, corners: [DVec3; 3], inside: bool) -> bool {
        let [a, b, c] = corners.map(|p| p.clamp(self.bounds[0], self.bounds[1]));
        let normal = (b - a).cross(c - a);
        if normal.length_squared() < 1e-12 {
            return false;
        }
        let normal = normal.normalize();
        let size = normal.abs();
        let k = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (u, v) = ((k + 1) % 3, (k + 2) % 3);
        let flat = [a, b, c].map(|p| [p[u], p[v], p[k]]);
        let (slope_u, slope_v) = (-normal[u] / normal[k], -normal[v] / normal[k]);
        const SLACK: f64 = 1e-9;
        let range = |i: usize| {
            let [x, y, z] = flat.map(|p| p[i]);
            (x.min(y).min(z) - SLACK, x.max(y).max(z) + SLACK)
        };
        let (v_low, v_high) = range(1);
        let (k_low, k_high) = range(2);
        let mut known = false;
        let border = self.cells.bounds;
        let layers = |axis: usize, low: f64, high: f64| {
            let most = border[1][axis].saturating_sub(1).max(border[0][axis]);
            let [low, high] = [low, high].map(|x| (x.floor() as u32).clamp(border[0][axis], most));
            low..=high
        };
        for row in layers(v, v_low, v_high) {
            let strip = (v_low.max(f64::from(row)), v_high.min(f64::from(row) + 1.0));
            let (mut u_low, mut u_high) = (f64::INFINITY, f64::NEG_INFINITY);
            for i in 0..3 {
                let (p, q) = (flat[i], flat[(i + 1) % 3]);
                let (p, q) = if p[1] <= q[1] { (p, q) } else { (q, p) };
                if q[1] < strip.0 - SLACK || p[1] > strip.1 + SLACK {
                    continue;
                }
                let at = |v: f64| {
                    if q[1] - p[1] < SLACK {
                        return [p[0].min(q[0]), p[0].max(q[0])];
                    }
                    let u = p[0] + (q[0] - p[0]) * ((v - p[1]) / (q[1] - p[1]));
                    [u, u]
                };
                for [low, high] in [at(strip.0.max(p[1])), at(strip.1.min(q[1]))] {
                    u_low = u_low.min(low);
                    u_high = u_high.max(high);
                }
            }
            u_low -= SLACK;
            u_high += SLACK;
            if u_low > u_high {
                continue;
            }
            for column in layers(u, u_low, u_high) {
                let across = (u_low.max(f64::from(column)), u_high.min(f64::from(column) + 1.0));
                let end = |slope: f64, (low, high): (f64, f64), from: f64| {
                    let (p, q) = (slope * (low - from), slope * (high - from));
                    (p.min(q), p.max(q))
                };
                let on_u = end(slope_u, across, flat[0][0]);
                let on_v = end(slope_v, strip, flat[0][1]);
                let low = (flat[0][2] + on_u.0 + on_v.0 - SLACK).max(k_low);
                let high = (flat[0][2] + on_u.1 + on_v.1 + SLACK).min(k_high);
                for layer in layers(k, low, high) {
                    let mut at = [0; 3];
                    (at[u], at[v], at[k]) = (column, row, layer);
                    match self.cells.state(at) {
                        State::Outside if inside => return false,
                        State::Inside if !inside => return false,
                        State::Outside | State::Inside => known = true,
                        State::Mixed(cell) => match self.side_in(cell, at, a, normal) {
                            Side::Known(side) if side == inside => known = true,
                            Side::Known(_) => return false,
                            Side::Unknown => {}
                            Side::Cut => {
                                if self.meets([a, b, c], cell) {
                                    return false;
                                }
                            }
                        },
                    }
                }
            }
        }
        known
    }

    /// Whether a triangle meets the surface in a mixed cell.
    fn meets(&self, corners: [DVec3; 3], cell: u32) -> bool {
        let corners = corners.map(|p| p.to_array());
        PATCHES[self.cells.mask(cell)].triangles().iter().any(|t| {
            let surface = t.map(|e| self.cells.crossing(cell, e.into()));
            exact::triangles_meet(corners, surface)
        })
    }

    /// The side of the surface that a plane runs on in a mixed cell.
    fn side_in(&self, cell: u32, at: [u32; 3], on: DVec3, normal: DVec3) -> Side {
        let mut points = [[0.0; 3]; 12];
        let count = self.cells.crossings(cell, &mut points);
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for &p in &points[..count] {
            let h = normal.dot(DVec3::from(p) - on);
            lowest = lowest.min(h);
            highest = highest.max(h);
        }
        // The cell's corner that lies farthest on the other side of the plane tells the side.
        let up = if highest < -ROUNDING {
            1.0
        } else if lowest > ROUNDING {
            -1.0
        } else {
            return Side::Cut;
        };
        let corner: usize = (0..3).map(|axis| usize::from(normal[axis] * up > 0.0) << axis).sum();
        let q =
            DVec3::from_array(std::array::from_fn(|x| f64::from(at[x]) + (corner >> x & 1) as f64));
        if normal.dot(q - on) * up <= ROUNDING {
            return Side::Unknown;
        }
        Side::Known(self.cells.mask(cell) >> corner & 1 == 1)
    }
}

enum Side {
    Known(bool),
    /// The plane leaves the cell at a corner.
    Unknown,
    /// The plane meets the surface, or nearly.
    Cut,
}

//! The tube around the surface: both distances between a patch and the surface, proved.
//!
//! The surface is that of marching cubes. From the surface to the patch: distance to a convex set
//! is convex, so a piece of the surface whose corners all lie within the tolerance of one face lies
//! there whole; pieces that do not are cut. From the patch to the surface: a face is pushed out and
//! in by vectors no longer than the tolerance. Where the one copy lies wholly outside and the other
//! wholly inside, the way from copy to copy through any point of the face meets the surface, and
//! does so within the tolerance. A copy lies on one side where it meets only cells of that side and
//! mixed cells whose surface it misses.

use super::cells::{Cells, State, WORD};
use super::cover::cover;
use super::piece::{Block, Piece, Pieces};
use crate::exact;
use crate::measure::intersect::meet_outside_shared;
use glam::DVec3;

/// Kept off all bounds, so that rounding cannot matter.
const ROUNDING: f64 = 1e-6;

/// Least height of a face that is made, in samples.
const LEAST_HEIGHT: f64 = 1e-3;

/// Faces of at most this extent are tried against single triangles of the surface.
const SMALL: f64 = 3.0;

/// How often a face is cut in four to be proved near the surface.
const CUTS: u32 = 1;

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
    pub fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let side = |p: DVec3, q: DVec3| {
            let out = (q - p).cross(normal).normalize_or_zero();
            (out, out.dot(p))
        };
        let sides = [side(a, b), side(b, c), side(c, a)];
        Self { corners, normal, offset: normal.dot(a), sides }
    }

    /// A face to be made: `None` where the corners lie nearly on one line.
    pub fn stout(corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let sides = [b - a, c - b, a - c].map(DVec3::length_squared);
        let longest = sides[0].max(sides[1]).max(sides[2]);
        // Twice the area over the longest side is the height.
        let height = (b - a).cross(c - a).length() / longest.sqrt();
        (height >= LEAST_HEIGHT).then(|| Self::new(corners))
    }

    /// Lowest and highest coordinates.
    pub fn span(&self) -> [DVec3; 2] {
        let [a, b, c] = self.corners;
        [a.min(b).min(c), a.max(b).max(c)]
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
    pub fn meets(
        &self,
        own: [u32; 3],
        other: &Self,
        others: [u32; 3],
        points: &[[f64; 3]],
    ) -> bool {
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

    /// How much of a block lies within a distance of the face.
    fn reaches(&self, block: &Block, distance: f64) -> Reach {
        let axes = block.axes.map(|a| a.as_dvec3());
        let spread = |n: DVec3| n.dot(axes[0]).abs() + n.dot(axes[1]).abs() + n.dot(axes[2]).abs();
        let (height, thick) = (self.height(block.middle).abs(), spread(self.normal));
        if height - thick > distance {
            return Reach::Nothing;
        }
        let mut beyond = 0.0f64;
        for &(out, offset) in &self.sides {
            let (at, wide) = (out.dot(block.middle) - offset, spread(out));
            if at - wide > distance {
                return Reach::Nothing;
            }
            beyond = beyond.max(at + wide);
        }
        let most = height + thick;
        if most > distance || beyond > distance {
            return Reach::Part;
        }
        // Straight above and below the face the height is the distance.
        if beyond <= 0.0 || block.corners().iter().all(|&p| self.is_within(p, distance)) {
            Reach::Whole
        } else {
            Reach::Part
        }
    }

    /// How much of a unit cube lies straight above and below the face, or within a distance of that.
    fn reaches_over(&self, middle: DVec3, distance: f64) -> Reach {
        let mut whole = true;
        for &(out, offset) in &self.sides {
            let at = out.dot(middle) - offset;
            let wide = 0.5 * (out.x.abs() + out.y.abs() + out.z.abs());
            if at - wide > distance {
                return Reach::Nothing;
            }
            whole &= at + wide <= 0.0;
        }
        if whole { Reach::Whole } else { Reach::Part }
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

/// The points within a tolerance of the surface.
pub struct Tube<'a> {
    pub cells: &'a Cells,
    pub pieces: &'a Pieces,
    /// The tolerance, in samples.
    pub tolerance: f64,
    bounds: [DVec3; 2],
}

impl<'a> Tube<'a> {
    pub fn new(cells: &'a Cells, pieces: &'a Pieces, tolerance: f64) -> Self {
        let bounds = cells.bounds.map(|b| DVec3::from(b.map(f64::from)));
        Self { cells, pieces, tolerance, bounds }
    }

    /// The tolerance without what rounding may take.
    fn reach(&self) -> f64 {
        self.tolerance - ROUNDING
    }

    /// Finds for a piece, or for all parts of it, a face that it lies within the tolerance of.
    /// Adds pairs of piece and face, and tells whether all were found. At most 64 faces are looked
    /// at.
    pub fn attach(&self, piece: Piece, faces: &[Face], out: &mut Vec<(Piece, u32)>) -> bool {
        let all = if faces.len() < 64 { (1 << faces.len()) - 1 } else { !0 };
        let hint = out.last().map_or(0, |last| last.1);
        self.attach_to(piece, faces, all, hint, out)
    }

    /// `near` tells, as bits, the faces that the piece may lie near; `hint` is tried first.
    fn attach_to(
        &self,
        piece: Piece,
        faces: &[Face],
        near: u64,
        hint: u32,
        out: &mut Vec<(Piece, u32)>,
    ) -> bool {
        let reach = self.reach();
        let mut left = near;
        if let Some(block) = self.pieces.block(piece) {
            let mut rest = near;
            while rest != 0 {
                let f = rest.trailing_zeros();
                rest &= rest - 1;
                match faces[f as usize].reaches(block, reach) {
                    Reach::Whole => {
                        out.push((piece, f));
                        return true;
                    }
                    Reach::Part => {}
                    Reach::Nothing => left &= !(1 << f),
                }
            }
        } else {
            let found = match piece.whole_cell() {
                Some(cell) => {
                    let middle = DVec3::from(self.cells.corner(cell).map(f64::from)) + 0.5;
                    self.place(Some(middle), self.cells.crossings(cell), faces, near, hint)
                }
                None => self.place(None, piece.corners(self.cells).into_iter(), faces, near, hint),
            };
            match found {
                Place::Near(f) => {
                    out.push((piece, f));
                    return true;
                }
                Place::Between => {}
                Place::Far => return false,
            }
        }
        let (mut any, mut hint) = (false, hint);
        left != 0
            && piece.parts(self.cells, |part| {
                any = true;
                let found = self.attach_to(part, faces, left, hint, out);
                hint = out.last().map_or(hint, |last| last.1);
                found
            })
            && any
    }

    /// Finds a face that all corners of a piece lie within the tolerance of. The piece lies in the
    /// unit cube about `middle`, where that is given.
    fn place(
        &self,
        middle: Option<DVec3>,
        corners: impl Iterator<Item = DVec3> + Clone,
        faces: &[Face],
        near: u64,
        hint: u32,
    ) -> Place {
        let reach = self.reach();
        let fits = |f: u32| {
            let face = &faces[f as usize];
            match middle.map_or(Reach::Part, |middle| face.reaches_over(middle, reach)) {
                Reach::Nothing => false,
                Reach::Part => corners.clone().all(|p| face.is_within(p, reach)),
                Reach::Whole => corners.clone().all(|p| face.height(p).abs() <= reach),
            }
        };
        if near >> hint & 1 == 1 && fits(hint) {
            return Place::Near(hint);
        }
        let mut rest = near & !(1 << hint);
        while rest != 0 {
            let f = rest.trailing_zeros();
            rest &= rest - 1;
            if fits(f) {
                return Place::Near(f);
            }
        }
        // Cutting cannot help a corner that lies too far from every face.
        let is_near = |p: DVec3| {
            let mut near = faces.iter().enumerate().filter(|(f, _)| near >> f & 1 == 1);
            near.any(|(_, face)| face.is_within(p, reach))
        };
        if corners.clone().all(is_near) { Place::Between } else { Place::Far }
    }

    /// Proves that every point of a face lies within the tolerance of the surface.
    pub fn holds(&self, face: &Face) -> bool {
        self.holds_part(face.corners, face.normal, CUTS)
    }

    fn holds_part(&self, corners: [DVec3; 3], normal: DVec3, cuts: u32) -> bool {
        let reach = self.reach();
        if self.is_by_one(corners) {
            return true;
        }
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

    /// Whether a small face lies whole within the tolerance of one triangle of the surface: the
    /// quick way where the surface is rough.
    fn is_by_one(&self, corners: [DVec3; 3]) -> bool {
        let [a, b, c] = corners;
        if (a.max(b).max(c) - a.min(b).min(c)).max_element() > SMALL {
            return false;
        }
        let reach = self.reach();
        [(a + b + c) / 3.0, a, b, c].into_iter().any(|p| {
            let cell = self.cells.find(p.to_array().map(|x| x as u32));
            cell.is_some_and(|cell| {
                self.cells.triangles(cell).any(|surface| {
                    let surface = Face::new(surface);
                    corners.iter().all(|&p| surface.is_within(p, reach))
                })
            })
        })
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

    /// Proves that a triangle lies wholly inside, or wholly outside: it meets no surface, and one
    /// of its points is known.
    fn is_on_side(&self, corners: [DVec3; 3], inside: bool) -> bool {
        let corners = corners.map(|p| p.clamp(self.bounds[0], self.bounds[1]));
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        if normal.length_squared() < 1e-12 {
            return false;
        }
        let normal = normal.normalize();
        let [low, high] = self.cells.bounds;
        // Cells end one before the last lattice points.
        let last: [u32; 3] = std::array::from_fn(|x| high[x].saturating_sub(1).max(low[x]));
        let mut known = false;
        let size = f64::from(WORD);
        let words = [low.map(|x| x / WORD), last.map(|x| x / WORD)];
        let clear = cover(corners, normal, size, words, |at| match self.cells.word_state(at) {
            State::Mixed(word) => {
                let block = self.pieces.word(word);
                let middle = normal.dot(block.middle - a);
                let reach: f64 =
                    block.axes.iter().map(|x| normal.dot(x.as_dvec3()).abs()).sum::<f64>()
                        + ROUNDING;
                if middle.abs() > reach {
                    return true;
                }
                let first = at.map(|x| x * WORD);
                let within = [
                    std::array::from_fn(|x| first[x].max(low[x])),
                    std::array::from_fn(|x| (first[x] + WORD - 1).min(last[x])),
                ];
                cover(corners, normal, 1.0, within, |at| {
                    self.is_clear_in(at, corners, normal, inside, &mut known)
                })
            }
            state => {
                known = true;
                (state == State::Inside) == inside
            }
        });
        if !clear || known {
            return clear;
        }
        // Only blocks that the surface meets elsewhere: one of its cells will tell.
        let middle = (a + b + c) / 3.0;
        for p in [middle, a, b, c] {
            let at = std::array::from_fn(|x| (p[x] as u32).clamp(low[x], last[x]));
            if !self.is_clear_in(at, corners, normal, inside, &mut known) {
                return false;
            }
            if known {
                return true;
            }
        }
        false
    }

    /// Whether a triangle that touches a cell does not meet the surface there, nor lies on the
    /// wrong side of it; notes where the cell tells that it lies on the right one.
    fn is_clear_in(
        &self,
        at: [u32; 3],
        corners: [DVec3; 3],
        normal: DVec3,
        inside: bool,
        known: &mut bool,
    ) -> bool {
        let State::Mixed(cell) = self.cells.state(at) else {
            *known = true;
            return (self.cells.state(at) == State::Inside) == inside;
        };
        match self.side_in(cell, at, corners[0], normal) {
            Side::Known(side) => {
                *known = true;
                side == inside
            }
            Side::Unknown => true,
            Side::Cut => !self.meets(corners, cell),
        }
    }

    /// Whether a triangle meets the surface in a mixed cell.
    fn meets(&self, corners: [DVec3; 3], cell: u32) -> bool {
        // Whether the plane of a triangle has another one wholly on one side.
        let clears = |[a, b, c]: [DVec3; 3], other: [DVec3; 3]| {
            let normal = (b - a).cross(c - a);
            let slack = ROUNDING * normal.length();
            let heights = other.map(|p| normal.dot(p - a));
            heights.iter().all(|&h| h > slack) || heights.iter().all(|&h| h < -slack)
        };
        self.cells.triangles(cell).any(|surface| {
            !clears(corners, surface)
                && !clears(surface, corners)
                && exact::triangles_meet(
                    corners.map(|p| p.to_array()),
                    surface.map(|p| p.to_array()),
                )
        })
    }

    /// The side of the surface that a plane runs on in a mixed cell.
    fn side_in(&self, cell: u32, at: [u32; 3], on: DVec3, normal: DVec3) -> Side {
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in self.cells.crossings(cell) {
            let h = normal.dot(p - on);
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
        // The surface keeps more than this from the plane.
        if normal.dot(q - on) * up < -ROUNDING / 2.0 {
            return Side::Unknown;
        }
        Side::Known(self.cells.mask(cell) >> corner & 1 == 1)
    }
}

/// Where a piece lies.
enum Place {
    /// Near one face.
    Near(u32),
    /// Its corners near different ones.
    Between,
    /// Some corner near none.
    Far,
}

/// How much of a block lies near a face.
enum Reach {
    Nothing,
    /// Some of it may.
    Part,
    Whole,
}

enum Side {
    Known(bool),
    /// The plane leaves the cell at a corner.
    Unknown,
    /// The plane meets the surface, or nearly.
    Cut,
}

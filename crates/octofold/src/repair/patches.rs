//! The triangles of the surface, free of self-intersection by construction.
//!
//! In full, the surface in each cell is a cone from the loop's vertex over a polygon on the cell's
//! walls: piercing points on its edges, joined on its faces by the chords of arcs. Cells meet only in
//! their walls, where both see the same polygons. Chords and piercing points are then left out where
//! an exact test allows it. Source: specification of repair (D.6); the proofs stand in
//! `docs/methods.md`.

use super::apexes::{
    Apexes, Shared, face_centre, on_edge, owner, pierced_point, seen_from_below, split,
};
use super::bricks::{Place, coordinates};
use super::cells::Cells;
use super::loops::{Config, Loops, corner_of};
use super::piercing::{Guide, Point, cross, crosses, dot, meets, sub};
use crate::run::{Cancelled, Run};
use crate::surface::cell::{edge_at, edge_axis, face_corners};

/// Lattice points and triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Patches {
    /// Points: first those of loops, then those on walls.
    pub points: Vec<Point>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Quads in two triangles.
    pub quads: u64,
    /// Quads cut into a fan round their piercing point, or into the halves of chords.
    pub fans: u64,
}

/// What is common to all cells.
struct Weaver<'a, G> {
    cells: &'a Cells<'a>,
    apexes: &'a Apexes,
    guide: &'a G,
    steps: i32,
    /// Which rules are applied.
    lean: bool,
}

/// Makes the surface. Without `lean` all points on walls stay.
pub fn patches<G: Guide>(
    cells: &Cells<'_>,
    apexes: Apexes,
    guide: &G,
    steps: i32,
    lean: bool,
    run: &Run,
) -> Result<Option<Patches>, Cancelled> {
    let weaver = Weaver { cells, apexes: &apexes, guide, steps, lean };
    run.stage("chords");
    let straight = cells.members.per_cell(run, |cell, place| weaver.straight_arcs(cell, place))?;
    run.stage("quads");
    let cuts = cells.members.per_cell(run, |cell, place| weaver.cuts(&straight, cell, place))?;
    let mut extras = Vec::with_capacity(cuts.len());
    let mut next = cells.loop_count() as u64;
    for cut in &cuts {
        extras.push(next as u32);
        next += u64::from(cut.extras().count_ones());
    }
    if next >= u64::from(u32::MAX) {
        return Ok(None);
    }
    run.stage("weave");
    let woven = Woven { straight, cuts, extras };
    let parts = cells.members.per_brick(run, |bricks| {
        let mut part = Patches::default();
        for brick in bricks {
            cells
                .members
                .in_brick(brick, |cell, place| weaver.weave(&woven, cell, place, &mut part));
        }
        part
    })?;
    let triangles = parts.iter().map(|p| p.triangles.len()).sum();
    let mut all = Patches { triangles: Vec::with_capacity(triangles), ..Patches::default() };
    all.points = apexes.points;
    all.points.reserve_exact(next as usize - cells.loop_count());
    for part in parts {
        all.points.extend(part.points);
        all.triangles.extend(part.triangles);
        all.quads += part.quads;
        all.fans += part.fans;
    }
    Ok(Some(all))
}

/// What was decided, cell by cell.
struct Woven {
    straight: Vec<u16>,
    cuts: Vec<Cut>,
    /// Number of the first point on walls that a cell owns.
    extras: Vec<u32>,
}

/// How the quads round the three edges at the low corner of a cell are cut: two bits for each end
/// of each edge; above them, whether the points in the middle of its three low faces are needed.
#[derive(Debug, Clone, Copy, Default)]
struct Cut(u16);

/// How a quad is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quad {
    /// There is none.
    None,
    /// Along the diagonal from the first vertex.
    First,
    /// Along the diagonal from the second.
    Second,
    /// Round the piercing point.
    Fan,
}

impl Quad {
    /// All ways, by their numbers.
    pub const ALL: [Self; 4] = [Self::None, Self::First, Self::Second, Self::Fan];
}

impl Cut {
    fn quad(self, axis: usize, end: usize) -> Quad {
        Quad::ALL[(self.0 >> (2 * (2 * axis + end)) & 3) as usize]
    }

    fn set(&mut self, axis: usize, end: usize, quad: Quad) {
        self.0 |= (quad as u16) << (2 * (2 * axis + end));
    }

    /// The points on walls that the cell owns: six piercing points, three in faces.
    fn extras(self) -> u16 {
        let fans = (0..6).filter(|n| self.0 >> (2 * n) & 3 == 3).fold(0, |b, n| b | 1 << n);
        fans | self.0 >> 12 << 6
    }
}

/// One quad: its vertices and what lies between them, counter-clockwise seen from outside.
struct Ring {
    cells: [u32; 4],
    /// The piercing point as each cell numbers it.
    points: [usize; 4],
    /// The cells that own the faces between each cell and the next, and the axis of these.
    faces: [(u32, usize, usize); 4],
}

impl<G: Guide> Weaver<'_, G> {
    /// The cell `down` below a place.
    fn below(&self, place: Place, down: [i32; 3]) -> Option<u32> {
        let inside = coordinates(place.cell);
        self.cells.members.beside(place.brick, std::array::from_fn(|a| inside[a] as i32 - down[a]))
    }

    fn apex(&self, cell: u32, point: usize) -> Point {
        self.apexes.points[self.cells.loop_at(cell, point) as usize]
    }

    /// Which arcs on the low faces of a cell need no point on the face: bit `4 axis + corner`, where
    /// corners are counted along the face and that of the arc's end is meant.
    fn straight_arcs(&self, cell: u32, place: Place) -> u16 {
        if !self.lean {
            return 0;
        }
        let loops = self.cells.loops(cell);
        let mut bits = 0;
        for axis in 0..3 {
            let f = 2 * axis;
            if loops.arcs[f] == 0 {
                continue;
            }
            let mut down = [0; 3];
            down[axis] = 1;
            let Some(below) = self.below(place, down) else { continue };
            for (p, q) in loops.on_face(f) {
                if self.is_straight(cell, below, place, axis, p, q) {
                    bits |= 1 << (4 * axis + corner_on_face(f, q));
                }
            }
        }
        bits
    }

    /// Whether the arc from point `p` to point `q` may run where the segment between the vertices
    /// of both cells crosses their face.
    fn is_straight(
        &self,
        cell: u32,
        below: u32,
        place: Place,
        axis: usize,
        p: usize,
        q: usize,
    ) -> bool {
        let steps = i64::from(self.steps);
        let other = |p: usize| 2 * seen_from_below(p / 2, axis) + p % 2;
        let (high, low) = (self.apex(cell, p), self.apex(below, other(p)));
        let corner = place.at.map(|x| x as i32 * self.steps);
        let span = sub(high, low);
        // The crossing, as `span[axis]` times its distance from the low corner of the face.
        let ahead = i64::from(corner[axis]) - i64::from(low[axis]);
        let from = sub(low, corner);
        let at: [i64; 3] = std::array::from_fn(|t| from[t] * span[axis] + span[t] * ahead);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let room = steps * span[axis];
        if [u, v].iter().any(|&t| at[t] <= 0 || at[t] >= room) {
            return false;
        }
        let config = self.cells.config(cell);
        if self.cells.loops(cell).arcs[2 * axis] > 1 {
            // The arc must stay in what the ends of its intervals cut off.
            let [a, b] = [p, q].map(|p| sub(self.far(place, config, p), corner));
            let on = |x: i64, y: i64, scale: i64| {
                let (dx, dy) = (b[u] - a[u], b[v] - a[v]);
                i128::from(dx) * i128::from(y - a[v] * scale)
                    - i128::from(dy) * i128::from(x - a[u] * scale)
            };
            let c = corner_of(q);
            let [cx, cy] = [u, v].map(|t| (c >> t & 1) as i64 * steps);
            if on(at[u], at[v], span[axis]).signum() != on(cx, cy, 1).signum() {
                return false;
            }
        }
        let seen = |of: u32, apex: Point, beyond: Point, p: usize, q: usize, at: [usize; 2]| {
            let Some(shared) = self.apexes.shared(of) else { return true };
            self.sees(of, shared, apex, beyond, [p, q], place, config, at)
        };
        // Seen from below the arc runs the other way.
        seen(cell, high, low, p, q, [p, q]) && seen(below, low, high, other(q), other(p), [q, p])
    }

    /// Whether the moved cone of a loop stays on its side where the arc between its piercing points
    /// bends towards the vertex beyond the face, wherever those lie in their intervals. The
    /// piercing points are numbered by the cell itself, and by the cell at `place`.
    #[expect(clippy::too_many_arguments, reason = "one arc as its two cells see it")]
    fn sees(
        &self,
        cell: u32,
        shared: &Shared,
        apex: Point,
        beyond: Point,
        [p, _]: [usize; 2],
        place: Place,
        config: Config,
        at: [usize; 2],
    ) -> bool {
        let side =
            shared.sides[(self.cells.loop_at(cell, p) - self.cells.first_loop(cell)) as usize];
        if side == 0 {
            return true;
        }
        let step = sub(apex, shared.base);
        let beyond = sub(beyond, shared.base);
        at.iter().enumerate().all(|(i, &point)| {
            let ends = self.interval(place, config, point).map(|end| {
                let x = sub(end, shared.base);
                let normal = if i == 0 { cross(x, beyond) } else { cross(beyond, x) };
                i64::from(side) * dot(step, normal)
            });
            ends.iter().all(|&e| e >= 0) && ends.iter().any(|&e| e > 0)
        })
    }

    /// The far end of the interval of a piercing point.
    fn far(&self, place: Place, config: Config, point: usize) -> Point {
        self.interval(place, config, point)[0]
    }

    /// The ends of the interval of a piercing point, that away from its corner first.
    fn interval(&self, place: Place, config: Config, point: usize) -> [Point; 2] {
        let (e, end) = (point / 2, point % 2);
        let ends = if config.pierced(e) == [true, true] {
            split(self.cells, self.guide, place, config, e, self.steps).interval(end)
        } else if end == 0 {
            [self.steps, 0]
        } else {
            [0, self.steps]
        };
        ends.map(|along| on_edge(place, e, along, self.steps))
    }

    /// The quad round the edge that leaves the low corner of a cell along `axis`, towards end `end`.
    fn ring(&self, place: Place, cell: u32, axis: usize, end: usize) -> Option<Ring> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let down = |du: i32, dv: i32| {
            let mut down = [0; 3];
            (down[u], down[v]) = (du, dv);
            down
        };
        let point = |du: usize, dv: usize| 2 * edge_at(du << u | dv << v, axis) + end;
        let [c00, c10, c01] = [(1, 1), (0, 1), (1, 0)].map(|(a, b)| self.below(place, down(a, b)));
        let (c00, c10, c11, c01) = (c00?, c10?, cell, c01?);
        let (p00, p10, p11, p01) = (point(1, 1), point(0, 1), point(0, 0), point(1, 0));
        // The normal points from the edge to its open end.
        Some(if end == 1 {
            Ring {
                cells: [c00, c10, c11, c01],
                points: [p00, p10, p11, p01],
                faces: [(c10, u, p10), (c11, v, p11), (c11, u, p11), (c01, v, p01)],
            }
        } else {
            Ring {
                cells: [c00, c01, c11, c10],
                points: [p00, p01, p11, p10],
                faces: [(c01, v, p01), (c11, u, p11), (c11, v, p11), (c10, u, p10)],
            }
        })
    }

    /// Whether each of the four arcs round a quad is straight.
    fn straight_round(&self, straight: &[u16], ring: &Ring) -> [bool; 4] {
        ring.faces.map(|(owner, axis, p)| {
            let loops = self.cells.loops(owner);
            let f = 2 * axis;
            let end = if loops.via[p] as usize == f { loops.next[p] as usize } else { p };
            straight[owner as usize] >> (4 * axis + corner_on_face(f, end)) & 1 == 1
        })
    }

    /// How the quads are cut whose edges leave the low corner of a cell, and which points in its low
    /// faces are needed.
    fn cuts(&self, straight: &[u16], cell: u32, place: Place) -> Cut {
        let mut cut = Cut::default();
        let config = self.cells.config(cell);
        for axis in 0..3 {
            let pierced = config.pierced(edge_at(0, axis));
            for end in (0..2).filter(|&end| pierced[end]) {
                let Some(ring) = self.ring(place, cell, axis, end) else { continue };
                let all = self.straight_round(straight, &ring) == [true; 4];
                let quad = if all { self.diagonal(&ring, place, config, axis, end) } else { None };
                cut.set(axis, end, quad.unwrap_or(Quad::Fan));
            }
            let loops = self.cells.loops(cell);
            for (p, q) in loops.on_face(2 * axis) {
                let bit = 4 * axis + corner_on_face(2 * axis, q);
                if p / 2 == q / 2 && straight[cell as usize] >> bit & 1 == 0 {
                    cut.0 |= 1 << (12 + axis);
                }
            }
        }
        cut
    }

    /// The diagonal along which a quad may be cut, if any.
    fn diagonal(
        &self,
        ring: &Ring,
        place: Place,
        config: Config,
        axis: usize,
        end: usize,
    ) -> Option<Quad> {
        let loops: [usize; 4] =
            std::array::from_fn(|i| self.cells.loop_at(ring.cells[i], ring.points[i]) as usize);
        let edge = self.interval(place, config, 2 * edge_at(0, axis) + end);
        let ranks = loops.map(|l| self.apexes.ranks[l]);
        diagonal(loops.map(|l| self.apexes.points[l]), ranks, edge)
    }

    /// The number of a point on a wall that `cell` owns.
    fn extra(&self, woven: &Woven, cell: u32, number: usize) -> u32 {
        let before = woven.cuts[cell as usize].extras() & ((1 << number) - 1);
        woven.extras[cell as usize] + before.count_ones()
    }

    /// The number of piercing point `p` of a cell.
    fn point_number(&self, woven: &Woven, place: Place, p: usize) -> Option<u32> {
        let owner = self.cells.members.find(owner(self.cells.members.bricks, place, p / 2)?)?;
        Some(self.extra(woven, owner, 2 * edge_axis(p / 2) + p % 2))
    }

    /// Adds the quads and chords that a cell owns.
    fn weave(&self, woven: &Woven, cell: u32, place: Place, part: &mut Patches) {
        let (cut, config) = (woven.cuts[cell as usize], self.cells.config(cell));
        for axis in 0..3 {
            for end in 0..2 {
                let quad = cut.quad(axis, end);
                if quad != Quad::None {
                    self.weave_quad(woven, cell, place, (axis, end), quad, part);
                }
            }
        }
        let extras = cut.extras();
        for number in (0..6).filter(|n| extras >> n & 1 == 1) {
            let p = 2 * edge_at(0, number / 2) + number % 2;
            part.points.push(pierced_point(self.cells, self.guide, place, config, p, self.steps));
        }
        for axis in (0..3).filter(|a| extras >> (6 + a) & 1 == 1) {
            part.points.push(face_centre(place, 2 * axis, self.steps));
        }
        let loops = self.cells.loops(cell);
        for axis in 0..3 {
            self.weave_chords(woven, cell, place, axis, loops, part);
        }
    }

    fn weave_quad(
        &self,
        woven: &Woven,
        cell: u32,
        place: Place,
        (axis, end): (usize, usize),
        quad: Quad,
        part: &mut Patches,
    ) {
        let Some(ring) = self.ring(place, cell, axis, end) else { return };
        let [a, b, c, d] =
            std::array::from_fn(|i| self.cells.loop_at(ring.cells[i], ring.points[i]));
        match quad {
            Quad::None => {}
            Quad::First => part.triangles.extend([[a, b, c], [a, c, d]]),
            Quad::Second => part.triangles.extend([[b, c, d], [b, d, a]]),
            Quad::Fan => {
                let middle = self.extra(woven, cell, 2 * axis + end);
                let straight = self.straight_round(&woven.straight, &ring);
                let sides = [[a, b], [b, c], [c, d], [d, a]];
                let shown = sides.iter().zip(straight).filter(|(_, straight)| *straight);
                part.triangles.extend(shown.map(|(&[a, b], _)| [a, b, middle]));
            }
        }
        if quad == Quad::Fan { part.fans += 1 } else { part.quads += 1 }
    }

    /// The halves of chords on both sides of the low face of a cell along `axis`.
    fn weave_chords(
        &self,
        woven: &Woven,
        cell: u32,
        place: Place,
        axis: usize,
        loops: &Loops,
        part: &mut Patches,
    ) {
        let f = 2 * axis;
        let mut down = [0; 3];
        down[axis] = 1;
        for (p, q) in loops.on_face(f) {
            if woven.straight[cell as usize] >> (4 * axis + corner_on_face(f, q)) & 1 == 1 {
                continue;
            }
            let ends = [p, q].map(|p| self.point_number(woven, place, p));
            let (Some(below), [Some(from), Some(to)]) = (self.below(place, down), ends) else {
                continue;
            };
            let high = self.cells.loop_at(cell, p);
            let low = self.cells.loop_at(below, 2 * seen_from_below(p / 2, axis) + p % 2);
            let mut add = |from: u32, to: u32| {
                part.triangles.extend([[high, from, to], [low, to, from]]);
            };
            if p / 2 == q / 2 {
                let middle = self.extra(woven, cell, 6 + axis);
                add(from, middle);
                add(middle, to);
            } else {
                add(from, to);
            }
        }
    }
}

/// The place of a piercing point's corner along a face.
fn corner_on_face(f: usize, point: usize) -> usize {
    let corner = corner_of(point);
    face_corners(f).iter().position(|&c| c == corner).unwrap_or_default()
}

/// The diagonal along which a quad with the given vertices and their ranks may be cut, if any. All
/// lines at its corners are left out, and its point on the edge may lie anywhere in the open interval
/// `edge`.
pub fn diagonal(at: [Point; 4], ranks: [u8; 4], edge: [Point; 2]) -> Option<Quad> {
    let passes = |i: usize| {
        let (a, b) = (at[i], at[i + 2]);
        // A diagonal through the edge is as good as two that pass it.
        meets(a, b, edge, at[i + 1])
            || [i + 1, (i + 3) % 4].into_iter().any(|wing| {
                let rest = at[(wing + 2) % 4];
                crosses(a, b, [at[wing], edge[0], edge[1]])
                    && crosses(edge[0], edge[1], [a, b, rest])
            })
    };
    let rank = |i: usize| ranks[i] + ranks[i + 2];
    let length = |i: usize| {
        let d = sub(at[i], at[i + 2]);
        dot(d, d)
    };
    // Creases are kept by joining the vertices that lie on them.
    let order = (rank(1), length(0)) > (rank(0), length(1));
    let [first, second] = if order { [1, 0] } else { [0, 1] };
    let found = if passes(first) {
        first
    } else if passes(second) {
        second
    } else {
        return None;
    };
    Some(if found == 0 { Quad::First } else { Quad::Second })
}

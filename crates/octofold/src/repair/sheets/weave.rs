//! The triangles of sheets, free of self-intersection by construction.
//!
//! In full, the surface in each cell is a cone from a leaf's vertex over the lines on the cell's
//! walls: a chord where a face joins two quads, a star where it joins three or four, nothing where a
//! quad ends. Lines and points on walls are then left out where an exact test allows it, by the same
//! rules as in closed repair; no rule needs more of a line than that it lies in its face. Source:
//! specification of repair (D.6).

use super::super::apexes::{face_centre, owner};
use super::super::bricks::{Place, coordinates};
use super::super::patches::{Quad, diagonal};
use super::super::piercing::{Point, sub};
use super::apexes::{Apexes, crossing};
use super::cells::{Cells, each_edge};
use super::complex::{Complex, Vertex};
use super::guide::SheetGuide;
use crate::run::{Cancelled, Run};
use crate::surface::cell::{edge_at, edge_axis, edge_corner};

/// Lattice points and triangles; how triangles are turned is not settled yet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Woven {
    /// Points: first those of leaves, then those on walls.
    pub points: Vec<Point>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Which triangles bound a solid part; these are counter-clockwise seen from outside.
    pub outward: Vec<bool>,
    /// Quads in two triangles.
    pub quads: u64,
    /// Quads cut round a point on their edge.
    pub fans: u64,
}

struct Weaver<'a, G> {
    complex: &'a Complex<'a>,
    cells: &'a Cells<'a>,
    apexes: &'a Apexes,
    guide: &'a G,
    steps: i32,
    lean: bool,
}

/// How the three edges and faces at the low corner of a cell are woven: two bits for each edge, then
/// for each face a bit where its lines are left out, and one where its centre is needed.
#[derive(Debug, Clone, Copy, Default)]
struct Cut(u16);

impl Cut {
    fn quad(self, axis: usize) -> Quad {
        Quad::ALL[(self.0 >> (2 * axis) & 3) as usize]
    }

    fn is_straight(self, axis: usize) -> bool {
        self.0 >> (6 + axis) & 1 == 1
    }

    /// The points on walls that the cell owns: three on edges, three in faces.
    fn extras(self) -> u16 {
        let fans = (0..3).filter(|&a| self.quad(a) == Quad::Fan).fold(0, |bits, a| bits | 1 << a);
        fans | self.0 >> 9 << 3
    }
}

/// One quad: the leaves round its edge, counter-clockwise seen from the high end, and between each
/// and the next the face by its owner and axis.
struct Ring {
    cells: [u32; 4],
    edges: [usize; 4],
    faces: [(u32, usize); 4],
}

/// Weaves all quads. Without `lean` all points on walls stay.
pub fn weave<G: SheetGuide>(
    complex: &Complex<'_>,
    cells: &Cells<'_>,
    apexes: &Apexes,
    guide: &G,
    steps: i32,
    lean: bool,
    run: &Run,
) -> Result<Option<Woven>, Cancelled> {
    let weaver = Weaver { complex, cells, apexes, guide, steps, lean };
    run.stage("lines");
    let straight = cells.members.per_cell(run, |cell, place| weaver.straight(cell, place))?;
    run.stage("quads");
    let cuts = cells.members.per_cell(run, |cell, place| weaver.cuts(&straight, cell, place))?;
    let mut extras = Vec::with_capacity(cuts.len());
    let mut next = apexes.points.len() as u64;
    for cut in &cuts {
        extras.push(next as u32);
        next += u64::from(cut.extras().count_ones());
    }
    if next >= u64::from(u32::MAX) {
        return Ok(None);
    }
    run.stage("weave");
    let wall = Wall { cuts: &cuts, first: &extras };
    let parts = cells.members.per_brick(run, |bricks| {
        let mut part = Woven::default();
        for brick in bricks {
            cells.members.in_brick(brick, |cell, place| {
                weaver.weave(&wall, cell, place, &mut part);
            });
        }
        part
    })?;
    let mut all = Woven { points: apexes.points.clone(), ..Woven::default() };
    for part in parts {
        all.points.extend(part.points);
        all.triangles.extend(part.triangles);
        all.outward.extend(part.outward);
        all.quads += part.quads;
        all.fans += part.fans;
    }
    Ok(Some(all))
}

impl<G: SheetGuide> Weaver<'_, G> {
    fn below(&self, place: Place, down: [i32; 3]) -> Option<u32> {
        let inside = coordinates(place.cell);
        let local = std::array::from_fn(|a| inside[a] as i32 - down[a]);
        self.cells.members.beside(place.brick, local)
    }

    fn below_along(&self, place: Place, axis: usize) -> Option<u32> {
        self.cells.along(place, axis, -1)
    }

    /// The number of the vertex of the leaf with edge `e` of a cell.
    fn vertex(&self, cell: u32, e: usize) -> u32 {
        self.apexes.of[self.cells.leaf_at(cell, e) as usize]
    }

    fn at(&self, vertex: u32) -> Point {
        self.apexes.points[vertex as usize]
    }

    /// Which of the three low faces of a cell need no line: the segment between the vertices of both
    /// cells crosses the face, and neither cell has another leaf.
    fn straight(&self, cell: u32, place: Place) -> u8 {
        let config = self.cells.config(cell);
        let mut bits = 0;
        for axis in 0..3 {
            let [group, other] = config.groups(2 * axis);
            let Some(below) = self.below_along(place, axis) else { continue };
            if !self.lean
                || group == 0
                || other != 0
                || !self.cells.is_alone(cell)
                || !self.cells.is_alone(below)
            {
                continue;
            }
            let e = group.trailing_zeros() as usize;
            let (high, low) =
                (self.at(self.vertex(cell, e)), self.at(self.vertex_below(below, e, axis)));
            let steps = i64::from(self.steps);
            let corner = place.at.map(|x| x as i32 * self.steps);
            let span = sub(high, low);
            let ahead = i64::from(corner[axis]) - i64::from(low[axis]);
            let from = sub(low, corner);
            let inside = [(axis + 1) % 3, (axis + 2) % 3].iter().all(|&t| {
                let at = from[t] * span[axis] + span[t] * ahead;
                0 < at && at < steps * span[axis]
            });
            bits |= u8::from(inside) << axis;
        }
        bits
    }

    /// The vertex of the cell below along `axis` for edge `e` of the cell above, on their face.
    fn vertex_below(&self, below: u32, e: usize, axis: usize) -> u32 {
        self.vertex(below, edge_at(edge_corner(e) | 1 << axis, edge_axis(e)))
    }

    /// The quad round the edge that leaves the low corner of a cell along `axis`.
    fn ring(&self, place: Place, cell: u32, axis: usize) -> Option<Ring> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let down = |du: i32, dv: i32| {
            let mut down = [0; 3];
            (down[u], down[v]) = (du, dv);
            self.below(place, down)
        };
        let edge = |du: usize, dv: usize| edge_at(du << u | dv << v, axis);
        let (c00, c10, c01) = (down(1, 1)?, down(0, 1)?, down(1, 0)?);
        Some(Ring {
            cells: [c00, c10, cell, c01],
            edges: [edge(1, 1), edge(0, 1), edge(0, 0), edge(1, 0)],
            faces: [(c10, u), (cell, v), (cell, u), (c01, v)],
        })
    }

    /// How the quads at the low corner of a cell are cut, and which points in its low faces are
    /// needed.
    fn cuts(&self, straight: &[u8], cell: u32, place: Place) -> Cut {
        let config = self.cells.config(cell);
        let mut cut = Cut(u16::from(straight[cell as usize]) << 6);
        for axis in 0..3 {
            if config.stands(edge_at(0, axis))
                && let Some(ring) = self.ring(place, cell, axis)
            {
                let all =
                    ring.faces.iter().all(|&(owner, a)| straight[owner as usize] >> a & 1 == 1);
                let quad = if all { self.diagonal(&ring, place, axis) } else { None };
                cut.0 |= (quad.unwrap_or(Quad::Fan) as u16) << (2 * axis);
            }
            let [group, _] = config.groups(2 * axis);
            if group.count_ones() > 2 && !cut.is_straight(axis) {
                cut.0 |= 1 << (9 + axis);
            }
        }
        cut
    }

    fn diagonal(&self, ring: &Ring, place: Place, axis: usize) -> Option<Quad> {
        let vertices: [u32; 4] = std::array::from_fn(|i| self.vertex(ring.cells[i], ring.edges[i]));
        let low = place.at.map(|x| x as i32 * self.steps);
        let mut high = low;
        high[axis] += self.steps;
        let ranks = vertices.map(|v| self.apexes.ranks[v as usize]);
        diagonal(vertices.map(|v| self.at(v)), ranks, [low, high])
    }

    /// Adds the quads whose edges and the lines whose faces are at the low corner of a cell.
    fn weave(&self, wall: &Wall<'_>, cell: u32, place: Place, part: &mut Woven) {
        let cut = wall.cuts[cell as usize];
        for axis in (0..3).filter(|&a| cut.quad(a) != Quad::None) {
            self.weave_quad(wall, cell, place, axis, part);
        }
        for number in (0..6).filter(|n| cut.extras() >> n & 1 == 1) {
            part.points.push(if number < 3 {
                crossing(self.cells, self.guide, place, edge_at(0, number), self.steps)
            } else {
                face_centre(place, 2 * (number - 3), self.steps)
            });
        }
        for axis in (0..3).filter(|&a| !cut.is_straight(a)) {
            self.weave_lines(wall, cell, place, axis, part);
        }
    }

    fn weave_quad(&self, wall: &Wall<'_>, cell: u32, place: Place, axis: usize, part: &mut Woven) {
        let Some(ring) = self.ring(place, cell, axis) else { return };
        let vertices: [u32; 4] = std::array::from_fn(|i| self.vertex(ring.cells[i], ring.edges[i]));
        let [a, b, c, d] = vertices;
        let first = part.triangles.len();
        let quad = wall.cuts[cell as usize].quad(axis);
        match quad {
            Quad::None => {}
            Quad::First => part.triangles.extend([[a, b, c], [a, c, d]]),
            Quad::Second => part.triangles.extend([[b, c, d], [b, d, a]]),
            Quad::Fan => {
                let middle = wall.point(cell, axis);
                let sides = [[a, b], [b, c], [c, d], [d, a]];
                let shown = sides
                    .iter()
                    .zip(ring.faces)
                    .filter(|(_, (owner, face))| wall.cuts[*owner as usize].is_straight(*face));
                part.triangles.extend(shown.map(|(&[a, b], _)| [a, b, middle]));
            }
        }
        if quad == Quad::Fan {
            part.fans += 1
        } else {
            part.quads += 1
        }
        let [low, high] = [Some(place), self.complex.step(place, axis, 1)]
            .map(|p| p.is_none_or(|p| self.complex.vertex(p) == Vertex::Solid));
        if high {
            part.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
        }
        part.outward.resize(part.triangles.len(), low || high);
    }

    /// The halves of the lines on the low face of a cell along `axis`, on both of its sides.
    fn weave_lines(&self, wall: &Wall<'_>, cell: u32, place: Place, axis: usize, part: &mut Woven) {
        let Some(below) = self.below_along(place, axis) else { return };
        let on_edge = |e: usize| {
            let owner = self.cells.members.find(owner(self.cells.members.bricks, place, e)?)?;
            Some(wall.point(owner, edge_axis(e)))
        };
        for group in self.cells.config(cell).groups(2 * axis) {
            if group.count_ones() < 2 {
                continue;
            }
            let e = group.trailing_zeros() as usize;
            let (high, low) = (self.vertex(cell, e), self.vertex_below(below, e, axis));
            let mut points = Vec::with_capacity(4);
            each_edge(group, |e| points.extend(on_edge(e)));
            let mut add = |from: u32, to: u32| {
                part.triangles.extend([[high, from, to], [low, to, from]]);
            };
            match points[..] {
                [from, to] => add(from, to),
                _ => points.iter().for_each(|&p| add(p, wall.point(cell, 3 + axis))),
            }
        }
        part.outward.resize(part.triangles.len(), false);
    }
}

/// What was decided of the points on walls.
struct Wall<'a> {
    cuts: &'a [Cut],
    /// Number of the first point on walls that a cell owns.
    first: &'a [u32],
}

impl Wall<'_> {
    /// The number of a point on a wall that `cell` owns: those of three edges, then of three faces.
    fn point(&self, cell: u32, number: usize) -> u32 {
        let before = self.cuts[cell as usize].extras() & ((1 << number) - 1);
        self.first[cell as usize] + before.count_ones()
    }
}

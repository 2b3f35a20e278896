//! The vertices of leaves: each strictly inside its cell, their cones apart where a cell has several.
//!
//! In a cell with several leaves the cones are fixed by their vertices alone, since no line on the
//! walls of such a cell is moved; so whether two of them meet is decided by exact predicates. Where
//! no place tried keeps them apart, leaves share one vertex: a *pinch*. Cones from one apex over
//! graphs without a common point meet in the apex alone. Source: specification of repair (D.6).

use super::super::apexes::{face_centre, inside, on_edge};
use super::super::bricks::Place;
use super::super::piercing::Point;
use super::cells::{Cells, each_edge};
use super::complex::Edge;
use super::guide::{Leaf, SheetGuide};
use super::pockets::Pockets;
use crate::exact;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// The vertices of all leaves.
#[derive(Default)]
pub struct Apexes {
    /// Positions, leaf by leaf.
    pub points: Vec<Point>,
    /// The rank of the shape there, leaf by leaf.
    pub ranks: Vec<u8>,
    /// The leaf whose vertex each leaf takes: its own, but for pinches.
    pub of: Vec<u32>,
    /// Cells in which leaves share a vertex.
    pub pinches: u64,
}

/// A segment on a wall of a cell, over which a cone has a triangle.
type Line = [Point; 2];

impl Apexes {
    /// Places them.
    pub fn new<G: SheetGuide>(
        cells: &Cells<'_>,
        pockets: Option<&Pockets<'_>>,
        guide: &G,
        steps: i32,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        run.stage("place");
        let parts = cells.members.per_brick(run, |bricks| {
            let mut part = Self::default();
            for brick in bricks {
                cells.members.in_brick(brick, |cell, place| {
                    let up = pockets.and_then(|p| p.near(place));
                    if cells.is_alone(cell) {
                        for (number, leaf) in cells.leaves(cell) {
                            let target = guide.vertex(place, &leaf, up);
                            part.points.push(inside(place, target.at, 1, steps));
                            part.ranks.push(target.rank);
                            part.of.push(number);
                        }
                    } else {
                        part.fit(cells, guide, up, cell, place, steps);
                    }
                });
            }
            part
        })?;
        let mut all = Self::default();
        for part in parts {
            all.points.extend(part.points);
            all.ranks.extend(part.ranks);
            all.of.extend(part.of);
            all.pinches += part.pinches;
        }
        Ok(all)
    }

    /// Places the leaves of a cell with several.
    fn fit<G: SheetGuide>(
        &mut self,
        cells: &Cells<'_>,
        guide: &G,
        up: Option<DVec3>,
        cell: u32,
        place: Place,
        steps: i32,
    ) {
        let leaves: Vec<(u32, Leaf)> = cells.leaves(cell).collect();
        let lines: Vec<Vec<Line>> =
            leaves.iter().map(|(_, leaf)| lines(cells, guide, cell, place, leaf, steps)).collect();
        let targets: Vec<_> =
            leaves.iter().map(|(_, leaf)| guide.vertex(place, leaf, up)).collect();
        let mut found: Vec<(Point, u32)> = Vec::with_capacity(leaves.len());
        for (l, &(number, _)) in leaves.iter().enumerate() {
            let middle = middle(&lines[l], place, steps);
            let mixed = |part: f64| -> [f64; 3] {
                std::array::from_fn(|a| targets[l].at[a] * (1.0 - part) + middle[a] * part)
            };
            let tried = [0.0, 0.5, 1.0].map(|part| inside(place, mixed(part), 1, steps));
            let free = tried.into_iter().find(|&apex| {
                let clear = |(k, &(other, _)): (usize, &(Point, u32))| {
                    apart((apex, &lines[l]), (other, &lines[k]))
                };
                found.iter().enumerate().all(clear)
            });
            found.push((free.unwrap_or(tried[0]), number));
            if free.is_none() {
                // One apex for all keeps the cones apart but for itself.
                let base = inside(place, [f64::from(steps) / 2.0; 3], 1, steps);
                found = leaves.iter().map(|_| (base, leaves[0].0)).collect();
                self.pinches += 1;
                break;
            }
        }
        for (&(point, of), target) in found.iter().zip(&targets) {
            self.points.push(point);
            self.ranks.push(target.rank);
            self.of.push(of);
        }
    }
}

/// Where the quad of edge `e` of a cell crosses it.
pub fn crossing<G: SheetGuide>(
    cells: &Cells<'_>,
    guide: &G,
    place: Place,
    e: usize,
    steps: i32,
) -> Point {
    let at = Edge::of_cell(cells.members.bricks, place, e).and_then(|edge| guide.piercing(edge).at);
    let at = at.unwrap_or(f64::from(steps) / 2.0).round() as i32;
    on_edge(place, e, at.clamp(1, steps - 1), steps)
}

/// The lines of a leaf on the walls of its cell, which has several: chords between two edges, and
/// stars round the centre of a face between three or four.
fn lines<G: SheetGuide>(
    cells: &Cells<'_>,
    guide: &G,
    cell: u32,
    place: Place,
    leaf: &Leaf,
    steps: i32,
) -> Vec<Line> {
    let config = cells.config(cell);
    let mut lines = Vec::new();
    for f in 0..6 {
        for group in config.groups(f).into_iter().filter(|g| g & leaf.edges != 0) {
            let mut points = Vec::new();
            each_edge(group, |e| points.push(crossing(cells, guide, place, e, steps)));
            match points[..] {
                [p] => lines.push([p, p]),
                [p, q] => lines.push([p, q]),
                _ => {
                    let centre = face_centre(place, f, steps);
                    lines.extend(points.iter().map(|&p| [p, centre]));
                }
            }
        }
    }
    lines
}

/// The middle of some lines, in steps from the low corner of a cell.
fn middle(lines: &[Line], place: Place, steps: i32) -> [f64; 3] {
    let count = 2.0 * lines.len().max(1) as f64;
    std::array::from_fn(|a| {
        let sum: f64 = lines.iter().flatten().map(|p| f64::from(p[a])).sum();
        sum / count - f64::from(place.at[a] as i32 * steps)
    })
}

/// Whether two cones have no point in common. Lines are never flat with an apex, since they lie on
/// walls and the apex does not.
fn apart((a, lines_a): (Point, &[Line]), (b, lines_b): (Point, &[Line])) -> bool {
    let triangle = |apex: Point, [p, q]: Line| [apex, p, q].map(|p| p.map(f64::from));
    lines_a.iter().all(|&first| {
        let clear = |&second| !exact::triangles_meet(triangle(a, first), triangle(b, second));
        lines_b.iter().all(clear)
    })
}

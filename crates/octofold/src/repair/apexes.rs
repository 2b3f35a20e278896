//! The vertices of loops: each strictly inside its cell, and apart where a cell has several.
//!
//! In each cell the surface is a cone from a vertex over each loop. Cones from one common apex meet
//! there alone; so where a cell has several loops, each apex is moved into its own side, in a
//! direction from which the whole loop is seen: the moved cone lies in the old one's side, and the
//! sides have no point in common. Whether the direction does is tested in integers. Source:
//! specification of repair (D.6, rule 3).

use super::bricks::{BRICK, Bricks, Place, coordinates};
use super::cells::Cells;
use super::loops::{Config, Loops, Side};
use super::piercing::{Guide, Point, SHELL, Split, Target, cross, dot, sub};
use crate::run::{Cancelled, Run};
use crate::surface::cell::{edge_at, edge_axis, edge_corner};

/// The vertices of all loops.
#[derive(Default)]
pub struct Apexes {
    /// Positions, loop by loop.
    pub points: Vec<Point>,
    /// The rank of the shape there, loop by loop.
    pub ranks: Vec<u8>,
    /// Whether each loop has its cell to itself.
    alone: Vec<bool>,
    /// What was done in cells with several loops, in order of the cells.
    shared: Vec<Shared>,
}

/// The common apex of the loops of a cell, and the side to which each was moved: 1 the open one, -1
/// the other, 0 for the one that was not.
#[derive(Debug, Clone, Copy)]
pub struct Shared {
    cell: u32,
    /// The common apex.
    pub base: Point,
    /// The side of each loop.
    pub sides: [i8; MOST_LOOPS],
}

/// No cell has more loops: each takes two piercing points at least.
const MOST_LOOPS: usize = 12;

/// A side that is taken, and the polygon of its loop relative to the common apex.
type Polygon = Vec<[i64; 3]>;

impl Apexes {
    /// Places them, or tells in which cells the loops cannot be told apart.
    pub fn new<G: Guide>(
        cells: &Cells<'_>,
        guide: &G,
        steps: i32,
        run: &Run,
    ) -> Result<Result<Self, Vec<Place>>, Cancelled> {
        run.stage("place");
        let parts = cells.members.per_brick(run, |bricks| {
            let mut part = Self::default();
            let mut failed = Vec::new();
            for brick in bricks {
                cells.members.in_brick(brick, |cell, place| {
                    let target = guide.target(place);
                    if cells.is_shared(cell) {
                        let fitted = part.fit(cells, guide, cell, place, target, steps);
                        if !fitted {
                            failed.push(place);
                        }
                    } else {
                        part.points.push(inside(place, target.at, 1, steps));
                        part.ranks.push(target.rank);
                        part.alone.push(true);
                    }
                });
            }
            (part, failed)
        })?;
        let failed: Vec<Place> = parts.iter().flat_map(|p| p.1.iter().copied()).collect();
        if !failed.is_empty() {
            return Ok(Err(failed));
        }
        let mut all = Self::default();
        all.points.reserve_exact(cells.loop_count());
        all.ranks.reserve_exact(cells.loop_count());
        for (part, _) in parts {
            all.points.extend(part.points);
            all.ranks.extend(part.ranks);
            all.alone.extend(part.alone);
            all.shared.extend(part.shared);
        }
        Ok(Ok(all))
    }

    /// Whether a loop has its cell to itself.
    pub fn is_alone(&self, vertex: u32) -> bool {
        self.alone[vertex as usize]
    }

    /// What was done in a cell with several loops.
    pub fn shared(&self, cell: u32) -> Option<&Shared> {
        let at = self.shared.binary_search_by_key(&cell, |s| s.cell).ok()?;
        self.shared.get(at)
    }

    /// Places the loops of a cell with several; tells whether that was possible.
    fn fit<G: Guide>(
        &mut self,
        cells: &Cells<'_>,
        guide: &G,
        cell: u32,
        place: Place,
        target: Target,
        steps: i32,
    ) -> bool {
        let (config, loops) = (cells.config(cell), cells.loops(cell));
        let sides = loops.sides(config);
        let count = sides.len().min(MOST_LOOPS);
        let polygons: Vec<Vec<Point>> = (0..count as u8)
            .map(|l| polygon(cells, guide, place, config, loops, l, steps))
            .collect();
        let centre = [f64::from(steps) / 2.0; 3];
        let mut best: Option<(usize, Point, Vec<Option<Point>>)> = None;
        // Rounding leaves little choice near walls: the centre comes second.
        for at in [target.at, centre] {
            let base = inside(place, at, (steps / (2 * SHELL)).max(2), steps);
            let moved: Vec<Option<Point>> = (0..count)
                .map(|l| {
                    let side = sides[l]?;
                    let polygon = polygons[l].iter().map(|&p| sub(p, base)).collect();
                    moved(place, base, &polygon, side, steps)
                })
                .collect();
            let left = moved.iter().filter(|m| m.is_none()).count();
            if best.as_ref().is_none_or(|b| left < b.0) {
                best = Some((left, base, moved));
            }
            if left == 0 {
                break;
            }
        }
        let Some((left, base, moved)) = best else { return false };
        let mut shared = Shared { cell, base, sides: [0; MOST_LOOPS] };
        for (l, point) in moved.iter().enumerate() {
            if point.is_some() {
                shared.sides[l] = if sides[l] == Some(Side::Open) { 1 } else { -1 };
            }
            self.points.push(point.unwrap_or(base));
            self.ranks.push(target.rank);
            self.alone.push(false);
        }
        self.shared.push(shared);
        // One of them may stay where it is.
        left <= 1
    }
}

/// The lattice point of a cell next to `at`, at least `margin` steps from its walls.
pub fn inside(place: Place, at: [f64; 3], margin: i32, steps: i32) -> Point {
    std::array::from_fn(|a| {
        let offset = (at[a].round() as i32).clamp(margin, steps - margin);
        place.at[a] as i32 * steps + offset
    })
}

/// The piercing point and the centres of faces along a loop, as lattice points.
fn polygon<G: Guide>(
    cells: &Cells<'_>,
    guide: &G,
    place: Place,
    config: Config,
    loops: &Loops,
    number: u8,
    steps: i32,
) -> Vec<Point> {
    let mut points = Vec::new();
    for p in loops.points(number) {
        points.push(pierced_point(cells, guide, place, config, p, steps));
        if loops.next[p] as usize / 2 == p / 2 {
            points.push(face_centre(place, loops.via[p] as usize, steps));
        }
    }
    points
}

/// The centre of face `f` of a cell.
pub fn face_centre(place: Place, f: usize, steps: i32) -> Point {
    std::array::from_fn(|a| {
        let offset = if a == f / 2 { (f % 2) as i32 * steps } else { steps / 2 };
        place.at[a] as i32 * steps + offset
    })
}

/// The cell at whose low corner edge `e` of a cell begins.
pub fn owner(bricks: &Bricks, place: Place, e: usize) -> Option<Place> {
    let (low, inside) = (edge_corner(e), coordinates(place.cell));
    if low == 0 {
        return Some(place);
    }
    bricks.place(place.brick, std::array::from_fn(|a| (inside[a] + (low as u32 >> a & 1)) as i32))
}

/// The piercing points of edge `e` of a cell.
pub fn split<G: Guide>(
    cells: &Cells<'_>,
    guide: &G,
    place: Place,
    config: Config,
    e: usize,
    steps: i32,
) -> Split {
    let crossings =
        owner(cells.members.bricks, place, e).and_then(|o| guide.crossings(o, edge_axis(e)));
    Split::new(crossings, config.pierced(e), steps)
}

/// Piercing point `p` of a cell.
pub fn pierced_point<G: Guide>(
    cells: &Cells<'_>,
    guide: &G,
    place: Place,
    config: Config,
    p: usize,
    steps: i32,
) -> Point {
    let split = split(cells, guide, place, config, p / 2, steps);
    on_edge(place, p / 2, split.at[p % 2], steps)
}

/// The point `along` steps from the low end of edge `e` of a cell.
pub fn on_edge(place: Place, e: usize, along: i32, steps: i32) -> Point {
    let low = edge_corner(e);
    let mut point = std::array::from_fn(|a| (place.at[a] + (low as u32 >> a & 1)) as i32 * steps);
    point[edge_axis(e)] += along;
    point
}

/// Edge `e` of a cell as an edge of the cell below it along `axis`, on whose high face it lies.
pub fn seen_from_below(e: usize, axis: usize) -> usize {
    edge_at(edge_corner(e) | 1 << axis, edge_axis(e))
}

/// Where an apex goes from `base` so that the whole polygon is seen from the direction on one side.
fn moved(place: Place, base: Point, polygon: &Polygon, side: Side, steps: i32) -> Option<Point> {
    let sign = if side == Side::Open { 1 } else { -1 };
    let normals: Vec<[i64; 3]> = (0..polygon.len())
        .map(|j| cross(polygon[j], polygon[(j + 1) % polygon.len()]).map(|x| sign * x))
        .collect();
    let unit: Vec<glam::DVec3> = normals
        .iter()
        .map(|n| glam::DVec3::from_array(n.map(|x| x as f64)).normalize_or_zero())
        .collect();
    let sum: glam::DVec3 = unit.iter().sum();
    attempt(place, base, &normals, sum, steps)
        .or_else(|| attempt(place, base, &normals, middle_of_kernel(&unit), steps))
}

/// The mean of the extreme directions that lie on the positive side of all normals.
fn middle_of_kernel(normals: &[glam::DVec3]) -> glam::DVec3 {
    let mut sum = glam::DVec3::ZERO;
    for i in 0..normals.len() {
        for j in 0..i {
            let ray = normals[i].cross(normals[j]).normalize_or_zero();
            for ray in [ray, -ray] {
                if normals.iter().all(|n| n.dot(ray) > -1e-9) {
                    sum += ray;
                }
            }
        }
    }
    sum
}

fn attempt(
    place: Place,
    base: Point,
    normals: &[[i64; 3]],
    direction: glam::DVec3,
    steps: i32,
) -> Option<Point> {
    let direction = direction.try_normalize()?;
    [SHELL, 2 * SHELL, 4 * SHELL, SHELL / 2, SHELL / 4].into_iter().find_map(|part| {
        let step = (direction * f64::from(steps) / f64::from(part)).to_array();
        let step = step.map(|x| x.round() as i32);
        let point: Point = std::array::from_fn(|a| base[a] + step[a]);
        let strictly_inside = (0..3).all(|a| {
            let low = place.at[a] as i32 * steps;
            low < point[a] && point[a] < low + steps
        });
        let step = step.map(i64::from);
        let seen = normals.iter().all(|&n| dot(n, step) > 0);
        (strictly_inside && seen).then_some(point)
    })
}

/// The cells round each cell that one of its open corners touches, nearest first in order of z, y
/// and x: those that are outside are candidates for filling.
pub fn touching(place: Place, config: Config) -> Vec<[u32; 3]> {
    let mut cells = Vec::new();
    for n in 0..27usize {
        let step = [n % 3, n / 3 % 3, n / 9];
        // A neighbour touches a corner that lies on its side on every axis.
        let touches = (0..8usize)
            .filter(|&c| config.open(c))
            .any(|c| (0..3).all(|a| step[a] == 1 || (step[a] == 2) == (c >> a & 1 == 1)));
        let at = std::array::from_fn(|a| place.at[a] + step[a] as u32 - 1);
        if touches && n != 13 && at.iter().all(|&x| x >= BRICK) {
            cells.push(at);
        }
    }
    cells
}

//! From the loop of an octant to its patch: canonical polylines, and triangles on them.
//!
//! A loop is cut at its break points, the crossings on an edge of any octant: each piece then lies
//! in one face of the finer of the two octants beside it, and both simplify it in the same
//! direction to the same polyline. The polygon so found is filled with triangles that never lie in a
//! face of the octant, nor do their chords, or with a fan round one more vertex (a Steiner vertex)
//! inside it. A patch is taken only where the tube proves it and no two of its triangles meet.
//!
//! Source: the specification's A.8, steps 3 to 5; polylines and triangles in Nishio, Kobori and
//! Kutsuwa 1997, sections 3.2 and 3.3.

use super::cells::{Cells, STEPS};
use super::octant::{Octant, Step, planes};
use super::piece::Piece;
use super::tube::{Face, Tube};
use crate::octree::VertexName;
use crate::quadric::Quadric;
use crate::surface::cell::PATCHES;
use glam::DVec3;
use std::ops::Range;

/// Polygons with more vertices are not tried without a Steiner vertex.
const MOST_CHORDS: usize = 24;

/// Polygons with more vertices are not tried at all.
const MOST_VERTICES: usize = 64;

/// A vertex of an octant's polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    pub name: VertexName,
    pub at: [f64; 3],
}

/// The surface of one octant, certified.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// The boundary; for a single cell, the vertices of all its loops.
    pub polygon: Vec<Vertex>,
    /// One more vertex inside.
    pub steiner: Option<[f64; 3]>,
    /// Triangles on the polygon's vertices; the Steiner vertex follows them.
    pub triangles: Vec<[u8; 3]>,
    /// Pieces of the surface, and the triangle near which each lies whole.
    pub pieces: Vec<(Piece, u32)>,
}

/// Simplifies a loop between its break points to within `tolerance`.
pub fn polygon(
    cells: &Cells,
    steps: &[Step],
    tolerance: f64,
    mut is_break: impl FnMut(&Step) -> bool,
) -> Vec<Vertex> {
    let at: Vec<DVec3> =
        steps.iter().map(|s| cells.crossing(s.cell, s.edge.into()).into()).collect();
    let count = steps.len();
    let mut breaks: Vec<usize> = (0..count)
        .filter(|&i| steps[i].face != steps[(i + count - 1) % count].face || is_break(&steps[i]))
        .collect();
    if breaks.len() < 2 {
        // A loop within one face: its first and last points, whoever looks at it.
        let order = |&i: &usize, &j: &usize| {
            at[i].to_array().partial_cmp(&at[j].to_array()).unwrap_or(std::cmp::Ordering::Equal)
        };
        breaks.extend((0..count).min_by(order));
        breaks.extend((0..count).max_by(order));
        breaks.sort_unstable();
        breaks.dedup();
    }
    let mut kept = Vec::new();
    let mut chain = Vec::new();
    for (i, &start) in breaks.iter().enumerate() {
        let end = breaks.get(i + 1).copied().unwrap_or(breaks[0] + count);
        chain.clear();
        chain.extend((start..=end).map(|i| at[i % count]));
        let first = kept.len();
        simplify(&chain, tolerance, &mut kept);
        kept[first..].iter_mut().for_each(|k| *k = (*k + start) % count);
    }
    kept.iter().map(|&i| Vertex { name: steps[i].name(cells), at: at[i].to_array() }).collect()
}

/// Adds the places that a chain keeps, but for its last: those of Douglas and Peucker 1973, with
/// distances to segments, taken from its smaller end.
fn simplify(chain: &[DVec3], tolerance: f64, kept: &mut Vec<usize>) {
    let last = chain.len() - 1;
    let turned = chain[last].to_array() < chain[0].to_array();
    let at = |i: usize| chain[if turned { last - i } else { i }];
    // Chains in two faces of an octant must not both fall onto the edge between them.
    let way = chain[last] - chain[0];
    let is_level = way.to_array().iter().filter(|&&x| x == 0.0).count() == 2;
    let first = kept.len();
    let mut stack = vec![(0, last)];
    kept.push(0);
    while let Some((a, b)) = stack.pop() {
        let (p, d) = (at(a), at(b) - at(a));
        let length = d.length_squared();
        let tolerance = if (a, b) == (0, last) && is_level { 0.0 } else { tolerance };
        let mut farthest = (tolerance * tolerance, None);
        for i in a + 1..b {
            let r = at(i) - p;
            let along = if length > 0.0 { (r.dot(d) / length).clamp(0.0, 1.0) } else { 0.0 };
            let distance = (r - d * along).length_squared();
            if distance > farthest.0 {
                farthest = (distance, Some(i));
            }
        }
        if let Some(i) = farthest.1 {
            kept.push(i);
            stack.extend([(a, i), (i, b)]);
        }
    }
    let found = &mut kept[first..];
    if turned {
        // The start was noted as 0; its mirror image is the end, which is left out.
        found.iter_mut().skip(1).for_each(|i| *i = last - *i);
    }
    found.sort_unstable();
}

/// The patch of a single cell: the surface itself.
pub fn of_cell(cells: &Cells, cell: u32) -> Patch {
    let mut polygon: Vec<Vertex> = Vec::new();
    let mut places = [u8::MAX; 12];
    let triangles: Vec<[u8; 3]> = PATCHES[cells.mask(cell)]
        .triangles()
        .iter()
        .map(|t| {
            t.map(|edge| {
                let place = &mut places[edge as usize];
                if *place == u8::MAX {
                    *place = polygon.len() as u8;
                    let step = Step { cell, edge, face: 0 };
                    let at = cells.crossing(cell, edge.into());
                    polygon.push(Vertex { name: step.name(cells), at });
                }
                *place
            })
        })
        .collect();
    let pieces = (0..triangles.len()).map(|t| (Piece::triangle(cell, t), t as u32)).collect();
    Patch { polygon, steiner: None, triangles, pieces }
}

/// Fills the polygon of an octant; `None` where no filling is proved.
pub fn fill(tube: &Tube, octant: Octant, range: Range<u32>, polygon: Vec<Vertex>) -> Option<Patch> {
    let count = polygon.len();
    if !(3..=MOST_VERTICES).contains(&count) {
        return None;
    }
    let bounds = octant.bounds(tube.cells);
    let surface = Piece::of_octant(tube.cells, octant, range.clone());
    let mut points: Vec<DVec3> = polygon.iter().map(|v| v.at.into()).collect();
    if let Some(triangles) = by_chords(&points, bounds)
        && let Some(pieces) = prove(tube, &surface, &points, &triangles)
    {
        return Some(Patch { polygon, steiner: None, triangles, pieces });
    }
    let fan: Vec<[u8; 3]> =
        (0..count).map(|i| [i as u8, ((i + 1) % count) as u8, count as u8]).collect();
    for steiner in steiners(tube, range.clone(), &points, bounds) {
        points.truncate(count);
        points.push(steiner);
        if let Some(pieces) = prove(tube, &surface, &points, &fan) {
            let steiner = Some(steiner.to_array());
            return Some(Patch { polygon, steiner, triangles: fan, pieces });
        }
    }
    None
}

/// The triangulation of a polygon of least area without a chord or a triangle in a face of the
/// octant, by dynamic programming (Klincsek 1980).
fn by_chords(points: &[DVec3], bounds: [[u32; 3]; 2]) -> Option<Vec<[u8; 3]>> {
    let count = points.len();
    if count > MOST_CHORDS {
        return None;
    }
    let on: Vec<u8> = points.iter().map(|p| planes(bounds, p.to_array())).collect();
    let is_side = |i: usize, j: usize| j - i == 1 || j - i == count - 1;
    let mut cost = [[f64::INFINITY; MOST_CHORDS]; MOST_CHORDS];
    let mut apex = [[0u8; MOST_CHORDS]; MOST_CHORDS];
    for length in 1..count {
        for i in 0..count - length {
            let j = i + length;
            if !is_side(i, j) && on[i] & on[j] != 0 {
                continue;
            }
            if length == 1 {
                cost[i][j] = 0.0;
                continue;
            }
            for k in i + 1..j {
                // A triangle in a face could be that of the octant behind it, too.
                if on[i] & on[k] & on[j] != 0 {
                    continue;
                }
                let area = (points[k] - points[i]).cross(points[j] - points[i]).length();
                let sum = cost[i][k] + cost[k][j] + area;
                if sum < cost[i][j] {
                    (cost[i][j], apex[i][j]) = (sum, k as u8);
                }
            }
        }
    }
    if !cost[0][count - 1].is_finite() {
        return None;
    }
    let mut triangles = Vec::with_capacity(count - 2);
    let mut stack = vec![(0, count - 1)];
    while let Some((i, j)) = stack.pop() {
        if j - i > 1 {
            let k = apex[i][j] as usize;
            triangles.push([i as u8, k as u8, j as u8]);
            stack.extend([(i, k), (k, j)]);
        }
    }
    Some(triangles)
}

/// Vertices inside the octant to try as the middle of a fan: the point nearest to the planes of
/// all triangles of the surface (Garland and Heckbert 1997; the corner, where there is one), and
/// the surface point nearest to the polygon's middle.
fn steiners(tube: &Tube, range: Range<u32>, points: &[DVec3], bounds: [[u32; 3]; 2]) -> Vec<DVec3> {
    let middle = points.iter().sum::<DVec3>() / points.len() as f64;
    let mut planes = Quadric::default();
    let mut nearest = (f64::INFINITY, middle);
    for cell in range {
        for [a, b, c] in tube.cells.triangles(cell) {
            let area = (b - a).cross(c - a);
            if let Some(normal) = area.try_normalize() {
                // Near the origin the sums lose no digits.
                planes += Quadric::plane(normal, a - middle, area.length());
            }
            for p in [a, b, c] {
                if p.distance_squared(middle) < nearest.0 {
                    nearest = (p.distance_squared(middle), p);
                }
            }
        }
    }
    // A little pull to the middle settles directions that no plane speaks for.
    let corner = planes.lowest(DVec3::ZERO, 1e-3).map(|p| middle + p);
    let [low, high] = bounds.map(|b| DVec3::from(b.map(f64::from)));
    let margin = 1.0 / STEPS;
    corner
        .into_iter()
        .chain([nearest.1])
        .map(|p| ((p * STEPS).round() / STEPS).clamp(low + margin, high - margin))
        .collect()
}

/// Proves a patch: no two of its triangles meet outside what they share, and the surface in the
/// octant and the patch are near each other. Gives the pieces of the surface with their triangles.
fn prove(
    tube: &Tube,
    surface: &[Piece],
    points: &[DVec3],
    triangles: &[[u8; 3]],
) -> Option<Vec<(Piece, u32)>> {
    let mut faces = Vec::with_capacity(triangles.len());
    for t in triangles {
        faces.push(Face::stout(t.map(|i| points[i as usize]))?);
    }
    let mut pieces = Vec::with_capacity(surface.len());
    if !surface.iter().all(|&piece| tube.attach(piece, &faces, &mut pieces)) {
        return None;
    }
    (is_embedded(points, &faces, triangles) && faces.iter().all(|f| tube.holds(f)))
        .then_some(pieces)
}

fn is_embedded(points: &[DVec3], faces: &[Face], triangles: &[[u8; 3]]) -> bool {
    let points: Vec<[f64; 3]> = points.iter().map(DVec3::to_array).collect();
    let names = |t: usize| triangles[t].map(u32::from);
    (1..triangles.len())
        .all(|b| (0..b).all(|a| !faces[a].meets(names(a), &faces[b], names(b), &points)))
}

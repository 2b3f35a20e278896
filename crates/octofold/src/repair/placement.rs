//! Where the input wants the vertices: on its faces, creases and corners.
//!
//! In each cell the facets, clipped to the cell, fall into planes of about one direction; the vertex
//! goes where the sum of squared distances to these is least, and where that leaves it free, to the
//! middle of the input in the cell. It never leaves the cell: where the least point lies outside, the
//! least point of the cell is taken. Source: specification of repair (A.1.7, D.7).

use super::bricks::{Bricks, Place, coordinates};
use super::content::Content;
use super::frame::Frame;
use super::piercing::{Guide, Target};
use crate::measure::nearest_on;
use crate::quadric::Quadric;
use crate::scan::Facet;
use glam::DVec3;
use std::ops::Range;

/// The input as a guide.
pub struct Placement<'a> {
    content: &'a Content,
    bricks: &'a Bricks,
    ranges: &'a [Range<usize>],
    steps: f64,
    sub_bits: u32,
}

/// How strongly a vertex is held in the middle where planes leave it free.
const PULL: f64 = 1e-3;

/// Facets whose normals are nearer to each other than this count as one plane (20 degrees).
const SAME_PLANE: f64 = 0.94;

/// A point is on all planes where the sum of squared distances, in cells, is below this.
const ON_ALL: f64 = 1e-3;

/// A vertex further than this from the input, in cells, goes to its nearest point.
const OFF: f64 = 0.25;

/// Planes that are told apart.
const MOST_PLANES: usize = 8;

impl<'a> Placement<'a> {
    /// The facets of the input; `ranges` are their touches brick by brick.
    pub fn new(
        content: &'a Content,
        bricks: &'a Bricks,
        ranges: &'a [Range<usize>],
        frame: &Frame,
    ) -> Self {
        let (steps, sub_bits) = (f64::from(frame.steps), frame.lattice.sub_bits());
        Self { content, bricks, ranges, steps, sub_bits }
    }

    /// Output steps along an edge of a cell.
    pub fn steps(&self) -> f64 {
        self.steps
    }

    /// A facet, its corners in sub-steps.
    pub fn facet(&self, number: u32) -> &Facet {
        &self.content.facets[number as usize]
    }

    /// The facets that touch a cell, with their numbers.
    pub fn facets(&self, place: Place) -> impl Iterator<Item = (u32, &Facet)> {
        let range = self.ranges[place.brick as usize].clone();
        let numbers = self.content.facets_in(range, place.cell);
        numbers.map(|f| (f, self.facet(f)))
    }

    /// A point in sub-steps, from the low corner of a cell.
    fn offset(&self, p: [i32; 3], at: [u32; 3]) -> [i64; 3] {
        [0, 1, 2].map(|a| i64::from(p[a]) - (i64::from(at[a]) << self.sub_bits))
    }

    /// A point in sub-steps with a cell as the unit cube.
    pub fn local_point(&self, p: [i32; 3], at: [u32; 3]) -> DVec3 {
        let size = f64::from(1u32 << self.sub_bits);
        DVec3::from_array(self.offset(p, at).map(|x| x as f64)) / size
    }

    /// The corners of a facet with the cell as the unit cube.
    pub fn local(&self, facet: &Facet, at: [u32; 3]) -> [DVec3; 3] {
        facet.map(|p| self.local_point(p, at))
    }

    /// Where a facet crosses the edge that leaves the low corner of a cell along `axis`, in cells.
    /// The edge is taken as moved by less than anything, so that of all facets round a point of a
    /// sheet exactly one is crossed.
    pub fn crossing(&self, facet: u32, at: [u32; 3], axis: usize) -> Option<f64> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corners = self.facet(facet).map(|p| self.offset(p, at).map(i128::from));
        let mut weights = [0; 3];
        let mut sides = [0; 3];
        for i in 0..3 {
            let (p, q) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
            weights[i] = p[u] * q[v] - p[v] * q[u];
            let ties = [weights[i], p[v] - q[v], q[u] - p[u]];
            sides[i] = ties.iter().map(|t| t.signum()).find(|&t| t != 0)?;
        }
        let sum: i128 = weights.iter().sum();
        if sum == 0 || sides[0] != sides[1] || sides[1] != sides[2] {
            return None;
        }
        let height = (0..3).map(|i| corners[i][axis] * weights[i]).sum::<i128>() * sum.signum();
        let size = sum.abs() << self.sub_bits;
        (0..size).contains(&height).then(|| height as f64 / size as f64)
    }
}

impl Placement<'_> {
    /// The point of the picked facets of a cell that is nearest to `p`.
    fn nearest(&self, place: Place, p: DVec3, pick: impl Fn(u32) -> bool) -> DVec3 {
        let points = self.facets(place).filter(|f| pick(f.0)).map(|(_, facet)| {
            let corners = self.local(facet, place.at).map(|c| c.to_array());
            DVec3::from_array(nearest_on(corners, p.to_array()))
        });
        let nearer = |a: DVec3, b: DVec3| {
            if p.distance_squared(b) < p.distance_squared(a) { b } else { a }
        };
        points.reduce(nearer).unwrap_or(p)
    }
}

/// Facets of about one direction in a cell.
#[derive(Clone, Copy)]
struct Plane {
    normal: DVec3,
    quadric: Quadric,
}

impl Placement<'_> {
    /// Where the vertex of a cell should be for the picked facets; `rims` are borders of the input
    /// on which it should lie, two points of each, with the cell as the unit cube.
    pub fn fit(&self, place: Place, rims: &[[DVec3; 2]], pick: impl Fn(u32) -> bool) -> Target {
        let mut planes: [Option<Plane>; MOST_PLANES] = [None; MOST_PLANES];
        let (mut sum, mut area) = (DVec3::ZERO, 0.0);
        let mut touched = DVec3::ZERO;
        let mut count = 0.0;
        for (_, facet) in self.facets(place).filter(|f| pick(f.0)) {
            let corners = self.local(facet, place.at);
            touched += corners[0].clamp(DVec3::ZERO, DVec3::ONE);
            count += 1.0;
            let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let Some(normal) = across.try_normalize() else { continue };
            let (clipped, weight) = clip(corners, normal);
            if weight <= 0.0 {
                continue;
            }
            sum += clipped * weight;
            area += weight;
            let quadric = Quadric::plane(normal, corners[0], weight);
            let near =
                planes.iter_mut().flatten().find(|p| p.normal.dot(normal).abs() > SAME_PLANE);
            if let Some(plane) = near {
                plane.quadric += quadric;
            } else if let Some(free) = planes.iter_mut().find(|p| p.is_none()) {
                *free = Some(Plane { normal, quadric });
            }
        }
        if area <= 0.0 {
            let at = if count > 0.0 { touched / count } else { DVec3::splat(0.5) };
            return Target { at: (at * self.steps).to_array(), rank: u8::from(count > 0.0) };
        }
        let home = sum / area;
        if !rims.is_empty() {
            let widest = planes
                .iter()
                .flatten()
                .max_by(|a, b| a.quadric.weight().total_cmp(&b.quadric.weight()));
            let across = widest.map_or(DVec3::ZERO, |p| p.normal);
            for [p, q] in rims {
                let Some(normal) = (*q - *p).cross(across).try_normalize() else { continue };
                if let Some(free) = planes.iter_mut().find(|p| p.is_none()) {
                    *free = Some(Plane { normal, quadric: Quadric::plane(normal, *p, area) });
                }
            }
        }
        let found = planes.iter().flatten().count();
        let all = planes.iter().flatten();
        let alike = sum_of(all.clone().map(|p| p.quadric * (1.0 / p.quadric.weight())));
        let meeting = least(&alike, home).filter(|&at| found < 2 || alike.at(at) < ON_ALL);
        let (at, rank) = match meeting {
            Some(at) => (at, found.min(3) as u8),
            // Planes that only graze the cell must not pull as hard as those that fill it.
            None => (least(&sum_of(all.map(|p| p.quadric)), home).unwrap_or(home), 1),
        };
        // Planes may meet where the input does not reach.
        let (at, rank) = if found > 1 && self.nearest(place, at, &pick).distance(at) > OFF {
            (self.nearest(place, home, &pick), 1)
        } else {
            (at, rank)
        };
        let at = at.clamp(DVec3::ZERO, DVec3::ONE);
        Target { at: (at * self.steps).to_array(), rank }
    }
}

impl Guide for Placement<'_> {
    fn target(&self, place: Place) -> Target {
        self.fit(place, &[], |_| true)
    }

    fn crossings(&self, place: Place, axis: usize) -> Option<[f64; 2]> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let inside = coordinates(place.cell);
        let mut span: Option<[f64; 2]> = None;
        for round in 0..4 {
            let mut local = inside.map(|x| x as i32);
            local[u] -= round & 1;
            local[v] -= round >> 1;
            let Some(beside) = self.bricks.place(place.brick, local) else { continue };
            for (_, facet) in self.facets(beside) {
                if let Some(t) = crossing(self.local(facet, place.at), axis) {
                    let [low, high] = span.unwrap_or([t; 2]);
                    span = Some([low.min(t), high.max(t)]);
                }
            }
        }
        span.map(|s| s.map(|t| t * self.steps))
    }
}

fn sum_of(quadrics: impl Iterator<Item = Quadric>) -> Quadric {
    let mut sum = Quadric::default();
    quadrics.for_each(|q| sum += q);
    sum
}

/// The least point of a sum of quadrics, in the unit cube where it lies outside.
fn least(sum: &Quadric, home: DVec3) -> Option<DVec3> {
    let free = sum.lowest(home, PULL)?;
    if is_inside(free) { Some(free) } else { Some(sum.lowest_in_cube(home, PULL)) }
}

fn is_inside(p: DVec3) -> bool {
    p.min_element() >= 0.0 && p.max_element() <= 1.0
}

/// The middle and the area of what a triangle has in the unit cube.
fn clip(corners: [DVec3; 3], normal: DVec3) -> (DVec3, f64) {
    let low = corners[0].min(corners[1]).min(corners[2]);
    let high = corners[0].max(corners[1]).max(corners[2]);
    let mut polygon = [DVec3::ZERO; 9];
    polygon[..3].copy_from_slice(&corners);
    let mut count = 3;
    for axis in 0..3 {
        if low[axis] < 0.0 {
            count = cut(&mut polygon, count, |p| p[axis]);
        }
        if high[axis] > 1.0 {
            count = cut(&mut polygon, count, |p| 1.0 - p[axis]);
        }
    }
    let (mut sum, mut area) = (DVec3::ZERO, 0.0);
    for i in 1..count.max(2) - 1 {
        let (a, b, c) = (polygon[0], polygon[i], polygon[i + 1]);
        let part = (b - a).cross(c - a).dot(normal) / 2.0;
        sum += (a + b + c) * (part / 3.0);
        area += part;
    }
    if area > 0.0 { (sum / area, area) } else { (DVec3::ZERO, 0.0) }
}

/// Keeps the part of a convex polygon where `height` is not negative.
fn cut(polygon: &mut [DVec3; 9], count: usize, height: impl Fn(DVec3) -> f64) -> usize {
    let mut kept = [DVec3::ZERO; 9];
    let mut n = 0;
    for i in 0..count {
        let (p, q) = (polygon[i], polygon[(i + 1) % count]);
        let (a, b) = (height(p), height(q));
        if a >= 0.0 && n < 9 {
            kept[n] = p;
            n += 1;
        }
        if (a < 0.0) != (b < 0.0) && n < 9 {
            kept[n] = p + (q - p) * (a / (a - b));
            n += 1;
        }
    }
    *polygon = kept;
    n
}

/// Where the edge of the unit cube along `axis` from its low corner crosses a triangle.
fn crossing(corners: [DVec3; 3], axis: usize) -> Option<f64> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = corners.map(|p| [p[u], p[v]]);
    let area = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
    let weights = [area(flat[1], flat[2]), area(flat[2], flat[0]), area(flat[0], flat[1])];
    let sum: f64 = weights.iter().sum();
    let one_side = weights.iter().all(|&w| w >= 0.0) || weights.iter().all(|&w| w <= 0.0);
    if sum == 0.0 || !one_side {
        return None;
    }
    let t = (0..3).map(|i| corners[i][axis] * weights[i]).sum::<f64>() / sum;
    (0.0..=1.0).contains(&t).then_some(t)
}

//! The input as a guide for sheets: how it pierces edges, how its traces run on faces, and where its
//! own borders are.

use super::super::bricks::{Bricks, Place, coordinates};
use super::super::content::Rims;
use super::super::piercing::Target;
use super::super::placement::Placement;
use super::complex::Edge;
use super::guide::{CANONICAL, Leaf, PARALLEL, Pairing, Piercing, SheetGuide};
use crate::measure::nearest_on;
use crate::scan::Facet;
use crate::sets::Sets;
use glam::{DVec2, DVec3};

/// The input, its borders, and the grid.
pub struct Traced<'a> {
    /// Its facets.
    pub placement: &'a Placement<'a>,
    /// Its borders.
    pub rims: &'a Rims,
    /// The grid.
    pub bricks: &'a Bricks,
    /// Parallel walls nearer to each other than twice as many cells are one.
    pub rounds: u32,
}

/// Facets round one edge that are told apart; beyond, each counts as a part of its own.
const MOST_FACETS: usize = 256;

/// Traces on one face that are told apart; beyond, all are one.
const MOST_TRACES: usize = 64;

/// Walls nearer to each other than this, in cells, are one.
const APART: f64 = 0.05;

/// Walls are square to each other, nearly, where the cosine between their normals is below this.
const ACROSS: f64 = 0.3;

/// Traces nearer to each other than this, in cells, hang together.
const TOUCH: f64 = 1e-7;

impl Traced<'_> {
    /// The four cells round an edge.
    fn round(&self, Edge { place, axis }: Edge) -> impl Iterator<Item = Place> + '_ {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        (0..4).filter_map(move |n| {
            let mut local = coordinates(place.cell).map(|x| x as i32);
            local[u] -= n & 1;
            local[v] -= n >> 1;
            self.bricks.place(place.brick, local)
        })
    }

    /// The facets round an edge, each once.
    fn facets_round(&self, edge: Edge) -> Vec<u32> {
        let mut facets: Vec<u32> =
            self.round(edge).flat_map(|p| self.placement.facets(p).map(|f| f.0)).collect();
        facets.sort_unstable();
        facets.dedup();
        facets
    }

    /// The facets among `facets` that pierce an edge, and where, in cells from its low end.
    fn pierce(&self, facets: &[u32], edge: Edge) -> Vec<(u32, f64)> {
        let at = |f: u32| self.placement.crossing(f, edge.place.at, edge.axis);
        facets.iter().filter_map(|&f| Some((f, at(f)?))).collect()
    }
}

impl SheetGuide for Traced<'_> {
    fn vertex(&self, place: Place, leaf: &Leaf, up: Option<DVec3>) -> Target {
        let rims = if leaf.rim { self.rims_near(place) } else { Vec::new() };
        let mut own: Vec<(u32, f64)> = Vec::new();
        let mut double = false;
        if !leaf.alone || up.is_none() {
            for edge in self.edges(place, leaf) {
                let pierced = self.pierce(&self.facets_round(edge), edge);
                double |= pierced.len() > 1 && self.is_double(&pierced);
                own.extend(pierced);
            }
        }
        if !leaf.alone && !own.is_empty() {
            return self.placement.fit(place, &rims, |f| own.iter().any(|p| p.0 == f));
        }
        if up.is_some() || double {
            let discarded = self.discarded(place, up);
            return self.placement.fit(place, &rims, |f| !discarded.contains(&f));
        }
        self.placement.fit(place, &rims, |_| true)
    }

    fn holds(&self, edge: Edge, up: Option<DVec3>) -> bool {
        let facets = self.facets_round(edge);
        let pierced = self.pierce(&facets, edge);
        if pierced.is_empty() || self.sheet_through(&facets, &pierced, edge).is_none() {
            return false;
        }
        pierced.iter().any(|&(f, t)| !self.is_surplus(f, t, edge, up))
    }

    fn piercing(&self, edge: Edge) -> Piercing {
        let facets = self.facets_round(edge);
        let pierced = self.pierce(&facets, edge);
        if pierced.is_empty() {
            return Piercing::NONE;
        }
        let steps = self.placement.steps();
        let low = pierced.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let high = pierced.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        let facet = self.sheet_through(&facets, &pierced, edge);
        Piercing {
            at: Some((low + high) / 2.0 * steps),
            odd: facet.is_some(),
            normal: facet.map_or(DVec3::ZERO, |f| normal(self.placement.facet(f))),
        }
    }

    fn pairing(&self, place: Place, axis: usize) -> Pairing {
        let traces: Vec<[DVec2; 2]> = self
            .placement
            .facets(place)
            .filter_map(|(_, facet)| trace(self.placement.local(facet, place.at), axis))
            .take(MOST_TRACES + 1)
            .collect();
        if traces.len() > MOST_TRACES {
            return Pairing::Junction;
        }
        let mut sets = Sets::singles(traces.len());
        for i in 0..traces.len() {
            for j in 0..i {
                if meet(traces[i], traces[j]) {
                    sets.join(i as u32, j as u32);
                }
            }
        }
        // Sides in order round the face, side k between corners k and k + 1.
        let on = |side: usize, p: DVec2| match side {
            0 => p.y < TOUCH,
            1 => p.x > 1.0 - TOUCH,
            2 => p.y > 1.0 - TOUCH,
            _ => p.x < TOUCH,
        };
        let mut reach = |side: usize| {
            let mut found: Vec<u32> = (0..traces.len())
                .filter(|&i| traces[i].iter().any(|&p| on(side, p)))
                .map(|i| sets.root(i as u32))
                .collect();
            found.sort_unstable();
            found.dedup();
            found
        };
        let reached: [Vec<u32>; 4] = std::array::from_fn(&mut reach);
        let linked = |a: usize, b: usize| reached[a].iter().any(|s| reached[b].contains(s));
        let [l01, l12, l23, l30] = [linked(0, 1), linked(1, 2), linked(2, 3), linked(3, 0)];
        if linked(0, 2) || linked(1, 3) {
            Pairing::Junction
        } else if l01 && l23 && !l12 && !l30 {
            Pairing::Odd
        } else if l12 && l30 && !l01 && !l23 {
            Pairing::Even
        } else {
            Pairing::Junction
        }
    }
}

impl Traced<'_> {
    /// The edges of a leaf.
    fn edges(&self, place: Place, leaf: &Leaf) -> impl Iterator<Item = Edge> {
        let edges = leaf.edges;
        let own = (0..12).filter(move |e| edges >> e & 1 == 1);
        own.filter_map(move |e| Edge::of_cell(self.bricks, place, e))
    }

    /// Whether an edge is pierced in more places than one by walls that are parallel.
    fn is_double(&self, pierced: &[(u32, f64)]) -> bool {
        let (first, at) = pierced[0];
        let own = normal(self.placement.facet(first));
        pierced[1..].iter().any(|&(f, t)| {
            (t - at).abs() > APART && normal(self.placement.facet(f)).dot(own).abs() > PARALLEL
        })
    }

    /// The facets of a cell that belong to the walls of parallel ones that are not kept: those
    /// further up than half of the way from the lowest to the highest.
    fn discarded(&self, place: Place, up: Option<DVec3>) -> Vec<u32> {
        let facets: Vec<(u32, DVec3, DVec3)> = self
            .placement
            .facets(place)
            .map(|(f, facet)| (f, normal(facet), self.placement.local_point(facet[0], place.at)))
            .collect();
        let Some(up) = up.or_else(|| facets.first().map(|f| upward(f.1))) else {
            return Vec::new();
        };
        let along = |n: &DVec3| n.dot(up).abs() > PARALLEL;
        let height = |n: &DVec3, on: &DVec3| n.dot(*on - 0.5) / n.dot(up);
        let parallel = facets.iter().filter(|f| along(&f.1));
        let heights: Vec<(u32, f64)> = parallel.map(|f| (f.0, height(&f.1, &f.2))).collect();
        let low = heights.iter().map(|h| h.1).fold(f64::INFINITY, f64::min);
        let high = heights.iter().map(|h| h.1).fold(f64::NEG_INFINITY, f64::max);
        if high - low < APART {
            return Vec::new();
        }
        let middle = f64::midpoint(low, high);
        heights.into_iter().filter(|h| h.1 > middle).map(|h| h.0).collect()
    }

    /// Whether a facet that pierces an edge at `t` lies above a parallel one within the thickness, or
    /// joins two parallel ones across it.
    fn is_surplus(&self, facet: u32, t: f64, edge: Edge, up: Option<DVec3>) -> bool {
        let own = normal(self.placement.facet(facet));
        let mut at = DVec3::ZERO;
        at[edge.axis] = t;
        let up = up.filter(|u| u.dot(own).abs() > PARALLEL).map_or_else(
            || upward(own),
            |u| {
                if u.dot(own) < 0.0 { -own } else { own }
            },
        );
        let reach = self.rounds as i32 + 1;
        let thick = 2.0 * f64::from(self.rounds);
        let inside = coordinates(edge.place.cell).map(|x| x as i32);
        let span = -reach..=reach;
        let mut across: Vec<(DVec3, f64)> = Vec::new();
        for z in span.clone() {
            for y in span.clone() {
                for x in span.clone() {
                    let local = [inside[0] + x, inside[1] + y, inside[2] + z];
                    let Some(beside) = self.bricks.place(edge.place.brick, local) else { continue };
                    for (_, other) in self.placement.facets(beside) {
                        let corners = self.placement.local(other, edge.place.at);
                        let n = normal(other);
                        let below = n.dot(corners[0] - at) / n.dot(up);
                        if n.dot(own).abs() > PARALLEL {
                            let foot = at + up * below;
                            if (-thick..-APART).contains(&below) && is_over(corners, foot) {
                                return true;
                            }
                        } else if n.dot(own).abs() < ACROSS {
                            across.push((n, n.dot(corners[0] - at)));
                        }
                    }
                }
            }
        }
        // A flange: walls on both sides, not further from each other than sheets are thick.
        across.iter().enumerate().any(|(i, &(n, a))| {
            across[..i].iter().any(|&(m, b)| {
                let b = if m.dot(n) < 0.0 { -b } else { b };
                m.dot(n).abs() > PARALLEL && (a > 0.0) != (b > 0.0) && (a - b).abs() < thick
            })
        })
    }

    /// A facet of a sheet that goes from one side of the edge to the other. Where two parallel walls
    /// hang together round the edge, as at the border of a thin plate, they are one sheet through it;
    /// the tip of a fold is none.
    fn sheet_through(&self, facets: &[u32], pierced: &[(u32, f64)], edge: Edge) -> Option<u32> {
        self.odd_part(facets, pierced, edge).or_else(|| {
            let first = pierced[0].0;
            let own = normal(self.placement.facet(first));
            let square = |&f: &u32| normal(self.placement.facet(f)).dot(own).abs() < ACROSS;
            (self.is_double(pierced) && facets.iter().any(square)).then_some(first)
        })
    }

    /// A facet of a part that pierces the edge an odd number of times. Parts are facets that hang
    /// together within the four cells round the edge.
    fn odd_part(&self, facets: &[u32], pierced: &[(u32, f64)], edge: Edge) -> Option<u32> {
        if pierced.len() == 1 || facets.len() > MOST_FACETS {
            return Some(pierced[0].0);
        }
        let mut sets = Sets::singles(facets.len());
        let mut sides: Vec<([[i32; 3]; 2], u32)> = Vec::with_capacity(3 * facets.len());
        for (i, &f) in facets.iter().enumerate() {
            let [a, b, c] = *self.placement.facet(f);
            sides.extend([[a, b], [b, c], [a, c]].map(|side| (side, i as u32)));
        }
        sides.sort_unstable();
        let [u, v] = [(edge.axis + 1) % 3, (edge.axis + 2) % 3];
        for alike in sides.chunk_by(|a, b| a.0 == b.0) {
            let [p, q] = alike[0].0.map(|p| self.placement.local_point(p, edge.place.at));
            let (mut low, mut high) = (DVec3::ZERO, DVec3::ONE);
            (low[u], low[v]) = (-1.0, -1.0);
            (high[u], high[v]) = (1.0, 1.0);
            if alike.len() > 1 && passes(p, q, low, high) {
                for other in &alike[1..] {
                    sets.join(alike[0].1, other.1);
                }
            }
        }
        let mut part = |f: u32| facets.binary_search(&f).map_or(0, |i| sets.root(i as u32));
        let parts: Vec<u32> = pierced.iter().map(|p| part(p.0)).collect();
        let odd = |i: &usize| parts.iter().filter(|&&s| s == parts[*i]).count() % 2 == 1;
        (0..parts.len()).find(odd).map(|i| pierced[i].0)
    }

    /// The borders of the input through a cell, or if there are none, those beside it: two points of
    /// each, with the cell as the unit cube.
    fn rims_near(&self, place: Place) -> Vec<[DVec3; 2]> {
        let own = self.rims_in(place, place.at);
        if !own.is_empty() {
            return own;
        }
        let mut near = Vec::new();
        let inside = coordinates(place.cell).map(|x| x as i32);
        for n in (0..27i32).filter(|&n| n != 13) {
            let local = [inside[0] + n % 3 - 1, inside[1] + n / 3 % 3 - 1, inside[2] + n / 9 - 1];
            if let Some(beside) = self.bricks.place(place.brick, local) {
                near.extend(self.rims_in(beside, place.at));
            }
        }
        // The nearest alone: the others are further along.
        let away = |[p, q]: &[DVec3; 2]| {
            let span = *q - *p;
            let t = ((DVec3::splat(0.5) - *p).dot(span) / span.length_squared()).clamp(0.0, 1.0);
            (*p + span * t - 0.5).length_squared()
        };
        near.into_iter().min_by(|a, b| away(a).total_cmp(&away(b))).into_iter().collect()
    }

    fn rims_in(&self, place: Place, at: [u32; 3]) -> Vec<[DVec3; 2]> {
        let rims = self.rims.through(self.bricks, place);
        rims.map(|rim| rim.map(|p| self.placement.local_point(p, at))).collect()
    }
}

fn normal(facet: &Facet) -> DVec3 {
    let [a, b, c] = facet.map(|p| DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero()
}

/// A normal, turned to the canonical side.
fn upward(normal: DVec3) -> DVec3 {
    if normal.dot(CANONICAL) < 0.0 { -normal } else { normal }
}

/// Whether a point in the plane of a triangle lies in it, or not far from it.
fn is_over(corners: [DVec3; 3], p: DVec3) -> bool {
    let near = nearest_on(corners.map(|c| c.to_array()), p.to_array());
    DVec3::from_array(near).distance(p) < 0.25
}

/// What a triangle leaves on the low face of the unit cube along `axis`.
fn trace(corners: [DVec3; 3], axis: usize) -> Option<[DVec2; 2]> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut ends = [DVec2::ZERO; 2];
    let mut count = 0;
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        if (p[axis] < 0.0) != (q[axis] < 0.0) && count < 2 {
            let t = p[axis] / (p[axis] - q[axis]);
            let at = p + (q - p) * t;
            ends[count] = DVec2::new(at[u], at[v]);
            count += 1;
        }
    }
    if count < 2 {
        return None;
    }
    // Clipped to the unit square.
    let span = ends[1] - ends[0];
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for a in 0..2 {
        let (start, step) = (ends[0][a], span[a]);
        if step == 0.0 {
            if !(0.0..=1.0).contains(&start) {
                return None;
            }
        } else {
            let [s, t] = [-start / step, (1.0 - start) / step];
            from = from.max(s.min(t));
            to = to.min(s.max(t));
        }
    }
    (from <= to).then(|| [ends[0] + span * from, ends[0] + span * to])
}

/// Whether two segments meet, or nearly.
fn meet([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    let apart = |x: f64, y: f64| (x > 0.0 && y > 0.0) || (x < 0.0 && y < 0.0);
    let near = |p: DVec2, q: DVec2, r: DVec2| {
        let span = q - p;
        let t = ((r - p).dot(span) / span.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p + span * t).distance(r) < TOUCH
    };
    let crossed = !apart(side(a, b, c), side(a, b, d)) && !apart(side(c, d, a), side(c, d, b));
    let on_one_line = side(a, b, c) == 0.0 && side(a, b, d) == 0.0;
    (crossed && !on_one_line) || near(a, b, c) || near(a, b, d) || near(c, d, a) || near(c, d, b)
}

/// Whether a segment has a point in a box.
fn passes(p: DVec3, q: DVec3, low: DVec3, high: DVec3) -> bool {
    let span = q - p;
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for a in 0..3 {
        if span[a] == 0.0 {
            if p[a] < low[a] || p[a] > high[a] {
                return false;
            }
        } else {
            let [s, t] = [(low[a] - p[a]) / span[a], (high[a] - p[a]) / span[a]];
            from = from.max(s.min(t));
            to = to.min(s.max(t));
        }
    }
    from <= to
}

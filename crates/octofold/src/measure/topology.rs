//! What triangles make of their edges and points: boundary, fans, components, Euler number.
//!
//! Triangles that name a point twice are counted and otherwise left out. Everything is found
//! point by point from the triangles around it, in parallel over blocks of points, so that no
//! edge table is ever sorted or hashed as a whole.

use crate::par;
use crate::run::{Cancelled, Run};
use crate::sets::Sets;

/// How many places are kept per defect.
pub const PLACES: usize = 8;

const BLOCK: usize = 4096;

/// Counts of one mesh, and the first places where something is wrong. Edges are named by their
/// points, the lower one first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Topology {
    /// Points that a triangle uses.
    pub points: usize,
    /// Edges.
    pub edges: usize,
    /// Triangles, those that name a point twice left out.
    pub proper_triangles: usize,
    /// Triangles that name a point twice.
    pub degenerate_triangles: Defect<u32>,
    /// Triangles on the same three points as an earlier one.
    pub duplicate_triangles: Defect<u32>,
    /// Edges with one triangle.
    pub boundary_edges: Defect<[u32; 2]>,
    /// Edges with three triangles or more.
    pub nonmanifold_edges: Defect<[u32; 2]>,
    /// Edges with two triangles that run along it the same way.
    pub misoriented_edges: Defect<[u32; 2]>,
    /// Edges that are run along more often one way than the other.
    pub unbalanced_edges: usize,
    /// Points whose triangles form more than one fan, a fan being held together by shared edges.
    pub nonmanifold_points: Defect<u32>,
    /// Sets of triangles connected across edges.
    pub components: usize,
}

/// How often something is wrong, and the first [`PLACES`] times.
#[derive(Debug, Clone, PartialEq)]
pub struct Defect<T> {
    /// How often.
    pub count: usize,
    /// Where first.
    pub first: Vec<T>,
}

impl<T> Default for Defect<T> {
    fn default() -> Self {
        Self { count: 0, first: Vec::new() }
    }
}

impl<T> Defect<T> {
    fn add(&mut self, place: T) {
        self.count += 1;
        if self.first.len() < PLACES {
            self.first.push(place);
        }
    }

    fn append(&mut self, other: Self) {
        self.count += other.count;
        let room = PLACES - self.first.len();
        self.first.extend(other.first.into_iter().take(room));
    }
}

impl Topology {
    /// Counts everything. Indices must be below `points`.
    pub fn of(points: usize, triangles: &[[u32; 3]], run: &Run) -> Result<Self, Cancelled> {
        let around = Around::new(points, triangles);
        let parts = par::blocks(run, points, BLOCK, |range| {
            let mut part = Part::default();
            let mut desk = Desk::default();
            for p in range {
                part.visit(p as u32, around.triangles(p), triangles, &mut desk);
            }
            part
        })?;
        let mut whole = Self::default();
        for (t, _) in triangles.iter().enumerate().filter(|(_, t)| names_a_point_twice(t)) {
            whole.degenerate_triangles.add(t as u32);
        }
        whole.proper_triangles = triangles.len() - whole.degenerate_triangles.count;
        let mut joined = Sets::singles(triangles.len());
        let mut joins = 0;
        for part in parts {
            joins += part.neighbours.iter().filter(|&&[a, b]| joined.join(a, b)).count();
            whole.append(part.counts);
        }
        whole.components = whole.proper_triangles - joins;
        Ok(whole)
    }

    /// Points minus edges plus triangles.
    pub fn euler(&self) -> i64 {
        self.points as i64 - self.edges as i64 + self.proper_triangles as i64
    }

    /// True where there are triangles and every edge has exactly two.
    pub fn is_closed(&self) -> bool {
        self.proper_triangles > 0
            && self.boundary_edges.count == 0
            && self.nonmanifold_edges.count == 0
    }

    /// True where the two triangles at an edge run along it in opposite ways, at every edge that
    /// has two.
    pub fn is_oriented(&self) -> bool {
        self.misoriented_edges.count == 0
    }

    /// True where no edge has three triangles, no point two fans, and no triangle is repeated.
    pub fn is_manifold(&self) -> bool {
        self.nonmanifold_edges.count == 0
            && self.nonmanifold_points.count == 0
            && self.duplicate_triangles.count == 0
    }

    /// True where every edge is run along as often one way as the other: then the volume is
    /// defined, because it does not depend on where it is measured from.
    pub fn is_balanced(&self) -> bool {
        self.proper_triangles > 0 && self.unbalanced_edges == 0
    }

    /// Handles of all components together; only closed, oriented manifolds have a genus.
    pub fn genus(&self) -> Option<u64> {
        let applies = self.is_closed() && self.is_oriented() && self.is_manifold();
        let doubled = 2 * self.components as i64 - self.euler();
        (applies && doubled >= 0).then_some(doubled as u64 / 2)
    }

    fn append(&mut self, part: Self) {
        self.points += part.points;
        self.edges += part.edges;
        self.unbalanced_edges += part.unbalanced_edges;
        self.duplicate_triangles.append(part.duplicate_triangles);
        self.boundary_edges.append(part.boundary_edges);
        self.nonmanifold_edges.append(part.nonmanifold_edges);
        self.misoriented_edges.append(part.misoriented_edges);
        self.nonmanifold_points.append(part.nonmanifold_points);
    }
}

fn names_a_point_twice([a, b, c]: &[u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// The proper triangles around each point, in order.
struct Around {
    starts: Vec<usize>,
    triangles: Vec<u32>,
}

impl Around {
    fn new(points: usize, triangles: &[[u32; 3]]) -> Self {
        let mut ends = vec![0; points + 1];
        let proper = || triangles.iter().enumerate().filter(|(_, t)| !names_a_point_twice(t));
        for (_, t) in proper() {
            t.iter().for_each(|&p| ends[p as usize + 1] += 1);
        }
        for p in 0..points {
            ends[p + 1] += ends[p];
        }
        let mut next = ends.clone();
        let mut around = vec![0; ends[points]];
        for (i, t) in proper() {
            for &p in t {
                around[next[p as usize]] = i as u32;
                next[p as usize] += 1;
            }
        }
        Self { starts: ends, triangles: around }
    }

    fn triangles(&self, point: usize) -> &[u32] {
        &self.triangles[self.starts[point]..self.starts[point + 1]]
    }
}

/// What one block of points contributes.
#[derive(Default)]
struct Part {
    counts: Topology,
    /// Triangles that share an edge.
    neighbours: Vec<[u32; 2]>,
}

/// Room to work in, kept from point to point.
#[derive(Default)]
struct Desk {
    spokes: Vec<Spoke>,
    opposite: Vec<([u32; 2], u32)>,
    fans: Sets,
}

/// An edge at the point in hand, as one triangle sees it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Spoke {
    /// The point at its other end.
    far: u32,
    /// Position of the triangle among those around the point.
    slot: u32,
    /// True where the triangle runs from the point in hand to `far`.
    outward: bool,
}

impl Part {
    /// Counts the point, the edges to higher points, and the triangles whose lowest point it is.
    fn visit(&mut self, p: u32, around: &[u32], triangles: &[[u32; 3]], desk: &mut Desk) {
        if around.is_empty() {
            return;
        }
        self.counts.points += 1;
        let Desk { spokes, opposite, fans } = desk;
        spokes.clear();
        opposite.clear();
        fans.reset(around.len());
        for (slot, &t) in around.iter().enumerate() {
            let [next, last] = others(triangles[t as usize], p);
            let slot = slot as u32;
            spokes.push(Spoke { far: next, slot, outward: true });
            spokes.push(Spoke { far: last, slot, outward: false });
            if p < next.min(last) {
                opposite.push(([next.min(last), next.max(last)], t));
            }
        }
        spokes.sort_unstable();
        let mut fan_count = around.len();
        for edge in spokes.chunk_by(|a, b| a.far == b.far) {
            fan_count -= edge.windows(2).filter(|w| fans.join(w[0].slot, w[1].slot)).count();
            if p < edge[0].far {
                self.edge([p, edge[0].far], edge);
                let triangle = |s: &Spoke| around[s.slot as usize];
                self.neighbours.extend(edge.windows(2).map(|w| [triangle(&w[0]), triangle(&w[1])]));
            }
        }
        if fan_count > 1 {
            self.counts.nonmanifold_points.add(p);
        }
        opposite.sort_unstable();
        for same in opposite.chunk_by(|a, b| a.0 == b.0) {
            same[1..].iter().for_each(|&(_, t)| self.counts.duplicate_triangles.add(t));
        }
    }

    fn edge(&mut self, ends: [u32; 2], spokes: &[Spoke]) {
        let counts = &mut self.counts;
        counts.edges += 1;
        let outward = spokes.iter().filter(|s| s.outward).count();
        let balanced = 2 * outward == spokes.len();
        counts.unbalanced_edges += usize::from(!balanced);
        match spokes.len() {
            1 => counts.boundary_edges.add(ends),
            2 if !balanced => counts.misoriented_edges.add(ends),
            2 => {}
            _ => counts.nonmanifold_edges.add(ends),
        }
    }
}

/// The two other points of a triangle at `p`, in its winding.
fn others([a, b, c]: [u32; 3], p: u32) -> [u32; 2] {
    if a == p {
        [b, c]
    } else if b == p {
        [c, a]
    } else {
        [a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::{BTreeMap, BTreeSet};

    /// Joins sets that share a member until none do, and counts them.
    fn count_joined<T: Ord + Clone>(mut sets: Vec<BTreeSet<T>>) -> usize {
        let mut count = 0;
        while let Some(mut set) = sets.pop() {
            while let Some(i) = sets.iter().position(|s| !s.is_disjoint(&set)) {
                set.extend(sets.swap_remove(i));
            }
            count += 1;
        }
        count
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn counts_are_those_of_a_plain_recount(
            triangles in prop::collection::vec(prop::array::uniform3(0u32..9), 0..24),
        ) {
            let proper: Vec<[u32; 3]> = triangles.iter().copied()
                .filter(|t| t.iter().collect::<BTreeSet<_>>().len() == 3).collect();
            let mut edges: BTreeMap<[u32; 2], (usize, usize)> = BTreeMap::new();
            for t in &proper {
                for i in 0..3 {
                    let (p, q) = (t[i], t[(i + 1) % 3]);
                    let ways = edges.entry([p.min(q), p.max(q)]).or_default();
                    if p < q { ways.0 += 1 } else { ways.1 += 1 }
                }
            }
            let edge_set = |t: &[u32; 3]| -> BTreeSet<[u32; 2]> {
                (0..3).map(|i| (t[i], t[(i + 1) % 3])).map(|(p, q)| [p.min(q), p.max(q)]).collect()
            };
            let edges_where = |holds: &dyn Fn(usize, usize) -> bool| -> Vec<[u32; 2]> {
                edges.iter().filter(|(_, w)| holds(w.0, w.1)).map(|(&e, _)| e).collect()
            };
            let used: BTreeSet<u32> = proper.iter().flatten().copied().collect();
            let split: Vec<u32> = used.iter().copied().filter(|&p| {
                let spokes = proper.iter().filter(|t| t.contains(&p))
                    .map(|t| edge_set(t).into_iter().filter(|e| e.contains(&p)).collect());
                count_joined(spokes.collect()) > 1
            }).collect();
            let distinct: BTreeSet<BTreeSet<u32>> =
                proper.iter().map(|t| t.iter().copied().collect()).collect();

            let found = Topology::of(9, &triangles, &Run::default()).unwrap();
            prop_assert_eq!(found.points, used.len());
            prop_assert_eq!(found.edges, edges.len());
            prop_assert_eq!(found.proper_triangles, proper.len());
            prop_assert_eq!(found.degenerate_triangles.count, triangles.len() - proper.len());
            prop_assert_eq!(found.duplicate_triangles.count, proper.len() - distinct.len());
            prop_assert_eq!(found.components, count_joined(proper.iter().map(edge_set).collect()));
            for (defect, expected) in [
                (found.boundary_edges, edges_where(&|a, b| a + b == 1)),
                (found.nonmanifold_edges, edges_where(&|a, b| a + b > 2)),
                (found.misoriented_edges, edges_where(&|a, b| a + b == 2 && a != b)),
            ] {
                prop_assert_eq!(defect.count, expected.len());
                prop_assert_eq!(&defect.first[..], &expected[..expected.len().min(PLACES)]);
            }
            prop_assert_eq!(found.unbalanced_edges, edges_where(&|a, b| a != b).len());
            prop_assert_eq!(found.nonmanifold_points.count, split.len());
            prop_assert_eq!(&found.nonmanifold_points.first[..], &split[..split.len().min(PLACES)]);
        }
    }

    #[test]
    fn two_tetrahedra_at_a_point_have_no_genus() {
        let one = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let single = Topology::of(4, &one, &Run::default()).unwrap();
        assert_eq!((single.euler(), single.genus()), (2, Some(0)));
        let other = one.map(|t| t.map(|p| if p == 0 { 0 } else { p + 3 }));
        let both = Topology::of(7, &[one, other].concat(), &Run::default()).unwrap();
        assert_eq!((both.components, both.euler(), both.genus()), (2, 3, None));
        assert!(both.is_closed() && both.is_oriented() && !both.is_manifold());
        assert_eq!(both.nonmanifold_points.first, [0]);
    }
}

//! Crack filling between octants of different size (section 3.5).
//!
//! Two chains between the same ends are walked together. Of their next points the nearer one is
//! put on the other chain; where both are equally near, both move to their middle (G32: with all
//! that share them). The walk goes on until both chains are used up (G30), and a coarse chain is
//! set against all fine ones between its ends (G31). Chains without a counterpart stay as they
//! are (G34), and tolerances are not tested again (G33): so it was published.

use super::super::descent::Sheet;
use super::super::seam::{Insertion, Seam, divided, seams};
use crate::octree::VertexName;
use rustc_hash::FxHashMap;

/// Sheets with their cracks filled.
pub struct Filled {
    /// Triangles by the names of their points.
    pub triangles: Vec<[VertexName; 3]>,
    /// Where points lie that were moved, in lattice points.
    pub moved: FxHashMap<VertexName, [f64; 3]>,
    /// Chains with a counterpart.
    pub seams: usize,
    /// Chains without.
    pub unmatched_chains: usize,
    /// Points put on sides.
    pub points_inserted: usize,
}

/// Fills the cracks between all sheets.
pub fn fill(sheets: &[Sheet], levels: u32) -> Filled {
    let (seams, unmatched_chains) = seams(sheets, levels);
    let mut joined = Joined::default();
    let mut insertions = Vec::new();
    for seam in &seams {
        walk(seam, sheets, &mut joined, &mut insertions);
    }
    let points_inserted = insertions.iter().map(|i| i.points.len()).sum();
    let triangles = divided(sheets, insertions);
    let triangles = triangles.into_iter().map(|t| t.map(|v| joined.name(v))).collect();
    Filled { triangles, moved: joined.moved, seams: seams.len(), unmatched_chains, points_inserted }
}

/// Points that were moved together in pairs.
#[derive(Default)]
struct Joined {
    /// The name that a point gave up, and the one that it goes by now.
    names: FxHashMap<VertexName, VertexName>,
    moved: FxHashMap<VertexName, [f64; 3]>,
}

impl Joined {
    fn name(&self, vertex: VertexName) -> VertexName {
        self.names.get(&vertex).copied().unwrap_or(vertex)
    }

    fn is_free(&self, vertex: VertexName) -> bool {
        !self.names.contains_key(&vertex) && !self.moved.contains_key(&vertex)
    }

    fn join(&mut self, a: VertexName, b: VertexName) {
        let (a, b) = (a.min(b), a.max(b));
        self.names.insert(b, a);
        let [p, q] = [a, b].map(|v| v.low());
        // Points are centres of voxels.
        let middle = std::array::from_fn(|x| (f64::from(p[x]) + f64::from(q[x]) + 1.0) / 2.0);
        self.moved.insert(a, middle);
    }
}

/// One side of a seam: the points from its start to its end, and the edges between them.
struct Side {
    points: Vec<VertexName>,
    /// Sheet and edge of each.
    edges: Vec<(u32, u32)>,
    /// The points put on each edge.
    put: Vec<Vec<VertexName>>,
    /// Points passed.
    at: usize,
}

impl Side {
    fn new(points: Vec<VertexName>, edges: Vec<(u32, u32)>) -> Self {
        let put = vec![Vec::new(); edges.len()];
        Self { points, edges, put, at: 0 }
    }

    fn next(&self) -> VertexName {
        self.points[self.at + 1]
    }

    /// Only the end is ahead.
    fn is_at_end(&self) -> bool {
        self.at + 2 == self.points.len()
    }
}

fn walk(seam: &Seam, sheets: &[Sheet], joined: &mut Joined, insertions: &mut Vec<Insertion>) {
    let chain = &seam.chain;
    let own = (0..chain.edges as usize).map(|i| (chain.sheet, chain.edge(i, sheets)));
    let mut one = Side::new(chain.vertices(sheets).collect(), own.collect());
    let mut points = vec![chain.from(sheets)];
    let mut edges = Vec::new();
    // The other side runs back from the end; it is read from its own end.
    for other in seam.path.iter().rev() {
        points.extend(other.vertices(sheets).rev().skip(1));
        let own = (0..other.edges as usize).rev();
        edges.extend(own.map(|i| (other.sheet, other.edge(i, sheets))));
    }
    let mut two = Side::new(points, edges);
    let mut from = chain.from(sheets);
    loop {
        let (v1, v2) = (one.next(), two.next());
        if joined.name(v1) == joined.name(v2) {
            if one.is_at_end() || two.is_at_end() {
                break;
            }
            from = v1;
            one.at += 1;
            two.at += 1;
            continue;
        }
        let (d1, d2) = (squared(from, v1), squared(from, v2));
        let inner = !one.is_at_end() && !two.is_at_end();
        if d1 == d2 && inner && joined.is_free(v1) && joined.is_free(v2) {
            joined.join(v1, v2);
        } else if one.is_at_end() || (d1 > d2 && !two.is_at_end()) {
            if two.is_at_end() {
                break;
            }
            one.put[one.at].push(v2);
            two.at += 1;
            from = v2;
        } else {
            two.put[two.at].push(v1);
            one.at += 1;
            from = v1;
        }
    }
    let put = |((sheet, edge), points)| Insertion { sheet, edge, points };
    insertions.extend(one.edges.into_iter().zip(one.put).map(put));
    let turned = two.put.into_iter().map(|mut points| {
        points.reverse();
        points
    });
    insertions.extend(two.edges.into_iter().zip(turned).map(put));
}

fn squared(a: VertexName, b: VertexName) -> u64 {
    let (a, b) = (a.low(), b.low());
    (0..3).map(|x| u64::from(a[x].abs_diff(b[x])).pow(2)).sum()
}

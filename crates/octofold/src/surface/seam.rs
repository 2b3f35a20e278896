//! Seams: where the loops of a coarse octant and of finer ones meet on the plane between them.
//!
//! On each face a loop leaves chains of edges. A chain of the coarser octant is linked with the
//! chains on the other side that lead back from its end to its start, by the names of their ends.
//! Source: Nishio, Kobori and Kutsuwa 1997, section 3.5, with many fine octants against one.

use super::descent::Sheet;
use crate::octree::VertexName;
use crate::par;

/// Consecutive edges of one loop on one face of its octant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Chain {
    plane: Plane,
    /// The octant lies above the plane.
    above: bool,
    /// Edge length of the octant.
    size: u32,
    /// Low corner of the octant's face.
    corner: [u32; 2],
    /// Number of the sheet.
    pub sheet: u32,
    /// The first edge: the place of its first point in the ring.
    pub first: u32,
    /// How many edges.
    pub edges: u32,
}

/// A plane of the lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Plane {
    axis: u8,
    position: u32,
}

/// A chain and its counterpart: the chains of the other side, from its end back to its start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seam {
    /// The coarser side.
    pub chain: Chain,
    /// The other side; more than one where it is finer.
    pub path: Vec<Chain>,
}

/// All seams, and how many chains found no counterpart.
pub fn seams(sheets: &[Sheet], levels: u32) -> (Vec<Seam>, usize) {
    let mut chains: Vec<Chain> = Vec::new();
    for (number, sheet) in (0u32..).zip(sheets) {
        chains_of(sheet, number, levels, &mut chains);
    }
    par::sort(&mut chains);
    let planes: Vec<&[Chain]> = chains.chunk_by(|a, b| a.plane == b.plane).collect();
    let linked = par::map(&planes, |chains| link(chains, sheets));
    let unmatched = linked.iter().map(|(_, unmatched)| unmatched).sum();
    (linked.into_iter().flat_map(|(seams, _)| seams).collect(), unmatched)
}

impl Chain {
    /// The names along the chain, both ends included.
    pub fn vertices(&self, sheets: &[Sheet]) -> impl DoubleEndedIterator<Item = VertexName> {
        let ring = &sheets[self.sheet as usize].ring;
        (0..=self.edges).map(move |i| ring[(self.first + i) as usize % ring.len()].vertex)
    }

    /// The place in the ring of edge `i`.
    pub fn edge(&self, i: usize, sheets: &[Sheet]) -> u32 {
        ((self.first as usize + i) % sheets[self.sheet as usize].ring.len()) as u32
    }

    /// The name of its start.
    pub fn from(&self, sheets: &[Sheet]) -> VertexName {
        sheets[self.sheet as usize].ring[self.first as usize].vertex
    }

    fn to(&self, sheets: &[Sheet]) -> VertexName {
        let ring = &sheets[self.sheet as usize].ring;
        ring[(self.first + self.edges) as usize % ring.len()].vertex
    }

    /// Whether the face of this chain's octant covers the other's.
    fn covers(&self, other: &Self) -> bool {
        (0..2).all(|a| {
            let low = self.corner[a];
            low <= other.corner[a] && other.corner[a] + other.size <= low + self.size
        })
    }
}

/// Adds the chains of one sheet.
fn chains_of(sheet: &Sheet, number: u32, levels: u32, chains: &mut Vec<Chain>) {
    let ring = &sheet.ring;
    let points = ring.len();
    let size = sheet.octant.size(levels);
    let low = sheet.octant.corner();
    let starts = |i: usize| ring[i].face != ring[(i + points - 1) % points].face;
    let begin = (0..points).find(|&i| starts(i)).unwrap_or(0);
    let mut at = 0;
    while at < points {
        let first = (begin + at) % points;
        let on = |i: usize| ring[(begin + i) % points].face == ring[first].face;
        let edges = 1 + (at + 1..points).take_while(|&i| on(i)).count();
        let (axis, side) = (ring[first].face as usize / 2, u32::from(ring[first].face % 2));
        chains.push(Chain {
            plane: Plane { axis: axis as u8, position: low[axis] + side * size },
            above: side == 0,
            size,
            corner: [low[(axis + 1) % 3], low[(axis + 2) % 3]],
            sheet: number,
            first: first as u32,
            edges: edges as u32,
        });
        at += edges;
    }
}

/// Links the chains of one plane, the coarsest first.
fn link(chains: &[Chain], sheets: &[Sheet]) -> (Vec<Seam>, usize) {
    let mut order: Vec<usize> = (0..chains.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(chains[i].size));
    let mut starts: Vec<(bool, VertexName, usize)> =
        (0..chains.len()).map(|i| (chains[i].above, chains[i].from(sheets), i)).collect();
    starts.sort_unstable();
    let mut used = vec![false; chains.len()];
    let mut found = Vec::new();
    let mut unmatched = 0;
    for i in order {
        if std::mem::replace(&mut used[i], true) {
            continue;
        }
        let chain = chains[i];
        let (start, mut at) = (chain.from(sheets), chain.to(sheets));
        let mut path: Vec<usize> = Vec::new();
        let complete = loop {
            let first = starts.partition_point(|s| (s.0, s.1) < (!chain.above, at));
            let here = starts[first..].iter().take_while(|s| (s.0, s.1) == (!chain.above, at));
            let fits = |s: &&(bool, VertexName, usize)| !used[s.2] && chain.covers(&chains[s.2]);
            let Some(&(_, _, next)) = here.into_iter().find(fits) else { break false };
            used[next] = true;
            path.push(next);
            at = chains[next].to(sheets);
            if at == start {
                break true;
            }
        };
        if complete {
            found.push(Seam { chain, path: path.iter().map(|&i| chains[i]).collect() });
        } else {
            path.iter().for_each(|&i| used[i] = false);
            unmatched += 1;
        }
    }
    (found, unmatched)
}

/// Points to be put on one side of a loop, in its order.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Insertion {
    /// Number of the sheet.
    pub sheet: u32,
    /// The side: the place of its first point in the ring.
    pub edge: u32,
    /// The points.
    pub points: Vec<VertexName>,
}

/// The triangles of all sheets, those beside an insertion divided from their opposite corner.
pub fn divided(sheets: &[Sheet], mut insertions: Vec<Insertion>) -> Vec<[VertexName; 3]> {
    insertions.retain(|i| !i.points.is_empty());
    par::sort(&mut insertions);
    let mut rest = insertions.as_slice();
    let mut triangles = Vec::new();
    for (number, sheet) in (0u32..).zip(sheets) {
        let (own, after) = rest.split_at(rest.partition_point(|i| i.sheet <= number));
        rest = after;
        let points = sheet.ring.len() as u32;
        let vertex = |i: u32| sheet.ring[i as usize].vertex;
        for t in &sheet.triangles {
            let begin = triangles.len();
            triangles.push(t.map(vertex));
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                // Only sides of the loop are shared with other octants.
                if b == (a + 1) % points
                    && let Ok(at) = own.binary_search_by_key(&a, |insertion| insertion.edge)
                {
                    divide(&mut triangles, begin, [vertex(a), vertex(b)], &own[at].points);
                }
            }
        }
    }
    triangles
}

/// Divides the triangle among those from `begin` on that has the side.
fn divide(
    triangles: &mut Vec<[VertexName; 3]>,
    begin: usize,
    [from, to]: [VertexName; 2],
    points: &[VertexName],
) {
    let side = |t: &[VertexName; 3]| (0..3).find(|&i| t[i] == from && t[(i + 1) % 3] == to);
    let found = triangles[begin..].iter().enumerate().find_map(|(n, t)| Some((n, side(t)?)));
    let Some((number, i)) = found else { return };
    let opposite = triangles[begin + number][(i + 2) % 3];
    let ends = points.iter().copied().chain([to]);
    let mut at = from;
    for (n, next) in ends.enumerate() {
        let triangle = [at, next, opposite];
        match n {
            0 => triangles[begin + number] = triangle,
            _ => triangles.push(triangle),
        }
        at = next;
    }
}

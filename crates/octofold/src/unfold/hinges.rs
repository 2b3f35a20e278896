//! Facets and the hinges between them: the graph in which an unfolding is a forest.
//!
//! At an edge of two facets that show the same side there may be a hinge; where more meet, the two
//! that go on most straight may share one. Hinges between the same two facets that turn about the
//! same line are one hinge. Turning about a hinge into the plane takes the neighbour along a rigid
//! motion.

use super::facets::Facets;
use super::plane::Motion;
use super::sets::Sets;
use glam::DVec3;

/// A hinge between two facets.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hinge {
    /// The facets.
    pub facets: [u32; 2],
    /// The edges along which it runs, with the side of either facet.
    pub edges: Vec<(u32, [u32; 2])>,
    /// Takes the plane of the second facet into that of the first, unfolded.
    pub motion: Motion,
    /// Fold in radians, positive where the facets turn away from the printed side.
    pub fold: f64,
    /// Length along all its edges.
    pub length: f64,
}

/// The hinges of all facets.
#[derive(Debug, Clone)]
pub(super) struct Hinges {
    /// The hinges.
    pub hinges: Vec<Hinge>,
    /// Hinges at each facet.
    pub at: Vec<Vec<u32>>,
}

impl Hinges {
    /// Finds all hinges.
    pub fn new(mesh: &Facets) -> Self {
        let mut hinges: Vec<Hinge> = Vec::new();
        let mut at: Vec<Vec<u32>> = vec![Vec::new(); mesh.facets.len()];
        for edge in 0..mesh.edges.len() {
            let Some((sides, fold)) = straightest(mesh, edge) else { continue };
            let facets = sides.map(|(facet, _)| facet);
            let [own, other] = sides.map(|(f, side)| mesh.facets[f as usize].side(side));
            let motion = Motion::between([other[1], other[0]], own);
            let length = own[0].distance(own[1]);
            let numbers = sides.map(|(_, side)| side);
            let alike = at[facets[0] as usize].iter().copied().find(|&h| {
                let known = &hinges[h as usize];
                known.facets == facets
                    && other.iter().all(|&p| {
                        motion.at(p).distance(known.motion.at(p)) <= 1e-9 * (length + known.length)
                    })
            });
            if let Some(h) = alike {
                let known = &mut hinges[h as usize];
                if length > known.length {
                    (known.motion, known.fold) = (motion, fold);
                }
                known.edges.push((edge as u32, numbers));
                known.length += length;
                continue;
            }
            facets.iter().for_each(|&f| at[f as usize].push(hinges.len() as u32));
            hinges.push(Hinge {
                facets,
                edges: vec![(edge as u32, numbers)],
                motion,
                fold,
                length,
            });
        }
        Self { hinges, at }
    }

    /// The hinge `hinge`.
    pub fn get(&self, hinge: u32) -> &Hinge {
        &self.hinges[hinge as usize]
    }

    /// Sets of facets that hang together, each in order.
    pub fn components(&self) -> Vec<Vec<u32>> {
        let mut sets = Sets::singles(self.at.len());
        for hinge in &self.hinges {
            sets.join(hinge.facets[0], hinge.facets[1]);
        }
        sets.groups()
    }
}

/// The two sides at an edge that may share a hinge, the lower facet first, and the fold there.
fn straightest(mesh: &Facets, edge: usize) -> Option<([(u32, u32); 2], f64)> {
    let sides = mesh.edges.sides(edge);
    let mut best: Option<([(u32, u32); 2], f64)> = None;
    for (i, a) in sides.iter().enumerate() {
        for b in &sides[i + 1..] {
            if a.face == b.face {
                // The facet goes on through this edge, so that all others end at it.
                return None;
            }
            if !a.opposes(b) {
                continue;
            }
            let along = mesh.points[a.to as usize] - mesh.points[a.from as usize];
            let [m, n] = [a, b].map(|s| mesh.facets[s.face as usize].normal);
            let fold = fold(m, n, along);
            if best.is_none_or(|(_, least)| fold.abs() < least.abs()) {
                best = Some(([(a.face, a.number), (b.face, b.number)], fold));
            }
        }
    }
    best
}

/// The angle from normal `m` to normal `n` about `along`, along which the facet of `m` runs.
fn fold(m: DVec3, n: DVec3, along: DVec3) -> f64 {
    m.cross(n).dot(along.normalize_or_zero()).atan2(m.dot(n))
}

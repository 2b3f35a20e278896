//! One connected set of facets with the hinges between them, numbered from 0.

use super::facets::{Facets, gathered};
use super::grid::Grid;
use super::hinges::Hinges;
use super::plane::{Bounds, Motion, convex_meet, doubled_area};
use glam::DVec2;

/// A connected set of facets. Facets and hinges are numbered within the patch.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    /// The facets, by their numbers in the mesh.
    pub facets: Vec<u32>,
    /// The hinges, by their numbers in the mesh.
    pub hinges: Vec<u32>,
    /// The facets of each hinge.
    pub ends: Vec<[u32; 2]>,
    /// Hinges at each facet.
    pub at: Vec<Vec<u32>>,
    /// What is printed of each facet.
    pub outlines: Vec<Outline>,
    /// Motion over each hinge: the second facet beside the first, and the first beside the second.
    pub motions: Vec<[Motion; 2]>,
    /// Middle of a side of each hinge, in the planes of its facets, and its length.
    pub middles: Vec<([DVec2; 2], f64)>,
    /// The facet of each convex part.
    pub part_of: Vec<u32>,
    /// The first part of each facet.
    pub first_part: Vec<u32>,
    /// Depth up to which facets that reach into each other only touch.
    pub slack: f64,
    /// Size of a usual part.
    pub size: f64,
}

/// Convex polygons, counter-clockwise, that make up a shape.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Outline {
    points: Vec<DVec2>,
    ends: Vec<u32>,
}

impl Outline {
    /// An outline of convex polygons.
    pub fn new(parts: impl IntoIterator<Item = Vec<DVec2>>) -> Self {
        let mut outline = Self::default();
        for part in parts {
            outline.points.extend(part);
            outline.ends.push(outline.points.len() as u32);
        }
        outline
    }

    /// The convex polygons.
    pub fn parts(&self) -> impl Iterator<Item = &[DVec2]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(from, &to)| &self.points[from as usize..to as usize])
    }

    /// Every corner of a polygon with each of its two neighbours.
    pub fn corners(&self) -> impl Iterator<Item = [DVec2; 2]> {
        self.parts().flat_map(|part| {
            let n = part.len();
            let neighbours = move |k: usize| [part[(k + 1) % n], part[(k + n - 1) % n]];
            (0..n).flat_map(move |k| neighbours(k).map(|other| [part[k], other]))
        })
    }

    /// The same outline, moved; kept in the room of `moved`.
    pub fn place_into(&self, motion: &Motion, moved: &mut Self) {
        moved.points.clear();
        moved.points.extend(self.points.iter().map(|&p| motion.at(p)));
        moved.ends.clone_from(&self.ends);
    }

    /// The same outline, moved.
    pub fn placed(&self, motion: &Motion) -> Self {
        let mut moved = Self::default();
        self.place_into(motion, &mut moved);
        moved
    }

    /// Its box.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(&self.points)
    }

    /// Its area.
    pub fn area(&self) -> f64 {
        self.parts().map(doubled_area).sum::<f64>() / 2.0
    }

    /// All corners of its polygons.
    pub fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// The convex polygon `part`.
    pub fn part(&self, part: u32) -> &[DVec2] {
        let from = if part == 0 { 0 } else { self.ends[part as usize - 1] };
        &self.points[from as usize..self.ends[part as usize] as usize]
    }

    /// How many convex polygons there are.
    pub fn count(&self) -> usize {
        self.ends.len()
    }

    /// True where the two reach into each other by more than `slack`.
    pub fn meets(&self, other: &Self, slack: f64) -> bool {
        if self.ends.len() == 1 && other.ends.len() == 1 {
            return convex_meet(&self.points, &other.points, slack);
        }
        let shared = self.bounds().shared(&other.bounds());
        let near = |part: &&[DVec2]| Bounds::of(part).meet(&shared, -slack);
        let others: Vec<&[DVec2]> = other.parts().filter(near).collect();
        self.parts().filter(near).any(|a| {
            let bounds = Bounds::of(a);
            let close = |b: &&&[DVec2]| bounds.meet(&Bounds::of(b), slack);
            others.iter().filter(close).any(|b| convex_meet(a, b, slack))
        })
    }
}

impl Patch {
    /// The patch of `facets`, which are in order.
    pub fn new(mesh: &Facets, all: &Hinges, facets: &[u32]) -> Self {
        let local = |f: u32| facets.binary_search(&f).ok().map(|i| i as u32);
        let mut hinges: Vec<u32> =
            facets.iter().flat_map(|&f| all.at[f as usize].iter().copied()).collect();
        hinges.sort_unstable();
        hinges.dedup();
        hinges.retain(|&h| all.get(h).facets.iter().all(|&f| local(f).is_some()));
        let ends: Vec<[u32; 2]> =
            hinges.iter().map(|&h| all.get(h).facets.map(|f| local(f).unwrap_or(0))).collect();
        let mut at = vec![Vec::new(); facets.len()];
        for (h, ends) in ends.iter().enumerate() {
            ends.iter().for_each(|&f| at[f as usize].push(h as u32));
        }
        let outline = |&f: &u32| {
            let facet = &mesh.facets[f as usize];
            Outline::new(facet.parts.iter().map(|part| gathered(part, &facet.flat)))
        };
        let outlines: Vec<Outline> = facets.iter().map(outline).collect();
        let motion = |&h: &u32| {
            let motion = all.get(h).motion;
            [motion, motion.inverse()]
        };
        let motions = hinges.iter().map(motion).collect();
        let middle = |&h: &u32| {
            let hinge = all.get(h);
            let (_, sides) = hinge.edges[0];
            let middles = [0, 1].map(|k| {
                let [a, b] = mesh.facets[hinge.facets[k] as usize].side(sides[k]);
                a.midpoint(b)
            });
            (middles, hinge.length)
        };
        let middles = hinges.iter().map(middle).collect();
        let (mut part_of, mut first_part) = (Vec::new(), Vec::new());
        for (f, outline) in outlines.iter().enumerate() {
            first_part.push(part_of.len() as u32);
            part_of.resize(part_of.len() + outline.count(), f as u32);
        }
        let sizes: Vec<DVec2> =
            outlines.iter().flat_map(Outline::parts).map(|part| Bounds::of(part).size()).collect();
        let spans: f64 = sizes.iter().map(|s| s.element_sum() / 2.0).sum();
        let squares: f64 = sizes.iter().map(|s| s.length_squared() / 2.0).sum();
        let count = part_of.len().max(1) as f64;
        // A few large parts must not cover most of the squares.
        let size = (spans / count).max((squares / count).sqrt() / 2.0);
        Self {
            facets: facets.to_vec(),
            hinges,
            ends,
            at,
            outlines,
            motions,
            middles,
            part_of,
            first_part,
            slack: 1e-10 * (spans / count).max(1e-3),
            size,
        }
    }

    /// How many facets there are.
    pub fn len(&self) -> usize {
        self.facets.len()
    }

    /// The facet on the other side of `facet`.
    pub fn other(&self, hinge: u32, facet: u32) -> u32 {
        let [a, b] = self.ends[hinge as usize];
        if a == facet { b } else { a }
    }

    /// Takes the plane of the facet beyond `hinge` into that of `facet`.
    pub fn beyond(&self, hinge: u32, facet: u32) -> Motion {
        let h = hinge as usize;
        self.motions[h][usize::from(self.ends[h][0] != facet)]
    }

    /// A grid for all its parts.
    pub fn grid(&self) -> Grid {
        Grid::new(self.part_of.len(), self.size)
    }

    /// Places what hangs together by `tree` from `first` on: facets with their motions, each after
    /// the one it hangs on.
    pub fn spread(&self, first: u32, tree: &[u32]) -> Vec<(u32, Motion)> {
        let mut on = vec![false; self.hinges.len()];
        tree.iter().for_each(|&h| on[h as usize] = true);
        let mut seen = vec![false; self.len()];
        seen[first as usize] = true;
        let mut placed = vec![(first, Motion::REST)];
        let mut next = 0;
        while let Some(&(facet, motion)) = placed.get(next) {
            next += 1;
            for &h in self.at[facet as usize].iter().filter(|&&h| on[h as usize]) {
                let other = self.other(h, facet);
                if !std::mem::replace(&mut seen[other as usize], true) {
                    placed.push((other, motion.after(&self.beyond(h, facet))));
                }
            }
        }
        placed
    }
}

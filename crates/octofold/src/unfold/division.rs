//! Faces that are larger than a page are cut straight across. Sides of their neighbours are divided
//! at the same points, so that what met along whole sides still does.

use super::facets::Facet;
use super::plane::hull;
use super::room::Room;
use glam::{DQuat, DVec2, DVec3};
use std::collections::BTreeMap;

/// Triangles that are cut into parts, and which part of its face each belongs to.
pub(super) struct Division {
    /// Points, those of cuts last.
    pub points: Vec<[f64; 3]>,
    /// Oriented triangles.
    pub triangles: Vec<[u32; 3]>,
    /// The triangle that each was at first.
    pub sources: Vec<u32>,
    /// Parts of one face have different numbers, and faces that were not cut have 0.
    pub parts: Vec<u32>,
    cuts: u32,
}

/// A plane square to a face; what lies on it is at height 0.
struct Cut {
    normal: DVec3,
    offset: f64,
}

/// Points this near to a cut, in millimetres, are on it.
const NEAR: f64 = 0.05;

impl Cut {
    /// Where to cut a face that is too large for a page; `None` where it fits. The parts are of one
    /// size where that is enough.
    fn of(facet: &Facet, points: &[DVec3], room: &Room) -> Option<Self> {
        let (excess, along) = room.best_turn(&hull(&mut facet.flat.clone()));
        if excess <= 1.0 {
            return None;
        }
        let range = |direction: DVec2| {
            let of = facet.flat.iter().map(|p| p.dot(direction));
            of.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        let ways = [(along, room.size.x), (along.perp(), room.size.y)].map(|(direction, size)| {
            let [low, high] = range(direction);
            ((high - low) / size, direction, low, high)
        });
        let [x, y] = ways;
        let (times, direction, low, high) = if x.0 >= y.0 { x } else { y };
        let parts = times.ceil().max(2.0);
        let at = low + (high - low) * (parts / 2.0).floor() / parts;
        // Any two corners tell how the plane of the face lies in space.
        let [p, q] = facet.side(0);
        let [a, b] = facet.sides[0].map(|c| points[facet.corners[c as usize] as usize]);
        let turn = (q - p).angle_to(direction);
        let normal = DQuat::from_axis_angle(facet.normal, turn) * (b - a).normalize_or_zero();
        Some(Self { normal, offset: normal.dot(a) + at - direction.dot(p) })
    }

    fn height(&self, p: [f64; 3]) -> f64 {
        let height = self.normal.dot(p.into()) - self.offset;
        if height.abs() <= NEAR { 0.0 } else { height }
    }
}

impl Division {
    /// All in one part.
    pub fn new(points: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        let sources = (0..triangles.len() as u32).collect();
        let parts = vec![0; triangles.len()];
        Self { points, triangles, sources, parts, cuts: 0 }
    }

    /// How many cuts there are.
    pub fn cuts(&self) -> u32 {
        self.cuts
    }

    /// Cuts the first of `facets` that is too large; false where all fit. `at` are the points of
    /// the facets.
    pub fn cut(&mut self, facets: &[Facet], at: &[DVec3], room: &Room) -> bool {
        let mut cuts = facets.iter().filter_map(|f| Some((f, Cut::of(f, at, room)?)));
        let Some((facet, cut)) = cuts.next() else { return false };
        self.cuts += 1;
        let mut new: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for &t in &facet.triangles {
            for [a, b] in sides(self.triangles[t as usize]) {
                let [p, q] = [a, b].map(|p| self.points[p as usize]);
                let [h, k] = [p, q].map(|p| cut.height(p));
                if h * k < 0.0 {
                    let points = &mut self.points;
                    new.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                        points.push(DVec3::from(p).lerp(q.into(), h / (h - k)).into());
                        points.len() as u32 - 1
                    });
                }
            }
        }
        let mut is_cut = vec![false; self.triangles.len()];
        facet.triangles.iter().for_each(|&t| is_cut[t as usize] = true);
        for t in 0..self.triangles.len() {
            let between = sides(self.triangles[t]).map(|[a, b]| new.get(&[a.min(b), a.max(b)]));
            let pieces = divided(self.triangles[t], between.map(|p| p.copied()));
            let part = |piece: &[u32; 3], old: u32| {
                let sum: f64 = piece.iter().map(|&p| cut.height(self.points[p as usize])).sum();
                if is_cut[t] && sum > 0.0 { self.cuts } else { old }
            };
            let parts: Vec<u32> = pieces.iter().map(|piece| part(piece, self.parts[t])).collect();
            (self.triangles[t], self.parts[t]) = (pieces[0], parts[0]);
            self.triangles.extend(&pieces[1..]);
            self.parts.extend(&parts[1..]);
            self.sources.resize(self.triangles.len(), self.sources[t]);
        }
        true
    }
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// A triangle divided at points on its sides.
fn divided(triangle: [u32; 3], between: [Option<u32>; 3]) -> Vec<[u32; 3]> {
    let count = between.iter().flatten().count();
    for turn in 0..3 {
        let [a, b, c] = [0, 1, 2].map(|k| triangle[(turn + k) % 3]);
        let on = [0, 1, 2].map(|k| between[(turn + k) % 3]);
        match (count, on) {
            (1, [Some(p), ..]) => return vec![[a, p, c], [p, b, c]],
            // The corner between the two points comes off.
            (2, [Some(p), Some(q), _]) => return vec![[p, b, q], [a, p, q], [a, q, c]],
            (3, [Some(p), Some(q), Some(r)]) => {
                return vec![[p, b, q], [q, c, r], [r, a, p], [p, q, r]];
            }
            _ => {}
        }
    }
    vec![triangle]
}

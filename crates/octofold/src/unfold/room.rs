//! What fits on a page: pieces that do not are bitten into ones that do.

use super::patch::Patch;
use super::pieces::Piece;
use super::plane::hull;
use glam::DVec2;

/// A rectangle that a piece must fit into, turned as it likes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Room {
    /// Its width and height.
    pub size: DVec2,
}

/// Turns that are tried beside those along the hull's own edges.
const TURNS: u32 = 18;

impl Room {
    /// Its area.
    pub fn area(&self) -> f64 {
        self.size.x * self.size.y
    }

    /// How many times the room must grow to hold a convex shape; at most 1 where that fits.
    pub fn excess(&self, hull: &[DVec2]) -> f64 {
        self.best_turn(hull).0
    }

    /// The same, and the direction that is then turned to lie along the x axis.
    pub fn best_turn(&self, hull: &[DVec2]) -> (f64, DVec2) {
        let edges =
            (0..hull.len()).filter_map(|i| (hull[(i + 1) % hull.len()] - hull[i]).try_normalize());
        let fan = (0..TURNS).map(|k| {
            DVec2::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_2 / f64::from(TURNS))
        });
        let all = fan.chain(edges).flat_map(|d| [d, d.perp()]);
        all.map(|d| (self.excess_along(hull, d), d))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((0.0, DVec2::X))
    }

    /// The same with direction `along` turned to lie along the x axis.
    fn excess_along(&self, hull: &[DVec2], along: DVec2) -> f64 {
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for p in hull {
            let q = DVec2::new(p.dot(along), along.perp_dot(*p));
            (low, high) = (low.min(q), high.max(q));
        }
        ((high - low) / self.size).max_element()
    }

    /// Bites subtrees off a piece until all that is left fits: each time the largest that fits, or
    /// else the one that comes closest.
    pub fn bite(&self, patch: &Patch, piece: Piece) -> Vec<Piece> {
        let mut left = vec![piece];
        let mut done = Vec::new();
        while let Some(piece) = left.pop() {
            match self.cut_for(patch, &piece) {
                Some(hinge) => left.extend(piece.without(patch, &[hinge])),
                None => done.push(piece),
            }
        }
        done.sort_unstable_by_key(|p| p.facets[0]);
        done
    }

    /// The hinge to cut, where the piece does not fit.
    fn cut_for(&self, patch: &Patch, piece: &Piece) -> Option<u32> {
        let placed = patch.spread(piece.facets[0], &piece.tree);
        let points: Vec<Vec<DVec2>> = placed
            .iter()
            .map(|&(f, motion)| {
                patch.outlines[f as usize].points().iter().map(|&p| motion.at(p)).collect()
            })
            .collect();
        let excess = |points: &mut Vec<DVec2>| self.excess(&hull(points));
        if piece.tree.is_empty() || excess(&mut points.concat()) <= 1.0 {
            return None;
        }
        // Facets stand in `placed` after what they hang on: a subtree is known by its top.
        let mut place = vec![usize::MAX; patch.len()];
        placed.iter().enumerate().for_each(|(i, &(f, _))| place[f as usize] = i);
        let mut above = vec![(0, 0); placed.len()];
        for &h in &piece.tree {
            let [a, b] = patch.ends[h as usize].map(|f| place[f as usize]);
            above[a.max(b)] = (a.min(b), h);
        }
        let own: Vec<f64> =
            placed.iter().map(|&(f, _)| patch.outlines[f as usize].area()).collect();
        let mut areas = own.clone();
        for i in (1..placed.len()).rev() {
            areas[above[i].0] += areas[i];
        }
        let all = areas[0];
        let mut bites: Vec<(f64, usize, bool)> = (1..placed.len())
            .flat_map(|i| [(areas[i], i, true), (all - areas[i], i, false)])
            .collect();
        bites.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut closest = (f64::INFINITY, 0);
        for (area, top, below) in bites {
            if area > self.area() && closest.0 < f64::INFINITY {
                continue;
            }
            let mut inside = vec![false; placed.len()];
            inside[top] = true;
            for i in top + 1..placed.len() {
                inside[i] = inside[above[i].0];
            }
            let mut bite: Vec<DVec2> = (0..placed.len())
                .filter(|&i| inside[i] == below)
                .flat_map(|i| points[i].iter().copied())
                .collect();
            let excess = excess(&mut bite);
            if excess <= 1.0 {
                return Some(above[top].1);
            }
            if excess < closest.0 {
                closest = (excess, top);
            }
        }
        Some(above[closest.1].1)
    }
}

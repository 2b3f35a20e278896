//! Unfolding in one piece: a walk through the trees of a patch that hangs subtrees elsewhere until no
//! two facets lie on one another.
//!
//! Zawallich and Pajarola 2024, "Unfolding polyhedra via tabu search": from a facet that lies on
//! another, climb to a random root; hang each subtree on the way where it lies on the fewest facets;
//! take the first move that helps, or the least bad one, and do not take back the last few moves.

use super::hanging::{Hanging, NONE};
use super::patch::Patch;
use crate::random::Random;
use crate::run::Run;

/// A walk that can be taken up again.
pub(super) struct Walk<'a> {
    hanging: Hanging<'a>,
    patch: &'a Patch,
    random: Random,
    moves: u64,
    /// By hinge and by which of its facets hangs: the move up to which that is not done again.
    barred: Vec<[u64; 2]>,
    memory: u64,
    best: (usize, Vec<u32>),
    climbs: usize,
}

/// A subtree and where to hang it.
struct Move {
    pairs: usize,
    top: u32,
    hinge: u32,
}

impl<'a> Walk<'a> {
    /// Begins at `tree`.
    pub fn new(patch: &'a Patch, tree: &[u32], random: Random) -> Self {
        let hanging = Hanging::new(patch, tree);
        let n = patch.len().max(2) as f64;
        let degree = (2.0 * patch.hinges.len() as f64 / n).max(2.0);
        let memory = (degree * n.ln() / degree.ln()).ceil() as u64 + 1;
        let best = (hanging.pairs(), tree.to_vec());
        let barred = vec![[0; 2]; patch.hinges.len()];
        Self { hanging, patch, random, moves: 0, barred, memory, best, climbs: 0 }
    }

    /// Walks on for about `work` (see [`Hanging::work`]), until no facets lie on one another, or until
    /// the run is cancelled.
    pub fn go(&mut self, work: u64, run: &Run) {
        let end = self.hanging.work() + work;
        while self.hanging.pairs() > 0 && self.hanging.work() < end {
            if self.climbs.is_multiple_of(64) && run.check().is_err() {
                break;
            }
            self.climb();
            self.hanging.add_work(16);
            self.climbs += 1;
            if self.hanging.pairs() < self.best.0 {
                self.best = (self.hanging.pairs(), self.hanging.tree());
            }
        }
    }

    /// The fewest pairs so far, and their tree.
    pub fn best(&self) -> (usize, &[u32]) {
        (self.best.0, &self.best.1)
    }

    /// How often it has climbed.
    pub fn climbs(&self) -> usize {
        self.climbs
    }

    fn climb(&mut self) {
        let root = self.random.below(self.patch.len()) as u32;
        self.hanging.root_at(root);
        let hit = self.hanging.hit();
        let mut top = hit[self.random.below(hit.len())];
        if self.hanging.parent(top) == NONE {
            top = self.hanging.meets(top)[0];
        }
        let mut least: Option<Move> = None;
        let mut free = false;
        while self.hanging.parent(top) != NONE {
            let subtree = self.hanging.take_subtree(top);
            let now = self.hanging.pairs();
            let rest = now - self.hanging.crossing(&subtree);
            let mut best: Option<Move> = None;
            for &hinge in &self.patch.at[top as usize] {
                let onto = self.patch.other(hinge, top);
                if hinge == self.hanging.by(top)
                    || self.hanging.is_inside(onto)
                    || self.barred[hinge as usize][self.end(hinge, top)] > self.moves
                {
                    continue;
                }
                free = true;
                let known = best.as_ref().or(least.as_ref());
                let most = known.map_or(usize::MAX, |m| m.pairs.saturating_sub(rest));
                let pairs = rest + self.hanging.crossing_by(&subtree, hinge, most);
                if best.as_ref().is_none_or(|m| pairs < m.pairs) {
                    best = Some(Move { pairs, top, hinge });
                }
            }
            if let Some(found) = best {
                if found.pairs < now {
                    return self.take(&found, &subtree);
                }
                if least.as_ref().is_none_or(|m| found.pairs < m.pairs) {
                    least = Some(found);
                }
            }
            top = self.hanging.parent(top);
        }
        match least {
            Some(least) => {
                let subtree = self.hanging.take_subtree(least.top);
                self.take(&least, &subtree);
            }
            None if !free => self.moves += self.memory,
            None => {}
        }
    }

    fn take(&mut self, step: &Move, subtree: &[u32]) {
        self.hanging.hang(subtree, step.hinge);
        self.moves += 1;
        let end = self.end(step.hinge, step.top);
        self.barred[step.hinge as usize][end] = self.moves + self.memory;
    }

    fn end(&self, hinge: u32, facet: u32) -> usize {
        usize::from(self.patch.ends[hinge as usize][0] != facet)
    }
}

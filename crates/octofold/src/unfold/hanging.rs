//! A tree of facets laid out in the plane, which counts the pairs that lie on one another and can
//! hang any subtree elsewhere.

use super::grid::Grid;
use super::patch::{Outline, Patch};
use super::plane::{Bounds, Motion, convex_meet};
use glam::DVec2;

/// Marks the root, which hangs on nothing.
pub(super) const NONE: u32 = u32::MAX;

/// A spanning tree of a patch in the plane.
pub(super) struct Hanging<'a> {
    patch: &'a Patch,
    parent: Vec<u32>,
    by: Vec<u32>,
    children: Vec<Vec<u32>>,
    places: Vec<Motion>,
    outlines: Vec<Outline>,
    /// Boxes of the parts of all facets, and the parts by place.
    bounds: Vec<Bounds>,
    grid: Grid,
    meets: Vec<Vec<u32>>,
    pairs: usize,
    /// Facets that lie on others, and where each stands in that list.
    hit: Vec<u32>,
    hit_at: Vec<u32>,
    /// The subtree that last held a facet.
    inside: Vec<u32>,
    subtree: u32,
    seen: Seen,
    scratch: Outline,
    work: u64,
}

/// Which facets and parts a question has come across.
struct Seen {
    facets: Vec<u32>,
    parts: Vec<u32>,
    facet: u32,
    part: u32,
}

impl<'a> Hanging<'a> {
    /// Lays out `tree`, which must span the patch.
    pub fn new(patch: &'a Patch, tree: &[u32]) -> Self {
        let n = patch.len();
        let mut hanging = Self {
            patch,
            parent: vec![NONE; n],
            by: vec![NONE; n],
            children: vec![Vec::new(); n],
            places: vec![Motion::REST; n],
            outlines: patch.outlines.clone(),
            bounds: patch.outlines.iter().flat_map(Outline::parts).map(Bounds::of).collect(),
            grid: patch.grid(),
            meets: vec![Vec::new(); n],
            pairs: 0,
            hit: Vec::new(),
            hit_at: vec![NONE; n],
            inside: vec![0; n],
            subtree: 0,
            seen: Seen {
                facets: vec![0; n],
                parts: vec![0; patch.part_of.len()],
                facet: 0,
                part: 0,
            },
            scratch: Outline::default(),
            work: 0,
        };
        let order = patch.spread(0, tree);
        let mut on = vec![false; patch.hinges.len()];
        tree.iter().for_each(|&h| on[h as usize] = true);
        let mut placed = vec![false; n];
        for &(facet, motion) in &order {
            placed[facet as usize] = true;
            for &h in patch.at[facet as usize].iter().filter(|&&h| on[h as usize]) {
                let other = patch.other(h, facet);
                if !placed[other as usize] && hanging.parent[other as usize] == NONE {
                    hanging.parent[other as usize] = facet;
                    hanging.by[other as usize] = h;
                    hanging.children[facet as usize].push(other);
                }
            }
            hanging.put(facet, motion);
        }
        hanging
    }

    /// Pairs of facets that lie on one another.
    pub fn pairs(&self) -> usize {
        self.pairs
    }

    /// Parts of facets that were laid out and compared so far: the measure of work.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// All such pairs, the lower facet first, in order.
    pub fn list_pairs(&self) -> Vec<[u32; 2]> {
        let of = |(f, others): (usize, &Vec<u32>)| {
            let f = f as u32;
            others.iter().filter(move |&&g| f < g).map(move |&g| [f, g]).collect::<Vec<_>>()
        };
        let mut pairs: Vec<[u32; 2]> = self.meets.iter().enumerate().flat_map(of).collect();
        pairs.sort_unstable();
        pairs
    }

    /// The facets that lie on others.
    pub fn hit(&self) -> &[u32] {
        &self.hit
    }

    /// The facets that `facet` lies on.
    pub fn meets(&self, facet: u32) -> &[u32] {
        &self.meets[facet as usize]
    }

    /// The facet that `facet` hangs on, [`NONE`] for the root.
    pub fn parent(&self, facet: u32) -> u32 {
        self.parent[facet as usize]
    }

    /// The hinge by which `facet` hangs.
    pub fn by(&self, facet: u32) -> u32 {
        self.by[facet as usize]
    }

    /// The hinges of the tree, in order.
    pub fn tree(&self) -> Vec<u32> {
        let mut tree: Vec<u32> = self.by.iter().copied().filter(|&h| h != NONE).collect();
        tree.sort_unstable();
        tree
    }

    /// Makes `root` the root. Nothing moves.
    pub fn root_at(&mut self, root: u32) {
        let (mut at, mut above, mut hinge) = (root, NONE, NONE);
        loop {
            let next = std::mem::replace(&mut self.parent[at as usize], above);
            let own = std::mem::replace(&mut self.by[at as usize], hinge);
            if next == NONE {
                return;
            }
            self.leave(next, at);
            self.children[at as usize].push(next);
            (above, at, hinge) = (at, next, own);
        }
    }

    /// The facets that hang on `facet`, itself first, and marks them for [`Self::is_inside`].
    pub fn take_subtree(&mut self, facet: u32) -> Vec<u32> {
        self.subtree += 1;
        let mut all = vec![facet];
        let mut next = 0;
        while let Some(&f) = all.get(next) {
            next += 1;
            self.inside[f as usize] = self.subtree;
            all.extend_from_slice(&self.children[f as usize]);
        }
        all
    }

    /// True where `facet` is in the subtree taken last.
    pub fn is_inside(&self, facet: u32) -> bool {
        self.inside[facet as usize] == self.subtree
    }

    /// Pairs with one facet in the subtree taken last, which is `subtree`, and one outside.
    pub fn crossing(&self, subtree: &[u32]) -> usize {
        let outside = |&f: &u32| self.meets(f).iter().filter(|&&g| !self.is_inside(g)).count();
        subtree.iter().map(outside).sum()
    }

    /// How many facets outside the subtree taken last it would lie on if it hung by `hinge`; counts
    /// no further than just above `most`.
    pub fn crossing_by(&mut self, subtree: &[u32], hinge: u32, most: usize) -> usize {
        let moved = self.moved_by(subtree[0], hinge);
        let mut found = 0;
        let mut outline = std::mem::take(&mut self.scratch);
        for &facet in subtree {
            self.outlines[facet as usize].place_into(&moved, &mut outline);
            let mark = self.subtree;
            self.work += outline.count() as u64;
            let Self { patch, grid, seen, inside, outlines, bounds, .. } = self;
            let boxes = Boxes { patch, grid, outlines, bounds };
            let wanted = |other: u32| inside[other as usize] != mark;
            let compared = boxes.near(&outline, seen, wanted, |_| {
                found += 1;
                found > most
            });
            self.work += compared;
            if found > most {
                break;
            }
        }
        self.scratch = outline;
        found
    }

    /// How much of the length of `hinge` is too narrow a cut: none where its facets hang together by
    /// it or its middles are `width` apart.
    pub fn narrowness(&self, hinge: u32, width: f64) -> f64 {
        let [a, b] = self.patch.ends[hinge as usize];
        if self.by(a) == hinge || self.by(b) == hinge {
            return 0.0;
        }
        self.cut_narrowness(hinge, width, |_| Motion::REST)
    }

    /// How much narrower all cuts get if the subtree taken last hangs by `hinge`.
    pub fn narrowing_by(&self, subtree: &[u32], hinge: u32, width: f64) -> f64 {
        let moved = self.moved_by(subtree[0], hinge);
        let motion = |f: u32| if self.is_inside(f) { moved } else { Motion::REST };
        let old = self.by(subtree[0]);
        let mut change = 0.0;
        for &f in subtree {
            for &h in &self.patch.at[f as usize] {
                if self.is_inside(self.patch.other(h, f)) {
                    continue;
                }
                if h != old {
                    change -= self.narrowness(h, width);
                }
                if h != hinge {
                    change += self.cut_narrowness(h, width, motion);
                }
            }
        }
        change
    }

    /// The middle of the layout's box, and how far the farthest facet is from it.
    pub fn spread(&self) -> (DVec2, f64) {
        let low = self.bounds.iter().map(|b| b.low).fold(DVec2::INFINITY, DVec2::min);
        let high = self.bounds.iter().map(|b| b.high).fold(DVec2::NEG_INFINITY, DVec2::max);
        let middle = low.midpoint(high);
        let all = 0..self.places.len() as u32;
        (middle, all.map(|f| self.far(f, &Motion::REST, middle)).fold(0.0, f64::max))
    }

    /// How far from `middle` the subtree taken last would reach if it hung by `hinge`.
    pub fn reach_by(&self, subtree: &[u32], hinge: u32, middle: DVec2) -> f64 {
        let moved = self.moved_by(subtree[0], hinge);
        subtree.iter().map(|&f| self.far(f, &moved, middle)).fold(0.0, f64::max)
    }

    fn far(&self, facet: u32, moved: &Motion, middle: DVec2) -> f64 {
        self.outlines[facet as usize]
            .points()
            .first()
            .map_or(0.0, |&p| moved.at(p).distance(middle))
    }

    fn cut_narrowness(&self, hinge: u32, width: f64, motion: impl Fn(u32) -> Motion) -> f64 {
        let (middles, length) = self.patch.middles[hinge as usize];
        let ends = self.patch.ends[hinge as usize];
        let [p, q] = [0, 1].map(|k| {
            let f = ends[k];
            motion(f).at(self.places[f as usize].at(middles[k]))
        });
        let gap = p.distance(q);
        // Sides that lie on one another are no cut at all.
        if gap < 1e-7 { 0.0 } else { length * (1.0 - gap / width).max(0.0) }
    }

    /// A facet from which no subtree holds more than half of all facets.
    pub fn middle(&self) -> u32 {
        let n = self.parent.len();
        let mut order: Vec<u32> = (0..n as u32).filter(|&f| self.parent(f) == NONE).collect();
        let mut next = 0;
        while let Some(&f) = order.get(next) {
            next += 1;
            order.extend_from_slice(&self.children[f as usize]);
        }
        let mut sizes = vec![1; n];
        for &f in order.iter().rev() {
            if 2 * sizes[f as usize] >= n || self.parent(f) == NONE {
                return f;
            }
            sizes[self.parent(f) as usize] += sizes[f as usize];
        }
        0
    }

    /// Hangs the subtree taken last by `hinge`.
    pub fn hang(&mut self, subtree: &[u32], hinge: u32) {
        let moved = self.moved_by(subtree[0], hinge);
        let top = subtree[0];
        for &facet in subtree {
            for other in std::mem::take(&mut self.meets[facet as usize]) {
                if self.is_inside(other) {
                    self.meets[facet as usize].push(other);
                } else {
                    let back = &mut self.meets[other as usize];
                    if let Some(place) = back.iter().position(|&f| f == facet) {
                        back.swap_remove(place);
                    }
                    self.pairs -= 1;
                    self.mark_hit(other);
                }
            }
            self.mark_hit(facet);
            self.unplace(facet);
        }
        let mut found = Vec::new();
        for &facet in subtree {
            let f = facet as usize;
            self.places[f] = moved.after(&self.places[f]);
            self.draw(facet);
            // The others of the subtree are not in the grid yet.
            self.find(facet, &mut found);
            found.drain(..).for_each(|other| self.meet(facet, other));
        }
        for &facet in subtree {
            self.place(facet);
        }
        let (old, new) = (self.parent[top as usize], self.patch.other(hinge, top));
        self.leave(old, top);
        self.parent[top as usize] = new;
        self.by[top as usize] = hinge;
        self.children[new as usize].push(top);
    }

    /// How the subtree of `top` moves when it is hung by `hinge`.
    fn moved_by(&self, top: u32, hinge: u32) -> Motion {
        let to = self.patch.other(hinge, top);
        let place = self.places[to as usize].after(&self.patch.beyond(hinge, to));
        place.after(&self.places[top as usize].inverse())
    }

    fn put(&mut self, facet: u32, motion: Motion) {
        self.places[facet as usize] = motion;
        self.draw(facet);
        let mut found = Vec::new();
        self.find(facet, &mut found);
        found.into_iter().for_each(|other| self.meet(facet, other));
        self.place(facet);
    }

    /// Draws a facet at its place.
    fn draw(&mut self, facet: u32) {
        let f = facet as usize;
        self.patch.outlines[f].place_into(&self.places[f], &mut self.outlines[f]);
        let first = self.patch.first_part[f] as usize;
        for (part, points) in (first..).zip(self.outlines[f].parts()) {
            self.bounds[part] = Bounds::of(points);
        }
    }

    /// Puts the parts of a facet into the grid.
    fn place(&mut self, facet: u32) {
        for part in self.parts(facet) {
            self.grid.insert(part, &self.bounds[part as usize]);
        }
    }

    fn unplace(&mut self, facet: u32) {
        for part in self.parts(facet) {
            self.grid.remove(part, &self.bounds[part as usize]);
        }
    }

    fn parts(&self, facet: u32) -> std::ops::Range<u32> {
        let first = self.patch.first_part[facet as usize];
        first..first + self.patch.outlines[facet as usize].count() as u32
    }

    /// Adds to the work that was done.
    pub fn add_work(&mut self, work: u64) {
        self.work += work;
    }

    /// The facets of the grid that `facet` lies on.
    fn find(&mut self, facet: u32, found: &mut Vec<u32>) {
        let Self { patch, grid, seen, outlines, bounds, .. } = self;
        let boxes = Boxes { patch, grid, outlines, bounds };
        boxes.near(
            &outlines[facet as usize],
            seen,
            |_| true,
            |other| {
                found.push(other);
                false
            },
        );
    }

    fn meet(&mut self, a: u32, b: u32) {
        self.meets[a as usize].push(b);
        self.meets[b as usize].push(a);
        self.pairs += 1;
        self.mark_hit(a);
        self.mark_hit(b);
    }

    /// Keeps the list of facets that lie on others.
    fn mark_hit(&mut self, facet: u32) {
        let place = self.hit_at[facet as usize];
        match (self.meets[facet as usize].is_empty(), place) {
            (false, NONE) => {
                self.hit_at[facet as usize] = self.hit.len() as u32;
                self.hit.push(facet);
            }
            (true, place) if place != NONE => {
                self.hit.swap_remove(place as usize);
                if let Some(&moved) = self.hit.get(place as usize) {
                    self.hit_at[moved as usize] = place;
                }
                self.hit_at[facet as usize] = NONE;
            }
            _ => {}
        }
    }

    fn leave(&mut self, parent: u32, child: u32) {
        let children = &mut self.children[parent as usize];
        if let Some(place) = children.iter().position(|&c| c == child) {
            children.swap_remove(place);
        }
    }
}

/// The facets in the plane.
struct Boxes<'a> {
    patch: &'a Patch,
    grid: &'a Grid,
    outlines: &'a [Outline],
    bounds: &'a [Bounds],
}

impl Boxes<'_> {
    /// The facets in the grid, those of them that `wanted` takes, that `outline` lies on, each once;
    /// stops where `found` says so. How many pairs of parts were compared.
    fn near(
        &self,
        outline: &Outline,
        seen: &mut Seen,
        wanted: impl Fn(u32) -> bool,
        mut found: impl FnMut(u32) -> bool,
    ) -> u64 {
        let mut compared = 0;
        seen.facet += 1;
        let slack = self.patch.slack;
        for points in outline.parts() {
            seen.part += 1;
            let bounds = Bounds::of(points);
            let mut done = false;
            self.grid.near(&bounds, |part| {
                let p = part as usize;
                let other = self.patch.part_of[p];
                let o = other as usize;
                if std::mem::replace(&mut seen.parts[p], seen.part) == seen.part
                    || seen.facets[o] == seen.facet
                    || !wanted(other)
                    || !bounds.meet(&self.bounds[p], slack)
                {
                    return false;
                }
                compared += 1;
                let place = part - self.patch.first_part[o];
                if convex_meet(points, self.outlines[o].part(place), slack) {
                    seen.facets[o] = seen.facet;
                    done = found(other);
                }
                done
            });
            if done {
                break;
            }
        }
        compared
    }
}

//! The boxes of all faces in a tree that follows every change.
//!
//! Faces are numbered along a space-filling curve, so that four of a number stand together, and four
//! of these again: the tree is a pyramid of plain arrays. A box that changes is set in its place, and
//! those above it grow where they do not hold it yet; they never shrink, so that whoever makes
//! many changes builds the tree anew from time to time.

use glam::{BVec4A, DVec3, Vec4};

/// A box in f32, a little larger than what it holds. The fourth lane is unused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    pub low: Vec4,
    pub high: Vec4,
}

impl Span {
    /// No box: no comparison with it holds.
    const NONE: Self = Self { low: Vec4::NAN, high: Vec4::NAN };

    pub fn around([a, b, c]: &[DVec3; 3]) -> Self {
        let (low, high) = (a.min(*b).min(*c), a.max(*b).max(*c));
        let (low, high) = (low.as_vec3().extend(0.0), high.as_vec3().extend(0.0));
        let slack = |x: Vec4| x.abs() * f32::EPSILON + f32::MIN_POSITIVE;
        Self { low: low - slack(low), high: high + slack(high) }
    }

    pub fn overlaps(&self, other: &Self) -> bool {
        (self.low.cmple(other.high) & other.low.cmple(self.high)).all()
    }

    pub fn join(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    fn holds(&self, other: &Self) -> bool {
        (self.low.cmple(other.low) & other.high.cmple(self.high)).all()
    }
}

/// Four boxes, axis by axis.
#[derive(Debug, Clone, Copy)]
struct Four {
    low: [Vec4; 3],
    high: [Vec4; 3],
}

impl Four {
    const NONE: Self = Self { low: [Vec4::NAN; 3], high: [Vec4::NAN; 3] };

    fn get(&self, k: usize) -> Span {
        let of = |lanes: &[Vec4; 3]| Vec4::new(lanes[0][k], lanes[1][k], lanes[2][k], 0.0);
        Span { low: of(&self.low), high: of(&self.high) }
    }

    fn set(&mut self, k: usize, span: &Span) {
        for x in 0..3 {
            self.low[x][k] = span.low[x];
            self.high[x][k] = span.high[x];
        }
    }

    /// Makes room for `span` in box `k`; false where there was room.
    fn grow(&mut self, k: usize, span: &Span) -> bool {
        let mut grown = self.get(k);
        if grown.holds(span) {
            return false;
        }
        grown.join(span);
        self.set(k, &grown);
        true
    }

    fn hits(&self, query: &Query) -> u32 {
        let axis = |x: usize| -> BVec4A {
            self.low[x].cmple(query.high[x]) & query.low[x].cmple(self.high[x])
        };
        (axis(0) & axis(1) & axis(2)).bitmask()
    }

    /// A box round all four.
    fn whole(&self) -> Option<Span> {
        let there = (0..4).map(|k| self.get(k)).filter(|s| !s.low.x.is_nan());
        there.reduce(|mut whole, span| {
            whole.join(&span);
            whole
        })
    }
}

/// A box, each number four times.
struct Query {
    low: [Vec4; 3],
    high: [Vec4; 3],
}

/// The tree. Faces are told by their numbers.
#[derive(Debug, Default)]
pub struct Boxes {
    /// From the faces to the single root.
    levels: Vec<Vec<Four>>,
}

impl Boxes {
    /// The tree over the boxes of faces 0, 1, 2 and so on.
    pub fn new(spans: impl ExactSizeIterator<Item = Span>) -> Self {
        let mut level = vec![Four::NONE; spans.len().div_ceil(4)];
        spans.enumerate().for_each(|(i, span)| level[i / 4].set(i % 4, &span));
        let mut levels = vec![level];
        while let Some(below) = levels.last().filter(|below| below.len() > 1) {
            let mut level = vec![Four::NONE; below.len().div_ceil(4)];
            for (i, four) in below.iter().enumerate() {
                if let Some(span) = four.whole() {
                    level[i / 4].set(i % 4, &span);
                }
            }
            levels.push(level);
        }
        Self { levels }
    }

    pub fn get(&self, face: u32) -> Span {
        self.levels[0][face as usize / 4].get(face as usize % 4)
    }

    /// Sets the box of a face.
    pub fn set(&mut self, face: u32, span: &Span) {
        let mut i = face as usize;
        self.levels[0][i / 4].set(i % 4, span);
        for level in &mut self.levels[1..] {
            i /= 4;
            if !level[i / 4].grow(i % 4, span) {
                return;
            }
        }
    }

    /// Takes a face out.
    pub fn remove(&mut self, face: u32) {
        self.levels[0][face as usize / 4].set(face as usize % 4, &Span::NONE);
    }

    /// Appends all faces whose boxes touch `query` to `found`.
    pub fn near(&self, query: &Span, found: &mut Vec<u32>) {
        let lanes = |at: Vec4| [0, 1, 2].map(|x| Vec4::splat(at[x]));
        let query = Query { low: lanes(query.low), high: lanes(query.high) };
        // Sixteen levels hold more faces than there are numbers, and three of each may wait.
        let mut stack = [(0u32, 0u32); 64];
        stack[0] = (self.levels.len() as u32 - 1, 0);
        let mut waiting = usize::from(!self.levels[0].is_empty());
        while waiting > 0 {
            waiting -= 1;
            let (level, four) = stack[waiting];
            let mut hits = self.levels[level as usize][four as usize].hits(&query);
            while hits != 0 {
                let child = 4 * four + hits.trailing_zeros();
                hits &= hits - 1;
                if level == 0 {
                    found.push(child);
                } else {
                    stack[waiting] = (level - 1, child);
                    waiting += 1;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn span() -> impl Strategy<Value = Span> {
        let corner = || prop::array::uniform3(-9.0..9.0f64).prop_map(DVec3::from);
        prop::array::uniform3(corner()).prop_map(|t| Span::around(&t))
    }

    proptest! {
        #[test]
        fn what_touches_is_found_after_any_change(
            mut spans in prop::collection::vec(span(), 1..200),
            changes in prop::collection::vec((any::<prop::sample::Index>(), prop::option::of(span())), 0..80),
            query in span(),
        ) {
            let mut boxes = Boxes::new(spans.clone().into_iter());
            let mut there = vec![true; spans.len()];
            for (at, change) in changes {
                let i = at.index(spans.len());
                there[i] = change.is_some();
                match change {
                    Some(span) => {
                        spans[i] = span;
                        boxes.set(i as u32, &span);
                    }
                    None => boxes.remove(i as u32),
                }
            }
            let mut found = Vec::new();
            boxes.near(&query, &mut found);
            found.sort_unstable();
            let expected: Vec<u32> = (0..spans.len())
                .filter(|&i| there[i] && spans[i].overlaps(&query))
                .map(|i| i as u32)
                .collect();
            prop_assert_eq!(found, expected);
        }
    }
}

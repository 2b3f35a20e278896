//! A tree of boxes over triangles, four children to a node.
//!
//! Built from the top by the surface area heuristic over bins (Wald, "On fast construction of
//! SAH-based bounding volume hierarchies", 2007), two binary splits to a node. The tree depends on
//! the boxes alone, not on the number of threads. Boxes are kept in f32, rounded outwards, so that
//! they always contain what they stand for.

use crate::par;
use std::ops::Range;

/// Most triangles in a leaf.
const LEAF: usize = 4;
/// Bins along the axis of a split; the fewer are for parts of less than `FEW_ITEMS`.
const BINS: usize = 16;
const FEW_BINS: usize = 6;
const FEW_ITEMS: usize = 48;
/// From here on down the tree is halved blindly, which bounds its depth whatever the input.
const BLIND_DEPTH: u32 = 32;
/// Parts below this size are built on one thread.
const PARALLEL: usize = 8192;
/// Enough for the deepest tree: three siblings wait on each of at most 32 levels.
pub(super) const STACK: usize = 100;

/// A box in f32, rounded outwards. The fourth lane is unused; with it, boxes join in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Box3 {
    low: [f32; 4],
    high: [f32; 4],
}

impl Box3 {
    const EMPTY: Self = Self { low: [f32::INFINITY; 4], high: [f32::NEG_INFINITY; 4] };
    const ORIGIN: Self = Self { low: [0.0; 4], high: [0.0; 4] };

    pub(super) fn around(corners: &[[f64; 3]; 3]) -> Self {
        let [a, b, c] = corners;
        let mut around = Self::ORIGIN;
        for x in 0..3 {
            around.low[x] = round_down(a[x].min(b[x]).min(c[x]));
            around.high[x] = -round_down(-a[x].max(b[x]).max(c[x]));
        }
        around
    }

    pub(super) fn overlaps(&self, other: &Self) -> bool {
        (0..4).all(|x| self.low[x] <= other.high[x] && other.low[x] <= self.high[x])
    }

    fn join(&mut self, other: &Self) {
        for x in 0..4 {
            self.low[x] = lower(self.low[x], other.low[x]);
            self.high[x] = higher(self.high[x], other.high[x]);
        }
    }

    fn half_area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|a| self.high[a] - self.low[a]);
        x * y + y * z + z * x
    }

    /// The middle, as a box.
    fn twice_middle(&self) -> Self {
        let at: [f32; 4] = std::array::from_fn(|x| self.low[x] + self.high[x]);
        Self { low: at, high: at }
    }
}

fn round_down(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

fn lower(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

fn higher(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// A triangle's box and number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Item {
    pub(super) around: Box3,
    pub(super) triangle: u32,
}

/// Four children: boxes axis by axis, and what is in them. The boxes of unused ones are NaN, so
/// that no comparison with them holds.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) low: [[f32; 4]; 3],
    pub(super) high: [[f32; 4]; 3],
    /// First item of a leaf, or the number of an inner node.
    first: [u32; 4],
    /// Items of a leaf; none for an inner node.
    count: [u8; 4],
}

/// What a node's child is.
pub(super) enum Child {
    /// The node with this number, which is above the parent's.
    Inner(u32),
    /// These items.
    Leaf(Range<usize>),
}

impl Node {
    const EMPTY: Self =
        Self { low: [[f32::NAN; 4]; 3], high: [[f32::NAN; 4]; 3], first: [0; 4], count: [0; 4] };

    pub(super) fn child(&self, k: usize) -> Child {
        let first = self.first[k];
        match self.count[k] {
            0 => Child::Inner(first),
            n => Child::Leaf(first as usize..first as usize + usize::from(n)),
        }
    }

    /// True where child `k` holds anything.
    pub(super) fn is_used(&self, k: usize) -> bool {
        self.low[0][k] <= self.high[0][k]
    }

    fn around(&self, k: usize) -> Box3 {
        let mut around = Box3::ORIGIN;
        for x in 0..3 {
            around.low[x] = self.low[x][k];
            around.high[x] = self.high[x][k];
        }
        around
    }

    fn set_box(&mut self, k: usize, b: &Box3) {
        for x in 0..3 {
            self.low[x][k] = b.low[x];
            self.high[x][k] = b.high[x];
        }
    }
}

/// The tree. The first node is the root; children have higher numbers than their parents.
#[derive(Debug, Clone)]
pub(super) struct Bvh {
    pub(super) nodes: Vec<Node>,
    /// Items in the order of the leaves.
    pub(super) items: Vec<Item>,
}

impl Bvh {
    pub(super) fn new(mut items: Vec<Item>) -> Self {
        let mut nodes = Vec::with_capacity(items.len() / 6);
        if !items.is_empty() {
            grow(&mut items, 0, 0, &mut nodes);
        }
        Self { nodes, items }
    }

    /// Items and box of every leaf of these nodes.
    pub(super) fn leaves(&self, nodes: Range<usize>) -> impl Iterator<Item = (Range<usize>, Box3)> {
        let children = self.nodes[nodes].iter().flat_map(|node| (0..4).map(move |k| (node, k)));
        let used = children.filter(|(node, k)| node.is_used(*k));
        used.filter_map(|(node, k)| match node.child(k) {
            Child::Leaf(items) => Some((items, node.around(k))),
            Child::Inner(_) => None,
        })
    }

    /// Calls `visit` with ranges of items whose leaf's box overlaps `query`.
    pub(super) fn overlaps(&self, query: &Box3, mut visit: impl FnMut(Range<usize>)) {
        let mut stack = [0u32; STACK];
        let mut waiting = usize::from(!self.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let node = &self.nodes[stack[waiting] as usize];
            let mut hit = [true; 4];
            for x in 0..3 {
                for k in 0..4 {
                    hit[k] &= node.low[x][k] <= query.high[x] && query.low[x] <= node.high[x][k];
                }
            }
            for k in (0..4).filter(|&k| hit[k]) {
                match node.child(k) {
                    Child::Leaf(items) => visit(items),
                    Child::Inner(child) => {
                        stack[waiting] = child;
                        waiting += 1;
                    }
                }
            }
        }
    }
}

/// Appends the subtree over `items`, which start at `start` among all, and at least one of them.
fn grow(items: &mut [Item], start: usize, depth: u32, nodes: &mut Vec<Node>) {
    let at = nodes.len();
    nodes.push(Node::EMPTY);
    let large = items.len() > PARALLEL;
    let middle = split(items, depth);
    let quarters = [0..middle, middle..items.len()].map(|half| {
        let cut = half.start + split(&mut items[half.clone()], depth + 1);
        [half.start..cut, cut..half.end]
    });
    let parts: Vec<_> = quarters.into_iter().flatten().filter(|r| !r.is_empty()).collect();
    for (k, part) in parts.iter().enumerate() {
        let mut around = Box3::EMPTY;
        items[part.clone()].iter().for_each(|i| around.join(&i.around));
        nodes[at].set_box(k, &around);
        nodes[at].first[k] = (start + part.start) as u32;
        nodes[at].count[k] = if part.len() <= LEAF { part.len() as u8 } else { 0 };
    }
    let inner = parts.iter().enumerate().filter(|(_, part)| part.len() > LEAF);
    if !large {
        for (k, part) in inner {
            nodes[at].first[k] = nodes.len() as u32;
            grow(&mut items[part.clone()], start + part.start, depth + 2, nodes);
        }
        return;
    }
    let mut rest = items;
    let mut taken = 0;
    let mut jobs = Vec::with_capacity(4);
    for (k, part) in inner {
        let (_, tail) = std::mem::take(&mut rest).split_at_mut(part.start - taken);
        let (own, tail) = tail.split_at_mut(part.len());
        (rest, taken) = (tail, part.end);
        jobs.push((k, start + part.start, own, Vec::new()));
    }
    par::chunks_mut(&mut jobs, 1, |_, job| {
        let (_, start, items, nodes) = &mut job[0];
        grow(items, *start, depth + 2, nodes);
    });
    for (k, _, _, mut subtree) in jobs {
        let offset = nodes.len() as u32;
        nodes[at].first[k] = offset;
        for node in &mut subtree {
            for k in 0..4 {
                if node.count[k] == 0 {
                    node.first[k] += offset;
                }
            }
        }
        nodes.append(&mut subtree);
    }
}

/// Orders `items` so that those before the returned position go to one side; a part that is small
/// enough for a leaf stays whole.
fn split(items: &mut [Item], depth: u32) -> usize {
    if items.len() <= LEAF {
        return items.len();
    }
    let mut middles = Box3::EMPTY;
    items.iter().for_each(|item| middles.join(&item.around.twice_middle()));
    let extent: [f32; 3] = std::array::from_fn(|x| middles.high[x] - middles.low[x]);
    let axis = (0..3).fold(0, |best, x| if extent[x] > extent[best] { x } else { best });
    let usable = extent[axis] > 0.0 && extent[axis].is_finite();
    if depth >= BLIND_DEPTH || !usable {
        return items.len() / 2;
    }
    let bins = if items.len() < FEW_ITEMS { FEW_BINS } else { BINS };
    let scale = bins as f32 / extent[axis];
    let bin = |item: &Item| {
        let Box3 { low, high } = &item.around;
        ((low[axis] + high[axis] - middles.low[axis]) * scale) as usize
    };
    let last = bins - 1;
    let mut boxes = [Box3::EMPTY; BINS];
    let mut counts = [0usize; BINS];
    for item in items.iter() {
        let b = bin(item).min(last);
        boxes[b].join(&item.around);
        counts[b] += 1;
    }
    let Some(first_right) = cheapest(&boxes[..bins], &counts[..bins]) else {
        return items.len() / 2;
    };
    // The last bin holds the item farthest along, the first bin the nearest: neither side of a
    // partition is empty.
    let mut left = 0;
    for i in 0..items.len() {
        if bin(&items[i]) < first_right {
            items.swap(left, i);
            left += 1;
        }
    }
    left
}

/// The first bin of the right side in the cheapest split.
fn cheapest(boxes: &[Box3], counts: &[usize]) -> Option<usize> {
    let mut right_cost = [f32::INFINITY; BINS];
    let mut around = Box3::EMPTY;
    let mut count = 0;
    for b in (1..boxes.len()).rev() {
        around.join(&boxes[b]);
        count += counts[b];
        if count > 0 {
            right_cost[b] = around.half_area() * count as f32;
        }
    }
    around = Box3::EMPTY;
    count = 0;
    let mut best = (f32::INFINITY, None);
    for b in 1..boxes.len() {
        around.join(&boxes[b - 1]);
        count += counts[b - 1];
        if count > 0 && right_cost[b] < best.0 {
            let cost = around.half_area() * count as f32 + right_cost[b];
            if cost < best.0 {
                best = (cost, Some(b));
            }
        }
    }
    best.1
}

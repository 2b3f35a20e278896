//! Planes of any direction: nodes that lie as on the surface of a half-space.
//!
//! The surface of a half-space `n . p <= d` has one voxel in every column along its steepest axis, and
//! `n` and `d` tell where it lies and where it is exposed. Nodes that agree with that for one half-space
//! are one region, kept as the half-space and the loops of its boundary, seen along the axis: nothing
//! is lost, whichever half-space was found. One is grown from a node as far as some half-space fits,
//! large ones before small ones. Source: specification (D3.6); digital planes of Reveillès 1991 and
//! Debled-Rennesson.

use super::numbered::Numbered;
use super::planes::{Loop, NONE, axes_of, pixels, trace};
use super::slopes::{Offset, Slopes};
use super::{Mask, Node};

/// What a slope of 1 is in the numbers of a normal.
const ONE: i64 = 1 << 20;

/// Regions are looked for with at least so many nodes, one after the other.
const PASSES: [usize; 4] = [512, 96, 24, 6];

/// Nodes that fit no half-space with the others, after which the half-space is no longer changed.
const MOST_REFUSED: usize = 16;

/// A region of a plane of any direction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObliqueNode {
    /// Normal of the half-space, outwards.
    pub normal: [i64; 3],
    /// Voxels whose product with the normal is no larger lie in it.
    pub offset: i64,
    /// How many voxels it has.
    pub area: u32,
    /// Its boundary, in the two axes of [`ObliqueNode::axes`].
    pub loops: Vec<Loop>,
}

impl ObliqueNode {
    /// The axis along which each column has one voxel.
    pub fn axis(&self) -> usize {
        let steep = |a: &usize| self.normal[*a].abs();
        // The first of those that are as steep.
        (0..3).rev().max_by_key(steep).unwrap_or(0)
    }

    /// The two axes of its loops, seen from outside.
    pub fn axes(&self) -> [usize; 2] {
        let axis = self.axis();
        axes_of(axis as u8, 1 << (2 * axis + usize::from(self.normal[axis] > 0)))
    }

    /// The node in a column, by its places along the two axes.
    fn in_column(&self, [i, j]: [u32; 2]) -> Option<Node> {
        let (axis, [u, v]) = (self.axis(), self.axes());
        let rest = self.offset - self.normal[u] * i64::from(i) - self.normal[v] * i64::from(j);
        let steep = self.normal[axis];
        let w = steep.signum() * rest.div_euclid(steep.abs().max(1));
        let mut at = [0i64; 3];
        (at[axis], at[u], at[v]) = (w, i64::from(i), i64::from(j));
        let zyx = [at[2], at[1], at[0]].map(u16::try_from);
        let [Ok(z), Ok(y), Ok(x)] = zyx else { return None };
        Some(Node { zyx: [z, y, x], mask: self.mask(at)? })
    }

    /// Where a voxel of the half-space's surface is exposed.
    fn mask(&self, at: [i64; 3]) -> Option<Mask> {
        let below = self.offset - (0..3).map(|a| self.normal[a] * at[a]).sum::<i64>();
        let exposed = |d: &usize| {
            let step = self.normal[d / 2];
            below < if d % 2 == 1 { step } else { -step }
        };
        (below >= 0).then(|| (0..6).filter(exposed).map(|d| 1 << d).sum())
    }

    /// Its voxels.
    pub fn nodes(&self) -> Vec<Node> {
        let mut nodes = Vec::with_capacity(self.area as usize);
        pixels(&self.loops, |pixel| nodes.extend(self.in_column(pixel)));
        nodes
    }
}

/// Groups nodes whose region in `of` is [`NONE`] yet; new regions are numbered from `first` on.
pub fn oblique(
    numbered: &Numbered,
    of: &mut [u32],
    cracks: &mut [u8],
    first: u32,
) -> Vec<ObliqueNode> {
    let mut found = Vec::new();
    let mut search = Search { numbered, stamps: vec![0; of.len()], stamp: 0 };
    let mut tried = vec![0u8; of.len()];
    for (pass, least) in PASSES.into_iter().enumerate() {
        for seed in 0..of.len() {
            if of[seed] != NONE || tried[seed] > pass as u8 {
                continue;
            }
            tried[seed] = pass as u8 + 1;
            let Some(mut plane) = search.grow(seed as u32, of) else { continue };
            let region = search.fill(seed as u32, &plane, of);
            if region.len() < least {
                region.iter().for_each(|&n| tried[n as usize] = pass as u8 + 1);
                continue;
            }
            let number = first + found.len() as u32;
            region.iter().for_each(|&n| of[n as usize] = number);
            let is_in = |pixel| search.beneath(&plane, pixel).filter(|&n| of[n as usize] == number);
            let loops = trace(numbered, plane.axes(), &region, cracks, is_in, |_, _| ());
            (plane.area, plane.loops) = (region.len() as u32, loops);
            found.push(plane);
        }
    }
    found
}

/// Finds half-spaces round nodes.
struct Search<'a> {
    numbered: &'a Numbered<'a>,
    /// The last search that met a node.
    stamps: Vec<u32>,
    stamp: u32,
}

impl Search<'_> {
    /// The node of a half-space's surface in a column.
    fn beneath(&self, plane: &ObliqueNode, pixel: [u32; 2]) -> Option<u32> {
        if pixel.iter().any(|&i| i > u32::from(u16::MAX)) {
            return None;
        }
        let node = plane.in_column(pixel)?;
        let found = self.numbered.find(node.at())?;
        (self.numbered.nodes[found as usize].mask == node.mask).then_some(found)
    }

    /// The nodes that are joined to one on a half-space's surface, in order; none where it is not on
    /// that itself.
    fn fill(&mut self, seed: u32, plane: &ObliqueNode, of: &[u32]) -> Vec<u32> {
        self.stamp += 1;
        let [u, v] = plane.axes();
        let mut region = Vec::new();
        let at = self.numbered.nodes[seed as usize].at();
        if self.beneath(plane, [at[u], at[v]]) != Some(seed) {
            return region;
        }
        self.stamps[seed as usize] = self.stamp;
        region.push(seed);
        let mut next = 0;
        while let Some(&node) = region.get(next) {
            next += 1;
            let at = self.numbered.nodes[node as usize].at();
            let [i, j] = [at[u], at[v]];
            let beside = [[i + 1, j], [i.wrapping_sub(1), j], [i, j + 1], [i, j.wrapping_sub(1)]];
            for pixel in beside {
                let Some(found) = self.beneath(plane, pixel) else { continue };
                let stamp = &mut self.stamps[found as usize];
                if of[found as usize] == NONE && *stamp != self.stamp {
                    *stamp = self.stamp;
                    region.push(found);
                }
            }
        }
        region.sort_unstable();
        region
    }

    /// A half-space that fits a node and as many round it as were found.
    fn grow(&mut self, seed: u32, of: &[u32]) -> Option<ObliqueNode> {
        let start = self.numbered.nodes[seed as usize];
        let (axis, up) = self.steepest(start)?;
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let origin = start.at().map(i64::from);
        let sign = if up { 1 } else { -1 };
        let place = |at: [i64; 3]| -> Offset {
            [at[u] - origin[u], at[v] - origin[v], sign * (at[axis] - origin[axis])]
                .map(|i| i as i32)
        };
        self.stamp += 1;
        let mut half = Half { slopes: Slopes::all(), ..Half::default() };
        half.add(start, place);
        half.settle()?;
        self.stamps[seed as usize] = self.stamp;
        let mut region = vec![start.at()];
        let (mut next, mut refused) = (0, 0);
        while let Some(&at) = region.get(next) {
            next += 1;
            for (axis_beside, ahead) in [(u, true), (u, false), (v, true), (v, false)] {
                let Some(beside) = shifted(at, axis_beside, if ahead { 1 } else { -1 }) else {
                    continue;
                };
                for rise in [0, -1, 1] {
                    let Some(at) = shifted(beside, axis, rise) else { continue };
                    let Some(found) = self.numbered.find(at) else { continue };
                    let node = self.numbered.nodes[found as usize];
                    let faces = node.mask >> (2 * axis) & 3 == 1 << u8::from(up);
                    let stamp = &mut self.stamps[found as usize];
                    if !faces || of[found as usize] != NONE || *stamp == self.stamp {
                        continue;
                    }
                    *stamp = self.stamp;
                    if half.takes(node, place, refused < MOST_REFUSED) {
                        region.push(at);
                    } else {
                        refused += 1;
                    }
                }
            }
        }
        // Back to the world, in integers.
        let slope = half.slopes.middle.map(|s| (s * ONE as f64).round() as i64);
        let mut normal = [0; 3];
        (normal[axis], normal[u], normal[v]) = (sign * ONE, slope[0], slope[1]);
        let dot = |o: &Offset| {
            let [i, j, w] = o.map(i64::from);
            ONE * w + slope[0] * i + slope[1] * j
        };
        let high = half.inner.iter().map(dot).max()?;
        let low = half.outer.iter().map(dot).min()?;
        let here = (0..3).map(|a| normal[a] * origin[a]).sum::<i64>();
        let offset = here + (high + low - 1).div_euclid(2);
        Some(ObliqueNode { normal, offset, area: 0, loops: Vec::new() })
    }

    /// The axis along which the surface round a node is steepest, and whether it faces upwards there.
    fn steepest(&self, node: Node) -> Option<(usize, bool)> {
        let at = node.at();
        let mut sum = [0i32; 3];
        for i in 0..125u32 {
            let by = [i % 5, i / 5 % 5, i / 25];
            let there: [u32; 3] = std::array::from_fn(|a| (at[a] + by[a]).wrapping_sub(2));
            if let Some(found) = self.numbered.find(there) {
                let mask = self.numbered.nodes[found as usize].mask;
                for a in 0..3 {
                    sum[a] += i32::from(mask >> (2 * a + 1) & 1) - i32::from(mask >> (2 * a) & 1);
                }
            }
        }
        // Only where it is exposed itself, and not on both sides.
        let exposed = (0..6).filter(|d| node.mask >> d & 1 == 1 && node.mask >> (d ^ 1) & 1 == 0);
        let toward = |d: &usize| if d % 2 == 1 { sum[d / 2] } else { -sum[d / 2] };
        exposed.max_by_key(toward).map(|d| (d / 2, d % 2 == 1))
    }
}

/// A place some steps on along an axis; `None` below 0.
fn shifted(mut at: [u32; 3], axis: usize, by: i32) -> Option<[u32; 3]> {
    at[axis] = at[axis].checked_add_signed(by)?;
    Some(at)
}

/// A half-space while nodes are added to it.
#[derive(Debug)]
struct Half {
    slopes: Slopes,
    /// Voxels that are in, and those that are out.
    inner: Vec<Offset>,
    outer: Vec<Offset>,
    /// Height of the highest that is in, and of the lowest that is out.
    between: [f64; 2],
}

impl Default for Half {
    fn default() -> Self {
        let between = [f64::NEG_INFINITY, f64::INFINITY];
        Self { slopes: Slopes::all(), inner: Vec::new(), outer: Vec::new(), between }
    }
}

impl Half {
    /// Adds what a node tells: itself is in, so are the voxels beside it where it is not exposed, and
    /// the others are out.
    fn add(&mut self, node: Node, place: impl Fn([i64; 3]) -> Offset) {
        let at = node.at().map(i64::from);
        self.inner.push(place(at));
        for d in 0..6 {
            let mut beside = at;
            beside[d / 2] += if d % 2 == 1 { 1 } else { -1 };
            if node.mask >> d & 1 == 1 {
                self.outer.push(place(beside));
            } else {
                self.inner.push(place(beside));
            }
        }
    }

    fn settle(&mut self) -> Option<()> {
        self.between = self.slopes.separate(&self.inner, &self.outer)?;
        Some(())
    }

    /// Adds a node where it fits; where it does not, another slope is looked for if that is asked.
    fn takes(&mut self, node: Node, place: impl Fn([i64; 3]) -> Offset, turn: bool) -> bool {
        let before = [self.inner.len(), self.outer.len()];
        self.add(node, place);
        let height = |o: &Offset| self.slopes.height(*o);
        let high = self.inner[before[0]..].iter().map(height).fold(self.between[0], f64::max);
        let low = self.outer[before[1]..].iter().map(height).fold(self.between[1], f64::min);
        if high < low {
            self.between = [high, low];
            return true;
        }
        if turn {
            let mut other = self.slopes.clone();
            if let Some(between) = other.separate(&self.inner, &self.outer) {
                (self.slopes, self.between) = (other, between);
                return true;
            }
        }
        self.inner.truncate(before[0]);
        self.outer.truncate(before[1]);
        false
    }
}

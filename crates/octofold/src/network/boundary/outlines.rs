//! Connected regions of faces in a plane, and the loops round them.
//!
//! Faces are joined where they share a side and are of one class. A region is on the left of its loops, seen
//! so that the axes along and across run right and up: the outer one goes counter-clockwise, those of
//! holes clockwise. Where a region touches itself at a corner its loops keep to the face that they came along.
//! Source: specification (A8, A9: plane nodes with outer and inner loops).

use crate::sets::Sets;

/// Faces side by side in one line of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Strip {
    /// Direction of the faces, as of a network's.
    pub direction: u8,
    /// Place of their voxels along the direction's axis.
    pub plane: u32,
    /// Place of the line across.
    pub line: u32,
    /// First face along the line.
    pub start: u32,
    /// One past the last.
    pub end: u32,
    /// What its faces have in common; faces of other classes are other regions.
    pub class: u32,
    /// It was cut into tiles, and joins no strip of another.
    pub tiled: bool,
}

/// Sides of tiles that regions with many corners are cut into.
pub const TILE: u32 = 32;

/// Corners of a region that is not cut.
const MOST_CORNERS: usize = 600;

/// The way of a side: along, across, and back.
pub const WAYS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// A region of faces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outline {
    /// Direction of its faces.
    pub direction: u8,
    /// Place of its voxels along the direction's axis.
    pub plane: u32,
    /// The class of its faces.
    pub class: u32,
    /// The corners at which each loop turns, with its way from there on; the outer one is the first.
    pub loops: Vec<Vec<([u32; 2], u8)>>,
}

/// The regions of the strips of one plane, in order of lines and starts. Those with many corners are cut,
/// and their strips with them.
pub fn outlines(strips: &mut Vec<Strip>) -> Vec<Outline> {
    let (found, of_strip) = regions(strips);
    let corners = |o: &Outline| o.loops.iter().map(Vec::len).sum::<usize>();
    let large: Vec<bool> = found.iter().map(|o| corners(o) > MOST_CORNERS).collect();
    if !large.contains(&true) {
        return found;
    }
    let mut cut = Vec::new();
    for (strip, region) in strips.iter().zip(of_strip) {
        if !large[region as usize] {
            cut.push(*strip);
            continue;
        }
        let mut start = strip.start;
        while start < strip.end {
            let end = ((start / TILE + 1) * TILE).min(strip.end);
            cut.push(Strip { start, end, tiled: true, ..*strip });
            start = end;
        }
    }
    *strips = cut;
    regions(strips).0
}

/// Whether two strips of neighbouring lines, which overlap, are of one region.
fn joins(lower: &Strip, upper: &Strip) -> bool {
    let part = lower.tiled && upper.line.is_multiple_of(TILE);
    lower.class == upper.class && lower.tiled == upper.tiled && !part
}

/// The regions of strips, and which each strip is of.
fn regions(strips: &[Strip]) -> (Vec<Outline>, Vec<u32>) {
    let lines = Lines::new(strips);
    let mut sets = Sets::singles(strips.len());
    for (upper, strip) in strips.iter().enumerate() {
        for lower in lines.beside(strip, -1) {
            if joins(&strips[lower], strip) {
                sets.join(lower as u32, upper as u32);
            }
        }
    }
    let mut numbers = vec![u32::MAX; strips.len()];
    let mut count = 0;
    let of_strip: Vec<u32> = (0..strips.len())
        .map(|i| {
            let root = sets.root(i as u32) as usize;
            if numbers[root] == u32::MAX {
                numbers[root] = count;
                count += 1;
            }
            numbers[root]
        })
        .collect();
    let mut sides = Vec::new();
    for (i, strip) in strips.iter().enumerate() {
        let Strip { line, start, end, .. } = *strip;
        let mut side = |start: [u32; 2], end: [u32; 2], way: u8| {
            sides.push(Side { region: of_strip[i], start, end, way });
        };
        side([end, line], [end, line + 1], 1);
        side([start, line + 1], [start, line], 3);
        for (step, way, across) in [(-1, 0, line), (1, 2, line + 1)] {
            let mut from = start;
            let mut bare = |from: u32, to: u32| {
                if from < to {
                    let (low, high) = ([from, across], [to, across]);
                    if way == 0 { side(low, high, way) } else { side(high, low, way) }
                }
            };
            for other in lines.beside(strip, step).map(|i| &strips[i]) {
                let joined = if step < 0 { joins(other, strip) } else { joins(strip, other) };
                if joined {
                    bare(from, other.start.min(end));
                    from = other.end.max(from);
                }
            }
            bare(from, end);
        }
    }
    (trace(strips, &of_strip, sides, count as usize), of_strip)
}

/// Strips by line.
struct Lines<'a> {
    strips: &'a [Strip],
    first: u32,
    /// Where each line begins, and the end.
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    fn new(strips: &'a [Strip]) -> Self {
        let first = strips.first().map_or(0, |s| s.line);
        let last = strips.last().map_or(0, |s| s.line);
        let mut starts = vec![0; (last - first) as usize + 2];
        for strip in strips {
            starts[(strip.line - first) as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        Self { strips, first, starts }
    }

    /// The strips of the line before or after that of a strip that overlap it.
    fn beside(&self, strip: &Strip, step: i64) -> std::ops::Range<usize> {
        let line = i64::from(strip.line) - i64::from(self.first) + step;
        let Some(&[from, to]) = usize::try_from(line).ok().and_then(|l| self.starts.get(l..l + 2))
        else {
            return 0..0;
        };
        let own = &self.strips[from..to];
        let first = own.partition_point(|s| s.end <= strip.start);
        let end = own.partition_point(|s| s.start < strip.end);
        from + first..from + end.max(first)
    }
}

/// A side of a region's faces, with the region on its left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    region: u32,
    start: [u32; 2],
    way: u8,
    end: [u32; 2],
}

/// Puts sides together to loops.
fn trace(strips: &[Strip], of_strip: &[u32], mut sides: Vec<Side>, count: usize) -> Vec<Outline> {
    let mut outlines: Vec<Option<Outline>> = vec![None; count];
    for (strip, &region) in strips.iter().zip(of_strip) {
        outlines[region as usize].get_or_insert_with(|| {
            let Strip { direction, plane, class, .. } = *strip;
            Outline { direction, plane, class, loops: Vec::new() }
        });
    }
    let mut outlines: Vec<Outline> = outlines.into_iter().flatten().collect();
    sides.sort_unstable();
    let mut used = vec![false; sides.len()];
    for first in 0..sides.len() {
        if used[first] {
            continue;
        }
        let mut corners = Vec::new();
        let mut at = first;
        loop {
            used[at] = true;
            let Side { region, end, way, .. } = sides[at];
            let next = sides.partition_point(|s| (s.region, s.start) < (region, end));
            // Of two ways the left one keeps to the same face.
            let left = (way + 1) % 4;
            let second = next + 1;
            let is_left = sides
                .get(second)
                .is_some_and(|s| (s.region, s.start, s.way) == (region, end, left));
            at = if is_left { second } else { next };
            if sides[at].way != way {
                corners.push((end, sides[at].way));
            }
            if at == first {
                break;
            }
        }
        let loops = &mut outlines[sides[first].region as usize].loops;
        if area(&corners) > 0 {
            loops.insert(0, corners);
        } else {
            loops.push(corners);
        }
    }
    outlines
}

/// Twice the area that a loop goes round counter-clockwise.
fn area(corners: &[([u32; 2], u8)]) -> i64 {
    let mut sum = 0;
    for (i, (a, _)) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()].0;
        let [a, b] = [a, &b].map(|p| p.map(i64::from));
        sum += a[0] * b[1] - a[1] * b[0];
    }
    sum
}

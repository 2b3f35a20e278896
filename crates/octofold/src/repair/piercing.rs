//! Where grid edges are pierced, and exact signs on the output lattice.

use super::bricks::Place;

/// A point of the output lattice.
pub type Point = [i32; 3];

/// What a shape says about where its surface should lie. Nothing that it says can spoil the
/// guarantees of the extraction: positions are clamped and tested.
pub trait Guide: Sync {
    /// Where the vertex of a cell should be.
    fn target(&self, place: Place) -> Target;

    /// Where the shape crosses the grid edge that leaves the low corner of a cell along `axis`: the
    /// lowest and the highest crossing, in steps from that corner.
    fn crossings(&self, place: Place, axis: usize) -> Option<[f64; 2]>;
}

/// Where the vertex of a cell should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Steps from the low corner of the cell.
    pub at: [f64; 3],
    /// 0 in the middle of a cell without shape, 1 on a face, 2 on a crease, 3 on a corner.
    pub rank: u8,
}

/// The piercing points of one grid edge, in steps from its low end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Split {
    /// The points towards the low and the high end.
    pub at: [i32; 2],
    /// The open intervals in which they may lie, their far ends first.
    spans: [[i32; 2]; 2],
}

impl Split {
    /// Finds the points of an edge of `steps` steps that is pierced at the given ends.
    pub fn new(crossings: Option<[f64; 2]>, pierced: [bool; 2], steps: i32) -> Self {
        let middle = f64::from(steps) / 2.0;
        let [first, last] = crossings.unwrap_or([middle; 2]);
        let within = |t: f64, low: i32, high: i32| (t.round() as i32).clamp(low, high);
        if pierced != [true, true] {
            let at = [first, last].map(|t| within(t, 1, steps - 1));
            return Self { at, spans: [[steps, 0], [0, steps]] };
        }
        let split = within((first + last) / 2.0, 2, steps - 2);
        let apart = (steps / SHELL).max(1);
        let low = within(first, 1, (split - apart).max(1));
        let high = within(last, (split + apart).min(steps - 1), steps - 1);
        // No wider than need be: moved cones must be seen from all of it.
        let spans = [[split, (low - 2 * apart).max(0)], [split, (high + 2 * apart).min(steps)]];
        Self { at: [low, high], spans }
    }

    /// The ends of the open interval of the point towards end `end`, that away from its corner first.
    pub fn interval(&self, end: usize) -> [i32; 2] {
        self.spans[end]
    }
}

/// Front and back of a sheet without thickness are this part of a cell away from it.
pub const SHELL: i32 = 16;

/// The difference of two points.
pub fn sub(a: Point, b: Point) -> [i64; 3] {
    std::array::from_fn(|i| i64::from(a[i]) - i64::from(b[i]))
}

/// The cross product of two vectors.
pub fn cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The scalar product of two vectors.
pub fn dot(a: [i64; 3], b: [i64; 3]) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Six times the signed volume of the tetrahedron `a b c d`. Points of neighbouring cells are at most
/// 2^17 steps apart, so this is below 2^54.
pub fn volume(a: Point, b: Point, c: Point, d: Point) -> i64 {
    dot(cross(sub(b, a), sub(c, a)), sub(d, a))
}

/// Whether the segments `a b` and `c d` meet in a point inside the second; `a` and `b` lie on
/// opposite sides of its line, and `aside` does not lie in one plane with `a` and `c d`.
pub fn meets(a: Point, b: Point, [c, d]: [Point; 2], aside: Point) -> bool {
    volume(a, b, c, d) == 0 && volume(a, b, aside, c).signum() * volume(a, b, aside, d).signum() < 0
}

/// Whether the open segment `a b` crosses the inside of the triangle `p q r`, not its border.
pub fn crosses(a: Point, b: Point, [p, q, r]: [Point; 3]) -> bool {
    let (below, above) = (volume(p, q, r, a).signum(), volume(p, q, r, b).signum());
    if below * above >= 0 {
        return false;
    }
    let turns = [(p, q), (q, r), (r, p)].map(|(s, t)| volume(a, b, s, t).signum());
    turns == [1; 3] || turns == [-1; 3]
}

//! The cell in which more than two labels meet.
//!
//! Labels sit on the eight corners, as in [`crate::surface::cell`]. An edge between two labels is crossed
//! at its middle. On a face, four corners in a ring:
//!
//! - two crossed edges are joined by a segment;
//! - where a label holds two corners across a diagonal it connects them, and the other two corners
//!   are cut off by a segment each; where both diagonals ask for that, the lower of the two labels
//!   connects;
//! - else three or four labels meet, at a junction in the middle of the face.
//!
//! What a face looks like follows from its four labels alone, so both cells beside it see the
//! same. The segments cut the surface of the cell into regions of one label each. Segments that
//! are connected without a junction are a loop between two labels, and are filled as in marching
//! cubes, or, where two saddles would touch, joined to the mean of their points. Between
//! two junctions the labels meet along the straight line from one to the other, and each wall is
//! cut into triangles between that line and its segments. More junctions are joined to their mean,
//! and all their segments with them.
//!
//! The patch depends on which corners hold equal labels (4140 ways), and on which label is the
//! lower where both diagonals are even. Each is derived when it is first asked for.
//!
//! Source: specification of surfaces, D.4.

use crate::surface::cell::{FIRST_FACE, edge_at, face_corners, middle, triangulate};
use std::sync::{LazyLock, OnceLock};

/// The first of the points inside, which come after those on edges and faces.
pub const FIRST_INNER: usize = 18;

/// Steps into which an axis of the cell is cut for the points inside.
pub const STEPS: u32 = 64;

/// Fewest crossed edges of a loop that bends both ways.
const SADDLE: usize = 6;

/// The interfaces between the labels of a cell.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Patch {
    /// The triangles; those at the same inner point stand together.
    pub triangles: Vec<Facet>,
    /// The points inside, in [`STEPS`] to the cell.
    pub inner: Vec<[u32; 3]>,
}

/// A triangle between two labels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facet {
    /// Its corners: an edge, a face or a point inside. A point inside stands last.
    pub points: [u8; 3],
    /// A corner of the cell with the label behind it; it is wound clockwise seen from there.
    pub behind: u8,
    /// A corner of the cell with the label in front.
    pub front: u8,
}

/// All ways in which eight corners may be equal, by the number of the way.
static WAYS: LazyLock<Vec<OnceLock<Way>>> = LazyLock::new(|| {
    let most = (1..=8).product();
    std::iter::repeat_with(OnceLock::new).take(most).collect()
});

/// One of the ways in which corners may be equal.
struct Way {
    /// For each corner, the number of its label in the order of first corners.
    kinds: [u8; 8],
    /// Faces on which both diagonals are even.
    even: Vec<usize>,
    /// Patches by the lower diagonal of each even face.
    patches: Vec<OnceLock<Patch>>,
}

/// The patch of the cell with these labels.
pub fn patch(labels: &[u32; 8]) -> &'static Patch {
    let mut kinds = [0u8; 8];
    let (mut number, mut weight, mut count) = (0, 1, 1);
    for c in 1..8 {
        let known = (0..c).find(|&d| labels[d] == labels[c]);
        kinds[c] = known.map_or(count, |d| kinds[d]);
        count += u8::from(known.is_none());
        // Corner c has one of c + 1 kinds at most.
        weight *= c;
        number += weight * usize::from(kinds[c]);
    }
    let way = WAYS[number].get_or_init(|| {
        let even: Vec<_> = (0..6).filter(|&f| is_even(f, &kinds)).collect();
        let patches = std::iter::repeat_with(OnceLock::new).take(1 << even.len()).collect();
        Way { kinds, even, patches }
    });
    let mut first_is_lower = 0;
    for (i, &f) in way.even.iter().enumerate() {
        let [a, b, ..] = face_corners(f);
        first_is_lower |= usize::from(labels[a] < labels[b]) << i;
    }
    way.patches[first_is_lower].get_or_init(|| {
        let of_face = |i: usize| first_is_lower >> i & 1 == 1;
        let lower = |f| way.even.iter().position(|&e| e == f).is_some_and(of_face);
        derive(&way.kinds, lower)
    })
}

/// The patches of three labels, by a digit to base 3 for each corner: 0 for the lowest label, 1 for the
/// middle one, 2 for the highest.
static OF_THREE: LazyLock<Vec<OnceLock<&Patch>>> =
    LazyLock::new(|| std::iter::repeat_with(OnceLock::new).take(3usize.pow(8)).collect());

/// Bits as digits to base 3.
static TERNARY: LazyLock<[u16; 256]> = LazyLock::new(|| {
    std::array::from_fn(|m| (0..8).map(|c| 3u16.pow(c) * (m as u16 >> c & 1)).sum())
});

/// The patch of the cell with these labels, three or more of them: `low` are the corners with the
/// lowest one, `high` those with the highest one.
pub fn patch_of_many(labels: &[u32; 8], low: usize, high: usize) -> &'static Patch {
    let between = 255 ^ low ^ high;
    let middle = labels[between.trailing_zeros() as usize % 8];
    if corners(labels, middle) != between {
        return patch(labels);
    }
    let number = TERNARY[between] + 2 * TERNARY[high];
    OF_THREE[usize::from(number)].get_or_init(|| patch(labels))
}

/// The corners that hold a label, as bits.
pub fn corners(labels: &[u32; 8], label: u32) -> usize {
    (0..8).fold(0, |corners, c| corners | usize::from(labels[c] == label) << c)
}

/// Whether face `f` has two labels, each across a diagonal.
fn is_even(f: usize, kinds: &[u8; 8]) -> bool {
    let [a, b, c, d] = face_corners(f).map(|corner| kinds[corner]);
    a == c && b == d && a != b
}

/// A piece of the border between two labels on a face, with the corners of the cell that hold the
/// labels to its left and right, seen from outside the cell.
#[derive(Debug, Clone, Copy)]
struct Segment {
    ends: [u8; 2],
    left: u8,
    right: u8,
}

impl Segment {
    /// The same segment as it leaves `point`.
    fn from(&self, point: u8) -> Option<Self> {
        let [from, to] = self.ends;
        if from == point {
            Some(*self)
        } else {
            (to == point).then_some(Self { ends: [to, from], left: self.right, right: self.left })
        }
    }
}

/// The segments of face `f`. `first_is_lower`: where both diagonals are even, the first corner has
/// the lower label.
fn segments(f: usize, kinds: &[u8; 8], first_is_lower: bool) -> Vec<Segment> {
    let ring = face_corners(f);
    let kind = |i: usize| kinds[ring[i % 4]];
    let edge = |i: usize| {
        let (a, b) = (ring[i % 4], ring[(i + 1) % 4]);
        edge_at(a & b, (a ^ b).trailing_zeros() as usize) as u8
    };
    // Into the face across edge i, corner i is on the left.
    let segment = |i: usize, to: u8| {
        let (left, right) = (ring[i % 4] as u8, ring[(i + 1) % 4] as u8);
        Segment { ends: [edge(i), to], left, right }
    };
    let cut_off = |corner: usize| segment(corner + 3, edge(corner));
    let crossed: Vec<_> = (0..4).filter(|&i| kind(i) != kind(i + 1)).collect();
    match (crossed.as_slice(), kind(0) == kind(2), kind(1) == kind(3)) {
        ([], ..) => Vec::new(),
        (&[i, j], ..) => vec![segment(i, edge(j))],
        (_, true, true) if first_is_lower => vec![cut_off(1), cut_off(3)],
        (_, true, true) | (_, false, true) => vec![cut_off(0), cut_off(2)],
        (_, true, false) => vec![cut_off(1), cut_off(3)],
        (all, false, false) => all.iter().map(|&i| segment(i, (FIRST_FACE + f) as u8)).collect(),
    }
}

/// Makes the patch. `first_is_lower` says of each face with two even diagonals whether its first
/// corner has the lower label.
fn derive(kinds: &[u8; 8], first_is_lower: impl Fn(usize) -> bool) -> Patch {
    let of_face = |f: usize| segments(f, kinds, first_is_lower(f));
    let mut all: Vec<Segment> = (0..6).flat_map(of_face).collect();
    // One way round every loop.
    for s in &mut all {
        if kinds[s.left as usize] > kinds[s.right as usize] {
            *s = Segment { ends: [s.ends[1], s.ends[0]], left: s.right, right: s.left };
        }
    }
    let mut group: [u8; FIRST_INNER] = std::array::from_fn(|point| point as u8);
    for s in &all {
        let [from, to] = s.ends.map(|end| group[end as usize]);
        group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
    }
    let of_group = |number: u8| all.iter().filter(move |s| group[s.ends[0] as usize] == number);
    let parts: Vec<Vec<Segment>> = (0..FIRST_INNER as u8)
        .map(|number| of_group(number).copied().collect())
        .filter(|part: &Vec<_>| !part.is_empty())
        .collect();
    let mut patch = Patch::default();
    for part in &parts {
        let faces = FIRST_FACE as u8..FIRST_INNER as u8;
        let junctions: Vec<u8> =
            faces.filter(|face| part.iter().any(|s| s.ends.contains(face))).collect();
        let sheets = match junctions[..] {
            [] => vec![sheet(part, part[0])],
            [first, _] => part.iter().filter_map(|s| Some(sheet(part, s.from(first)?))).collect(),
            _ => Vec::new(),
        };
        // Two saddles, crosswise above each other, would touch in the middle of the cell.
        let is_saddle = junctions.is_empty() && part.len() >= SADDLE && parts.len() > 1;
        let cut: Option<Vec<_>> = sheets.iter().map(Sheet::cut).collect();
        if let Some(facets) = cut.filter(|facets| !facets.is_empty() && !is_saddle) {
            patch.triangles.extend(facets.concat());
            continue;
        }
        let inner = (FIRST_INNER + patch.inner.len()) as u8;
        patch.inner.push(mean(if junctions.is_empty() { &sheets[0].ring } else { &junctions }));
        patch.triangles.extend(part.iter().map(|s| Facet {
            points: [s.ends[0], s.ends[1], inner],
            behind: s.right,
            front: s.left,
        }));
    }
    patch
}

/// The border of a wall: along faces, and from the last point straight back to the first.
struct Sheet {
    ring: Vec<u8>,
    behind: u8,
    front: u8,
}

impl Sheet {
    fn cut(&self) -> Option<Vec<Facet>> {
        let facet = |points| Facet { points, behind: self.behind, front: self.front };
        Some(triangulate(&self.ring)?.into_iter().map(facet).collect())
    }
}

/// Follows the segments from `first` on, up to a junction or round to its start.
fn sheet(part: &[Segment], first: Segment) -> Sheet {
    let [start, mut at] = first.ends;
    let mut ring = vec![start];
    while at != start {
        let before = ring[ring.len() - 1];
        ring.push(at);
        let ways = part.iter().filter_map(|s| s.from(at)).filter(|s| s.ends[1] != before);
        match usize::from(at).checked_sub(FIRST_FACE) {
            None => at = ways.map(|s| s.ends[1]).next().unwrap_or(start),
            Some(_) => break,
        }
    }
    Sheet { ring, behind: first.right, front: first.left }
}

/// The mean of some points on edges and faces, to the nearest step.
fn mean(points: &[u8]) -> [u32; 3] {
    let halves = points.iter().map(|&p| middle(p.into()));
    let sum = halves.fold([0; 3], |sum, p| std::array::from_fn(|x| sum[x] + p[x]));
    let count = points.len() as u32;
    sum.map(|x| (x * STEPS + count) / (2 * count))
}

/// Where an edge's or a face's middle is, in half cells, if it lies on face `f`.
#[cfg(test)]
pub fn on_face(point: u8, f: usize) -> Option<[u32; 3]> {
    let at = (usize::from(point) < FIRST_INNER).then(|| middle(point.into()))?;
    (at[f / 2] == 2 * (f % 2) as u32).then_some(at)
}

//! The cell of marching cubes: corners, edges, faces, and the patch for each of the 256 masks.
//!
//! ```text
//!        6 ------- 7          corner c sits at (c & 1, c >> 1 & 1, c >> 2)
//!      / |       / |          edge  4 a + b runs along axis a; b counts its position in the
//!     4 ------- 5  |                plane of the other two axes, the lower axis in the low bit
//!     |  2 -----|- 3          face  2 a + s is the side s of axis a
//!     | /       | /
//!     0 ------- 1    x to the right, y into the page, z up
//! ```
//!
//! The table is derived, not pasted. On each face, every run of inside corners is cut off by one
//! segment (two inside corners across a diagonal stay apart), so both cells beside a face see the
//! same segments; segments join into loops, and each loop of n edges is cut into n - 2 triangles
//! by chords that never lie in a face. So no edge of the surface ever has more than two triangles.
//! Source: Lorensen and Cline 1987, with the face rule of the specification's theorem (A.8).

use std::sync::LazyLock;

/// The corner at the low end of edge `e`.
pub const fn edge_corner(e: usize) -> usize {
    let (axis, b) = (e / 4, e % 4);
    match axis {
        0 => b << 1,
        1 => (b & 1) | (b & 2) << 1,
        _ => b,
    }
}

/// The axis that edge `e` runs along.
pub const fn edge_axis(e: usize) -> usize {
    e / 4
}

/// The edge along `axis` whose low corner is `corner` with bit `axis` cleared.
pub const fn edge_at(corner: usize, axis: usize) -> usize {
    let (x, y, z) = (corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    4 * axis
        + match axis {
            0 => y | z << 1,
            1 => x | z << 1,
            _ => x | y << 1,
        }
}

/// The corners of face `f`, counter-clockwise seen from outside the cell.
pub const fn face_corners(f: usize) -> [usize; 4] {
    let (axis, side) = (f / 2, f % 2);
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = side << axis;
    if side == 1 {
        [base, base | u, base | u | v, base | v]
    } else {
        [base, base | v, base | u | v, base | u]
    }
}

/// The middles of edges are points 0 to 11, those of faces the points from here on.
pub(super) const FIRST_FACE: usize = 12;

/// Most points of a loop: all edges and faces.
const LONGEST: usize = 18;

/// The faces that contain an edge's or a face's middle, as bits.
pub(super) fn faces_of(point: usize) -> u8 {
    if let Some(f) = point.checked_sub(FIRST_FACE) {
        return 1 << f;
    }
    let (axis, corner) = (edge_axis(point), edge_corner(point));
    let mut faces = 0;
    for other in (0..3).filter(|&a| a != axis) {
        faces |= 1 << (2 * other + (corner >> other & 1));
    }
    faces
}

/// One closed loop of a mask.
#[derive(Debug, Clone, PartialEq)]
pub struct Ring {
    /// The crossed edges, outside on the left seen from outside the cell.
    pub edges: Vec<u8>,
    /// For each crossed edge, the face on which the loop runs on from it.
    pub faces: Vec<u8>,
    /// The loop's triangles, as in [`PATCHES`], by places in `edges`.
    pub triangles: Vec<[u32; 3]>,
}

/// The loops of every mask.
pub static RINGS: LazyLock<[Vec<Ring>; 256]> =
    LazyLock::new(|| std::array::from_fn(|mask| loops(mask).into_iter().map(Ring::new).collect()));

impl Ring {
    fn new(edges: Vec<u8>) -> Self {
        let place = |e: u8| edges.iter().take_while(|&&other| other != e).count() as u32;
        let triangles = triangulate(&edges).into_iter().flatten().map(|t| t.map(place)).collect();
        let faces = (0..edges.len())
            .map(|i| {
                let [a, b] = [edges[i], edges[(i + 1) % edges.len()]].map(usize::from);
                (faces_of(a) & faces_of(b)).trailing_zeros() as u8
            })
            .collect();
        Self { edges, faces, triangles }
    }
}

/// The triangles of one mask, as triples of edge numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Patch {
    count: u8,
    triangles: [[u8; 3]; 5],
}

impl Patch {
    /// The triangles, each wound counter-clockwise seen from outside the solid.
    pub fn triangles(&self) -> &[[u8; 3]] {
        &self.triangles[..self.count as usize]
    }

    /// Turns every triangle over, for placements that mirror.
    pub fn reverse(&mut self) {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// The patch of every mask; bit c of a mask is set where corner c is inside.
pub static PATCHES: LazyLock<[Patch; 256]> = LazyLock::new(|| std::array::from_fn(patch));

fn patch(mask: usize) -> Patch {
    let mut patch = Patch::default();
    for ring in loops(mask) {
        let Some(triangles) = triangulate(&ring) else {
            unreachable!("every loop of two labels can be cut; all 256 masks are tested")
        };
        for t in triangles {
            patch.triangles[patch.count as usize] = t;
            patch.count += 1;
        }
    }
    patch
}

/// The segments that cut off the inside corners of face `f`, each from a crossed edge to a crossed
/// edge, outside on the left seen from outside the cell.
fn segments(mask: usize, f: usize) -> impl Iterator<Item = (usize, usize)> {
    let inside = move |c: usize| mask >> c & 1 == 1;
    let ring = face_corners(f);
    let edge = move |i: usize| {
        let (a, b) = (ring[i % 4], ring[(i + 1) % 4]);
        edge_at(a & b, (a ^ b).trailing_zeros() as usize)
    };
    (0..4).filter(move |&i| !inside(ring[i]) && inside(ring[(i + 1) % 4])).map(move |first| {
        let run = (1..4).take_while(|&k| inside(ring[(first + k) % 4])).count();
        (edge(first), edge(first + run))
    })
}

/// Where the segments on a cell's faces lead: `ONWARD[mask][face][edge]` is the edge at the end of
/// the segment on that face that starts on that edge, [`NO_EDGE`] where none does.
pub static ONWARD: LazyLock<Box<[[[u8; 12]; 6]; 256]>> = LazyLock::new(|| {
    let mut onward = Box::new([[[NO_EDGE; 12]; 6]; 256]);
    for mask in 0..256 {
        for f in 0..6 {
            segments(mask, f).for_each(|(from, to)| onward[mask][f][from] = to as u8);
        }
    }
    onward
});

/// Stands for no edge in [`ONWARD`].
pub const NO_EDGE: u8 = u8::MAX;

/// The crossed edges of a mask, as bits.
pub const fn crossed(mask: usize) -> u16 {
    let mut edges = 0;
    let mut e = 0;
    while e < 12 {
        let c = edge_corner(e);
        edges |= (((mask >> c) ^ (mask >> (c | 1 << edge_axis(e)))) as u16 & 1) << e;
        e += 1;
    }
    edges
}

/// The closed loops of crossed edges on the cell's faces, outside on the left seen from outside
/// the cell.
pub fn loops(mask: usize) -> Vec<Vec<u8>> {
    let mut next = [None; 12];
    for f in 0..6 {
        segments(mask, f).for_each(|(from, to)| next[from] = Some(to));
    }
    let mut found = Vec::new();
    for start in 0..12 {
        let mut ring = Vec::new();
        let mut at = start;
        while let Some(to) = next[at].take() {
            ring.push(at as u8);
            at = to;
        }
        if !ring.is_empty() {
            found.push(ring);
        }
    }
    found
}

/// Cuts a loop of middles into triangles without a chord inside a face; of all such ways, the one with the
/// shortest chords. `None` where there is no such way.
pub(super) fn triangulate(ring: &[u8]) -> Option<Vec<[u8; 3]>> {
    let chord = |i: usize, j: usize| -> Option<u32> {
        if j - i == 1 || j - i == ring.len() - 1 {
            return Some(0);
        }
        let (a, b) = (ring[i] as usize, ring[j] as usize);
        (faces_of(a) & faces_of(b) == 0).then(|| {
            let (p, q) = (middle(a), middle(b));
            (0..3).map(|k| p[k].abs_diff(q[k]).pow(2)).sum()
        })
    };
    let last = ring.len().checked_sub(1).filter(|&last| last > 0)?;
    // The least cost of the polygon from i to j, and the point that closes it over that chord.
    let mut least = [[(0, 0); LONGEST]; LONGEST];
    for span in 2..ring.len() {
        for i in 0..ring.len() - span {
            let j = i + span;
            let way = |k: usize| {
                let (left, right): (u32, u32) = (least[i][k].0, least[k][j].0);
                (left.saturating_add(right), k)
            };
            let (parts, k) = (i + 1..j).map(way).min_by_key(|way| way.0)?;
            least[i][j] = (chord(i, j).map_or(u32::MAX, |own| own.saturating_add(parts)), k);
        }
    }
    fn collect(
        [i, j]: [usize; 2],
        least: &[[(u32, usize); LONGEST]; LONGEST],
        triangle: &mut impl FnMut([usize; 3]),
    ) {
        if j - i > 1 {
            let k = least[i][j].1;
            collect([i, k], least, triangle);
            collect([k, j], least, triangle);
            triangle([i, k, j]);
        }
    }
    if least[0][last].0 == u32::MAX {
        return None;
    }
    let mut triangles = Vec::with_capacity(last - 1);
    collect([0, last], &least, &mut |t| triangles.push(t.map(|i| ring[i])));
    Some(triangles)
}

/// Middle of an edge or a face, in half cells.
pub(super) fn middle(point: usize) -> [u32; 3] {
    if let Some(f) = point.checked_sub(FIRST_FACE) {
        return std::array::from_fn(|a| if a == f / 2 { 2 * (f % 2) as u32 } else { 1 });
    }
    let corner = edge_corner(point);
    std::array::from_fn(|a| if a == edge_axis(point) { 1 } else { 2 * (corner >> a & 1) as u32 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn every_mask_uses_its_crossed_edges_and_closes_on_the_faces() {
        let mut longest = 0;
        for mask in 0..256 {
            let patch = PATCHES[mask];
            let mut uses = BTreeMap::new();
            for t in patch.triangles() {
                for i in 0..3 {
                    assert!(crossed(mask) >> t[i] & 1 == 1, "mask {mask}");
                    *uses.entry((t[i], t[(i + 1) % 3])).or_insert(0) += 1;
                }
            }
            let rings = loops(mask);
            longest = longest.max(rings.iter().map(Vec::len).max().unwrap_or(0));
            let on_faces: usize = rings.iter().map(Vec::len).sum();
            assert_eq!(on_faces, crossed(mask).count_ones() as usize);
            assert_eq!(patch.triangles().len(), on_faces - 2 * rings.len());
            for (&(a, b), &n) in &uses {
                assert_eq!(n, 1, "mask {mask}");
                let on_face = faces_of(a.into()) & faces_of(b.into()) != 0;
                // Chords pair up inside the cell; segments on faces are left to the neighbour.
                assert_eq!(uses.contains_key(&(b, a)), !on_face, "mask {mask}");
            }
        }
        assert_eq!(longest, 7);
    }

    /// The segments that a patch leaves open on one face, in face-local terms.
    fn open_segments(mask: usize, f: usize) -> Vec<(u8, u8)> {
        let mut open = Vec::new();
        for t in PATCHES[mask].triangles() {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                if faces_of(a.into()) & faces_of(b.into()) & 1 << f != 0 {
                    open.push((a, b));
                }
            }
        }
        open.sort_unstable();
        open
    }

    #[test]
    fn cells_that_share_a_face_agree_on_it() {
        for axis in 0..3 {
            let bit = 1 << axis;
            for low in 0..256usize {
                for high in 0..256usize {
                    let shared = (0..8).filter(|c| c & bit != 0);
                    if shared.clone().any(|c| (low >> c ^ high >> (c ^ bit)) & 1 == 1) {
                        continue;
                    }
                    let seen = open_segments(low, 2 * axis + 1);
                    let shift = |e: u8| {
                        let c = edge_corner(e.into()) ^ bit;
                        edge_at(c, edge_axis(e.into())) as u8
                    };
                    let mut expected: Vec<_> = open_segments(high, 2 * axis)
                        .iter()
                        .map(|&(a, b)| (shift(b), shift(a)))
                        .collect();
                    expected.sort_unstable();
                    assert_eq!(seen, expected, "masks {low} and {high} along axis {axis}");
                }
            }
        }
    }
}

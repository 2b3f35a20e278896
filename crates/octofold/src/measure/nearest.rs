//! The nearest point of a mesh, and the triangle that it lies on.
//!
//! The answer is that of a search through all triangles, up to the last bits of rounding;
//! triangles without area count as the segments or points that they are. Where several triangles
//! are equally near, the lowest number wins. Closest points follow the regions of Ericson,
//! "Real-Time Collision Detection", 5.1.5; slivers, where the regions drown in rounding, take the
//! best of their edges and their inside instead.

use super::bvh::{Box3, Bvh, Child, Item, Node, STACK};
use crate::mesh::{Mesh, bounds};
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec3;

const BLOCK: usize = 1024;

/// Below this sine squared at its sharpest corner a triangle is a sliver.
const SLIVER: f64 = 1e-6;

/// The nearest point of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The triangle it lies on.
    pub triangle: u32,
    /// Where it is.
    pub point: [f64; 3],
    /// Its distance from the query, squared.
    pub distance_squared: f64,
}

/// An index over the triangles of one mesh.
#[derive(Debug, Clone)]
pub struct Nearest {
    tree: Bvh,
    /// In the order of the tree's items.
    faces: Vec<Face>,
    diagonal: f64,
}

impl Nearest {
    /// Indexes all triangles of `mesh`.
    pub fn new(mesh: &Mesh) -> Self {
        let numbers: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let tree = Bvh::new(par::map(&numbers, |&t| Item {
            around: Box3::around(&mesh.corners(t as usize)),
            triangle: t,
        }));
        let faces = par::map(&tree.items, |i| Face::new(mesh.corners(i.triangle as usize)));
        let [low, high] = bounds(&mesh.points).unwrap_or_default().map(DVec3::from);
        Self { tree, faces, diagonal: low.distance(high) }
    }

    /// The nearest point of the mesh; `None` where the mesh has no triangles.
    pub fn nearest(&self, query: [f64; 3]) -> Option<Hit> {
        self.search(query.into(), f64::INFINITY, None).map(|best| self.hit(query, &best))
    }

    /// The nearest point of the mesh no farther than `distance`.
    pub fn nearest_within(&self, query: [f64; 3], distance: f64) -> Option<Hit> {
        self.search(query.into(), distance * distance, None).map(|best| self.hit(query, &best))
    }

    /// The nearest points for many queries, in their order.
    pub fn nearest_all(
        &self,
        queries: &[[f64; 3]],
        run: &Run,
    ) -> Result<Vec<Option<Hit>>, Cancelled> {
        let parts = par::blocks(run, queries.len(), BLOCK, |range| {
            queries[range].iter().map(|&q| self.nearest(q)).collect::<Vec<_>>()
        })?;
        Ok(parts.concat())
    }

    /// Where the line through `from` along `direction` crosses the mesh nearest to `from`, either way
    /// and no further than `reach` times the direction: the factor of the direction. Crossings at the
    /// border of a triangle count.
    pub fn crossing(&self, from: [f64; 3], direction: [f64; 3], reach: f64) -> Option<f64> {
        let (start, way) = (DVec3::from(from), DVec3::from(direction));
        let mut best: Option<f64> = None;
        let mut stack = [0u32; STACK];
        let mut waiting = usize::from(!self.tree.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let node = &self.tree.nodes[stack[waiting] as usize];
            for k in (0..4).filter(|&k| node.is_used(k)) {
                let most = best.map_or(reach, f64::abs);
                if !meets(node, k, from, direction, most) {
                    continue;
                }
                match node.child(k) {
                    Child::Inner(child) => {
                        stack[waiting] = child;
                        waiting += 1;
                    }
                    Child::Leaf(leaf) => {
                        for at in leaf.filter_map(|face| self.faces[face].crossing(start, way)) {
                            if at.abs() <= best.map_or(reach, f64::abs) {
                                best = Some(at);
                            }
                        }
                    }
                }
            }
        }
        best
    }

    /// The faces, in an order of the index's own.
    pub(super) fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The nearest face no farther than `distance`, as its place in [`Self::faces`], and how far
    /// it is. The answer is the same with any `hint`; one that is near saves most of the search.
    pub(super) fn nearest_face(
        &self,
        query: DVec3,
        distance: f64,
        hint: Option<usize>,
    ) -> Option<(usize, f64)> {
        let best = self.search(query, distance * distance, hint)?;
        Some((best.face, best.distance_squared.sqrt()))
    }

    fn hit(&self, query: [f64; 3], best: &Best) -> Hit {
        Hit {
            triangle: best.triangle,
            point: (DVec3::from(query) + best.offset).to_array(),
            distance_squared: best.distance_squared,
        }
    }

    fn search(&self, p: DVec3, farthest_squared: f64, hint: Option<usize>) -> Option<Best> {
        let query = p.to_array();
        let mut best = Best {
            distance_squared: farthest_squared,
            reach: self.reach(farthest_squared),
            triangle: u32::MAX,
            face: 0,
            offset: DVec3::NAN,
        };
        if let Some(face) = hint {
            self.look_at(face, p, &mut best);
        }
        let mut stack = [(0.0f64, 0u32); STACK];
        let mut waiting = usize::from(!self.tree.nodes.is_empty());
        while waiting > 0 {
            waiting -= 1;
            let (bound, number) = stack[waiting];
            if bound > best.reach {
                continue;
            }
            let node = &self.tree.nodes[number as usize];
            let bounds = box_distances(node, query);
            let base = waiting;
            for k in 0..4 {
                if bounds[k].is_nan() || bounds[k] > best.reach {
                    continue;
                }
                match node.child(k) {
                    Child::Inner(child) => {
                        // Nearest on top: what it yields spares most of the others.
                        let mut at = waiting;
                        while at > base && stack[at - 1].0 < bounds[k] {
                            stack[at] = stack[at - 1];
                            at -= 1;
                        }
                        stack[at] = (bounds[k], child);
                        waiting += 1;
                    }
                    Child::Leaf(leaf) => leaf.for_each(|face| self.look_at(face, p, &mut best)),
                }
            }
        }
        (best.triangle != u32::MAX).then_some(best)
    }

    #[inline]
    fn look_at(&self, face: usize, p: DVec3, best: &mut Best) {
        let offset = self.faces[face].offset_from(p);
        let d = offset.length_squared();
        let triangle = self.tree.items[face].triangle;
        if d < best.distance_squared || (d == best.distance_squared && triangle < best.triangle) {
            *best = Best { distance_squared: d, reach: self.reach(d), triangle, face, offset };
        }
    }

    /// Squared distance within which a box may hold something that rounds to no farther than
    /// `distance_squared`.
    fn reach(&self, distance_squared: f64) -> f64 {
        let distance = distance_squared.sqrt();
        let slack = 16.0 * f64::EPSILON * (distance + self.diagonal);
        (distance + slack) * (distance + slack)
    }
}

struct Best {
    distance_squared: f64,
    reach: f64,
    triangle: u32,
    face: usize,
    offset: DVec3,
}

/// Squared distances from `p` to the boxes of a node; NaN for a child that is not there.
fn box_distances(node: &Node, p: [f64; 3]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for x in 0..3 {
        for k in 0..4 {
            let below = f64::from(node.low[x][k]) - p[x];
            let above = p[x] - f64::from(node.high[x][k]);
            let outside = if below > above { below } else { above };
            let outside = if outside < 0.0 { 0.0 } else { outside };
            sum[k] += outside * outside;
        }
    }
    sum
}

/// Whether a line comes into the box of child `k` between `-most` and `most` times its direction.
fn meets(node: &Node, k: usize, from: [f64; 3], direction: [f64; 3], most: f64) -> bool {
    let (mut first, mut last) = (-most, most);
    for x in 0..3 {
        let (low, high) = (f64::from(node.low[x][k]), f64::from(node.high[x][k]));
        if direction[x] == 0.0 {
            if from[x] < low || from[x] > high {
                return false;
            }
            continue;
        }
        let (a, b) = ((low - from[x]) / direction[x], (high - from[x]) / direction[x]);
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    first <= last + 1e-9 * most
}

/// The nearest point of one triangle.
pub fn nearest_on(corners: [[f64; 3]; 3], query: [f64; 3]) -> [f64; 3] {
    let p = DVec3::from(query);
    (p + Face::new(corners).offset_from(p)).to_array()
}

/// A triangle, made ready for distances.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    a: DVec3,
    ab: DVec3,
    ac: DVec3,
    sliver: bool,
}

impl Face {
    pub(crate) fn new(corners: [[f64; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(DVec3::from);
        let (ab, ac) = (b - a, c - a);
        let longest = ab.length_squared().max(ac.length_squared()).max((c - b).length_squared());
        let doubled_area_squared = ab.cross(ac).length_squared();
        let sliver = doubled_area_squared <= SLIVER * longest * longest;
        Self { a, ab, ac, sliver }
    }

    /// Distance of `p` from the face, squared: up to rounding never less than that of a point of
    /// the face.
    #[inline]
    pub(crate) fn distance_squared(&self, p: DVec3) -> f64 {
        self.offset_from(p).length_squared()
    }

    /// Where a line crosses the face, as a factor of its direction.
    fn crossing(&self, from: DVec3, direction: DVec3) -> Option<f64> {
        const EDGE: f64 = 1e-9;
        let across = direction.cross(self.ac);
        let whole = self.ab.dot(across);
        let start = from - self.a;
        let (first, turned) = (start.dot(across) / whole, start.cross(self.ab));
        let second = direction.dot(turned) / whole;
        let inside = first >= -EDGE && second >= -EDGE && first + second <= 1.0 + EDGE;
        inside.then(|| self.ac.dot(turned) / whole)
    }

    /// One corner, and the way from it to both others.
    pub(super) fn spread(&self) -> [DVec3; 3] {
        [self.a, self.ab, self.ac]
    }

    /// From `p` to the closest point of the face.
    #[inline]
    fn offset_from(&self, p: DVec3) -> DVec3 {
        let (ab, ac) = (self.ab, self.ac);
        let ap = p - self.a;
        if self.sliver {
            return self.offset_from_sliver(ap);
        }
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return -ap;
        }
        let bp = ap - ab;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return -bp;
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return ab * (d1 / (d1 - d3)) - ap;
        }
        let cp = ap - ac;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return -cp;
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return ac * (d2 / (d2 - d6)) - ap;
        }
        let va = d3 * d6 - d5 * d4;
        let (along_b, along_c) = (d4 - d3, d5 - d6);
        if va <= 0.0 && along_b >= 0.0 && along_c >= 0.0 {
            return (ac - ab) * (along_b / (along_b + along_c)) - bp;
        }
        let scale = 1.0 / (va + vb + vc);
        ab * (vb * scale) + ac * (vc * scale) - ap
    }

    #[inline(never)]
    fn offset_from_sliver(&self, ap: DVec3) -> DVec3 {
        let (ab, ac) = (self.ab, self.ac);
        let edges = [
            offset_to_segment(ap, ab),
            offset_to_segment(ap, ac),
            offset_to_segment(ap - ab, ac - ab),
        ];
        let candidates = edges.into_iter().chain(self.offset_to_inside(ap));
        candidates.fold(DVec3::INFINITY, |best, offset| {
            if offset.length_squared() < best.length_squared() { offset } else { best }
        })
    }

    /// To the foot of the perpendicular, where that lies inside the face.
    fn offset_to_inside(&self, ap: DVec3) -> Option<DVec3> {
        let (ab, ac) = (self.ab, self.ac);
        let n = ab.cross(ac);
        let scale = 1.0 / n.length_squared();
        let (mut v, mut w, mut rest) = (0.0, 0.0, ap);
        // The second round takes up what rounding left in the plane after the first.
        for _ in 0..2 {
            v += rest.cross(ac).dot(n) * scale;
            w += ab.cross(rest).dot(n) * scale;
            rest = ap - ab * v - ac * w;
        }
        (v >= 0.0 && w >= 0.0 && v + w <= 1.0).then_some(-rest)
    }
}

/// From a point, given relative to the segment's start, to the closest point of the segment.
fn offset_to_segment(from_start: DVec3, segment: DVec3) -> DVec3 {
    let along = segment.dot(from_start);
    let whole = segment.length_squared();
    if along <= 0.0 || whole == 0.0 {
        -from_start
    } else if along >= whole {
        segment - from_start
    } else {
        segment * (along / whole) - from_start
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::strategy::ValueTree;
    use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

    /// Small triangles all over the unit cube, and among them long ones, slivers, segments, points
    /// and repeated ones.
    fn soup() -> impl Strategy<Value = Mesh> {
        let unit = || prop::array::uniform3(0.0..1.0f64);
        let triangle = (unit(), unit(), unit(), 0..12u8).prop_map(|(a, b, c, kind)| {
            let near = |p: [f64; 3], size: f64| std::array::from_fn(|x| a[x] + size * (p[x] - 0.5));
            match kind {
                0 => vec![[a, b, c]],
                1 => vec![[a, b, std::array::from_fn(|x| (a[x] + b[x]) / 2.0 + 1e-9 * c[x])]],
                2 => vec![[a, b, a]],
                3 => vec![[a, a, a]],
                4 => vec![[a, b, near(c, 1e-3)]],
                5 => vec![[a, near(b, 0.1), near(c, 0.1)]; 2],
                _ => vec![[a, near(b, 0.1), near(c, 0.1)]],
            }
        });
        prop::collection::vec(triangle, 400).prop_map(|triangles| {
            let points = triangles.concat().concat();
            let count = points.len() as u32 / 3;
            Mesh::new(points, (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()).unwrap()
        })
    }

    fn sample<T>(strategy: impl Strategy<Value = T>) -> T {
        let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        let mut runner = TestRunner::new_with_rng(ProptestConfig::default(), rng);
        strategy.new_tree(&mut runner).unwrap().current()
    }

    #[test]
    fn a_hundred_thousand_queries_agree_with_brute_force() {
        let mesh = sample(soup());
        let box_queries = prop::collection::vec(prop::array::uniform3(-0.5..1.5f64), 90_000);
        let mut queries = sample(box_queries);
        // On corners, where triangles are equally near.
        queries.extend(mesh.points.iter().cycle().take(10_000));
        let index = Nearest::new(&mesh);
        let faces: Vec<Face> =
            (0..mesh.triangles.len()).map(|t| Face::new(mesh.corners(t))).collect();
        let run = Run::default();
        let found = index.nearest_all(&queries, &run).unwrap();
        let expected = par::map(&queries, |&q| {
            let d = |f: &Face| f.offset_from(q.into()).length_squared();
            let by_distance = faces.iter().map(d).enumerate().map(|(t, d)| (d.to_bits(), t));
            by_distance.min().unwrap()
        });
        for ((query, hit), (bits, triangle)) in queries.iter().zip(found).zip(expected) {
            let hit = hit.unwrap();
            assert_eq!((hit.distance_squared.to_bits(), hit.triangle as usize), (bits, triangle));
            let back = DVec3::from(hit.point).distance_squared((*query).into());
            assert!((back - hit.distance_squared).abs() < 1e-14);
            let distance = hit.distance_squared.sqrt();
            assert_eq!(index.nearest_within(*query, distance * 1.000_001 + 1e-300), Some(hit));
            assert!(
                distance == 0.0 || index.nearest_within(*query, distance * 0.999_999).is_none()
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5_000))]

        #[test]
        fn regions_and_candidates_find_the_same_point(
            corners in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            query in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let face = Face::new(corners);
            prop_assume!(!face.sliver);
            let ap = DVec3::from(query) - face.a;
            let (one, other) = (face.offset_from(query.into()), face.offset_from_sliver(ap));
            prop_assert!(one.distance(other) < 1e-9, "{one} {other}");
            prop_assert!((one.length() - other.length()).abs() < 1e-13);
        }
    }

    #[test]
    fn lines_cross_where_a_search_through_all_triangles_says() {
        let mesh = sample(soup());
        let index = Nearest::new(&mesh);
        let lines = prop::collection::vec(
            prop::array::uniform2(prop::array::uniform3(-1.0..2.0f64)),
            2_000,
        );
        let mut crossed = 0;
        for [from, direction] in sample(lines) {
            let of = |t: usize| Face::new(mesh.corners(t)).crossing(from.into(), direction.into());
            let all = (0..mesh.triangles.len()).filter_map(of).filter(|at| at.abs() <= 0.7);
            let nearest = all.map(f64::abs).min_by(f64::total_cmp);
            assert_eq!(index.crossing(from, direction, 0.7).map(f64::abs), nearest);
            crossed += usize::from(nearest.is_some());
        }
        assert!(crossed > 100, "{crossed}");
    }

    #[test]
    fn a_mesh_without_triangles_has_no_nearest_point() {
        let mesh = Mesh::new(vec![[0.0; 3]], vec![]).unwrap();
        assert_eq!(Nearest::new(&mesh).nearest([0.0; 3]), None);
    }

    #[test]
    fn the_lowest_of_equally_near_triangles_wins() {
        let square = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::new(square, vec![[2, 3, 0], [0, 1, 2], [0, 1, 2]]).unwrap();
        let hit = Nearest::new(&mesh).nearest([0.5, 0.5, 1.0]).unwrap();
        assert_eq!((hit.triangle, hit.point, hit.distance_squared), (0, [0.5, 0.5, 0.0], 1.0));
        let hit = Nearest::new(&mesh).nearest([0.75, 0.25, 1.0]).unwrap();
        assert_eq!(hit.triangle, 1);
    }
}

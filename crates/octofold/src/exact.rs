//! Exact predicates on points, segments and triangles.
//!
//! Every answer is that of exact arithmetic on the given doubles (Shewchuk, "Adaptive Precision
//! Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997), as long as products of
//! three coordinate differences neither overflow nor underflow. Segments and triangles are closed
//! sets: touching is meeting.

use robust::{Coord, Coord3D};

/// A point of space.
pub type Point = [f64; 3];

/// Side of the plane `a b c` that `d` lies on: 1 below (`a b c` runs clockwise seen from `d`),
/// -1 above, 0 on it.
pub fn side(a: Point, b: Point, c: Point, d: Point) -> i8 {
    let coord = |[x, y, z]: Point| Coord3D { x, y, z };
    // Planes square to an axis are frequent, and the adaptive way to zero is long.
    if (0..3).any(|x| a[x] == b[x] && a[x] == c[x] && a[x] == d[x]) {
        return 0;
    }
    sign(robust::orient3d(coord(a), coord(b), coord(c), coord(d)))
}

/// Turn of the path `a b c` seen along coordinate axis `axis`: 1 left, -1 right, 0 straight.
pub fn turn(axis: usize, a: Point, b: Point, c: Point) -> i8 {
    let coord = |p: Point| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] };
    sign(robust::orient2d(coord(a), coord(b), coord(c)))
}

/// An axis along which the triangle does not look like a segment; `None` where its corners lie on
/// one line.
pub fn clear_axis([a, b, c]: [Point; 3]) -> Option<usize> {
    (0..3).find(|&axis| turn(axis, a, b, c) != 0)
}

/// True where the triangle's corners lie on one line, so that it has no area.
pub fn is_flat(triangle: [Point; 3]) -> bool {
    clear_axis(triangle).is_none()
}

/// True where two triangles, neither of them flat, have a point in common.
pub fn triangles_meet(a: [Point; 3], b: [Point; 3]) -> bool {
    let sides_of_b = b.map(|p| side(a[0], a[1], a[2], p));
    if apart(&sides_of_b) {
        return false;
    }
    if sides_of_b == [0; 3] {
        return clear_axis(a).is_some_and(|axis| {
            !separated_by_an_edge(axis, a, b) && !separated_by_an_edge(axis, b, a)
        });
    }
    let sides_of_a = a.map(|p| side(b[0], b[1], b[2], p));
    if apart(&sides_of_a) {
        return false;
    }
    (0..3).any(|i| {
        let j = (i + 1) % 3;
        crosses([a[i], a[j]], [sides_of_a[i], sides_of_a[j]], b)
            || crosses([b[i], b[j]], [sides_of_b[i], sides_of_b[j]], a)
    })
}

/// True where the triangles on `corner` and `a`, and on `corner` and `b`, neither of them flat,
/// have a point in common besides the corner.
pub fn triangles_meet_beyond(corner: Point, a: [Point; 2], b: [Point; 2]) -> bool {
    let [of_a, of_b] = [a, b].map(|[p, q]| [corner, p, q]);
    let sides_of_b = b.map(|p| side(corner, a[0], a[1], p));
    if apart(&sides_of_b) {
        return false;
    }
    let sides_of_a = a.map(|p| side(corner, b[0], b[1], p));
    if apart(&sides_of_a) {
        return false;
    }
    // What they share is convex and contains the corner: it ends on an edge against the corner.
    crosses(a, sides_of_a, of_b) || crosses(b, sides_of_b, of_a)
}

/// True where the triangles `p q a` and `p q b` lie in one plane, on the same side of `p q`.
pub fn folded_flat(p: Point, q: Point, a: Point, b: Point) -> bool {
    side(p, q, a, b) == 0
        && clear_axis([p, q, a]).is_some_and(|axis| turn(axis, p, q, a) == turn(axis, p, q, b))
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

fn apart(sides: &[i8]) -> bool {
    sides.iter().all(|&s| s > 0) || sides.iter().all(|&s| s < 0)
}

/// Whether a segment meets a triangle, given the sides of the triangle's plane that its ends lie
/// on.
fn crosses([p, q]: [Point; 2], [side_p, side_q]: [i8; 2], [a, b, c]: [Point; 3]) -> bool {
    if side_p * side_q > 0 {
        return false;
    }
    if side_p == 0 && side_q == 0 {
        return clear_axis([a, b, c])
            .is_some_and(|axis| segment_meets_triangle_in_plane(axis, [p, q], [a, b, c]));
    }
    // The line through p and q meets the plane in one point, and that point lies on the segment;
    // it is inside the triangle where the line passes all three edges on the same side.
    let passes = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    passes.iter().all(|&s| s >= 0) || passes.iter().all(|&s| s <= 0)
}

/// Whether the line through an edge of `t` has `t` on one side and `other` strictly on the other.
fn separated_by_an_edge(axis: usize, t: [Point; 3], other: [Point; 3]) -> bool {
    let outside = -turn(axis, t[0], t[1], t[2]);
    (0..3).any(|i| other.iter().all(|&p| turn(axis, t[i], t[(i + 1) % 3], p) == outside))
}

fn segment_meets_triangle_in_plane(axis: usize, [p, q]: [Point; 2], t: [Point; 3]) -> bool {
    inside_in_plane(axis, p, t)
        || (0..3).any(|i| segments_meet_in_plane(axis, [p, q], [t[i], t[(i + 1) % 3]]))
}

fn inside_in_plane(axis: usize, p: Point, [a, b, c]: [Point; 3]) -> bool {
    let turns = [turn(axis, a, b, p), turn(axis, b, c, p), turn(axis, c, a, p)];
    turns.iter().all(|&s| s >= 0) || turns.iter().all(|&s| s <= 0)
}

fn segments_meet_in_plane(axis: usize, [p, q]: [Point; 2], [a, b]: [Point; 2]) -> bool {
    let [ta, tb] = [turn(axis, p, q, a), turn(axis, p, q, b)];
    let [tp, tq] = [turn(axis, a, b, p), turn(axis, a, b, q)];
    if ta == 0 && tb == 0 && tp == 0 && tq == 0 {
        // All on one line: they meet where their shadows on both axes do.
        return [(axis + 1) % 3, (axis + 2) % 3]
            .into_iter()
            .all(|x| p[x].min(q[x]) <= a[x].max(b[x]) && a[x].min(b[x]) <= p[x].max(q[x]));
    }
    ta * tb <= 0 && tp * tq <= 0
}

#[cfg(test)]
pub(crate) mod oracle {
    //! The same questions, answered in integers by other means.

    use super::Point;

    type Int3 = [i128; 3];

    pub fn int(p: Point) -> Int3 {
        p.map(|x| x as i128)
    }

    pub fn sub(p: Int3, q: Int3) -> Int3 {
        [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
    }

    pub fn cross(p: Int3, q: Int3) -> Int3 {
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    }

    pub fn dot(p: Int3, q: Int3) -> i128 {
        p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
    }

    pub fn normal([a, b, c]: [Point; 3]) -> Int3 {
        cross(sub(int(b), int(a)), sub(int(c), int(a)))
    }

    /// Whether the hulls of `a` and `b` meet: they do unless a plane lies strictly between them,
    /// and if there is such a plane, one is square to a normal, an edge, or a product of two.
    pub fn meet(a: &[Point], b: &[Point]) -> bool {
        let mut spans = Vec::new();
        for hull in [a, b] {
            for i in 0..hull.len() {
                spans.push(sub(int(hull[(i + 1) % hull.len()]), int(hull[i])));
            }
            if let &[a, b, c] = hull {
                spans.push(normal([a, b, c]));
            }
        }
        let products = spans.iter().flat_map(|&p| spans.iter().map(move |&q| cross(p, q)));
        let directions: Vec<_> = spans.iter().copied().chain(products).collect();
        !directions.iter().any(|&d| {
            let along = |hull: &[Point]| hull.iter().map(|&p| dot(int(p), d)).collect::<Vec<_>>();
            let (a, b) = (along(a), along(b));
            a.iter().max() < b.iter().min() || b.iter().max() < a.iter().min()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point> {
        prop::array::uniform3(-2i8..=2).prop_map(|p| p.map(f64::from))
    }

    fn triangle() -> impl Strategy<Value = [Point; 3]> {
        prop::array::uniform3(point()).prop_filter("flat", |&t| !is_flat(t))
    }

    proptest! {
        #![proptest_config(ProptestConfig { max_global_rejects: 20_000, ..ProptestConfig::with_cases(20_000) })]

        #[test]
        fn triangles_meet_as_integers_say(a in triangle(), b in triangle()) {
            prop_assert_eq!(triangles_meet(a, b), oracle::meet(&a, &b));
        }

        #[test]
        fn triangles_meet_beyond_a_corner_as_integers_say(
            a in triangle(),
            b in prop::array::uniform2(point()),
        ) {
            let [corner, p, q] = a;
            let of_b = [corner, b[0], b[1]];
            prop_assume!(!is_flat(of_b) && b.iter().all(|r| !a.contains(r)));
            let expected = oracle::meet(&[p, q], &of_b) || oracle::meet(&b, &a);
            prop_assert_eq!(triangles_meet_beyond(corner, [p, q], b), expected);
        }
    }

    #[test]
    fn coplanarity_is_decided_beyond_rounding() {
        let tiny = f64::EPSILON / 2.0;
        let [a, b, c] = [[0.5, 0.5, 0.5], [12.0, 12.0, 12.0], [24.0, 24.0, 24.0]];
        assert!(is_flat([a, b, c]));
        assert!(!is_flat([[0.5 + tiny, 0.5, 0.5], b, c]));
    }
}

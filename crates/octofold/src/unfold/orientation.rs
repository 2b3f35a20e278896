//! Which side of each face is printed.
//!
//! Neighbours across an edge of two faces should show the same side; where three or more faces
//! meet, so should the two that go on most straight. A band with one side only (Moebius) keeps edges
//! where the sides change: no fold goes across these.

use super::edges::Edges;
use super::sets::Sets;
use glam::DVec3;

/// Turns triangles over where that makes neighbours show the same side; the larger part of each
/// connected set keeps its own.
pub(super) fn orient(points: &[[f64; 3]], triangles: &mut [[u32; 3]]) {
    let corner = |p: u32| DVec3::from_array(points[p as usize]);
    let normals: Vec<DVec3> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(corner);
            (b - a).cross(c - a)
        })
        .collect();
    let edges = Edges::of_triangles(triangles);
    let mut sets = Sets::singles(triangles.len());
    for sides in edges.iter() {
        if let [a, b] = sides {
            sets.join_turned(a.face, b.face, !a.opposes(b));
        }
    }
    let mut straight = Vec::new();
    for (edge, sides) in edges.iter().enumerate().filter(|(_, sides)| sides.len() > 2) {
        for (i, a) in sides.iter().enumerate() {
            for b in &sides[i + 1..] {
                let [m, n] = [a, b].map(|s| normals[s.face as usize].normalize_or_zero());
                let sign = if a.opposes(b) { 1.0 } else { -1.0 };
                straight.push((sign * m.dot(n), edge, *a, *b));
            }
        }
    }
    straight.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, _, a, b) in straight {
        sets.join_turned(a.face, b.face, !a.opposes(&b));
    }
    for group in sets.groups() {
        let sign =
            |&t: &u32| normals[t as usize].length() * [1.0, -1.0][usize::from(sets.find(t).1)];
        let keeps = group.iter().map(sign).sum::<f64>() >= 0.0;
        for &t in &group {
            if sets.find(t).1 == keeps {
                triangles[t as usize].swap(1, 2);
            }
        }
    }
}

//! The cells of a grid that a triangle touches, and maybe a few that it only nearly does.

use glam::DVec3;

/// Triangles are taken this much larger, so that rounding cannot miss a cell.
const SLACK: f64 = 1e-9;

/// Calls `visit` with every cell of `size` that the triangle touches within `bounds`, the first
/// and the last cell on each axis; stops, and gives false, where `visit` does. The triangle must
/// not be flat, and `normal` is its unit normal.
pub fn cover(
    corners: [DVec3; 3],
    normal: DVec3,
    size: f64,
    bounds: [[u32; 3]; 2],
    mut visit: impl FnMut([u32; 3]) -> bool,
) -> bool {
    let steep = normal.abs();
    let k = if steep.x >= steep.y && steep.x >= steep.z {
        0
    } else if steep.y >= steep.z {
        1
    } else {
        2
    };
    let (u, v) = ((k + 1) % 3, (k + 2) % 3);
    let flat = corners.map(|p| [p[u] / size, p[v] / size, p[k] / size]);
    let (slope_u, slope_v) = (-normal[u] / normal[k], -normal[v] / normal[k]);
    let range = |i: usize| {
        let [x, y, z] = flat.map(|p| p[i]);
        (x.min(y).min(z) - SLACK, x.max(y).max(z) + SLACK)
    };
    let clip = |axis: usize, low: f64, high: f64| {
        let [first, last] = bounds.map(|b| b[axis]);
        // Negative numbers become 0.
        (low as u32).max(first)..=(high as u32).min(last)
    };
    let (v_low, v_high) = range(1);
    let (k_low, k_high) = range(2);
    for row in clip(v, v_low, v_high) {
        let strip = (v_low.max(f64::from(row)), v_high.min(f64::from(row) + 1.0));
        let (mut u_low, mut u_high) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..3 {
            let (p, q) = (flat[i], flat[(i + 1) % 3]);
            let (p, q) = if p[1] <= q[1] { (p, q) } else { (q, p) };
            if q[1] < strip.0 - SLACK || p[1] > strip.1 + SLACK {
                continue;
            }
            let [first, last] = if q[1] - p[1] < SLACK {
                [p[0], q[0]]
            } else {
                let slope = (q[0] - p[0]) / (q[1] - p[1]);
                [strip.0.max(p[1]), strip.1.min(q[1])].map(|v| p[0] + slope * (v - p[1]))
            };
            u_low = u_low.min(first).min(last);
            u_high = u_high.max(first).max(last);
        }
        u_low -= SLACK;
        u_high += SLACK;
        if u_low > u_high {
            continue;
        }
        let end = |slope: f64, low: f64, high: f64| {
            let (p, q) = (slope * low, slope * high);
            (p.min(q), p.max(q))
        };
        let on_v = end(slope_v, strip.0 - flat[0][1], strip.1 - flat[0][1]);
        for column in clip(u, u_low, u_high) {
            let across = (u_low.max(f64::from(column)), u_high.min(f64::from(column) + 1.0));
            let on_u = end(slope_u, across.0 - flat[0][0], across.1 - flat[0][0]);
            let low = (flat[0][2] + on_u.0 + on_v.0 - SLACK).max(k_low);
            let high = (flat[0][2] + on_u.1 + on_v.1 + SLACK).min(k_high);
            for layer in clip(k, low, high) {
                let mut at = [0; 3];
                (at[u], at[v], at[k]) = (column, row, layer);
                if !visit(at) {
                    return false;
                }
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #![proptest_config(crate::sweep::cases(200))]

        #[test]
        fn no_cell_is_missed(
            corners in prop::array::uniform3(prop::array::uniform3(0.0f64..20.0)),
            size in prop::sample::select(vec![1.0, 4.0]),
        ) {
            let corners = corners.map(DVec3::from);
            let [a, b, c] = corners;
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { return Ok(()) };
            let mut seen = BTreeSet::new();
            cover(corners, normal, size, [[0; 3], [31; 3]], |at| seen.insert(at));
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let [s, t] = [i, j].map(|x| f64::from(x) / 60.0);
                    let p = (a + (b - a) * s + (c - a) * t) / size;
                    prop_assert!(seen.contains(&p.to_array().map(|x| x as u32)));
                }
            }
            prop_assert!(seen.len() as f64 <= 40.0 + 6.0 * (b - a).cross(c - a).length());
        }
    }
}

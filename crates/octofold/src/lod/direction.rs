//! Unit vectors in two bytes, as points of an unfolded octahedron.
//!
//! Source: Meyer, Suessmuth, Sussner, Stamminger, Greiner, "On Floating-Point Normal Vectors", 2010.

use glam::DVec3;

/// The nearest two bytes to a direction; what has none points up.
pub(super) fn packed(direction: DVec3) -> [u8; 2] {
    let sum = direction.abs().element_sum();
    if sum.is_nan() || sum <= 0.0 {
        return [128, 128];
    }
    let DVec3 { x, y, z } = direction / sum;
    let [x, y] =
        if z < 0.0 { [(1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)] } else { [x, y] };
    [x, y].map(|c| (c * 127.0).round() as i32 + 128).map(|c| c.clamp(1, 255) as u8)
}

/// The direction of two bytes, of unit length.
pub(super) fn unpacked(bytes: [u8; 2]) -> DVec3 {
    let [x, y] = bytes.map(|c| (f64::from(c) - 128.0) / 127.0);
    let z = 1.0 - x.abs() - y.abs();
    let under = (-z).max(0.0);
    DVec3::new(x - under.copysign(x), y - under.copysign(y), z).normalize_or(DVec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn directions_come_back_within_a_degree(
            d in prop::array::uniform3(-1.0f64..1.0).prop_filter("short", |d| DVec3::from(*d).length() > 0.1),
        ) {
            let d = DVec3::from(d).normalize();
            prop_assert!(unpacked(packed(d)).dot(d) > 1f64.to_radians().cos());
        }

        #[test]
        fn bytes_are_unit_vectors(a: u8, b: u8) {
            prop_assert!((unpacked([a, b]).length() - 1.0).abs() < 1e-9);
        }
    }
}

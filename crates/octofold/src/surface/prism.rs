//! The tolerance test of Nishio, Kobori and Kutsuwa 1997, section 3.4: a prism round a triangle.
//!
//! The prism lies between two planes parallel to the triangle and three planes square to it, each
//! at the tolerance from the triangle or its sides. It is no offset of the triangle: at a sharp
//! corner it reaches further than the tolerance, and it bounds the way from the points to the
//! triangles alone.

use glam::DVec3;

/// Room for rounding.
const SLACK: f64 = 1e-9;

/// The prism round one triangle.
#[derive(Debug, Clone, Copy)]
pub struct Prism {
    corners: [DVec3; 3],
    normal: DVec3,
    /// Unit vectors in the triangle's plane, out of the side that leaves each corner.
    out: [DVec3; 3],
    reach: f64,
}

impl Prism {
    /// The prism at `tolerance` round a triangle; `None` where that has no area.
    pub fn new(corners: [[f64; 3]; 3], tolerance: f64) -> Option<Self> {
        let corners = corners.map(DVec3::from);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).try_normalize()?;
        let out = [b - a, c - b, a - c].map(|side| side.cross(normal).normalize_or_zero());
        Some(Self { corners, normal, out, reach: tolerance + SLACK })
    }

    /// Whether a point lies in the prism.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        let point = DVec3::from(point);
        (point - self.corners[0]).dot(self.normal).abs() <= self.reach
            && (0..3).all(|i| (point - self.corners[i]).dot(self.out[i]) <= self.reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prism_reaches_as_far_as_its_planes() {
        let prism = Prism::new([[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]], 1.0).unwrap();
        for inside in [[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [-1.0, -1.0, 0.5], [2.0, -1.0, 0.0]] {
            assert!(prism.contains(inside), "{inside:?}");
        }
        for outside in [[1.0, 1.0, 1.01], [-1.01, 1.0, 0.0], [3.0, 3.0, 0.0]] {
            assert!(!prism.contains(outside), "{outside:?}");
        }
        // The sharp corner lies further away than the tolerance.
        assert!(prism.contains([5.3, -0.9, 0.0]));
    }

    #[test]
    fn triangles_without_area_have_none() {
        assert!(Prism::new([[0.0; 3], [1.0; 3], [2.0; 3]], 1.0).is_none());
    }
}

//! Quaternions of the qform, both ways.

use octofold::Placement;

/// The rotation of a quaternion `b, c, d` whose first part follows from unit length. Columns.
///
/// Where rounding or damage makes `b, c, d` longer than 1, they are scaled down to it, as the
/// reference implementation does.
pub(super) fn rotation([b, c, d]: [f64; 3]) -> [[f64; 3]; 3] {
    let squares = b * b + c * c + d * d;
    let (a, [b, c, d]) = if squares > 1.0 - 1e-7 {
        let scale = squares.sqrt().recip();
        (0.0, [b * scale, c * scale, d * scale])
    } else {
        ((1.0 - squares).sqrt(), [b, c, d])
    };
    glam::DMat3::from_quat(glam::DQuat::from_xyzw(b, c, d, a)).to_cols_array_2d()
}

/// The directions of a placement as quaternion and handedness.
pub(super) struct Rigid {
    /// `b, c, d`.
    pub(super) quaternion: [f64; 3],
    /// -1 where the z axis is flipped, else 1.
    pub(super) qfac: f64,
}

/// The rigid form of `placement`; `None` where its axes are skewed.
pub(super) fn rigid(placement: &Placement) -> Option<Rigid> {
    let axes = placement.axes.map(glam::DVec3::from);
    let [x, y, mut z] = axes.map(glam::DVec3::normalize_or_zero);
    let square = [x.dot(y), y.dot(z), z.dot(x)].iter().all(|d| d.abs() < 1e-6);
    if !square {
        return None;
    }
    let qfac = if x.cross(y).dot(z) < 0.0 { -1.0 } else { 1.0 };
    z *= qfac;
    let mut q = glam::DQuat::from_mat3(&glam::DMat3::from_cols(x, y, z)).normalize();
    if q.w < 0.0 {
        q = -q;
    }
    Some(Rigid { quaternion: [q.x, q.y, q.z], qfac })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placements_survive_the_quaternion() {
        for (angle, flip) in [(0.0, 1.0), (0.7, -1.0), (3.1, 1.0), (-2.0, -1.0)] {
            let turn = glam::DMat3::from_axis_angle(glam::DVec3::new(0.6, 0.0, 0.8), angle);
            let sizes = [0.5, 2.0, 3.0];
            let mut axes = turn.to_cols_array_2d();
            for (axis, size) in axes.iter_mut().zip([0.5, 2.0, 3.0 * flip]) {
                *axis = axis.map(|v| v * size);
            }
            let form = rigid(&Placement { axes, ..Placement::default() }).unwrap();
            let mut back = rotation(form.quaternion);
            for (axis, size) in back.iter_mut().zip(sizes) {
                *axis = axis.map(|v| v * size);
            }
            back[2] = back[2].map(|v| v * form.qfac);
            for (a, b) in axes.iter().flatten().zip(back.iter().flatten()) {
                assert!((a - b).abs() < 1e-9, "{axes:?} {back:?}");
            }
        }
    }

    #[test]
    fn skewed_axes_have_no_rigid_form() {
        let mut placement = Placement::default();
        placement.axes[1][0] = 0.5;
        assert!(rigid(&placement).is_none());
    }
}

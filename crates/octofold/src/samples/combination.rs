//! Simple combinations of simple solids, as in the experiments of Fujimura et al.

use super::field::{ball, block, common, cone, drum, minus, torus, union};
use glam::{DMat3, DVec3};

fn centred(p: [f64; 3]) -> DVec3 {
    DVec3::from(p) - 0.5
}

/// Box and ball joined, drilled along y and along x.
pub(super) fn csg1(p: [f64; 3]) -> f64 {
    let p = centred(p);
    let joined =
        union([block(p, [0.0, 0.0, -0.05], [0.3, 0.28, 0.25]), ball(p, [0.12, 0.08, 0.15], 0.22)]);
    let drills =
        union([drum(p, 2, [-0.1, -0.05, 0.0], 0.12, 1.0), drum(p, 0, [0.0, 0.0, 0.0], 0.08, 1.0)]);
    minus(joined, drills)
}

/// Rounded cube, drilled along all three axes.
pub(super) fn csg2(p: [f64; 3]) -> f64 {
    let p = centred(p);
    let body = common([ball(p, [0.0; 3], 0.4), block(p, [0.0; 3], [0.31; 3])]);
    minus(body, union([0, 1, 2].map(|axis| drum(p, axis, [0.0; 3], 0.17, 1.0))))
}

/// Rows of a rotation that fits no lattice.
const TURN: [[f64; 3]; 3] = [
    [-0.813_587_031_088_409_5, -0.168_766_972_555_637_52, -0.556_411_584_907_388_5],
    [-0.173_343_476_795_459_67, -0.843_031_440_470_532_6, 0.509_166_013_624_869_5],
    [-0.555_002_866_566_659_5, 0.510_701_184_013_297_1, 0.656_624_792_975_567_8],
];

/// Two cylinders and a cube joined, in a generic position.
pub(super) fn csg3(p: [f64; 3]) -> f64 {
    let p = DMat3::from_cols_array_2d(&TURN).transpose() * centred(p);
    union([
        drum(p, 2, [0.0; 3], 0.2, 0.42),
        drum(p, 0, [0.0; 3], 0.15, 0.42),
        block(p, [0.0; 3], [0.22; 3]),
    ])
}

/// Ball with a cube's corner taken out of it.
pub(super) fn csg4(p: [f64; 3]) -> f64 {
    let p = centred(p);
    minus(ball(p, [0.0; 3], 0.4), block(p, [0.25, -0.25, 0.25], [0.26; 3]))
}

/// Cone and its mirror image, held by a ring.
pub(super) fn csg5(p: [f64; 3]) -> f64 {
    let p = centred(p);
    let mirrored = DVec3::new(p.x, p.y, -p.z);
    union([
        cone(p, [0.0, 0.0, -0.4], 0.3, 0.6),
        cone(mirrored, [0.0, 0.0, -0.4], 0.3, 0.6),
        torus(p, 2, [0.0; 3], 0.15, 0.07),
    ])
}

/// Dice: a cube with rounded corners and a hollow ball of pips on three faces.
pub(super) fn csg6(p: [f64; 3]) -> f64 {
    let p = centred(p);
    let body = common([block(p, [0.0; 3], [0.36; 3]), ball(p, [0.0; 3], 0.52)]);
    let one = ball(p, [0.0, 0.0, 0.38], 0.12);
    let two = union([-0.15, 0.15].map(|s| ball(p, [0.38, s, s], 0.09)));
    let three = union([-0.18, 0.0, 0.18].map(|s| ball(p, [s, -0.38, s], 0.08)));
    minus(body, union([one, two, three]))
}

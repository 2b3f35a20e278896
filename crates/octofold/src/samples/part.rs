//! The machine parts A to E: stand-ins for the part of Nishio, Kobori and Kutsuwa 1997, Fig. 11,
//! which is published without dimensions. Their numbers are fixed, so that tables can quote them.

use super::field::{common, cylinder, minus, slab, union};
use glam::DVec3;

/// Longer than the unit cube to both sides.
const THROUGH: [f64; 2] = [-1.0, 2.0];

/// Block with an upright boss.
pub(super) fn a(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    union([
        slab(p, [0.07, 0.07, 0.07], [0.93, 0.93, 0.45]),
        cylinder(p, 2, [0.5, 0.5], 0.28, [0.40, 0.93]),
    ])
}

/// Block with a half-cylinder trough.
pub(super) fn b(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    minus(slab(p, [0.07; 3], [0.93; 3]), cylinder(p, 1, [0.5, 0.93], 0.28, THROUGH))
}

/// L-shaped block with a half-cylinder top.
pub(super) fn c(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    let round =
        union([slab(p, [-1.0; 3], [2.0, 2.0, 0.55]), cylinder(p, 0, [0.5, 0.55], 0.38, THROUGH)]);
    union([
        slab(p, [0.07, 0.07, 0.07], [0.93, 0.93, 0.36]),
        common([slab(p, [0.07, 0.07, 0.07], [0.40, 0.93, 0.93]), round]),
    ])
}

/// Block with a blind hole.
pub(super) fn d(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    minus(slab(p, [0.07; 3], [0.93; 3]), cylinder(p, 2, [0.5, 0.5], 0.25, [0.5, 2.0]))
}

/// Square plate with an upright cylinder.
pub(super) fn e(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    union([
        slab(p, [0.03, 0.03, 0.03], [0.97, 0.97, 0.30]),
        cylinder(p, 2, [0.5, 0.5], 0.35, [0.2, 0.97]),
    ])
}

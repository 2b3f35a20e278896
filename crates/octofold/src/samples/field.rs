//! Signed fields of simple solids and their combination.
//!
//! A field is negative inside, grows no faster than the distance (Lipschitz constant 1) and is
//! exact in sign. Union, intersection and difference by minimum and maximum keep both properties,
//! so that a box of samples is known to be all inside or all outside from its centre alone.
//! Nothing but arithmetic and square roots is used: the same bits on every machine.

use glam::{DVec2, DVec3};

/// Signed field of a solid on the unit cube.
pub type Field = fn([f64; 3]) -> f64;

/// Points of any of the solids.
pub(super) fn union<const N: usize>(fields: [f64; N]) -> f64 {
    fields.into_iter().fold(f64::INFINITY, f64::min)
}

/// Points of all of the solids.
pub(super) fn common<const N: usize>(fields: [f64; N]) -> f64 {
    fields.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Points of the first solid without those of the second.
pub(super) fn minus(solid: f64, taken: f64) -> f64 {
    solid.max(-taken)
}

/// Axis-parallel box between two corners.
pub(super) fn slab(p: DVec3, low: [f64; 3], high: [f64; 3]) -> f64 {
    (DVec3::from(low) - p).max(p - DVec3::from(high)).max_element()
}

/// Axis-parallel box about a centre.
pub(super) fn block(p: DVec3, centre: [f64; 3], half: [f64; 3]) -> f64 {
    ((p - DVec3::from(centre)).abs() - DVec3::from(half)).max_element()
}

/// Ball.
pub(super) fn ball(p: DVec3, centre: [f64; 3], radius: f64) -> f64 {
    (p - DVec3::from(centre)).length() - radius
}

/// The two coordinates across `axis`, in order, and the one along it.
fn across(p: DVec3, axis: usize) -> (DVec2, f64) {
    match axis {
        0 => (DVec2::new(p.y, p.z), p.x),
        1 => (DVec2::new(p.x, p.z), p.y),
        _ => (DVec2::new(p.x, p.y), p.z),
    }
}

/// Cylinder along `axis` between two heights; `centre` has the two other coordinates, in order.
pub(super) fn cylinder(
    p: DVec3,
    axis: usize,
    centre: [f64; 2],
    radius: f64,
    [low, high]: [f64; 2],
) -> f64 {
    let (q, h) = across(p, axis);
    common([(q - DVec2::from(centre)).length() - radius, low - h, h - high])
}

/// Cylinder along `axis`, `half` long to both sides of `centre`.
pub(super) fn drum(p: DVec3, axis: usize, centre: [f64; 3], radius: f64, half: f64) -> f64 {
    let (q, h) = across(p - DVec3::from(centre), axis);
    (q.length() - radius).max(h.abs() - half)
}

/// Ball swept along a segment.
pub(super) fn capsule(p: DVec3, from: [f64; 3], to: [f64; 3], radius: f64) -> f64 {
    let (from, to) = (DVec3::from(from), DVec3::from(to));
    let along = to - from;
    let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (p - from - t * along).length() - radius
}

/// Ring of radius `ring` and thickness `radius` about a line along `axis`.
pub(super) fn torus(p: DVec3, axis: usize, centre: [f64; 3], ring: f64, radius: f64) -> f64 {
    let (q, h) = across(p - DVec3::from(centre), axis);
    DVec2::new(q.length() - ring, h).length() - radius
}

/// Upright cone: `base` is the centre of the disc of `radius`, the apex lies `height` above it.
pub(super) fn cone(p: DVec3, base: [f64; 3], radius: f64, height: f64) -> f64 {
    let (q, h) = across(p - DVec3::from(base), 2);
    let slope = radius / height;
    ((q.length() - radius + slope * h) / (1.0 + slope * slope).sqrt()).max(-h)
}

/// Half-space on the inner side of a plane, whose normal may have any length.
pub(super) fn half_space(p: DVec3, normal: [f64; 3], offset: f64) -> f64 {
    let normal = DVec3::from(normal);
    (normal.dot(p) - offset) / normal.length()
}

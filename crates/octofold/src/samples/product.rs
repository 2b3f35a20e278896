//! Everyday products of boxes, cylinders and balls, after those that the papers name.
//!
//! Hair dryer, electric kettle and tape cutter are stand-ins for table 2 of Nishio, Kobori and
//! Kutsuwa 1997; camera, computer, telephone, bracket and gear for the products of Fujimura et al.

use super::field::{
    ball, block, capsule, common, cylinder, drum, half_space, minus, slab, torus, union,
};
use glam::{DVec2, DVec3};

/// Sine and cosine of 12 degrees, the tilt of the hair dryer's handle.
const TILT: [f64; 2] = [0.207_911_690_817_759_34, 0.978_147_600_733_805_7];

/// The point seen from the middle of the unit cube.
fn centred(p: [f64; 3]) -> DVec3 {
    DVec3::from(p) - 0.5
}

/// The same for products that are built with their front towards +y and stand with it towards -y.
fn turned(p: [f64; 3]) -> DVec3 {
    DVec3::new(-1.0, -1.0, 1.0) * centred(p)
}

pub(super) fn hair_dryer(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    let body = capsule(p, [0.30, 0.5, 0.68], [0.62, 0.5, 0.68], 0.20);
    let nozzle = cylinder(p, 0, [0.5, 0.68], 0.11, [0.60, 0.94]);
    let [sin, cos] = TILT;
    let (x, z) = (p.x - 0.36, p.z - 0.55);
    let (across, along) = (x * cos - z * sin, x * sin + z * cos);
    let handle =
        common([across.abs() - 0.075, (p.y - 0.5).abs() - 0.055, along - 0.05, -along - 0.48]);
    union([body, nozzle, handle])
}

pub(super) fn kettle(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    const TAPER: f64 = 0.16 / 0.62;
    let radius = 0.34 - TAPER * (p.z - 0.08).clamp(0.0, 0.62);
    let wall = DVec2::new(p.x - 0.45, p.y - 0.5).length() - radius;
    let body = common([wall / (1.0 + TAPER * TAPER).sqrt(), 0.08 - p.z, p.z - 0.70]);
    let knob = ball(p, [0.45, 0.5, 0.74], 0.06);
    let spout = capsule(p, [0.66, 0.5, 0.38], [0.90, 0.5, 0.66], 0.055);
    let handle = torus(p, 1, [0.26, 0.5, 0.45], 0.20, 0.04).max(p.x - 0.33);
    union([body, knob, spout, handle])
}

pub(super) fn tape_cutter(p: [f64; 3]) -> f64 {
    let p = DVec3::from(p);
    let base = slab(p, [0.06, 0.30, 0.10], [0.94, 0.70, 0.36]);
    let hub = cylinder(p, 1, [0.36, 0.44], 0.28, [0.34, 0.66]);
    let cutter = common([
        slab(p, [0.70, 0.30, 0.30], [0.94, 0.70, 0.62]),
        half_space(p, [-0.9, 0.0, 1.0], 0.62 - 0.94 * 0.9 + 0.10),
    ]);
    let slot = cylinder(p, 1, [0.36, 0.44], 0.10, [0.30, 0.70]);
    minus(union([base, hub, cutter]), slot)
}

pub(super) fn camera(p: [f64; 3]) -> f64 {
    let p = turned(p);
    let body = union([
        block(p, [0.0, -0.05, 0.0], [0.42, 0.12, 0.26]),
        drum(p, 1, [0.05, 0.16, -0.02], 0.18, 0.16),
        block(p, [-0.05, -0.05, 0.31], [0.12, 0.09, 0.06]),
        drum(p, 2, [0.32, -0.05, 0.285], 0.045, 0.03),
    ]);
    let hollows = union([
        drum(p, 1, [0.05, 0.29, -0.02], 0.15, 0.06),
        ball(p, [0.05, 0.28, -0.02], 0.13),
        block(p, [-0.36, 0.06, 0.2], [0.04, 0.02, 0.03]),
        block(p, [0.0, -0.17, 0.0], [0.3, 0.015, 0.17]),
    ]);
    minus(body, hollows)
}

pub(super) fn computer(p: [f64; 3]) -> f64 {
    let p = turned(p);
    let screen = minus(
        block(p, [0.0, -0.1, 0.16], [0.3, 0.22, 0.23]),
        block(p, [0.0, 0.11, 0.17], [0.25, 0.03, 0.18]),
    );
    let case = union([
        drum(p, 2, [0.0, -0.1, -0.1], 0.1, 0.04),
        block(p, [0.0, -0.1, -0.22], [0.38, 0.28, 0.085]),
    ]);
    let drive = block(p, [0.2, 0.17, -0.2], [0.13, 0.03, 0.012]);
    let keyboard = block(p, [0.0, 0.33, -0.28], [0.36, 0.1, 0.02]);
    // Fourteen columns and four rows of keys: the key nearest to a point repeats with the pitch.
    let (column, row) = ((p.x + 0.34).rem_euclid(0.048), (p.y - 0.245).rem_euclid(0.042));
    let keys = common([
        (column - 0.024).abs() - 0.018,
        (row - 0.021).abs() - 0.016,
        slab(p, [-0.334, 0.25, -0.265], [0.334, 0.41, -0.245]),
    ]);
    union([minus(screen.min(case), drive), keyboard, keys])
}

pub(super) fn telephone(p: [f64; 3]) -> f64 {
    let p = turned(p);
    let body = common([
        slab(p, [-0.32, -0.36, -0.3], [0.32, 0.36, 1.0]),
        half_space(p, [0.0, 0.26, 0.9656], -0.05),
    ]);
    let receiver = union([
        drum(p, 0, [0.0, -0.24, 0.16], 0.05, 0.36),
        ball(p, [-0.34, -0.24, 0.1], 0.1),
        ball(p, [0.34, -0.24, 0.1], 0.1),
    ]);
    let mut phone = union([
        body,
        receiver.max(0.02 - p.z),
        drum(p, 2, [-0.22, -0.24, 0.0], 0.05, 0.1),
        drum(p, 2, [0.22, -0.24, 0.0], 0.05, 0.1),
    ]);
    for column in 0..3 {
        for row in 0..4 {
            let (i, j) = (f64::from(column), f64::from(row));
            let centre = [-0.12 + 0.12 * i, -0.06 + 0.1 * j, -0.06 - 0.02 * j];
            phone = phone.min(drum(p, 2, centre, 0.035, 0.05));
        }
    }
    phone
}

pub(super) fn bracket(p: [f64; 3]) -> f64 {
    let p = centred(p);
    let plates = union([
        block(p, [0.0, 0.0, -0.32], [0.42, 0.3, 0.05]),
        block(p, [-0.37, 0.0, 0.0], [0.05, 0.3, 0.37]),
    ]);
    let fillet = minus(
        slab(p, [-0.32, -0.3, -0.27], [-0.22, 0.3, -0.17]),
        cylinder(p, 1, [-0.22, -0.17], 0.1, [-1.0, 1.0]),
    );
    let gussets = common([
        half_space(p, [1.0, 0.0, 1.0], -0.2),
        -0.37 - p.x,
        -0.32 - p.z,
        (p.y.abs() - 0.2).abs() - 0.02,
    ]);
    let mut holes = drum(p, 0, [-0.37, 0.0, 0.0], 0.07, 0.2);
    for x in [0.0, 0.28] {
        for y in [-0.1, 0.1] {
            holes = holes.min(drum(p, 2, [x, y, -0.32], 0.05, 0.2));
        }
    }
    for y in [-0.12, 0.12] {
        holes = holes.min(drum(p, 0, [-0.37, y, 0.22], 0.06, 0.2));
    }
    minus(union([plates, fillet, gussets]), holes)
}

/// Centres of the gear's six holes: radius 0.24, first at 0.2 rad, 60 degrees apart.
const HOLES: [[f64; 2]; 6] = [
    [0.235_215_978_681_898, 0.047_680_639_390_814_7],
    [0.076_315_344_359_818_5, 0.227_543_332_609_95],
    [-0.158_900_634_322_079_5, 0.179_862_693_219_135_3],
    [-0.235_215_978_681_898, -0.047_680_639_390_814_7],
    [-0.076_315_344_359_818_6, -0.227_543_332_609_949_9],
    [0.158_900_634_322_079_5, -0.179_862_693_219_135_2],
];

pub(super) fn gear(p: [f64; 3]) -> f64 {
    let p = centred(p);
    let radius = DVec2::new(p.x, p.y).length();
    let wheel = union([toothed(p, radius).max(p.z.abs() - 0.1), drum(p, 2, [0.0; 3], 0.14, 0.2)]);
    let bore = union([radius - 0.07, block(p, [0.07, 0.0, 0.0], [0.03, 0.02, 1.0])]);
    let holes = HOLES.map(|[x, y]| drum(p, 2, [x, y, 0.0], 0.055, 1.0));
    minus(wheel, bore.min(union(holes)))
}

/// Rim of 24 teeth between the radii 0.32 and 0.40.
fn toothed(p: DVec3, radius: f64) -> f64 {
    // The outline r(t) = 0.36 + 0.04 clamp(1.8 sin 24 t) is steep along the rim. Divided by 6,
    // which bounds its gradient from radius 0.304 outwards, it is met further in by the circle
    // of the tooth roots.
    let outline = if radius > 0.0 {
        let once = (p.x / radius, p.y / radius);
        let third = product(product(once, once), once);
        let wave = (0..3).fold(third, |z, _| product(z, z)).1;
        (radius - 0.36 - 0.04 * (1.8 * wave).clamp(-1.0, 1.0)) / 6.0
    } else {
        -0.06
    };
    (radius - 0.32).min(outline.max(radius - 0.40))
}

/// Product of complex numbers.
fn product(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

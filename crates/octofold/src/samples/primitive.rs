//! The simple solids, as fields and as polygons that are exact up to their curvature.
//!
//! All are centred in the unit cube. Curved faces are cut into `segments` around the axis, with
//! points on the surface, so that volume and area come from below; flat faces stay one polygon.

use super::field::{self, ball, block, common, drum, half_space, slab};
use crate::soup::SoupBuilder;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

const CENTRE: [f64; 3] = [0.5; 3];
const BALL: f64 = 0.4;
const HALF_CUBE: f64 = 0.35;
const CYLINDER: Round = Round { radius: 0.3, low: 0.1, high: 0.9 };
const CONE: Round = Round { radius: 0.38, low: 0.1, high: 0.9 };
const RING: f64 = 0.3;
const TUBE: f64 = 0.1;

/// Distance of the tetrahedron's faces from its centre, and their unit normals, in a position
/// that fits no lattice.
const TETRAHEDRON: f64 = 0.17;
const TETRAHEDRON_NORMALS: [[f64; 3]; 4] = [
    [0.773_076_517_649_272, 0.154_154_957_371_659_02, -0.615_295_820_704_982],
    [-0.297_673_603_103_575_3, 0.872_954_349_472_654_7, 0.386_446_800_675_215_6],
    [-0.754_456_956_338_253_7, -0.413_445_907_338_842_84, -0.509_761_888_274_888_4],
    [0.279_054_041_792_557_05, -0.613_663_399_505_471, 0.738_610_908_304_654_8],
];

/// Half height of the triangular prism, distance of its sides from the axis, and their normals.
const HALF_PRISM: f64 = 0.4;
const PRISM: f64 = 0.2;
const PRISM_NORMALS: [[f64; 2]; 3] = [
    [-0.109_778_300_837_174_84, 0.993_956_097_956_696_8],
    [-0.805_902_080_658_366, -0.592_048_846_287_632_3],
    [0.915_680_381_495_540_8, -0.401_907_251_669_064_7],
];

/// Waves of the gyroid along an edge of the unit cube, and half its wall in units of the field.
const WAVES: f64 = 2.0;
const WALL: f64 = 0.55;

/// An upright round solid.
struct Round {
    radius: f64,
    low: f64,
    high: f64,
}

fn centred(p: [f64; 3]) -> DVec3 {
    DVec3::from(p) - 0.5
}

pub(super) fn sphere_field(p: [f64; 3]) -> f64 {
    ball(p.into(), CENTRE, BALL)
}

pub(super) fn cube_field(p: [f64; 3]) -> f64 {
    block(p.into(), CENTRE, [HALF_CUBE; 3])
}

pub(super) fn cylinder_field(p: [f64; 3]) -> f64 {
    drum(p.into(), 2, CENTRE, CYLINDER.radius, (CYLINDER.high - CYLINDER.low) / 2.0)
}

pub(super) fn cone_field(p: [f64; 3]) -> f64 {
    field::cone(p.into(), [0.5, 0.5, CONE.low], CONE.radius, CONE.high - CONE.low)
}

pub(super) fn tetrahedron_field(p: [f64; 3]) -> f64 {
    common(TETRAHEDRON_NORMALS.map(|n| half_space(centred(p), n, TETRAHEDRON)))
}

pub(super) fn prism_field(p: [f64; 3]) -> f64 {
    let p = centred(p);
    let sides = common(PRISM_NORMALS.map(|[x, y]| half_space(p, [x, y, 0.0], PRISM)));
    sides.max(p.z.abs() - HALF_PRISM)
}

pub(super) fn torus_field(p: [f64; 3]) -> f64 {
    field::torus(p.into(), 2, CENTRE, RING, TUBE)
}

/// Wall of two waves of Schoen's gyroid, cut out of a cube. The only field that needs a sine.
pub(super) fn gyroid_field(p: [f64; 3]) -> f64 {
    let [x, y, z] = p.map(|a| (TAU * WAVES * a).sin_cos());
    let gyroid = x.0 * y.1 + y.0 * z.1 + z.0 * x.1;
    // By Cauchy and Schwarz the gradient of the sum is at most the square root of 3.
    let wall = (gyroid.abs() - WALL) / (TAU * WAVES * 3.0f64.sqrt());
    wall.max(slab(p.into(), [0.06; 3], [0.94; 3]))
}

/// Ball of quads, with triangles at the poles.
pub(super) fn sphere(segments: usize) -> SoupBuilder {
    let rings = (segments / 2).max(2);
    let mut soup = SoupBuilder::default();
    let south = point(&mut soup, [0.5, 0.5, 0.5 - BALL]);
    let circles: Vec<u32> = (1..rings)
        .map(|r| {
            let (sin, cos) = (PI * r as f64 / rings as f64).sin_cos();
            circle(&mut soup, segments, BALL * sin, 0.5 - BALL * cos)
        })
        .collect();
    let north = point(&mut soup, [0.5, 0.5, 0.5 + BALL]);
    fan(&mut soup, segments, circles[0], south, false);
    for pair in circles.windows(2) {
        band(&mut soup, segments, pair[0], pair[1]);
    }
    fan(&mut soup, segments, circles[rings - 2], north, true);
    soup
}

/// Six squares.
pub(super) fn cube() -> SoupBuilder {
    let mut soup = SoupBuilder::default();
    for corner in 0..8u32 {
        soup.points.push(
            [0, 1, 2].map(
                |axis| {
                    if corner >> axis & 1 == 1 { 0.5 + HALF_CUBE } else { 0.5 - HALF_CUBE }
                },
            ),
        );
    }
    for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    {
        soup.face(&face);
    }
    soup
}

/// Quads around, a polygon at each end.
pub(super) fn cylinder(segments: usize) -> SoupBuilder {
    let mut soup = SoupBuilder::default();
    let low = circle(&mut soup, segments, CYLINDER.radius, CYLINDER.low);
    let high = circle(&mut soup, segments, CYLINDER.radius, CYLINDER.high);
    band(&mut soup, segments, low, high);
    cap(&mut soup, segments, low, false);
    cap(&mut soup, segments, high, true);
    soup
}

/// Triangles around, a polygon below.
pub(super) fn cone(segments: usize) -> SoupBuilder {
    let mut soup = SoupBuilder::default();
    let base = circle(&mut soup, segments, CONE.radius, CONE.low);
    let apex = point(&mut soup, [0.5, 0.5, CONE.high]);
    cap(&mut soup, segments, base, false);
    fan(&mut soup, segments, base, apex, true);
    soup
}

/// Four triangles.
pub(super) fn tetrahedron() -> SoupBuilder {
    let mut soup = SoupBuilder::default();
    // A corner lies opposite to its face, three times as far from the centre.
    soup.points.extend(TETRAHEDRON_NORMALS.map(|n| n.map(|x| 0.5 - 3.0 * TETRAHEDRON * x)));
    for face in [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]] {
        soup.face(&face);
    }
    soup
}

/// Three rectangles and two triangles.
pub(super) fn prism() -> SoupBuilder {
    let mut soup = SoupBuilder::default();
    for z in [0.5 - HALF_PRISM, 0.5 + HALF_PRISM] {
        // The edge opposite to a side is twice as far from the axis.
        for [x, y] in PRISM_NORMALS {
            soup.points.push([0.5 - 2.0 * PRISM * x, 0.5 - 2.0 * PRISM * y, z]);
        }
    }
    band(&mut soup, 3, 0, 3);
    cap(&mut soup, 3, 0, false);
    cap(&mut soup, 3, 3, true);
    soup
}

/// Quads, half as many around the tube as around the axis.
pub(super) fn torus(segments: usize) -> SoupBuilder {
    let around = (segments / 2).max(3);
    let mut soup = SoupBuilder::default();
    let circles: Vec<u32> = (0..around)
        .map(|r| {
            let (sin, cos) = (TAU * r as f64 / around as f64).sin_cos();
            circle(&mut soup, segments, RING + TUBE * cos, 0.5 + TUBE * sin)
        })
        .collect();
    for (r, &low) in circles.iter().enumerate() {
        band(&mut soup, segments, low, circles[(r + 1) % around]);
    }
    soup
}

fn point(soup: &mut SoupBuilder, p: [f64; 3]) -> u32 {
    soup.points.push(p);
    soup.points.len() as u32 - 1
}

/// Adds a horizontal circle about the axis of the cube, counter-clockwise seen from above, and
/// returns its first point.
fn circle(soup: &mut SoupBuilder, segments: usize, radius: f64, z: f64) -> u32 {
    let first = soup.points.len() as u32;
    soup.points.extend((0..segments).map(|s| {
        let (sin, cos) = (TAU * s as f64 / segments as f64).sin_cos();
        [0.5 + radius * cos, 0.5 + radius * sin, z]
    }));
    first
}

/// Quads between two circles, facing outwards where `high` is the upper one.
fn band(soup: &mut SoupBuilder, segments: usize, low: u32, high: u32) {
    let n = segments as u32;
    for s in 0..n {
        let t = (s + 1) % n;
        soup.face(&[low + s, low + t, high + t, high + s]);
    }
}

/// Triangles between a circle and a point above or below it.
fn fan(soup: &mut SoupBuilder, segments: usize, circle: u32, tip: u32, above: bool) {
    let n = segments as u32;
    for s in 0..n {
        let (a, b) = (circle + s, circle + (s + 1) % n);
        soup.face(&if above { [a, b, tip] } else { [b, a, tip] });
    }
}

/// One polygon over a circle, facing up or down.
fn cap(soup: &mut SoupBuilder, segments: usize, circle: u32, up: bool) {
    let n = segments as u32;
    let corners: Vec<u32> = if up { (0..n).collect() } else { (0..n).rev().collect() };
    soup.face(&corners.iter().map(|c| circle + c).collect::<Vec<_>>());
}

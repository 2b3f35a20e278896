//! World coordinates as files have them, and the proof made for the lattice, made again for them.
//!
//! Points of the lattice are multiples of 1/1024 of a sample. Where the placement carries all of
//! them over into single precision exactly, what was proved on the lattice is true of the
//! coordinates. Elsewhere each coordinate is rounded to single precision. The distance that a point
//! may move by is bounded, and kept back from the tolerance; no triangle may turn over, no two
//! points fall together and no two triangles meet, which is decided exactly. Where that fails, or
//! single precision is too coarse so far from the origin, coordinates stay in double precision.

use super::cells::STEPS;
use crate::measure::{self_intersections, weld_points};
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Finding, Run};
use crate::volume::Placement;
use glam::DVec3;
use serde::Serialize;

/// Bits of a coordinate in single precision.
const SINGLE_BITS: u64 = 24;

/// Share of a coordinate that rounding to single precision may move it by.
const HALF_UNIT: f64 = 1.0 / (1u64 << SINGLE_BITS) as f64;

/// Points are not rounded where that could move them farther than this, in samples.
const COARSE: f64 = 1.0 / STEPS;

/// What is proved of the coordinates of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Coordinates {
    /// Single precision holds them as they were proved.
    Exact,
    /// Rounded to single precision, and proved again as they are.
    Single,
    /// Double precision is needed: as such they were proved again.
    Double,
    /// The placement flattens space, or points lie so far out that double precision is too coarse.
    Unproved,
}

/// The way from the lattice to the world.
pub struct Written {
    placement: Placement,
    exact: bool,
    single: bool,
    /// Rounding moves no point farther than this, in samples.
    pub rounding: f64,
}

impl Written {
    /// The way for a lattice with so many points along each axis.
    pub fn new(placement: Placement, points: [usize; 3]) -> Self {
        // No partial sum of a coordinate is larger than this.
        let most: [f64; 3] = std::array::from_fn(|r| {
            let reach = |c: usize| placement.axes[c][r].abs() * points[c] as f64;
            (0..3).map(reach).sum::<f64>() + placement.origin[r].abs()
        });
        let exact = (0..3).all(|r| {
            let steps = placement.axes.iter().map(|axis| last_bit(axis[r]) / STEPS);
            let step = steps.fold(last_bit(placement.origin[r]), f64::min);
            most[r] <= step / HALF_UNIT
        });
        let far = placement.inverse().map_or(f64::INFINITY, |back| {
            let moved = |r: usize| DVec3::from(back.axes[r]).length() * most[r] * HALF_UNIT;
            (0..3).map(moved).sum()
        });
        let single = far <= COARSE;
        Self { placement, exact, single, rounding: if exact || !single { 0.0 } else { far } }
    }

    /// The points in the world, which are given in samples, and what is proved of them.
    pub fn place(
        &self,
        points: &[DVec3],
        triangles: &[[u32; 3]],
        run: &Run,
    ) -> Result<(Vec<[f64; 3]>, Coordinates), Cancelled> {
        let double = par::map(points, |p| self.placement.place(p.to_array()));
        let single = || par::map(&double, |p| p.map(|x| f64::from(x as f32)));
        if self.exact {
            return Ok((single(), Coordinates::Exact));
        }
        if self.single {
            let single = single();
            if self.is_sound(points, &single, triangles, run)? {
                return Ok((single, Coordinates::Single));
            }
        }
        let proved = self.is_sound(points, &double, triangles, run)?;
        let text = if proved {
            "single precision is too coarse for the mesh at its place: its coordinates are in \
             double precision, and formats with less than that may make triangles meet"
        } else {
            "the placement leaves no room for the mesh: its triangles may meet"
        };
        run.finding(Finding::warning("coordinates-too-coarse", text));
        Ok((double, if proved { Coordinates::Double } else { Coordinates::Unproved }))
    }

    /// Whether no triangle turned over, no points fell together and no two triangles meet.
    fn is_sound(
        &self,
        lattice: &[DVec3],
        points: &[[f64; 3]],
        triangles: &[[u32; 3]],
        run: &Run,
    ) -> Result<bool, Cancelled> {
        let Some(back) = self.placement.inverse() else { return Ok(false) };
        let upright = |t: &[u32; 3]| {
            let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
            let before = normal(t.map(|p| lattice[p as usize]));
            // Seen from the lattice, where no scale or mirror is in the way.
            let place = |p: u32| DVec3::from(back.place(points[p as usize]));
            before.dot(normal(t.map(place))) > 0.0
        };
        if !triangles.iter().all(upright) {
            return Ok(false);
        }
        if weld_points(points, run)?.points.len() < points.len() {
            return Ok(false);
        }
        let (points, triangles) = (points.to_vec(), triangles.to_vec());
        let mesh = Mesh { points, triangles, ..Mesh::default() };
        Ok(self_intersections(&mesh, run)?.is_empty())
    }
}

/// The value of the lowest bit that is set in a number; infinite for 0.
fn last_bit(x: f64) -> f64 {
    const FRACTION: u64 = (1 << 52) - 1;
    if x == 0.0 {
        return f64::INFINITY;
    }
    if !x.is_normal() {
        return 0.0;
    }
    let exponent = x.to_bits() & !FRACTION & !(1 << 63);
    let power = f64::from_bits(exponent);
    let fraction = x.to_bits() & FRACTION;
    // A fraction of zeros leaves the leading one.
    let below = 52 - fraction.trailing_zeros().min(52);
    power / (1u64 << below) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Verdict, Weld, measure, within};
    use crate::surface::certified::{CertifiedOptions, certified};
    use crate::surface::{CubesOptions, Inside, marching_cubes, noise};
    use proptest::prelude::*;

    #[test]
    fn last_bits_are_found() {
        for (x, bit) in [(1.0, 1.0), (-0.9375, 0.0625), (6.0, 2.0), (0.0, f64::INFINITY)] {
            assert_eq!(last_bit(x), bit, "{x}");
        }
        assert_eq!(last_bit(0.1), 2f64.powi(-55));
        assert_eq!(last_bit(f64::MIN_POSITIVE / 4.0), 0.0);
    }

    #[test]
    fn placements_are_told_apart() {
        let of = |spacing: f64, origin: f64| {
            let placement = Placement { origin: [origin; 3], ..Placement::spacing([spacing; 3]) };
            Written::new(placement, [512; 3])
        };
        for (spacing, origin) in [(1.0, 0.0), (0.25, -90.5), (0.9375, 7.0), (3.0, 1024.0)] {
            let exact = of(spacing, origin);
            assert!(exact.exact && exact.rounding == 0.0, "{spacing} {origin}");
        }
        let rounded = of(0.1, 100.0);
        assert!(!rounded.exact && rounded.single && rounded.rounding > 0.0);
        assert!(!of(0.001, 1e6).single);
    }

    /// A turn about each axis, a scale, a mirror and a shift.
    fn placement(turns: [f64; 3], scales: [f64; 3], origin: [f64; 3]) -> Placement {
        let [a, b, c] = turns;
        let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, a, b, c);
        let axes = [0, 1, 2].map(|i| (turn.col(i) * scales[i]).to_array());
        Placement { axes, origin, unit: None }
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(24))]

        #[test]
        fn every_placement_keeps_what_was_proved(
            dims in (2usize..24, 2usize..16, 2usize..24),
            seed in any::<u64>(),
            smooth in 1u64..7,
            turns in prop::array::uniform3(-3.0f64..3.0),
            scales in prop::array::uniform3(0.3f64..3.0),
            mirror in any::<bool>(),
            origin in prop::array::uniform3(-300.0f64..300.0),
            far in prop::sample::select(vec![0.0, 0.0, 1.0, 100.0, 1e5]),
            tolerance in prop::sample::select(vec![0.5, 1.0, 1.5]),
        ) {
            let [x, y, z] = scales;
            let scales = [if mirror { -x } else { x }, y, z];
            let mut volume = noise([dims.0, dims.1, dims.2], seed, smooth);
            volume.placement = placement(turns, scales, origin.map(|o| o * far));
            let surface = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };
            let options = CertifiedOptions { surface, tolerance, collapse: true };
            let run = Run::default();
            let (mesh, certificate) = certified(&volume, &options, &run).unwrap();
            let reference = marching_cubes(&volume, &surface, &run).unwrap();
            prop_assume!(!mesh.triangles.is_empty());
            let is_single = |p: &[f64; 3]| p.iter().all(|&x| f64::from(x as f32) == x);
            match certificate.coordinates {
                Coordinates::Exact | Coordinates::Single => {
                    prop_assert!(mesh.points.iter().all(is_single));
                }
                Coordinates::Double => prop_assert!(far > 1.0),
                Coordinates::Unproved => prop_assert!(false, "{:?}", volume.placement),
            }
            let found = measure(&mesh, Weld::Exact, &run).unwrap();
            prop_assert!(found.closed && found.manifold && found.oriented);
            prop_assert_eq!((found.self_intersections, found.zero_area_triangles), (0, 0));
            prop_assert!(found.volume.unwrap() > 0.0);
            let back = volume.placement.inverse().unwrap();
            let [mesh, reference] = [mesh, reference].map(|m| m.map(|p| back.place(p)));
            let verdict = within(&mesh, &reference, tolerance, &run).unwrap();
            prop_assert_eq!(verdict, Verdict::Proven);
        }
    }
}

//! Quadrics: sums of squared distances to planes, as functions of a point.
//!
//! Source: Garland and Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997.

use glam::{DMat3, DVec3};
use std::ops::{AddAssign, Mul};

/// The sum of weighted squared distances to planes: p A p - 2 b p + c.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Quadric {
    /// A is symmetric: its diagonal, and what is beside it (xy, xz, yz).
    diagonal: DVec3,
    beside: DVec3,
    side: DVec3,
    rest: f64,
    weight: f64,
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.diagonal += other.diagonal;
        self.beside += other.beside;
        self.side += other.side;
        self.rest += other.rest;
        self.weight += other.weight;
    }
}

impl Mul<f64> for Quadric {
    type Output = Self;

    fn mul(self, by: f64) -> Self {
        Self {
            diagonal: self.diagonal * by,
            beside: self.beside * by,
            side: self.side * by,
            rest: self.rest * by,
            weight: self.weight * by,
        }
    }
}

impl Quadric {
    /// Of no planes.
    pub const NOTHING: Self = Self {
        diagonal: DVec3::ZERO,
        beside: DVec3::ZERO,
        side: DVec3::ZERO,
        rest: 0.0,
        weight: 0.0,
    };

    /// The squared distance to the plane through `on` with unit normal `normal`, times `weight`.
    pub fn plane(normal: DVec3, on: DVec3, weight: f64) -> Self {
        let offset = normal.dot(on);
        let DVec3 { x, y, z } = normal;
        Self {
            diagonal: normal * normal * weight,
            beside: DVec3::new(x * y, x * z, y * z) * weight,
            side: normal * (offset * weight),
            rest: offset * offset * weight,
            weight,
        }
    }

    fn form(&self) -> DMat3 {
        let (DVec3 { x, y, z }, DVec3 { x: xy, y: xz, z: yz }) = (self.diagonal, self.beside);
        DMat3::from_cols(DVec3::new(x, xy, xz), DVec3::new(xy, y, yz), DVec3::new(xz, yz, z))
    }

    /// The sum of the weights.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// The value at a point; never below zero.
    pub fn at(&self, p: DVec3) -> f64 {
        (p.dot(self.form() * p) - 2.0 * self.side.dot(p) + self.rest).max(0.0)
    }

    /// The point where the value and `pull` times the weight times the squared distance to `home`
    /// are least together; where planes do not settle a direction, `home` does.
    pub fn lowest(&self, home: DVec3, pull: f64) -> Option<DVec3> {
        let form = self.form();
        let settled = form + DMat3::from_diagonal(DVec3::splat(pull * self.weight));
        let step = settled.inverse() * (self.side - form * home);
        let p = home + step;
        p.is_finite().then_some(p)
    }

    /// The point of the unit cube where what [`Self::lowest`] makes least is least, by descent along
    /// one axis after the other; `home` lies in the cube.
    pub fn lowest_in_cube(&self, home: DVec3, pull: f64) -> DVec3 {
        const ROUNDS: usize = 64;
        let held = pull * self.weight;
        let form = self.form();
        let mut p = home;
        for _ in 0..ROUNDS {
            let before = p;
            for a in 0..3 {
                let column = form.col(a);
                let bend = column[a] + held;
                if bend > 0.0 {
                    let slope = column.dot(p) - self.side[a] + held * (p[a] - home[a]);
                    p[a] = (p[a] - slope / bend).clamp(0.0, 1.0);
                }
            }
            if p.distance_squared(before) < 1e-14 {
                break;
            }
        }
        p
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_point_is_where_planes_meet() {
        let corner = DVec3::new(3.0, -2.0, 5.0);
        let mut sum = Quadric::default();
        for normal in [DVec3::X, DVec3::Y, DVec3::new(0.6, 0.0, 0.8)] {
            sum += Quadric::plane(normal, corner, 2.0);
        }
        let found = sum.lowest(DVec3::ZERO, 1e-9).unwrap();
        assert!(found.distance(corner) < 1e-6, "{found}");
        assert!(sum.at(corner) < 1e-9);
        assert!((sum.at(corner + DVec3::Y) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn in_the_cube_the_lowest_point_is_on_its_wall() {
        let corner = DVec3::new(3.0, 0.25, 0.5);
        let mut sum = Quadric::default();
        for normal in [DVec3::X, DVec3::Y, DVec3::new(0.6, 0.0, 0.8)] {
            sum += Quadric::plane(normal, corner, 1.0);
        }
        let home = DVec3::splat(0.5);
        let found = sum.lowest_in_cube(home, 1e-6);
        let best = (0..=1000)
            .map(|i| DVec3::new(1.0, 0.25, f64::from(i) / 1000.0))
            .min_by(|a, b| sum.at(*a).total_cmp(&sum.at(*b)))
            .unwrap();
        assert!(found.distance(best) < 2e-3, "{found} {best}");
    }

    #[test]
    fn a_direction_without_planes_stays_at_home() {
        let home = DVec3::new(7.0, 8.0, 9.0);
        let found = Quadric::plane(DVec3::Z, DVec3::ZERO, 1.0).lowest(home, 1e-6).unwrap();
        assert!(found.distance(DVec3::new(7.0, 8.0, 0.0)) < 1e-4, "{found}");
    }
}

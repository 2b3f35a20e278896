//! How far the normals of a surface turn: the outermost of them in fourteen directions.
//!
//! Formula 1 of the paper asks for the least product of any two normals in an octant. The outermost
//! normals of a union are among those of its parts, so that they are handed up the tree; the pair
//! that is furthest apart is nearly always among them.

use glam::DVec3;

/// Directions: both ways along the axes and the diagonals of a cube.
const WAYS: [[i32; 3]; 7] =
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]];

/// Length of a normal in whole steps.
const UNIT: f64 = 127.0;

/// The outermost normals of a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    outermost: [[i8; 3]; 14],
    empty: bool,
}

impl Spread {
    /// No normals.
    pub(super) const NONE: Self = Self { outermost: [[0; 3]; 14], empty: true };

    /// One normal of unit length.
    pub(super) fn one(normal: DVec3) -> Self {
        let steps = (normal * UNIT).round().to_array().map(|x| x as i8);
        Self { outermost: [steps; 14], empty: false }
    }

    /// Takes in the normals of another surface.
    pub(super) fn add(&mut self, other: &Self) {
        if self.empty {
            *self = *other;
        } else if !other.empty && self.outermost != other.outermost {
            for (i, way) in WAYS.iter().enumerate() {
                let along = |n: [i8; 3]| (0..3).map(|a| i32::from(n[a]) * way[a]).sum::<i32>();
                let [high, low] = [2 * i, 2 * i + 1];
                if along(other.outermost[high]) > along(self.outermost[high]) {
                    self.outermost[high] = other.outermost[high];
                }
                if along(other.outermost[low]) < along(self.outermost[low]) {
                    self.outermost[low] = other.outermost[low];
                }
            }
        }
    }

    /// `(min n_i . n_j + 1) / 2`; 0 where there are no normals.
    pub(super) fn flatness(&self) -> f64 {
        if self.empty {
            return 0.0;
        }
        if self.outermost == [self.outermost[0]; 14] {
            return 1.0;
        }
        let product = |p: [i8; 3], q: [i8; 3]| {
            (0..3).map(|a| i32::from(p[a]) * i32::from(q[a])).sum::<i32>()
        };
        let mut least = i32::MAX;
        for (i, &p) in self.outermost.iter().enumerate() {
            for &q in &self.outermost[..i] {
                least = least.min(product(p, q));
            }
        }
        ((f64::from(least) / (UNIT * UNIT) + 1.0) / 2.0).clamp(0.0, 1.0)
    }

    /// Any of the normals; up where there is none.
    pub(super) fn any(&self) -> DVec3 {
        let [x, y, z] = self.outermost[0].map(f64::from);
        DVec3::new(x, y, z).normalize_or(DVec3::Z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn creases_have_the_flatness_of_the_formula() {
        let mut spread = Spread::one(DVec3::X);
        assert_eq!(spread.flatness(), 1.0);
        spread.add(&Spread::one(DVec3::new(0.6, 0.8, 0.0)));
        assert!((spread.flatness() - 0.8).abs() < 0.01);
        spread.add(&Spread::one(DVec3::Y));
        assert!((spread.flatness() - 0.5).abs() < 0.01);
        spread.add(&Spread::one(-DVec3::X));
        assert!(spread.flatness() < 0.01);
        assert_eq!(Spread::NONE.flatness(), 0.0);
    }
}

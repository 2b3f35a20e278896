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
    /// How far each is along its direction; below all that can be where there is none.
    along: [i32; 14],
    /// Steps along the axes, a byte each.
    outermost: [u32; 14],
}

/// Less than any normal is along any direction.
const NOTHING: i32 = i32::MIN;

impl Spread {
    /// No normals.
    pub(super) const NONE: Self = Self { along: [NOTHING; 14], outermost: [0; 14] };

    /// One normal of unit length.
    pub(super) fn one(normal: DVec3) -> Self {
        let steps = (normal * UNIT).round().to_array().map(|x| x as i32);
        let [x, y, z] = steps.map(|x| x as i8 as u8);
        let mut along = [0; 14];
        for (i, way) in WAYS.iter().enumerate() {
            along[i] = (0..3).map(|a| steps[a] * way[a]).sum();
            along[i + 7] = -along[i];
        }
        Self { along, outermost: [u32::from_le_bytes([x, y, z, 0]); 14] }
    }

    /// Takes in the normals of another surface.
    #[inline]
    pub(super) fn add(&mut self, other: &Self) {
        for i in 0..14 {
            let further = other.along[i] > self.along[i];
            self.along[i] = if further { other.along[i] } else { self.along[i] };
            self.outermost[i] = if further { other.outermost[i] } else { self.outermost[i] };
        }
    }

    /// `(min n_i . n_j + 1) / 2`; 0 where there are no normals.
    pub(super) fn flatness(&self) -> f64 {
        if self.along[0] == NOTHING {
            return 0.0;
        }
        if self.outermost == [self.outermost[0]; 14] {
            return 1.0;
        }
        // Twice in a row: each pair is one and another so many places on. No sum passes 16 bits.
        let steps: [[i16; 3]; 14] = self.outermost.map(|n| steps(n).map(|x| x as i16));
        let [x, y, z]: [[i16; 28]; 3] =
            [0, 1, 2].map(|a| std::array::from_fn(|i| steps[i % 14][a]));
        let mut least = [i16::MAX; 14];
        for on in 1..=7 {
            for (i, least) in least.iter_mut().enumerate() {
                let product = x[i] * x[i + on] + y[i] * y[i + on] + z[i] * z[i + on];
                *least = product.min(*least);
            }
        }
        let least = least.into_iter().fold(i16::MAX, i16::min);
        ((f64::from(least) / (UNIT * UNIT) + 1.0) / 2.0).clamp(0.0, 1.0)
    }

    /// Any of the normals; up where there is none.
    pub(super) fn any(&self) -> DVec3 {
        let [x, y, z] = steps(self.outermost[0]).map(f64::from);
        DVec3::new(x, y, z).normalize_or(DVec3::Z)
    }
}

fn steps(packed: u32) -> [i32; 3] {
    let [x, y, z, _] = packed.to_le_bytes().map(|b| i32::from(b as i8));
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn flatness_is_that_of_the_widest_pair(
            normals in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 1..20),
        ) {
            let mut spread = Spread::NONE;
            for normal in normals {
                spread.add(&Spread::one(DVec3::from(normal).normalize_or(DVec3::Z)));
            }
            let normals = spread.outermost.map(|n| steps(n).map(f64::from)).map(DVec3::from);
            let pairs = (0..14).flat_map(|i| (0..i).map(move |j| (i, j)));
            let least = pairs.map(|(i, j)| normals[i].dot(normals[j])).fold(f64::MAX, f64::min);
            let expected = ((least / (UNIT * UNIT) + 1.0) / 2.0).clamp(0.0, 1.0);
            let same = spread.outermost == [spread.outermost[0]; 14];
            prop_assert_eq!(spread.flatness(), if same { 1.0 } else { expected });
        }
    }

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

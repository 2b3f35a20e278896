//! The slopes that a digital plane may still have.
//!
//! A plane `s = w + a u + b v` separates the voxels that are in from those that are out where every
//! one of the first has a smaller `s` than every one of the second. For each pair of voxels the slopes
//! `(a, b)` for which that holds are a half-plane, so all slopes that are left form a convex polygon.
//! Its middle is tried, and two voxels that it fails on cut the polygon there. Source: Charrier and
//! Buzer 2008 (recognition of digital planes by cutting the parameter space at its centre).

/// A voxel as u, v and w, from some near origin.
pub type Offset = [i32; 3];

/// Polygons of less area hold no slope.
const LEAST_AREA: f64 = 1e-13;

/// Cuts at the middle after which no slope is looked for.
const MOST_CUTS: usize = 64;

/// A convex polygon of slopes, and the middle of it.
#[derive(Debug, Clone)]
pub struct Slopes {
    corners: Vec<[f64; 2]>,
    /// The slope that is used.
    pub middle: [f64; 2],
}

impl Slopes {
    /// All slopes of at most 1 along both axes.
    pub fn all() -> Self {
        let corners = vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        Self { corners, middle: [0.0; 2] }
    }

    /// How far up a voxel lies, seen along the slope.
    pub fn height(&self, [u, v, w]: Offset) -> f64 {
        f64::from(w) + self.middle[0] * f64::from(u) + self.middle[1] * f64::from(v)
    }

    /// The highest voxel that is in and the lowest that is out, with their heights.
    pub fn nearest(&self, inner: &[Offset], outer: &[Offset]) -> Option<[(f64, Offset); 2]> {
        let with = |&at: &Offset| (self.height(at), at);
        let high = inner.iter().map(with).reduce(|a, b| if b.0 > a.0 { b } else { a })?;
        let low = outer.iter().map(with).reduce(|a, b| if b.0 < a.0 { b } else { a })?;
        Some([high, low])
    }

    /// Finds a slope that separates; `None` where there is none. The heights of the highest voxel
    /// that is in and the lowest that is out are given back.
    pub fn separate(&mut self, inner: &[Offset], outer: &[Offset]) -> Option<[f64; 2]> {
        for _ in 0..MOST_CUTS {
            let [(high, p), (low, q)] = self.nearest(inner, outer)?;
            if high < low {
                return Some([high, low]);
            }
            let way = [0, 1, 2].map(|i| f64::from(q[i]) - f64::from(p[i]));
            self.cut(way);
            self.middle = self.centre()?;
        }
        None
    }

    /// Leaves the slopes on which the way from a voxel that is in to one that is out goes up.
    fn cut(&mut self, [u, v, w]: [f64; 3]) {
        let up = |[a, b]: [f64; 2]| w + a * u + b * v;
        let mut left = Vec::with_capacity(self.corners.len() + 1);
        for (i, &corner) in self.corners.iter().enumerate() {
            let next = self.corners[(i + 1) % self.corners.len()];
            let (here, there) = (up(corner), up(next));
            if here > 0.0 {
                left.push(corner);
            }
            if (here > 0.0) != (there > 0.0) {
                let t = here / (here - there);
                left.push([0, 1].map(|i| corner[i] + t * (next[i] - corner[i])));
            }
        }
        self.corners = left;
    }

    /// The centre of the polygon's area.
    fn centre(&self) -> Option<[f64; 2]> {
        let first = *self.corners.first()?;
        let (mut area, mut sum) = (0.0, [0.0; 2]);
        for pair in self.corners[1..].windows(2) {
            let [p, q] = [pair[0], pair[1]].map(|c| [c[0] - first[0], c[1] - first[1]]);
            let twice = p[0] * q[1] - p[1] * q[0];
            area += twice;
            sum = [0, 1].map(|i| sum[i] + twice * (p[i] + q[i]) / 3.0);
        }
        (area > LEAST_AREA).then(|| [0, 1].map(|i| first[i] + sum[i] / area))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(100))]

        #[test]
        fn what_a_plane_separates_is_separated(
            slope in prop::array::uniform2(-0.99f64..0.99),
            above in 0.0f64..1.0,
            size in 2i32..24,
        ) {
            let top = |u: i32, v: i32| {
                (above - slope[0] * f64::from(u) - slope[1] * f64::from(v)).floor() as i32
            };
            let pixels = || (0..size).flat_map(|v| (0..size).map(move |u| (u, v)));
            let inner: Vec<Offset> = pixels().map(|(u, v)| [u, v, top(u, v)]).collect();
            let outer: Vec<Offset> = pixels().map(|(u, v)| [u, v, top(u, v) + 1]).collect();
            let mut slopes = Slopes::all();
            let found = slopes.separate(&inner, &outer);
            prop_assert!(found.is_some());
            for (&p, &q) in inner.iter().zip(&outer) {
                prop_assert!(slopes.height(p) < slopes.height(q));
            }
            // One voxel far above all others cannot be in as well.
            let mut inner = inner;
            inner.push([size / 2, size / 2, top(size / 2, size / 2) + 3 * size]);
            prop_assert!(slopes.separate(&inner, &outer).is_none());
        }
    }
}

//! Ear clipping of one planar polygon in space.

use earcut::{Earcut, utils3d::project3d_to_2d};

/// Reusable buffers for cutting polygons into triangles.
#[derive(Default)]
pub struct Ears {
    earcut: Earcut<f64>,
    ring: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    triangles: Vec<u32>,
}

impl Ears {
    /// Calls `emit` with n - 2 triples of corner numbers, wound like the polygon.
    ///
    /// Polygons that ear clipping cannot cover in full (crossing themselves, flat, repeated
    /// points) are cut as a fan instead, so that the count and the boundary edges always hold.
    pub fn cut(&mut self, points: &[[f64; 3]], face: &[u32], mut emit: impl FnMut([usize; 3])) {
        let n = face.len();
        if n < 3 {
            return;
        }
        if n == 3 {
            return emit([0, 1, 2]);
        }
        self.ring.clear();
        self.ring.extend(face.iter().map(|&p| points[p as usize]));
        let clipped = project3d_to_2d(&self.ring, n, &mut self.flat) && {
            self.earcut.earcut(self.flat.iter().copied(), &[], &mut self.triangles);
            self.triangles.len() == 3 * (n - 2)
        };
        if clipped {
            // The projection looks along the polygon's own normal, so winding is the polygon's
            // own or all reversed; one shared ring edge tells which.
            let keep = self
                .triangles
                .chunks_exact(3)
                .any(|t| (0..3).any(|i| (t[i] as usize + 1) % n == t[(i + 1) % 3] as usize));
            for t in self.triangles.chunks_exact(3) {
                let [a, b, c] = [t[0] as usize, t[1] as usize, t[2] as usize];
                emit(if keep { [a, b, c] } else { [a, c, b] });
            }
        } else {
            (1..n - 1).for_each(|i| emit([0, i, i + 1]));
        }
    }
}

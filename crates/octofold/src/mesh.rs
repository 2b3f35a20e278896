//! Indexed triangles.

use crate::attributes::{Attributes, LengthUnit};
use crate::par;
use crate::soup::ShapeError;

/// An indexed triangle mesh. Nothing about closedness or orientation is promised; for that see
/// [`crate::Solid`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Positions.
    pub points: Vec<[f64; 3]>,
    /// Points of each triangle, counter-clockwise seen from outside where there is an outside.
    pub triangles: Vec<[u32; 3]>,
    /// Columns over points, corners and triangles.
    pub attributes: Attributes,
    /// Unit of the coordinates, where known.
    pub unit: Option<LengthUnit>,
}

impl Mesh {
    /// A mesh without attributes, after checking indices and coordinates.
    pub fn new(points: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Result<Self, ShapeError> {
        let mesh = Self { points, triangles, ..Self::default() };
        mesh.check()?;
        Ok(mesh)
    }

    /// Checks that indices are in range, points finite and columns of the right length.
    pub fn check(&self) -> Result<(), ShapeError> {
        let points = self.points.len();
        if let Some(point) = self.points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(ShapeError::NotFinite { point });
        }
        for (face, t) in self.triangles.iter().enumerate() {
            if let Some(&point) = t.iter().find(|&&p| p as usize >= points) {
                return Err(ShapeError::PointOutOfRange { face, point, points });
            }
        }
        let faces = self.triangles.len();
        self.attributes
            .misfit(points, 3 * faces, faces)
            .map_or(Ok(()), |c| Err(ShapeError::Column(c)))
    }

    /// The three positions of triangle `t`.
    pub fn corners(&self, t: usize) -> [[f64; 3]; 3] {
        self.triangles[t].map(|p| self.points[p as usize])
    }

    /// The same triangles with every point moved, without columns.
    pub fn map(&self, place: impl Fn([f64; 3]) -> [f64; 3] + Sync + Send) -> Self {
        Self {
            points: par::map(&self.points, |&p| place(p)),
            triangles: self.triangles.clone(),
            unit: self.unit,
            ..Self::default()
        }
    }

    /// Unit normal of each point: the area-weighted mean over its triangles; zero where that
    /// vanishes.
    pub fn area_weighted_normals(&self) -> Vec<[f32; 3]> {
        let mut sums = vec![glam::DVec3::ZERO; self.points.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            let [a, b, c] = self.corners(t).map(glam::DVec3::from_array);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|&p| sums[p as usize] += normal);
        }
        sums.iter().map(|n| n.normalize_or_zero().as_vec3().to_array()).collect()
    }

    /// Lowest and highest coordinates of all points; `None` without points.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        bounds(&self.points)
    }
}

/// Lowest and highest coordinates of `points`; `None` where there are none.
pub fn bounds(points: &[[f64; 3]]) -> Option<[[f64; 3]; 2]> {
    let first = *points.first()?;
    Some(points.iter().fold([first, first], |[lo, hi], p| {
        [std::array::from_fn(|a| lo[a].min(p[a])), std::array::from_fn(|a| hi[a].max(p[a]))]
    }))
}

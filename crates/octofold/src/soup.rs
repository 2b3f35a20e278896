//! Polygons as read: n-gons, duplicates, order and attributes kept.

use crate::attributes::{Attributes, LengthUnit};
use crate::mesh::Mesh;

/// Why polygons do not make a [`Soup`] or a [`Mesh`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A face names a point that is not there.
    #[error("face {face} names point {point}, but there are {points}")]
    PointOutOfRange {
        /// The face, counted from 0.
        face: usize,
        /// The point it names.
        point: u32,
        /// How many points there are.
        points: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {point} has a coordinate that is not a finite number")]
    NotFinite {
        /// The point, counted from 0.
        point: usize,
    },
    /// A column has not one entry per point, corner or face.
    #[error("column {0} does not fit the shape")]
    Column(&'static str),
    /// More points or corners than 32-bit indices can name.
    #[error("{0} are more than 32-bit indices can name")]
    TooMany(&'static str),
}

/// A polygon soup: indices are in range and points are finite, nothing more is promised.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Soup {
    points: Vec<[f64; 3]>,
    starts: Vec<u32>,
    corners: Vec<u32>,
    /// Columns over points, corners and faces.
    attributes: Attributes,
    /// Unit of the coordinates, where the file says so.
    pub unit: Option<LengthUnit>,
}

/// Collects polygons for a [`Soup`], one by one.
#[derive(Debug, Clone, Default)]
pub struct SoupBuilder {
    /// Points so far.
    pub points: Vec<[f64; 3]>,
    starts: Vec<u32>,
    /// Point of each corner so far, face after face.
    pub corners: Vec<u32>,
    /// Columns; fill them in step with points, corners and faces.
    pub attributes: Attributes,
    /// Unit of the coordinates.
    pub unit: Option<LengthUnit>,
}

impl SoupBuilder {
    /// Adds a face over points that may come later.
    pub fn face(&mut self, corners: &[u32]) {
        self.starts.push(self.corners.len() as u32);
        self.corners.extend_from_slice(corners);
    }

    /// Faces so far.
    pub fn faces(&self) -> usize {
        self.starts.len()
    }

    /// Checks indices, coordinates and columns.
    pub fn build(mut self) -> Result<Soup, ShapeError> {
        if self.corners.len() >= u32::MAX as usize {
            return Err(ShapeError::TooMany("corners"));
        }
        if self.points.len() >= u32::MAX as usize {
            return Err(ShapeError::TooMany("points"));
        }
        if let Some(point) = self.points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(ShapeError::NotFinite { point });
        }
        if let Some(at) = self.corners.iter().position(|&p| p as usize >= self.points.len()) {
            let face = self.starts.partition_point(|&s| s as usize <= at) - 1;
            let (point, points) = (self.corners[at], self.points.len());
            return Err(ShapeError::PointOutOfRange { face, point, points });
        }
        let (points, corners, faces) = (self.points.len(), self.corners.len(), self.starts.len());
        if let Some(column) = self.attributes.misfit(points, corners, faces) {
            return Err(ShapeError::Column(column));
        }
        self.starts.push(self.corners.len() as u32);
        Ok(Soup {
            points: self.points,
            starts: self.starts,
            corners: self.corners,
            attributes: self.attributes,
            unit: self.unit,
        })
    }
}

impl Soup {
    /// Positions, in the file's own coordinates.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Number of polygons.
    pub fn faces(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Points of face `face`, in the file's order.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.corners[self.starts[face] as usize..self.starts[face + 1] as usize]
    }

    /// Index of the first corner of face `face` in the corner columns.
    pub fn first_corner(&self, face: usize) -> usize {
        self.starts[face] as usize
    }

    /// Points of all corners, face after face.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// Columns over points, corners and faces.
    pub fn attributes(&self) -> &Attributes {
        &self.attributes
    }

    /// Triangles that the polygons fall into: a face of n corners gives n - 2.
    pub fn triangle_count(&self) -> usize {
        (0..self.faces()).map(|f| self.face(f).len().saturating_sub(2)).sum()
    }

    /// Cuts every polygon into triangles, concave ones by ear clipping in their own plane.
    ///
    /// A polygon of n corners always gives n - 2 triangles on its own corners, in order and with
    /// its winding; columns follow. Faces of fewer than three corners are dropped.
    pub fn triangulate(&self) -> Mesh {
        let total = self.triangle_count();
        let mut triangles = Vec::with_capacity(total);
        let mut corner_of = Vec::with_capacity(3 * total);
        let mut face_of = Vec::with_capacity(total);
        let mut ears = crate::polygon::Ears::default();
        for f in 0..self.faces() {
            let (face, first) = (self.face(f), self.first_corner(f));
            ears.cut(&self.points, face, |t| {
                triangles.push(t.map(|i| face[i]));
                corner_of.extend(t.map(|i| first + i));
                face_of.push(f);
            });
        }
        let a = &self.attributes;
        let attributes = Attributes {
            corner_uvs: gather(&a.corner_uvs, &corner_of),
            corner_normals: gather(&a.corner_normals, &corner_of),
            face_colours: gather(&a.face_colours, &face_of),
            face_materials: gather(&a.face_materials, &face_of),
            face_labels: gather(&a.face_labels, &face_of),
            ..a.clone()
        };
        Mesh { points: self.points.clone(), triangles, attributes, unit: self.unit }
    }

    /// As [`Self::triangulate`], but what is in triangles already is moved, not copied.
    pub fn into_mesh(self) -> Mesh {
        if (0..self.faces()).any(|f| self.face(f).len() != 3) {
            return self.triangulate();
        }
        let Self { points, corners, attributes, unit, .. } = self;
        Mesh { points, triangles: corners.as_chunks().0.to_vec(), attributes, unit }
    }
}

impl From<Mesh> for Soup {
    fn from(mesh: Mesh) -> Self {
        let starts = (0..=mesh.triangles.len() as u32).map(|f| 3 * f).collect();
        Self {
            points: mesh.points,
            starts,
            corners: bytemuck::cast_vec(mesh.triangles),
            attributes: mesh.attributes,
            unit: mesh.unit,
        }
    }
}

fn gather<T: Copy>(column: &Option<Vec<T>>, from: &[usize]) -> Option<Vec<T>> {
    column.as_ref().map(|c| from.iter().map(|&i| c[i]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moved_or_copied_the_mesh_is_the_same() {
        for faces in [vec![vec![0, 1, 2], vec![0, 2, 3]], vec![vec![0, 1, 2, 3], vec![2, 1, 0]]] {
            let mut builder = SoupBuilder {
                points: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
                ..SoupBuilder::default()
            };
            faces.iter().for_each(|face| builder.face(face));
            builder.attributes.face_labels = Some(vec![7, 8]);
            builder.attributes.corner_uvs =
                Some((0..builder.corners.len()).map(|c| [c as f32; 2]).collect());
            let soup = builder.build().unwrap();
            assert_eq!(soup.triangulate(), soup.into_mesh());
        }
    }
}

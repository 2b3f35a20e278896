//! A mesh proved closed, oriented and 2-manifold.

use crate::measure::Topology;
use crate::mesh::Mesh;
use crate::run::Run;
use std::ops::Deref;

/// A mesh that is closed, consistently oriented and 2-manifold by its own indices: every edge has
/// exactly two triangles, which run along it in opposite ways, and the triangles at every point
/// form one fan. Made only by [`Solid::try_from`].
///
/// Nothing is said about where the points are: a solid may still intersect itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid(Mesh);

/// Why a mesh is not a [`Solid`], and the first place where it is not.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotSolid {
    /// There is no triangle.
    #[error("the mesh has no triangles")]
    Empty,
    /// Indices, coordinates or columns do not fit.
    #[error(transparent)]
    Shape(#[from] crate::ShapeError),
    /// A triangle names a point twice.
    #[error("triangle {0} names a point twice")]
    Degenerate(u32),
    /// Two triangles have the same three points.
    #[error("triangle {0} repeats an earlier one")]
    Duplicate(u32),
    /// An edge has one triangle.
    #[error("the edge between points {} and {} has only one triangle", .0[0], .0[1])]
    Boundary([u32; 2]),
    /// An edge has three triangles or more.
    #[error("the edge between points {} and {} has more than two triangles", .0[0], .0[1])]
    NonmanifoldEdge([u32; 2]),
    /// The two triangles of an edge run along it the same way.
    #[error("the triangles at the edge between points {} and {} face opposite ways", .0[0], .0[1])]
    Misoriented([u32; 2]),
    /// The triangles at a point form more than one fan.
    #[error("the triangles at point {0} form more than one fan")]
    NonmanifoldPoint(u32),
}

impl TryFrom<Mesh> for Solid {
    type Error = NotSolid;

    fn try_from(mesh: Mesh) -> Result<Self, NotSolid> {
        mesh.check()?;
        let Ok(found) = Topology::of(mesh.points.len(), &mesh.triangles, &Run::default()) else {
            unreachable!("nobody else holds the flag that would cancel this run")
        };
        let edge =
            |first: &[[u32; 2]], not: fn([u32; 2]) -> NotSolid| first.first().copied().map(not);
        let number = |first: &[u32], not: fn(u32) -> NotSolid| first.first().copied().map(not);
        let wrong = number(&found.degenerate_triangles.first, NotSolid::Degenerate)
            .or_else(|| number(&found.duplicate_triangles.first, NotSolid::Duplicate))
            .or_else(|| edge(&found.boundary_edges.first, NotSolid::Boundary))
            .or_else(|| edge(&found.nonmanifold_edges.first, NotSolid::NonmanifoldEdge))
            .or_else(|| edge(&found.misoriented_edges.first, NotSolid::Misoriented))
            .or_else(|| number(&found.nonmanifold_points.first, NotSolid::NonmanifoldPoint));
        match wrong {
            Some(not) => Err(not),
            None if mesh.triangles.is_empty() => Err(NotSolid::Empty),
            None => Ok(Self(mesh)),
        }
    }
}

impl Solid {
    /// The mesh.
    pub fn as_mesh(&self) -> &Mesh {
        &self.0
    }

    /// Gives the mesh back; with it goes the promise.
    pub fn into_mesh(self) -> Mesh {
        self.0
    }
}

impl Deref for Solid {
    type Target = Mesh;

    fn deref(&self) -> &Mesh {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn not_solid(triangles: &[[u32; 3]]) -> NotSolid {
        let points = (0..8).map(|i| [f64::from(i), f64::from(i * i), f64::from(i % 3)]).collect();
        Solid::try_from(Mesh::new(points, triangles.to_vec()).unwrap()).unwrap_err()
    }

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn each_reason_is_told_with_its_place() {
        assert_eq!(not_solid(&[]), NotSolid::Empty);
        assert_eq!(not_solid(&[[0, 1, 1]]), NotSolid::Degenerate(0));
        assert_eq!(not_solid(&[[0, 1, 2], [2, 1, 0]]), NotSolid::Duplicate(1));
        assert_eq!(not_solid(&TETRAHEDRON[..3]), NotSolid::Boundary([0, 2]));
        let [a, b, c, d] = TETRAHEDRON;
        let flipped = [d[1], d[0], d[2]];
        assert_eq!(not_solid(&[a, b, c, flipped]), NotSolid::Misoriented([0, 2]));
        let second = TETRAHEDRON.map(|t| t.map(|p| if p == 0 { 0 } else { p + 3 }));
        let at_a_point = [&TETRAHEDRON[..], &second[..]].concat();
        assert_eq!(not_solid(&at_a_point), NotSolid::NonmanifoldPoint(0));
        let third = TETRAHEDRON.map(|t| t.map(|p| if p < 2 { p } else { p + 3 }));
        let at_an_edge = [&TETRAHEDRON[..], &third[..]].concat();
        assert_eq!(not_solid(&at_an_edge), NotSolid::NonmanifoldEdge([0, 1]));
    }

    #[test]
    fn a_tetrahedron_is_solid() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let solid = Solid::try_from(Mesh::new(points, TETRAHEDRON.to_vec()).unwrap()).unwrap();
        assert_eq!(solid.triangles.len(), 4);
        assert_eq!(solid.as_mesh().points.len(), solid.clone().into_mesh().points.len());
    }
}

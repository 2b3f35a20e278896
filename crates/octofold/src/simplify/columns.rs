//! Colours, normals and texture coordinates on their way through the collapses.
//!
//! Columns of faces stay with their faces. What a point or a corner carries becomes what lies on the
//! edge where its point comes to lie; at seams each side does so with its own values, those that
//! the faces that end have. Edges where materials, labels, face colours or texture coordinates differ
//! are seams, and so are those where corner normals differ by much.

use super::complex::Complex;
use crate::attributes::Attributes;
use crate::mesh::Mesh;
use glam::{DVec3, Vec3};

/// Cosine of the angle between corner normals at which an edge is a seam: 30 degrees.
const CREASE: f32 = 0.866;

/// One side in so many may lie on a seam.
const MOST_SEAMS: usize = 4;

/// The columns of the input, by the input's numbers, changed as its points move.
#[derive(Debug)]
pub struct Columns {
    attributes: Attributes,
    /// The input's number of each face that goes into the complex.
    faces: Vec<u32>,
}

impl Columns {
    /// The columns of a mesh of which only `faces` go into the complex.
    pub fn new(mesh: &Mesh, faces: Vec<u32>) -> Self {
        Self { attributes: mesh.attributes.clone(), faces }
    }

    fn input_face(&self, complex: &Complex, face: u32) -> usize {
        self.faces[complex.face_names[face as usize] as usize] as usize
    }

    /// Marks the seams of a complex. Where so many edges would be that hardly anything is left
    /// between them, none is.
    pub fn mark_seams(&self, complex: &mut Complex) {
        let a = &self.attributes;
        let of_faces =
            a.face_colours.is_some() || a.face_materials.is_some() || a.face_labels.is_some();
        if of_faces || a.corner_uvs.is_some() || a.corner_normals.is_some() {
            let seams = complex.sides_where(|one, other| self.differ(complex, one, other));
            if seams.len() > complex.faces.len() * 3 / MOST_SEAMS {
                return;
            }
            for side in seams {
                complex.seams[(side >> 2) as usize] |= 1 << (side & 3);
            }
        }
    }

    /// Whether columns differ across an edge, given as a side of either face.
    fn differ(&self, complex: &Complex, one: u32, other: u32) -> bool {
        fn unlike<T: PartialEq>(column: &Option<Vec<T>>, [a, b]: [usize; 2]) -> bool {
            column.as_ref().is_some_and(|c| c[a] != c[b])
        }
        let a = &self.attributes;
        let faces = [one, other].map(|side| self.input_face(complex, side >> 2));
        if unlike(&a.face_colours, faces)
            || unlike(&a.face_materials, faces)
            || unlike(&a.face_labels, faces)
        {
            return true;
        }
        let end = |i: usize| {
            let point = complex.ends(one)[i];
            let corners = complex.faces[(other >> 2) as usize].corners;
            let own = ((one & 3) as usize + i) % 3;
            let its = corners.iter().position(|&p| p == point).unwrap_or(0);
            [3 * faces[0] + own, 3 * faces[1] + its]
        };
        [end(0), end(1)].into_iter().any(|corners| {
            let bent = a.corner_normals.as_ref().is_some_and(|normals| {
                let [m, n] = corners.map(|c| Vec3::from(normals[c]));
                m.dot(n) < CREASE * m.length() * n.length()
            });
            bent || unlike(&a.corner_uvs, corners)
        })
    }

    /// Follows the collapse of `gone` into `kept` at `place`, before the complex makes it; `changed`
    /// are the faces that stay and move a corner.
    pub fn collapse(
        &mut self,
        complex: &Complex,
        [kept, gone]: [u32; 2],
        place: DVec3,
        changed: impl Iterator<Item = u32> + Clone,
        dying: &[u32],
    ) {
        let [from, to] = [kept, gone].map(|p| complex.at[p as usize]);
        let way = to - from;
        let along = (place - from).dot(way) / way.length_squared();
        let share = if along.is_finite() { along.clamp(0.0, 1.0) as f32 } else { 0.5 };
        let [own, other] = [kept, gone].map(|p| complex.point_names[p as usize] as usize);
        if let Some(colours) = &mut self.attributes.point_colours {
            let (a, b) = (colours[own], colours[other]);
            colours[own] = std::array::from_fn(|i| {
                let (a, b) = (f32::from(a[i]), f32::from(b[i]));
                (a + (b - a) * share).round() as u8
            });
        }
        if let Some(normals) = &mut self.attributes.point_normals {
            let (a, b) = (Vec3::from(normals[own]), Vec3::from(normals[other]));
            normals[own] = a.lerp(b, share).normalize_or(a).to_array();
        }
        if self.attributes.corner_uvs.is_none() && self.attributes.corner_normals.is_none() {
            return;
        }
        let corner = |face: u32, point: u32| {
            let slot = complex.faces[face as usize].corners.iter().position(|&p| p == point)?;
            Some(3 * self.input_face(complex, face) + slot)
        };
        // Where each side of the edge has its values, at `kept` and at `gone`.
        let ends: Vec<[usize; 2]> =
            dying.iter().filter_map(|&f| Some([corner(f, kept)?, corner(f, gone)?])).collect();
        let moves: Vec<(usize, usize)> = changed
            .filter_map(|f| {
                let at_kept = corner(f, kept).map(|c| (c, 0));
                at_kept.or_else(|| corner(f, gone).map(|c| (c, 1)))
            })
            .collect();
        if let Some(uvs) = &mut self.attributes.corner_uvs {
            shift(uvs, &ends, &moves, share);
        }
        if let Some(normals) = &mut self.attributes.corner_normals {
            shift(normals, &ends, &moves, share);
            for &(corner, _) in &moves {
                normals[corner] = Vec3::from(normals[corner]).normalize_or_zero().to_array();
            }
        }
    }

    /// The columns of what is left: faces and points by their numbers in the complex, in the order
    /// given.
    pub fn gather(self, complex: &Complex, points: &[u32], faces: &[u32]) -> Attributes {
        fn pick<T: Copy>(column: &Option<Vec<T>>, from: &[usize]) -> Option<Vec<T>> {
            column.as_ref().map(|c| from.iter().map(|&i| c[i]).collect())
        }
        let points: Vec<usize> =
            points.iter().map(|&p| complex.point_names[p as usize] as usize).collect();
        let faces: Vec<usize> = faces.iter().map(|&f| self.input_face(complex, f)).collect();
        let corners: Vec<usize> = faces.iter().flat_map(|f| 3 * f..3 * f + 3).collect();
        let a = self.attributes;
        Attributes {
            point_colours: pick(&a.point_colours, &points),
            point_normals: pick(&a.point_normals, &points),
            corner_uvs: pick(&a.corner_uvs, &corners),
            corner_normals: pick(&a.corner_normals, &corners),
            face_colours: pick(&a.face_colours, &faces),
            face_materials: pick(&a.face_materials, &faces),
            face_labels: pick(&a.face_labels, &faces),
            point_columns: a.point_columns.iter().map(|c| c.pick(&points)).collect(),
            materials: a.materials,
            label_names: a.label_names,
        }
    }
}

/// Moves values along the edge, each with the side of it whose value is nearest to its own.
fn shift<const N: usize>(
    column: &mut [[f32; N]],
    ends: &[[usize; 2]],
    moves: &[(usize, usize)],
    share: f32,
) {
    let ends: Vec<[[f32; N]; 2]> = ends.iter().map(|e| e.map(|c| column[c])).collect();
    for &(corner, end) in moves {
        let own = column[corner];
        let distance =
            |side: &[[f32; N]; 2]| -> f32 { (0..N).map(|i| (side[end][i] - own[i]).powi(2)).sum() };
        let Some(side) = ends.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            continue;
        };
        let [a, b] = *side;
        let reached: [f32; N] = std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share);
        // A value of its own keeps its distance from that of the edge.
        column[corner] = std::array::from_fn(|i| {
            if own[i] == side[end][i] { reached[i] } else { own[i] + (reached[i] - side[end][i]) }
        });
    }
}

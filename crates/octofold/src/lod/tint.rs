//! The colours of a mesh, in linear light.

use crate::attributes::Attributes;
use crate::light::linear;
use crate::mesh::Mesh;
use glam::{DVec3, Vec3, Vec4};

/// Where the colours of a mesh come from.
pub(super) enum Tint<'a> {
    /// One for each point.
    Points(&'a Mesh, &'a [[u8; 4]]),
    /// One for each triangle.
    Faces(&'a [[u8; 4]]),
    /// One for each material.
    Materials(&'a [u32], Vec<[u8; 4]>),
}

impl<'a> Tint<'a> {
    /// The colours of a mesh, where it has any: of points, else of faces, else of materials.
    pub(super) fn of(mesh: &'a Mesh) -> Option<Self> {
        let Attributes { point_colours, face_colours, face_materials, materials, .. } =
            &mesh.attributes;
        if let Some(colours) = point_colours {
            return Some(Self::Points(mesh, colours));
        }
        if let Some(colours) = face_colours {
            return Some(Self::Faces(colours));
        }
        let colours = materials.iter().map(|m| m.colour).collect();
        face_materials.as_ref().map(|of_face| Self::Materials(of_face, colours))
    }

    /// The colour of a triangle at a place in the world.
    pub(super) fn at(&self, triangle: u32, place: DVec3) -> Vec4 {
        let t = triangle as usize;
        match self {
            Self::Points(mesh, colours) => {
                let [a, b, c] = mesh.corners(t).map(DVec3::from);
                let whole = (b - a).cross(c - a);
                let area = whole.length_squared();
                let share = |p: DVec3, q: DVec3| {
                    if area > 0.0 {
                        ((p - place).cross(q - place).dot(whole) / area).clamp(0.0, 1.0)
                    } else {
                        1.0 / 3.0
                    }
                };
                let shares = [share(b, c), share(c, a), share(a, b)];
                let sum: f64 = shares.iter().sum();
                (0..3).fold(Vec4::ZERO, |mixed, i| {
                    let colour = light(colours[mesh.triangles[t][i] as usize]);
                    mixed + colour * (shares[i] / sum.max(1e-9)) as f32
                })
            }
            Self::Faces(colours) => light(colours[t]),
            Self::Materials(of_face, colours) => {
                let plain = crate::attributes::Material::default().colour;
                light(*colours.get(of_face[t] as usize).unwrap_or(&plain))
            }
        }
    }
}

/// Linear light of a colour, and its alpha.
fn light([r, g, b, a]: [u8; 4]) -> Vec4 {
    let Vec3 { x, y, z } = linear([r, g, b]);
    Vec4::new(x, y, z, f32::from(a) / 255.0)
}

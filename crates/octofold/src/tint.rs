//! The colours of a mesh, in linear light.

use crate::attributes::{Attributes, Material};
use crate::image::Pyramid;
use crate::light::{linear, srgb};
use crate::mesh::Mesh;
use glam::{DVec2, DVec3, Vec3, Vec4};
use std::sync::Arc;

/// Images of materials, one for each; `None` for those that have none.
pub type Images = [Option<Arc<Pyramid>>];

/// Where the colours of a mesh come from.
pub struct Tint<'a> {
    mesh: &'a Mesh,
    base: Base<'a>,
    textures: Option<Textures<'a>>,
    /// Side of a finest cell in the world.
    cell: f64,
}

/// Images, and where triangles are in them.
struct Textures<'a> {
    /// Texture coordinates of corners.
    uvs: &'a [[f32; 2]],
    /// Materials of triangles.
    materials: &'a [u32],
    images: &'a Images,
}

/// Colours that those of images are multiplied by.
enum Base<'a> {
    /// One for each point.
    Points(&'a [[u8; 4]]),
    /// One for each triangle.
    Faces(&'a [[u8; 4]]),
    /// One for each material.
    Materials(&'a [u32], Vec<[u8; 4]>),
}

impl<'a> Tint<'a> {
    /// The colours of a mesh, where it has any: of points, else of faces, else of materials, and of
    /// images as they look in cells of such a side.
    pub fn of(mesh: &'a Mesh, images: &'a Images, cell: f64) -> Option<Self> {
        let Attributes { point_colours, face_colours, face_materials, materials, .. } =
            &mesh.attributes;
        let base = if let Some(colours) = point_colours {
            Base::Points(colours)
        } else if let Some(colours) = face_colours {
            Base::Faces(colours)
        } else {
            let colours = materials.iter().map(|m| m.colour).collect();
            Base::Materials(face_materials.as_ref()?, colours)
        };
        let textures = match (&mesh.attributes.corner_uvs, face_materials) {
            (Some(uvs), Some(of_face)) if images.iter().any(Option::is_some) => {
                Some(Textures { uvs, materials: of_face, images })
            }
            _ => None,
        };
        Some(Self { mesh, base, textures, cell })
    }

    /// The colour of a triangle at a place in the world.
    pub fn at(&self, triangle: u32, place: DVec3) -> Vec4 {
        let t = triangle as usize;
        let base = match &self.base {
            Base::Points(colours) => {
                let shares = shares(self.mesh.corners(t), place);
                (0..3).fold(Vec4::ZERO, |mixed, i| {
                    let colour = light(colours[self.mesh.triangles[t][i] as usize]);
                    mixed + colour * shares[i] as f32
                })
            }
            Base::Faces(colours) => light(colours[t]),
            Base::Materials(of_face, colours) => {
                let plain = Material::default().colour;
                light(*colours.get(of_face[t] as usize).unwrap_or(&plain))
            }
        };
        match self.image(t, place) {
            Some(texel) => base * texel,
            None => base,
        }
    }

    /// The colour of a triangle's image, where it has one: the mean over about as much as a cell shows.
    fn image(&self, t: usize, place: DVec3) -> Option<Vec4> {
        let Textures { uvs, materials, images } = self.textures.as_ref()?;
        let pyramid = images.get(materials[t] as usize)?.as_ref()?;
        let corners = self.mesh.corners(t);
        let shares = shares(corners, place);
        let uvs = [0, 1, 2].map(|k| DVec2::from(uvs[3 * t + k].map(f64::from)));
        let at: DVec2 = (0..3).map(|k| uvs[k] * shares[k]).sum();
        let [a, b, c] = corners.map(DVec3::from);
        let area = (b - a).cross(c - a).length();
        let size = DVec2::from(pyramid.image().size().map(|x| x as f64));
        let shown = ((uvs[1] - uvs[0]) * size).perp_dot((uvs[2] - uvs[0]) * size).abs();
        let texels = if area > 0.0 { (shown / area).sqrt() * self.cell } else { 1.0 };
        Some(pyramid.light(at.to_array(), texels))
    }
}

/// Barycentric coordinates of a place on a triangle, none below zero.
fn shares(corners: [[f64; 3]; 3], place: DVec3) -> [f64; 3] {
    let [a, b, c] = corners.map(DVec3::from);
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
    shares.map(|share| share / sum.max(1e-9))
}

/// The colour of linear light and alpha, both straight.
pub fn colour(light: Vec4) -> [u8; 4] {
    let [r, g, b] = srgb(light.truncate());
    [r, g, b, (light.w * 255.0).round() as u8]
}

/// Linear light of a colour, and its alpha.
fn light([r, g, b, a]: [u8; 4]) -> Vec4 {
    let Vec3 { x, y, z } = linear([r, g, b]);
    Vec4::new(x, y, z, f32::from(a) / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::lod::{BuildOptions, build, build_painted};
    use crate::run::Run;

    /// A square whose left half shows the left half of an image, and so on.
    fn square(colour: [u8; 4]) -> Mesh {
        let mut mesh = Mesh {
            points: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.1], [0.0, 1.0, 0.1]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let uv = |p: &u32| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][*p as usize];
        let uvs = mesh.triangles.iter().flatten().map(uv).collect();
        mesh.attributes.corner_uvs = Some(uvs);
        mesh.attributes.face_materials = Some(vec![0, 0]);
        mesh.attributes.materials = vec![Material { colour, ..Material::default() }];
        mesh
    }

    fn image(texel: impl Fn(usize, usize) -> [u8; 4]) -> Vec<Option<Arc<Pyramid>>> {
        let rgba = (0..64 * 64).map(|i| texel(i % 64, i / 64)).collect();
        vec![Image::new(64, 64, rgba).map(|image| Arc::new(Pyramid::new(image)))]
    }

    #[test]
    fn colours_come_back_from_light() {
        for v in 0..=255 {
            let rgba = [v, 255 - v, v / 2, v];
            let back = colour(light(rgba));
            assert!((0..4).all(|k| back[k].abs_diff(rgba[k]) <= 1), "{rgba:?} {back:?}");
        }
    }

    #[test]
    fn octants_have_the_mean_of_what_they_show_in_linear_light() {
        let halves = image(|x, _| if x < 32 { [255, 0, 0, 255] } else { [0, 0, 255, 255] });
        let options = BuildOptions { level: 5, early_leaves: false, ..BuildOptions::default() };
        let lod = build_painted(&square([255; 4]), &halves, &options, &Run::default()).unwrap();
        // Half of the light is sRGB 188.
        let root = lod.colour(0).unwrap();
        assert!(root[0].abs_diff(188) < 4 && root[1] == 0 && root[2].abs_diff(188) < 4, "{root:?}");
        let leaves = lod.level(5);
        let plain = leaves.filter(|&leaf| {
            let [r, _, b, _] = lod.colour(leaf).unwrap();
            r.min(b) == 0
        });
        assert!(plain.count() > 800);
    }

    #[test]
    fn materials_tint_their_images_and_fine_patterns_become_gray() {
        let board = image(|x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
        let options = BuildOptions { level: 4, early_leaves: false, ..BuildOptions::default() };
        let mesh = square([255, 0, 255, 255]);
        let lod = build_painted(&mesh, &board, &options, &Run::default()).unwrap();
        for leaf in lod.level(4) {
            let [r, g, b, a] = lod.colour(leaf).unwrap();
            assert!(r.abs_diff(188) < 4 && g == 0 && b == r && a == 255, "{r} {g} {b} {a}");
        }
        let plain = build(&mesh, &options, &Run::default()).unwrap();
        assert_eq!(plain.colour(0), Some([255, 0, 255, 255]));
    }
}

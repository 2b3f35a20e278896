//! Normals, colours and light at the samples of a tile.

use super::colour::{linear, of_label, srgb};
use super::raster::{NOTHING, SAMPLES, Tile, area, corner};
use super::view::Camera;
use super::{Background, Paint, Shading, Style};
use crate::attributes::Attributes;
use crate::measure::weld_points;
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::{DVec3, Vec3};

/// Points with more faces around them than this are shaded flat.
const MOST_FACES: usize = 256;
/// Triangles in one unit of work.
const BLOCK: usize = 1 << 13;
/// Width of wireframe lines, in pixels.
const LINE: f64 = 1.0;
/// Share of the tint in faces seen from behind.
const TINT: f32 = 0.65;

/// Points by position: faces of a soup that meet there share one name.
pub(super) struct Weld {
    /// One name for all points at the same place.
    names: Vec<u32>,
}

impl Weld {
    pub fn new(mesh: &Mesh, run: &Run) -> Result<Self, Cancelled> {
        Ok(Self { names: weld_points(&mesh.points, run)?.of })
    }

    fn triangle(&self, t: [u32; 3]) -> [u32; 3] {
        t.map(|p| self.names[p as usize])
    }

    /// Ends of all edges with a single face.
    pub fn boundary(&self, mesh: &Mesh) -> Vec<[u32; 2]> {
        let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * mesh.triangles.len());
        for (t, &triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = self.triangle(triangle);
            if a != b && b != c && c != a {
                for (i, [p, q]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                    edges.push(([p.min(q), p.max(q)], (3 * t + i) as u32));
                }
            }
        }
        par::sort(&mut edges);
        let alone = edges.chunk_by(|x, y| x.0 == y.0).filter(|run| run.len() == 1);
        alone
            .map(|run| {
                let (t, i) = (run[0].1 as usize / 3, run[0].1 as usize % 3);
                [mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]]
            })
            .collect()
    }

    /// Faces around each point, as starts and faces.
    fn around(&self, mesh: &Mesh) -> (Vec<u32>, Vec<u32>) {
        let mut starts = vec![0u32; self.names.len() + 1];
        for &triangle in &mesh.triangles {
            self.triangle(triangle).iter().for_each(|&p| starts[p as usize + 1] += 1);
        }
        for p in 0..self.names.len() {
            starts[p + 1] += starts[p];
        }
        let (mut next, mut faces) = (starts.clone(), vec![0; 3 * mesh.triangles.len()]);
        for (t, &triangle) in mesh.triangles.iter().enumerate() {
            for p in self.triangle(triangle) {
                faces[next[p as usize] as usize] = t as u32;
                next[p as usize] += 1;
            }
        }
        (starts, faces)
    }
}

/// Everything needed to colour a sample of which the triangle is known.
pub(super) struct Shader<'a> {
    mesh: &'a Mesh,
    style: &'a Style,
    camera: &'a Camera,
    /// Normals of all corners; `None` for flat shading.
    normals: Option<Vec<[f32; 3]>>,
    lights: [Light; 2],
}

/// A light far away.
struct Light {
    /// Where it stands.
    towards: Vec3,
    colour: Vec3,
}

/// Light from above and from below, on what faces there.
const SKY: Vec3 = Vec3::new(0.36, 0.38, 0.42);
const GROUND: Vec3 = Vec3::new(0.15, 0.14, 0.13);

impl<'a> Shader<'a> {
    pub fn new(
        mesh: &'a Mesh,
        style: &'a Style,
        camera: &'a Camera,
        weld: &Weld,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        let normals = match style.shading {
            Shading::Flat => None,
            Shading::Smooth { crease } => Some(corner_normals(mesh, crease, weld, run)?),
        };
        let light = |right: f64, up: f64, back: f64, colour| Light {
            towards: (camera.right * right + camera.up * up + camera.back * back)
                .normalize()
                .as_vec3(),
            colour,
        };
        let lights = [
            light(-0.50, 0.62, 0.75, Vec3::new(0.88, 0.84, 0.78)),
            light(0.90, 0.05, 0.40, Vec3::new(0.15, 0.18, 0.23)),
        ];
        Ok(Self { mesh, style, camera, normals, lights })
    }

    /// The pixels of a tile, row by row.
    pub fn resolve(&self, tile: &Tile) -> Vec<[u8; 4]> {
        let mut pixels = Vec::with_capacity(Tile::SIDE * Tile::SIDE);
        let of_sample = 1.0 / (SAMPLES * SAMPLES) as f32;
        for y in 0..Tile::SIDE {
            for x in 0..Tile::SIDE {
                let (mut light, mut cover) = (Vec3::ZERO, 0.0);
                for i in 0..SAMPLES * SAMPLES {
                    let (sx, sy) = (x * SAMPLES + i % SAMPLES, y * SAMPLES + i / SAMPLES);
                    let (colour, alpha) = self.sample(tile, sx, sy);
                    light += colour * alpha;
                    cover += alpha;
                }
                (light, cover) = (light * of_sample, cover * of_sample);
                pixels.push(self.over_background(light, cover, tile.origin()[1] + y));
            }
        }
        pixels
    }

    /// Light of a sample, and how much of the background it hides.
    fn sample(&self, tile: &Tile, x: usize, y: usize) -> (Vec3, f32) {
        let at = y * Tile::ACROSS + x;
        let (mut light, mut alpha) = match tile.seen[at] {
            NOTHING => (Vec3::ZERO, 0.0),
            t => (self.surface(t as usize, tile, x, y), 1.0),
        };
        if let (Some(colour), Some(&cover)) = (self.style.boundary, tile.lined.get(at)) {
            let hidden = alpha * (1.0 - cover);
            if cover > 0.0 {
                alpha = cover + hidden;
                light = (linear(colour) * cover + light * hidden) / alpha;
            }
        }
        (light, alpha)
    }

    fn over_background(&self, light: Vec3, cover: f32, row: usize) -> [u8; 4] {
        let behind = match self.style.background {
            Background::Clear => {
                let alpha = (cover * 255.0).round() as u8;
                let [r, g, b] = srgb(if cover > 0.0 { light / cover } else { Vec3::ZERO });
                return [r, g, b, alpha];
            }
            Background::Plain(colour) => linear(colour),
            Background::Gradient(top, bottom) => {
                let t = (row as f32 + 0.5) / self.camera.size[1] as f32;
                linear(top).lerp(linear(bottom), t)
            }
        };
        let [r, g, b] = srgb(light + behind * (1.0 - cover));
        [r, g, b, 255]
    }

    /// Light from triangle `t` at a sample.
    fn surface(&self, t: usize, tile: &Tile, x: usize, y: usize) -> Vec3 {
        let triangle = self.mesh.triangles[t];
        let points = triangle.map(|p| self.camera.points[p as usize]);
        let corners = points.map(|p| corner(p.at));
        let sample = corner(tile.position(x, y));
        let [a, b, c] = corners;
        let parts = [area(b, c, sample), area(c, a, sample), area(a, b, sample)];
        let whole = area(a, b, c);
        let weights: [f64; 3] = std::array::from_fn(|i| parts[i] as f64 * points[i].weight);
        let total: f64 = weights.iter().sum();
        let shares = weights.map(|w| w / total);

        // On the picture y points down, so what turns left in the world turns right here... and
        // a triangle is seen from its front where its area is negative.
        let from_behind = whole > 0;
        let place: DVec3 =
            (0..3).map(|i| DVec3::from(self.mesh.points[triangle[i] as usize]) * shares[i]).sum();
        let eye = self.camera.towards_eye(place).as_vec3();
        let mut normal = self.normal(t, shares);
        let flat = self.flat_normal(t);
        // Both sides are lit; a smooth normal may not turn away where its face is seen.
        let facing = if from_behind { -flat } else { flat };
        if normal.dot(facing) < 0.0 {
            normal = -normal;
        }
        let mut colour = self.colour(t, shares);
        if let (true, Some(tint)) = (from_behind, self.style.back) {
            colour = colour.lerp(linear(tint), TINT);
        }
        let mut light = self.lit(colour, normal, eye);
        if let Some(ink) = self.style.wireframe {
            light = light.lerp(linear(ink), wire(corners, parts, whole));
        }
        light
    }

    /// Diffuse and a little reflected light.
    fn lit(&self, colour: Vec3, normal: Vec3, eye: Vec3) -> Vec3 {
        let up = self.camera.up.as_vec3();
        let mut diffuse = GROUND.lerp(SKY, 0.5 + 0.5 * normal.dot(up));
        let mut shine = Vec3::ZERO;
        for Light { towards, colour } in &self.lights {
            diffuse += *colour * ((normal.dot(*towards) + 0.12) / 1.12).max(0.0);
            let half = (*towards + eye).normalize_or_zero();
            shine += *colour * 0.10 * normal.dot(half).max(0.0).powi(32);
        }
        colour * diffuse + shine
    }

    fn flat_normal(&self, t: usize) -> Vec3 {
        face_normal(self.mesh, t).normalize_or_zero().as_vec3()
    }

    fn normal(&self, t: usize, shares: [f64; 3]) -> Vec3 {
        let flat = || self.flat_normal(t);
        let Some(normals) = &self.normals else { return flat() };
        let sum: Vec3 = (0..3).map(|i| Vec3::from(normals[3 * t + i]) * shares[i] as f32).sum();
        sum.try_normalize().unwrap_or_else(flat)
    }

    /// Linear colour of the surface.
    fn colour(&self, t: usize, shares: [f64; 3]) -> Vec3 {
        let Attributes { face_colours, face_materials, point_colours, face_labels, .. } =
            &self.mesh.attributes;
        let opaque = |[r, g, b, _]: [u8; 4]| linear([r, g, b]);
        let own = match self.style.paint {
            Paint::Plain => None,
            Paint::Labels => face_labels.as_ref().map(|labels| linear(of_label(labels[t]))),
            Paint::Own => {
                let of_face = face_colours.as_ref().map(|colours| opaque(colours[t]));
                let of_material = || {
                    let material = face_materials.as_ref()?[t];
                    let materials = &self.mesh.attributes.materials;
                    materials.get(material as usize).map(|m| opaque(m.colour))
                };
                let of_points = || {
                    let colours = point_colours.as_ref()?;
                    let corners = self.mesh.triangles[t].map(|p| opaque(colours[p as usize]));
                    Some((0..3).map(|i| corners[i] * shares[i] as f32).sum())
                };
                of_face.or_else(of_material).or_else(of_points)
            }
        };
        own.unwrap_or_else(|| linear(self.style.colour))
    }
}

/// How much of a sample the nearest edge of its triangle covers.
fn wire(corners: [[i64; 2]; 3], parts: [i64; 3], whole: i64) -> f32 {
    let pixel = corner(glam::DVec2::X)[0] as f64;
    let lengths: [f64; 3] = std::array::from_fn(|i| {
        let (p, q) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
        glam::DVec2::new((q[0] - p[0]) as f64, (q[1] - p[1]) as f64).length()
    });
    let distance =
        (0..3).map(|i| parts[i].abs() as f64 / lengths[i].max(1.0)).fold(f64::INFINITY, f64::min)
            / pixel;
    // Lines of triangles that are hardly larger than a line would blacken everything.
    let inner_radius = whole.abs() as f64 / lengths.iter().sum::<f64>().max(1.0) / pixel;
    let strength = ((inner_radius - 0.4) / 1.6).clamp(0.12, 0.85);
    let cover = (LINE / 2.0 - distance + 0.5).clamp(0.0, 1.0);
    (strength * cover) as f32
}

/// Twice the area of a triangle, along its normal.
fn face_normal(mesh: &Mesh, t: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(t).map(DVec3::from);
    (b - a).cross(c - a)
}

/// The mesh's own normals at corners, or those of the faces around that lie within the crease.
fn corner_normals(
    mesh: &Mesh,
    crease: f64,
    weld: &Weld,
    run: &Run,
) -> Result<Vec<[f32; 3]>, Cancelled> {
    if let Some(normals) = &mesh.attributes.corner_normals {
        return Ok(normals.clone());
    }
    if let Some(normals) = &mesh.attributes.point_normals {
        let corners = mesh.triangles.as_flattened();
        return Ok(corners.iter().map(|&p| normals[p as usize]).collect());
    }
    let (starts, faces) = weld.around(mesh);
    let areas: Vec<DVec3> = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
        range.map(|t| face_normal(mesh, t)).collect::<Vec<_>>()
    })?
    .concat();
    let least = crease.clamp(0.0, 180.0).to_radians().cos();
    let normals = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
        let mut normals = Vec::with_capacity(3 * range.len());
        for t in range {
            for p in weld.triangle(mesh.triangles[t]) {
                let [first, end] = [starts[p as usize], starts[p as usize + 1]].map(|i| i as usize);
                let around = if end - first > MOST_FACES { &[] } else { &faces[first..end] };
                let normal =
                    smooth_normal(areas[t], around.iter().map(|&f| areas[f as usize]), least);
                normals.push(normal.as_vec3().to_array());
            }
        }
        normals
    })?;
    Ok(normals.concat())
}

/// Normal of a face at a corner: of all faces `around` whose normals lie close to its own, each
/// by its area. Normals are twice the areas long; `least` is the cosine of the crease.
fn smooth_normal(face: DVec3, around: impl Iterator<Item = DVec3>, least: f64) -> DVec3 {
    let own = face.normalize_or_zero();
    let close = |n: &DVec3| n.dot(own) >= least * n.length();
    around.filter(close).sum::<DVec3>().try_normalize().unwrap_or(own)
}

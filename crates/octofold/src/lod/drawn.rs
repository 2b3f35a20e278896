//! Patches as a mesh.

use super::LodError;
use super::cut::{Cut, Eye, Octant, View};
use super::patches::{Mode, Patch};
use super::sheets::Sheets;
use super::tree::Lod;
use crate::attributes::PointColumn;
use crate::mesh::Mesh;
use crate::par;
use crate::run::Run;
use glam::{DVec3, Vec4};

/// Where quads are cut in two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Diagonal {
    /// From the first to the third place of the ring: so a quad goes over into that of a coarser cut,
    /// and nothing jumps.
    Fixed,
    /// Where the two triangles are flatter.
    #[default]
    Flatter,
}

/// Where the vertices of a mesh go when each octant becomes its parent: the end of a geomorph.
///
/// With `t` from 0 to 1, vertices at `lerp(own, parent, t)` go over into the patches of the cut in
/// which the parents stand for their children, without a jump where diagonals are fixed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Morphs {
    /// The parent's vertex.
    pub points: Vec<[f64; 3]>,
    /// The parent's normal.
    pub normals: Vec<[f32; 3]>,
    /// The parent's colour, where there are colours.
    pub colours: Option<Vec<[u8; 4]>>,
    /// The parent's error, in the world's unit.
    pub errors: Vec<f32>,
}

/// A mesh of patches, one point for each octant that has a patch (for each sheet in it with
/// [`Mode::Manifold`]).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawn {
    /// The mesh, with normals and colours of points.
    pub mesh: Mesh,
    /// Place in the cut of each point's octant.
    pub places: Vec<u32>,
}

impl Drawn {
    /// Moves the points of a mesh with [`Diagonal::Fixed`] and [`Mode::Any`] as a geomorph does, for the
    /// eye that the cut was chosen for: octants are at their parent where that is just divided, and on
    /// their own where it looks twice as wrong as it may. So nothing jumps while the eye moves, and the
    /// error stays below twice that of the eye.
    pub fn morph(&mut self, lod: &Lod, cut: &Cut, eye: &Eye) {
        let view = View::new(lod, eye);
        let mut all: Vec<(DVec3, DVec3, Vec4)> = Vec::with_capacity(cut.places().len());
        // Parents come first, and are themselves on their way.
        for place in cut.places() {
            let octant = cut.octant(place);
            let own = lod.vertex(octant.node, octant.corner, octant.size);
            let colour = lod.colour(octant.node).unwrap_or_default();
            let [r, g, b, a] = colour.map(|c| f32::from(c) / 255.0);
            let mut state = (own, lod.normal(octant.node), Vec4::new(r, g, b, a));
            let parent = cut.octant(cut.parent(place));
            if place != 0
                && let Some(&(at, normal, colour)) = all.get(cut.parent(place) as usize)
            {
                let t = (2.0 - view.excess(lod.error(parent.node), &parent)).clamp(0.0, 1.0);
                state.0 = state.0.lerp(at, t);
                state.1 = state.1.lerp(normal, t);
                state.2 = state.2.lerp(colour, t as f32);
            }
            all.push(state);
        }
        let of = |&place: &u32| all[place as usize];
        self.mesh.points = self.places.iter().map(|p| lod.world(of(p).0)).collect();
        let normal = |p| of(p).1.normalize_or(DVec3::Z).as_vec3().to_array();
        self.mesh.attributes.point_normals = Some(self.places.iter().map(normal).collect());
        if let Some(colours) = &mut self.mesh.attributes.point_colours {
            let bytes = |c: Vec4| (c * 255.0).round().to_array().map(|x| x as u8);
            *colours = self.places.iter().map(|p| bytes(of(p).2)).collect();
        }
    }
}

/// Draws patches as triangles.
///
/// # Errors
/// Where the work is interrupted.
pub fn drawn(
    lod: &Lod,
    cut: &Cut,
    patches: &[Patch],
    mode: Mode,
    diagonal: Diagonal,
    run: &Run,
) -> Result<Drawn, LodError> {
    let sheets = match mode {
        Mode::Manifold => Sheets::of(lod, cut, patches, run)?,
        _ => single(cut, patches),
    };
    run.stage("draw");
    Ok(meshed(lod, cut, patches, sheets, mode, diagonal))
}

/// Draws patches on vertices that were chosen for them.
pub(super) fn meshed<'a>(
    lod: &Lod,
    cut: &Cut,
    patches: impl IntoIterator<Item = &'a Patch>,
    sheets: Sheets,
    mode: Mode,
    diagonal: Diagonal,
) -> Drawn {
    let Sheets { rings, places, apart } = sheets;
    let octants: Vec<Octant> = places.iter().map(|&p| cut.octant(p)).collect();
    let own = |i: usize, o: &Octant| match apart.get(i) {
        Some(Some(apart)) => *apart,
        _ => (lod.vertex(o.node, o.corner, o.size), lod.normal(o.node)),
    };
    let vertices: Vec<(DVec3, DVec3)> =
        octants.iter().enumerate().map(|(i, o)| own(i, o)).collect();
    let mut mesh = Mesh {
        points: par::map(&vertices, |(at, _)| lod.world(*at)),
        unit: lod.frame().unit,
        ..Mesh::default()
    };
    let normals = vertices.iter().map(|(_, normal)| normal.as_vec3().to_array()).collect();
    mesh.attributes.point_normals = Some(normals);
    mesh.attributes.point_colours = octants.iter().map(|o| lod.colour(o.node)).collect();
    for (ring, patch) in rings.iter().zip(patches) {
        let mut corners = [0; 4];
        let mut count = 0;
        for k in 0..4 {
            if patch.ring[k] != patch.ring[(k + 3) % 4] {
                corners[count] = ring[k];
                count += 1;
            }
        }
        let [a, b, c, d] = corners;
        let even =
            || patch.ring.iter().all(|&p| cut.octant(p).size == cut.octant(patch.ring[0]).size);
        let across = match (mode, diagonal) {
            // Two larger octants may have several quads between them: their diagonal would be that of
            // all of these.
            (Mode::Manifold, _) if !even() => {
                patch.ring.iter().position(|&p| p == patch.owner).is_some_and(|k| k % 2 == 1)
            }
            (_, Diagonal::Flatter) => count == 4 && is_flatter_across(&mesh.points, corners),
            (_, Diagonal::Fixed) => false,
        };
        match count {
            4 if across => {
                mesh.triangles.extend([[b, c, d], [b, d, a]]);
            }
            4 => mesh.triangles.extend([[a, b, c], [a, c, d]]),
            3 => mesh.triangles.push([a, b, c]),
            _ => {}
        }
    }
    // A placement that mirrors turns everything inside out.
    if lod.frame().determinant() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Drawn { mesh, places }
}

/// One vertex for each octant that has a patch, in the order of places.
fn single(cut: &Cut, patches: &[Patch]) -> Sheets {
    const NONE: u32 = u32::MAX;
    let mut points = vec![NONE; cut.entries.len()];
    patches.iter().flat_map(|p| p.ring).for_each(|place| points[place as usize] = 0);
    let mut places = Vec::new();
    for (point, place) in points.iter_mut().zip(cut.places()).filter(|(point, _)| **point == 0) {
        *point = places.len() as u32;
        places.push(place);
    }
    let rings = patches.iter().map(|p| p.ring.map(|place| points[place as usize])).collect();
    Sheets { rings, places, apart: Vec::new() }
}

/// Whether a quad is flatter when it is cut from its second to its fourth corner.
fn is_flatter_across(points: &[[f64; 3]], corners: [u32; 4]) -> bool {
    let [a, b, c, d] = corners.map(|p| DVec3::from(points[p as usize]));
    let normal = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).normalize_or_zero();
    let along = normal(a, b, c).dot(normal(a, c, d));
    let across = normal(b, c, d).dot(normal(b, d, a));
    across > along
}

impl Morphs {
    /// Where the points of a drawn mesh go.
    pub fn of(lod: &Lod, cut: &Cut, places: &[u32]) -> Self {
        let parents: Vec<Octant> = places.iter().map(|&p| cut.octant(cut.parent(p))).collect();
        let vertex = |o: &Octant| lod.world(lod.vertex(o.node, o.corner, o.size));
        Self {
            points: parents.iter().map(vertex).collect(),
            normals: parents.iter().map(|o| lod.normal(o.node).as_vec3().to_array()).collect(),
            colours: parents.iter().map(|o| lod.colour(o.node)).collect(),
            errors: parents.iter().map(|o| (lod.error(o.node) * lod.stretch()) as f32).collect(),
        }
    }

    /// The same as named columns of points: `PARENT_POSITION`, `PARENT_NORMAL`, `PARENT_COLOR` (sRGB
    /// fractions with alpha) and `PARENT_ERROR`.
    pub fn columns(&self) -> Vec<PointColumn> {
        let column = |name: &str, width: usize, values: Vec<f32>| PointColumn {
            name: name.into(),
            width,
            values,
        };
        let mut columns = vec![
            column("PARENT_POSITION", 3, self.points.iter().flatten().map(|&x| x as f32).collect()),
            column("PARENT_NORMAL", 3, self.normals.as_flattened().to_vec()),
        ];
        if let Some(colours) = &self.colours {
            let fractions = colours.as_flattened().iter().map(|&c| f32::from(c) / 255.0);
            columns.push(column("PARENT_COLOR", 4, fractions.collect()));
        }
        columns.push(column("PARENT_ERROR", 1, self.errors.clone()));
        columns
    }
}

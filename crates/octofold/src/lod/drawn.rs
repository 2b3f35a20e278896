//! Patches as a mesh.

use super::cut::{Cut, Octant};
use super::patches::Patch;
use super::tree::Lod;
use crate::mesh::Mesh;

/// Where the vertices of a mesh go when each octant becomes its parent: the end of a geomorph.
///
/// With `t` from 0 to 1, vertices at `lerp(own, parent, t)` go over into the patches of the cut in
/// which the parents stand for their children, without a jump.
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

/// A mesh of patches, one point for each octant that has a patch, and where its points go.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawn {
    /// The mesh, with normals and colours of points.
    pub mesh: Mesh,
    /// Geomorphs of its points.
    pub morphs: Morphs,
    /// Place in the cut of each point's octant.
    pub places: Vec<u32>,
}

/// Draws patches as triangles. Quads are cut from their first to their third corner: so a quad goes
/// over into that of a coarser cut.
pub fn drawn(lod: &Lod, cut: &Cut, patches: &[Patch]) -> Drawn {
    const NONE: u32 = u32::MAX;
    let mut points = vec![NONE; cut.entries.len()];
    patches.iter().flat_map(|p| p.ring).for_each(|place| points[place as usize] = 0);
    let mut drawn = Drawn::default();
    for (point, place) in points.iter_mut().zip(cut.places()).filter(|(point, _)| **point == 0) {
        *point = drawn.places.len() as u32;
        drawn.places.push(place);
    }
    let point = |place: u32| points[place as usize];
    for patch in patches {
        let mut corners = [0; 4];
        let mut count = 0;
        for corner in patch.corners() {
            corners[count] = point(corner);
            count += 1;
        }
        let [a, b, c, d] = corners;
        if count >= 3 {
            drawn.mesh.triangles.push([a, b, c]);
        }
        if count == 4 {
            drawn.mesh.triangles.push([a, c, d]);
        }
    }
    let octants: Vec<Octant> = drawn.places.iter().map(|&p| cut.octant(p)).collect();
    let parents: Vec<Octant> = drawn.places.iter().map(|&p| cut.octant(cut.parent(p))).collect();
    let vertices = |octants: &[Octant]| {
        let vertex = |o: &Octant| lod.world(lod.vertex(o.node, o.corner, o.size));
        octants.iter().map(vertex).collect::<Vec<_>>()
    };
    let normals = |octants: &[Octant]| {
        let normal = |o: &Octant| lod.normal(o.node).as_vec3().to_array();
        octants.iter().map(normal).collect::<Vec<_>>()
    };
    let colours =
        |octants: &[Octant]| octants.iter().map(|o| lod.colour(o.node)).collect::<Option<Vec<_>>>();
    drawn.mesh.points = vertices(&octants);
    drawn.mesh.attributes.point_normals = Some(normals(&octants));
    drawn.mesh.attributes.point_colours = colours(&octants);
    drawn.mesh.unit = lod.frame().unit;
    let error = |o: &Octant| (lod.error(o.node) * lod.stretch()) as f32;
    drawn.morphs = Morphs {
        points: vertices(&parents),
        normals: normals(&parents),
        colours: colours(&parents),
        errors: parents.iter().map(error).collect(),
    };
    drawn
}

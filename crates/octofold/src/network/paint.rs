//! Where the labels and colours of nodes come from.
//!
//! - A *mesh*: each node takes the colour (of points, faces, materials and images, as they look in a
//!   voxel) and the label (or the material's number, from 1) of the triangle nearest to its centre.
//! - A *label volume*: each node takes its own sample as a label, and the label's colour.

use super::painted::{PaintError, Painted, sides};
use super::{Network, NetworkError};
use crate::attributes::Attributes;
use crate::measure::Nearest;
use crate::mesh::Mesh;
use crate::par;
use crate::payload::{Kinds, Value};
use crate::run::Run;
use crate::spans::Spans;
use crate::tint::{Images, Tint, colour};
use crate::volume::{Label, Region, Scalar, Volume, VolumeError};
use crate::with_samples;
use rustc_hash::FxHashMap;

/// Paints a solid that was made of a mesh. Of the kinds, those are taken that the mesh has.
pub fn paint_mesh(
    solid: Spans,
    mesh: &Mesh,
    images: &Images,
    kinds: Kinds,
    run: &Run,
) -> Result<Painted, NetworkError> {
    let placement = solid.placement;
    let cell = sides(&placement).into_iter().fold(f64::INFINITY, f64::min);
    let tint = Tint::of(mesh, images, cell).filter(|_| kinds.colours);
    let labels = FaceLabels::of(&mesh.attributes).filter(|_| kinds.labels);
    let kinds = Kinds { labels: labels.is_some(), colours: tint.is_some() };
    if kinds.is_none() || mesh.triangles.is_empty() {
        return Painted::plain(solid, run);
    }
    run.stage("index");
    let nearest = Nearest::new(mesh);
    Painted::with(solid, kinds, run, |_, at| {
        let hit = nearest.nearest(placement.place(at.map(f64::from)));
        hit.map_or(Value::PLAIN, |hit| Value {
            label: labels.as_ref().map_or(0, |l| l.of_face(hit.triangle)),
            colour: tint.as_ref().map_or(Value::PLAIN.colour, |tint| {
                colour(tint.at(hit.triangle, hit.point.into()))
            }),
        })
    })
}

/// Labels of faces.
enum FaceLabels<'a> {
    Told(&'a [u32]),
    /// Numbers of materials.
    Materials(&'a [u32]),
}

impl<'a> FaceLabels<'a> {
    fn of(attributes: &'a Attributes) -> Option<Self> {
        let told = attributes.face_labels.as_deref().map(Self::Told);
        told.or_else(|| attributes.face_materials.as_deref().map(Self::Materials))
    }

    fn of_face(&self, face: u32) -> u32 {
        match self {
            Self::Told(labels) => labels[face as usize],
            // A face without material has the number that comes before 0.
            Self::Materials(materials) => materials[face as usize].wrapping_add(1),
        }
    }
}

/// Paints the solid of all labels of a volume: what is 1 and more.
pub fn paint_volume(volume: &dyn Volume, kinds: Kinds, run: &Run) -> Result<Painted, PaintError> {
    let solid = Spans::at_least(volume, 1.0, run)?;
    let known: FxHashMap<u32, [u8; 4]> =
        volume.labels().iter().map(|label| (label.value, label.colour)).collect();
    let [width, height, depth] = volume.dims();
    let rows = |network: &Network, z: usize| -> Result<Vec<Value>, VolumeError> {
        let mut values = Vec::new();
        let slice = Region { start: [0, 0, z], end: [width, height, z + 1] };
        with_samples!(volume.read(slice)?, samples => {
            for y in 0..height {
                for s in network.row(y as u32, z as u32) {
                    values.extend((s.start..s.end).map(|x| {
                        let label = samples[y * width + x as usize].to_label();
                        let colour = known.get(&label).copied();
                        let colour = colour.unwrap_or_else(|| Label::plain_colour(label));
                        Value { label, colour }
                    }));
                }
            }
        });
        Ok(values)
    };
    Painted::found(solid, kinds, run, |network| {
        let filled = |z: &usize| (0..height).any(|y| !network.row(y as u32, *z as u32).is_empty());
        let slices: Vec<usize> = (0..depth).filter(filled).collect();
        let parts = par::blocks(run, slices.len(), 1, |range| {
            slices[range].iter().map(|&z| rows(network, z)).collect::<Result<Vec<_>, _>>()
        })
        .map_err(NetworkError::from)?;
        let parts = parts.into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(parts.concat().concat())
    })
}

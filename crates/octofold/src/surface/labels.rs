//! The walls between all labels of a volume, in one pass.
//!
//! Edges between samples of different labels are crossed at their middle. Crossed edges are found
//! by comparing rows as words, and numbered as in [`super::cubes`]; so are the faces on which three
//! labels or more meet. Cells in which one loop parts two labels are told from others, and their
//! triangles counted, 64 at a time. A cell of two labels takes the patch of marching cubes with the
//! higher one inside; what other cells look like is told in `junction`. The cost is that of the samples and
//! the walls, whatever the number of labels; for one label beside 0 the mesh is that of marching
//! cubes.
//!
//! Slabs of layers are worked on alone, once to count and once to write: a slab numbers its own
//! points, and those on its last layer as the first of the next slab, which they are.

pub mod complex;
mod crossings;
mod junction;
mod walls;

use crate::attributes::Attributes;
use crate::mesh::Mesh;
use crate::par;
use crate::run::Run;
use crate::volume::{Block, Label, Region, Scalar, Volume, VolumeError};
use crate::with_samples;
pub use complex::{LabelComplex, LabelMesh};
use crossings::Lattice;
use std::borrow::Cow;
use std::ops::Range;
use walls::{Place, Size};

/// Layers of cells in one unit of work.
const SLAB: usize = 32;

/// Runs `$body` with `$slice` bound to the labels of a block.
macro_rules! with_labels {
    ($block:expr, $slice:ident => $body:expr) => {
        match whole_numbers($block) {
            Labels::U8($slice) => $body,
            Labels::U16($slice) => $body,
            Labels::U32(samples) => {
                let $slice = samples.as_ref();
                $body
            }
        }
    };
}

/// Finds the walls between all labels. Outside the volume, and where a sample is not a whole number
/// from 1 to 2^32 - 1, the label is 0.
pub fn label_complex(volume: &dyn Volume, run: &Run) -> Result<LabelComplex, VolumeError> {
    let [nx, ny, nz] = volume.dims();
    let placement = volume.placement();
    let mut complex = LabelComplex { unit: placement.unit, ..LabelComplex::default() };
    if [nx, ny, nz].contains(&0) {
        return Ok(complex);
    }
    let dims = [nx, ny, nz];
    let read = |layers: &Range<usize>| {
        // Lattice layer z lies over sample layer z - 1; the first and the last are the ring.
        let real = layers.start.saturating_sub(1)..layers.end.min(nz);
        let region = Region { start: [0, 0, real.start], end: [nx, ny, real.end] };
        Ok::<_, VolumeError>((volume.read(region)?, real.start))
    };
    run.stage("count");
    let slabs = par::blocks(run, nz + 1, SLAB, |layers| {
        let (block, first) = read(&layers)?;
        Ok(with_labels!(&block, s => Size::of(&Lattice::new(dims, s, first), layers)))
    })?;
    let slabs = slabs.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
    let sum = |of: fn(&Size) -> usize| slabs.iter().map(of).sum::<usize>();
    let (outer, inner, triangles) = (sum(|s| s.points), sum(|s| s.inner), sum(|s| s.triangles));
    if outer + inner >= u32::MAX as usize {
        return Err(VolumeError::TooManyPoints);
    }
    complex.first_inner = outer as u32;
    // Zeroed memory is first touched by the thread that fills it.
    complex.points = bytemuck::zeroed_vec(outer + inner);
    complex.triangles = bytemuck::zeroed_vec(triangles);
    complex.sides = bytemuck::zeroed_vec(triangles);
    let (outer_points, inner_points) = complex.points.split_at_mut(outer);
    let points = par::split(outer_points, slabs.iter().map(|s| s.points));
    let inner = par::split(inner_points, slabs.iter().map(|s| s.inner));
    let triangles = par::split(&mut complex.triangles, slabs.iter().map(|s| s.triangles));
    let sides = par::split(&mut complex.sides, slabs.iter().map(|s| s.triangles));
    let mut next = [0, outer as u32];
    let places = points.into_iter().zip(inner).zip(triangles.into_iter().zip(sides));
    let tasks: Vec<_> = slabs
        .into_iter()
        .zip(places)
        .map(|(slab, ((points, inner), (triangles, sides)))| {
            let [start, inner_start] = next;
            next = [start + slab.points as u32, inner_start + slab.inner as u32];
            Place { points, inner, triangles, sides, start, inner_start }
        })
        .collect();
    run.stage("march");
    par::consume(run, tasks, |number, place| {
        let layers = number * SLAB..((number + 1) * SLAB).min(nz + 1);
        let (block, first) = read(&layers)?;
        with_labels!(&block, s => {
            walls::write(&Lattice::new(dims, s, first), layers, &placement, place);
        });
        Ok::<(), VolumeError>(())
    })?;
    Ok(complex)
}

/// The closed surface of every label but 0, in order of their values.
pub fn label_meshes(volume: &dyn Volume, run: &Run) -> Result<Vec<LabelMesh>, VolumeError> {
    let complex = label_complex(volume, run)?;
    run.check()?;
    run.stage("shells");
    Ok(complex.shells(run)?)
}

/// Joins label meshes into one mesh whose faces carry their label; points are not shared between
/// labels.
pub fn merge(meshes: Vec<LabelMesh>, volume: &dyn Volume) -> Result<Mesh, VolumeError> {
    let points: usize = meshes.iter().map(|m| m.mesh.points.len()).sum();
    let triangles = meshes.iter().map(|m| m.mesh.triangles.len()).sum();
    if points > u32::MAX as usize {
        return Err(VolumeError::TooManyPoints);
    }
    let mut merged = Mesh {
        points: Vec::with_capacity(points),
        triangles: Vec::with_capacity(triangles),
        unit: volume.placement().unit,
        ..Mesh::default()
    };
    let mut face_labels = Vec::with_capacity(triangles);
    let mut colours = Vec::with_capacity(triangles);
    let mut label_names = Vec::new();
    for LabelMesh { label, mesh } in meshes {
        let start = merged.points.len();
        let known = volume.labels().iter().find(|l| l.value == label);
        let name = known.map(|l| l.name.as_str()).filter(|n| !n.is_empty());
        label_names.push((label, name.map_or_else(|| format!("label {label}"), str::to_owned)));
        let colour = known.map_or_else(|| Label::plain_colour(label), |l| l.colour);
        face_labels.resize(face_labels.len() + mesh.triangles.len(), label);
        colours.resize(colours.len() + mesh.triangles.len(), colour);
        merged.points.extend(mesh.points);
        merged.triangles.extend(mesh.triangles.iter().map(|t| t.map(|p| p + start as u32)));
    }
    merged.attributes = Attributes {
        face_labels: Some(face_labels),
        face_colours: Some(colours),
        label_names,
        ..Attributes::default()
    };
    Ok(merged)
}

/// Samples as labels.
enum Labels<'a> {
    U8(&'a [u8]),
    U16(&'a [u16]),
    U32(Cow<'a, [u32]>),
}

/// The samples as whole numbers from 0 on; borrowed where they are such.
fn whole_numbers<'a>(block: &'a Block<'_>) -> Labels<'a> {
    // No number of a signed type that is not negative changes by being taken for unsigned.
    match block {
        Block::U8(s) => Labels::U8(s),
        Block::U16(s) => Labels::U16(s),
        Block::U32(s) => Labels::U32(Cow::Borrowed(s)),
        Block::I8(s) if s.iter().all(|&x| x >= 0) => Labels::U8(bytemuck::cast_slice(s)),
        Block::I16(s) if s.iter().all(|&x| x >= 0) => Labels::U16(bytemuck::cast_slice(s)),
        Block::I32(s) if s.iter().all(|&x| x >= 0) => {
            Labels::U32(Cow::Borrowed(bytemuck::cast_slice(s)))
        }
        block => with_samples!(block, s => Labels::U32(s.iter().map(|&x| x.to_label()).collect())),
    }
}

#[cfg(test)]
mod tests;

//! The walls between all labels of a volume, in one pass.
//!
//! Edges between samples of different labels are crossed at their middle. Crossed edges are found
//! by comparing rows as words, and numbered as in [`super::cubes`]; so are the faces on which three
//! labels or more meet. A cell of two labels takes the patch of marching cubes with the higher one
//! inside; any other joins what it sees on its faces to a point inside. The cost is that of the samples and the walls,
//! whatever the number of labels; for one label beside 0 the mesh is that of marching cubes.
//!
//! Slabs of layers are worked on alone: a slab numbers its own points, and those on its last layer
//! as the first of the next slab, which they are.

pub mod complex;
mod crossings;
mod junction;
mod walls;

use crate::attributes::Attributes;
use crate::mesh::Mesh;
use crate::par;
use crate::run::Run;
use crate::volume::{Block, Region, Scalar, Volume, VolumeError};
use crate::with_samples;
pub use complex::{LabelComplex, LabelMesh};
use crossings::Lattice;
use std::borrow::Cow;
use walls::Walls;

/// Layers of cells in one unit of work.
const SLAB: usize = 32;

/// Finds the walls between all labels. Outside the volume, and where a sample is not a whole number
/// from 1 to 2^32 - 1, the label is 0.
pub fn label_complex(volume: &dyn Volume, run: &Run) -> Result<LabelComplex, VolumeError> {
    let [nx, ny, nz] = volume.dims();
    let placement = volume.placement();
    let mut complex = LabelComplex { unit: placement.unit, ..LabelComplex::default() };
    if [nx, ny, nz].contains(&0) {
        return Ok(complex);
    }
    run.stage("march");
    let slabs = par::blocks(run, nz + 1, SLAB, |layers| {
        // Lattice layer z lies over sample layer z - 1; the first and the last are the ring.
        let real = layers.start.saturating_sub(1)..layers.end.min(nz);
        let block = volume.read(Region { start: [0, 0, real.start], end: [nx, ny, real.end] })?;
        let (dims, first) = ([nx, ny, nz], real.start);
        Ok(match whole_numbers(&block) {
            Labels::U8(s) => Walls::of(&Lattice::new(dims, s, first), layers, &placement),
            Labels::U16(s) => Walls::of(&Lattice::new(dims, s, first), layers, &placement),
            Labels::U32(s) => Walls::of(&Lattice::new(dims, &s, first), layers, &placement),
        })
    })?;
    let slabs = slabs.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
    run.check()?;
    join(&mut complex, slabs, run)?;
    Ok(complex)
}

/// The closed surface of every label but 0, in order of their values.
pub fn label_meshes(volume: &dyn Volume, run: &Run) -> Result<Vec<LabelMesh>, VolumeError> {
    let complex = label_complex(volume, run)?;
    run.check()?;
    run.stage("shells");
    Ok(complex.shells())
}

/// Joins label meshes into one mesh whose faces carry their label; points are not shared between
/// labels.
pub fn merge(meshes: Vec<LabelMesh>, volume: &dyn Volume) -> Result<Mesh, VolumeError> {
    let mut merged = Mesh { unit: volume.placement().unit, ..Mesh::default() };
    let mut face_labels = Vec::new();
    let mut colours = Vec::new();
    let mut label_names = Vec::new();
    for LabelMesh { label, mesh } in meshes {
        let start = merged.points.len();
        if start + mesh.points.len() > u32::MAX as usize {
            return Err(VolumeError::TooManyPoints);
        }
        let known = volume.labels().iter().find(|l| l.value == label);
        let name = known.map(|l| l.name.as_str()).filter(|n| !n.is_empty());
        label_names.push((label, name.map_or_else(|| format!("label {label}"), str::to_owned)));
        let colour = known.map_or_else(|| colour_of(label), |l| l.colour);
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

/// A colour for a label without one: hues a golden angle apart.
fn colour_of(label: u32) -> [u8; 4] {
    let turn = f64::from(label) * 0.381_966_011_250_105;
    let hue = 6.0 * (turn - turn.floor());
    let channel = |shift: f64| {
        let h = (hue + shift) % 6.0;
        let ramp = (h.min(4.0 - h)).clamp(0.0, 1.0);
        (80.0 + 160.0 * ramp) as u8
    };
    [channel(2.0), channel(0.0), channel(4.0), 255]
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
        block => with_samples!(block, s => Labels::U32(s.iter().map(|&x| label(x)).collect())),
    }
}

fn label<T: Scalar>(sample: T) -> u32 {
    let value = sample.to_f64();
    let whole = value as u32;
    if f64::from(whole) == value { whole } else { 0 }
}

/// Puts the slabs behind one another.
fn join(complex: &mut LabelComplex, slabs: Vec<Walls>, run: &Run) -> Result<(), VolumeError> {
    let sum = |of: fn(&Walls) -> usize| slabs.iter().map(of).sum::<usize>();
    let (outer, inner) = (sum(|w| w.points.len()), sum(|w| w.inner.len()));
    let triangles = sum(|w| w.triangles.len());
    if outer + inner >= u32::MAX as usize {
        return Err(VolumeError::TooManyPoints);
    }
    complex.first_inner = outer as u32;
    complex.points = bytemuck::zeroed_vec(outer + inner);
    complex.triangles = bytemuck::zeroed_vec(triangles);
    complex.sides = bytemuck::zeroed_vec(triangles);
    let (outer_points, inner_points) = complex.points.split_at_mut(outer);
    let mut starts = Vec::with_capacity(slabs.len());
    let mut next = [0, outer as u32];
    for slab in &slabs {
        starts.push(next);
        next = [next[0] + slab.points.len() as u32, next[1] + slab.inner.len() as u32];
    }
    let outer_points = par::split(outer_points, slabs.iter().map(|w| w.points.len()));
    let inner_points = par::split(inner_points, slabs.iter().map(|w| w.inner.len()));
    let triangles = par::split(&mut complex.triangles, slabs.iter().map(|w| w.triangles.len()));
    let sides = par::split(&mut complex.sides, slabs.iter().map(|w| w.sides.len()));
    let places = outer_points.into_iter().zip(inner_points).zip(triangles).zip(sides);
    let tasks = slabs.into_iter().zip(starts).zip(places).collect();
    par::consume(run, tasks, |_, ((slab, [start, inner_start]), place)| {
        let (((points, inner), triangles), sides) = place;
        points.copy_from_slice(&slab.points);
        inner.copy_from_slice(&slab.inner);
        sides.copy_from_slice(&slab.sides);
        let first_inner = slab.first_inner;
        let number =
            |p: u32| if p < first_inner { start + p } else { inner_start + (p - first_inner) };
        for (to, from) in triangles.iter_mut().zip(&slab.triangles) {
            *to = from.map(number);
        }
        Ok::<(), VolumeError>(())
    })
}

#[cfg(test)]
mod tests;

//! One closed mesh per label, all labels in one pass.
//!
//! Every cell whose eight samples are not all equal yields one record per label that it touches;
//! records are sorted by label, and each label's cells are meshed as a binary volume would be.
//! The cost is that of the surface, whatever the number of labels.

use super::cell::{PATCHES, Patch, edge_axis, edge_corner};
use crate::attributes::Attributes;
use crate::bits;
use crate::mesh::Mesh;
use crate::octree::VertexName;
use crate::par;
use crate::run::Run;
use crate::volume::{Placement, Region, Scalar, Volume, VolumeError};
use crate::with_samples;
use rustc_hash::FxHashMap;

/// Layers of cells in one unit of work.
const SLAB: usize = 16;

/// The closed surface of one label.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelMesh {
    /// The sample value.
    pub label: u32,
    /// Its surface, in world coordinates.
    pub mesh: Mesh,
}

/// A mixed cell, as one of its labels sees it. Sorts by label, then by cell.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Record {
    label: u32,
    /// Low corner in padded lattice points.
    z: u32,
    y: u32,
    x: u32,
    mask: u8,
}

/// Meshes every label but 0, in order of their values. Values that are not whole numbers from 1
/// to 2^32 - 1 count as 0.
pub fn label_meshes(volume: &dyn Volume, run: &Run) -> Result<Vec<LabelMesh>, VolumeError> {
    let placement = volume.placement();
    let [nx, ny, nz] = volume.dims();
    if [nx, ny, nz].contains(&0) {
        return Ok(Vec::new());
    }
    if let Some(&samples) = [nx, ny, nz].iter().find(|&&n| n > VertexName::LAST as usize) {
        return Err(VolumeError::TooLong { samples, most: VertexName::LAST as usize });
    }
    run.stage("count");
    let slabs = par::blocks(run, nz + 1, SLAB, |layers| {
        // Lattice layer z lies over sample layer z - 1; the first and the last are empty.
        let real = layers.start.saturating_sub(1)..layers.end.min(nz);
        let block = volume.read(Region { start: [0, 0, real.start], end: [nx, ny, real.end] })?;
        Ok(with_samples!(&block, samples => {
            Layers { dims: [nx, ny, nz], samples, first: real.start }.records(layers)
        }))
    })?;
    let slabs = slabs.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
    let mut records = slabs.concat();
    par::sort(&mut records);
    let groups: Vec<&[Record]> = records.chunk_by(|a, b| a.label == b.label).collect();
    let mut patches = *PATCHES;
    if placement.determinant() < 0.0 {
        patches.iter_mut().for_each(Patch::reverse);
    }
    run.check()?;
    run.stage("march");
    Ok(par::map(&groups, |group| LabelMesh {
        label: group[0].label,
        mesh: mesh_of(group, &patches, &placement),
    }))
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

struct Layers<'a, T> {
    dims: [usize; 3],
    samples: &'a [T],
    first: usize,
}

impl<T: Scalar> Layers<'_, T> {
    /// One record per mixed cell and label, for the cells between lattice layers z and z + 1.
    fn records(&self, layers: std::ops::Range<usize>) -> Vec<Record> {
        let [nx, ny, nz] = self.dims;
        let background = vec![T::default(); nx];
        let row = |y: usize, z: usize| -> &[T] {
            match (y.checked_sub(1), z.checked_sub(1)) {
                (Some(y), Some(z)) if y < ny && z < nz => {
                    let first = ((z - self.first) * ny + y) * nx;
                    &self.samples[first..first + nx]
                }
                _ => &background,
            }
        };
        let words = bits::words(nx + 2);
        let mut unequal = vec![0; words];
        let mut mixed = vec![0; words];
        let mut records = Vec::new();
        for z in layers {
            for y in 0..=ny {
                let rows = [row(y, z), row(y + 1, z), row(y, z + 1), row(y + 1, z + 1)];
                mixed.fill(0);
                for (a, b) in [(0, 1), (0, 2), (0, 3)] {
                    bits::pack_unequal(rows[a], rows[b], 1, &mut unequal);
                    for w in 0..words {
                        mixed[w] |= unequal[w] | bits::next(&unequal, w);
                    }
                }
                // Along x one row speaks for the others: where it is even and they are equal to it
                // at both ends, the cell is even. Its ends meet the ring.
                bits::pack_unequal(&rows[0][..nx - 1], &rows[0][1..], 1, &mut unequal);
                for w in 0..words {
                    mixed[w] |= unequal[w];
                }
                for x in [0, nx] {
                    let end = x.saturating_sub(1);
                    if rows.iter().any(|r| r[end] != T::default()) {
                        mixed[x / 64] |= 1 << (x % 64);
                    }
                }
                for w in 0..words {
                    bits::ones(mixed[w] & bits::below(nx + 1, w), |bit| {
                        let x = 64 * w + bit;
                        let sample = |c: usize| {
                            let x = (x + (c & 1)).checked_sub(1).filter(|&x| x < nx);
                            x.map_or(0, |x| label(rows[c >> 1][x]))
                        };
                        record([x, y, z].map(|i| i as u32), sample, &mut records);
                    });
                }
            }
        }
        records
    }
}

fn label<T: Scalar>(sample: T) -> u32 {
    let value = sample.to_f64();
    let whole = value as u32;
    if f64::from(whole) == value { whole } else { 0 }
}

/// Adds one record for each label other than 0 among a cell's corners.
fn record([x, y, z]: [u32; 3], corner: impl Fn(usize) -> u32, records: &mut Vec<Record>) {
    let corners: [u32; 8] = std::array::from_fn(corner);
    for c in 0..8 {
        let label = corners[c];
        if label == 0 || corners[..c].contains(&label) {
            continue;
        }
        let mask = (0..8).fold(0, |m, i| m | u8::from(corners[i] == label) << i);
        if mask != 255 {
            records.push(Record { label, z, y, x, mask });
        }
    }
}

/// Meshes the cells of one label; vertices are numbered in the order in which cells name them.
fn mesh_of(cells: &[Record], patches: &[Patch; 256], placement: &Placement) -> Mesh {
    let mut mesh = Mesh { unit: placement.unit, ..Mesh::default() };
    let mut numbers: FxHashMap<VertexName, u32> = FxHashMap::default();
    for cell in cells {
        let mut number = |edge: u8| {
            let (axis, corner) = (edge_axis(edge.into()), edge_corner(edge.into()) as u32);
            let low = [cell.x + (corner & 1), cell.y + (corner >> 1 & 1), cell.z + (corner >> 2)];
            *numbers.entry(VertexName::on_edge(low, axis)).or_insert_with(|| {
                let mut index = low.map(|i| f64::from(i) - 1.0);
                index[axis] += 0.5;
                mesh.points.push(placement.place(index));
                mesh.points.len() as u32 - 1
            })
        };
        for t in patches[cell.mask as usize].triangles() {
            mesh.triangles.push(t.map(&mut number));
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{CubesOptions, Inside, marching_cubes};
    use crate::volume::DenseVolume;
    use proptest::prelude::*;

    /// Triangles as sorted positions in quarter samples, for comparing meshes whatever their
    /// numbering.
    fn shape(mesh: &Mesh) -> Vec<[[i64; 3]; 3]> {
        let mut all: Vec<_> = (0..mesh.triangles.len())
            .map(|t| {
                let mut corners = mesh.corners(t).map(|p| p.map(|x| (4.0 * x).round() as i64));
                let first = (0..3).min_by_key(|&i| corners[i]).unwrap();
                corners.rotate_left(first);
                corners
            })
            .collect();
        all.sort_unstable();
        all
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(48))]

        #[test]
        fn each_label_is_meshed_as_its_own_mask(
            dims in (1usize..70, 1usize..6, 1usize..24),
            seed in any::<u64>(),
            labels in 2u64..6,
        ) {
            let (x, y, z) = dims;
            let mut state = seed;
            let samples: Vec<u16> = (0..x * y * z).map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                ((state >> 33) % labels) as u16 * 300
            }).collect();
            let volume =
                DenseVolume::new([x, y, z], samples.clone(), Placement::default()).unwrap();
            let meshes = label_meshes(&volume, &Run::default()).unwrap();
            let mut present: Vec<u16> = samples.iter().copied().filter(|&s| s > 0).collect();
            present.sort_unstable();
            present.dedup();
            prop_assert_eq!(
                meshes.iter().map(|m| m.label as u16).collect::<Vec<_>>(),
                present
            );
            for LabelMesh { label, mesh } in meshes {
                let mask = samples.iter().map(|&s| u8::from(u32::from(s) == label)).collect();
                let mask = DenseVolume::new([x, y, z], mask, Placement::default()).unwrap();
                let options = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };
                let alone = marching_cubes(&mask, &options, &Run::default()).unwrap();
                prop_assert_eq!(shape(&mesh), shape(&alone));
                prop_assert_eq!(mesh.points.len(), alone.points.len());
            }
        }
    }
}

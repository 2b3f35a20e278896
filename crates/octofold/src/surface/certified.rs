//! Certified TEL.

mod cells;
mod leaves;
mod octant;
mod patch;
mod tube;

use super::cubes::CubesOptions;
use super::slab::Frame;
use crate::mesh::Mesh;
use crate::octree::VertexName;
use crate::par;
use crate::run::Run;
use crate::volume::{Volume, VolumeError};
use cells::Cells;
use leaves::{Leaf, Settler};
use tube::Tube;

/// Layers of cells that are read at once.
const SLAB: usize = 64;

pub fn certified(
    volume: &dyn Volume,
    options: &CubesOptions,
    tolerance: f64,
    run: &Run,
) -> Result<Mesh, VolumeError> {
    let frame = Frame::new(volume, options);
    let cells = Cells::read(volume, &frame, SLAB, run)?;
    let settler = Settler { tube: Tube::new(&cells, tolerance), polyline: tolerance / 2.0 };
    let leaves = settler.leaves(run)?;
    let (points, triangles) = join(&leaves);
    let shift = f64::from(cells.shift);
    let points = par::map(&points, |p| frame.placement.place(p.map(|x| x - shift)));
    Ok(Mesh { points, triangles, unit: frame.placement.unit, ..Mesh::default() })
}

/// One mesh of all leaves, vertices joined by name.
fn join(leaves: &[Leaf]) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut names: Vec<(VertexName, [f64; 3])> = Vec::new();
    for leaf in leaves {
        names.extend(leaf.patch.polygon.iter().map(|v| (v.name, v.at)));
    }
    par::sort_by_key(&mut names, |n| n.0);
    names.dedup_by_key(|n| n.0);
    let mut points: Vec<[f64; 3]> = names.iter().map(|n| n.1).collect();
    let mut triangles = Vec::new();
    for leaf in leaves {
        let mut ids: Vec<u32> = leaf
            .patch
            .polygon
            .iter()
            .map(|v| names.partition_point(|n| n.0 < v.name) as u32)
            .collect();
        if let Some(steiner) = leaf.patch.steiner {
            ids.push(points.len() as u32);
            points.push(steiner);
        }
        triangles.extend(leaf.patch.triangles.iter().map(|t| t.map(|i| ids[i as usize])));
    }
    (points, triangles)
}

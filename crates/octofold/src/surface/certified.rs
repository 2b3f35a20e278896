//! Certified TEL.

mod cells;
mod collapse;
mod cover;
mod leaves;
mod octant;
mod patch;
mod piece;
mod tube;

use super::cubes::CubesOptions;
use super::slab::Frame;
use crate::mesh::Mesh;
use crate::octree::VertexName;
use crate::par;
use crate::run::Run;
use crate::volume::{Volume, VolumeError};
use cells::Cells;
use collapse::{Tile, Tiling};
use glam::DVec3;
use leaves::{Leaf, Settler};
use patch::Vertex;
use piece::Pieces;
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
    run.stage("pieces");
    let pieces = Pieces::new(&cells);
    let settler = Settler { tube: Tube::new(&cells, &pieces, tolerance), polyline: tolerance * std::env::var("TP").map_or(0.5, |s| s.parse::<f64>().unwrap()) };
    let leaves = settler.leaves(run)?;
    eprintln!("{} leaves", leaves.len());
    eprintln!("{} tiles", leaves.iter().map(|l| l.patch.triangles.len()).sum::<usize>());
    let mut tiling = join(&settler.tube, leaves);
    if std::env::var("RAW").is_err() { tiling.reduce(&settler.tube, run)?; }
    eprintln!("{:?}", patch::STAT.iter().map(|s| s.swap(0, std::sync::atomic::Ordering::Relaxed)).collect::<Vec<_>>());
    let shift = f64::from(cells.shift);
    let (points, triangles) = tiling.into_mesh();
    let points = par::map(&points, |p| frame.placement.place((*p - shift).to_array()));
    Ok(Mesh { points, triangles, unit: frame.placement.unit, ..Mesh::default() })
}

/// One mesh of all leaves, vertices joined by name.
fn join(tube: &Tube, leaves: Vec<Leaf>) -> Tiling {
    let mut names: Vec<(VertexName, [f64; 3])> = Vec::new();
    for leaf in &leaves {
        names.extend(leaf.patch.polygon.iter().map(|v| (v.name, v.at)));
    }
    par::sort_by_key(&mut names, |n| n.0);
    names.dedup_by_key(|n| n.0);
    let mut points: Vec<DVec3> = names.iter().map(|n| n.1.into()).collect();
    let mut tiles = Vec::new();
    for leaf in leaves {
        let name = |v: &Vertex| names.partition_point(|n| n.0 < v.name) as u32;
        let mut ids: Vec<u32> = leaf.patch.polygon.iter().map(name).collect();
        if let Some(steiner) = leaf.patch.steiner {
            ids.push(points.len() as u32);
            points.push(steiner.into());
        }
        let first = tiles.len();
        let corners = leaf.patch.triangles.iter().map(|t| t.map(|i| ids[i as usize]));
        tiles.extend(corners.map(|c| Tile::new(c, Vec::new())));
        for (piece, t) in leaf.patch.pieces {
            tiles[first + t as usize].pieces.push(piece);
        }
    }
    Tiling::new(tube, points, tiles)
}

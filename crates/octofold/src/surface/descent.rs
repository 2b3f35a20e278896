//! From the root down: an octant is skipped, accepted with its sheets, or divided in eight.
//!
//! Octants of one level are visited together, in parallel and in Morton order, so that neither
//! sheets nor counts depend on the number of threads.

use super::account::{OctreeAccount, Rejection, Tally};
use super::digital::DigitalSurface;
use crate::measure::Topology;
use crate::mesh::Mesh;
use crate::octree::{CellKey, VertexName};
use crate::par;
use crate::run::{Cancelled, Run};
use crate::volume::VolumeError;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Octants in one unit of work.
const BLOCK: usize = 64;

/// A part of the surface in one octant: a closed loop on the octant's faces, and triangles on
/// the loop's points.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// The octant.
    pub octant: CellKey,
    /// The loop, outside on the left seen from outside the octant.
    pub ring: Vec<RingPoint>,
    /// Triangles by places in `ring`, in its order.
    pub triangles: Vec<[u32; 3]>,
}

/// A point of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RingPoint {
    /// Its name.
    pub vertex: VertexName,
    /// The octant's face on which the loop runs on to the next point, as in [`super::cell`].
    pub face: u8,
}

/// What becomes of an octant.
#[derive(Debug, Clone, PartialEq)]
pub enum Fate {
    /// No surface is met.
    Skipped,
    /// It stays whole and carries these sheets.
    Accepted(Vec<Sheet>),
    /// Its eight children are visited.
    Divided(Rejection),
}

/// All that a descent found.
#[derive(Debug, Clone, PartialEq)]
pub struct Descent {
    /// Sheets in order of their octants.
    pub sheets: Vec<Sheet>,
    /// Octants that carry sheets, by level.
    pub octants: Vec<u64>,
    /// Octants that were divided, by reason.
    pub rejected: BTreeMap<Rejection, u64>,
}

impl Descent {
    /// Visits octants from the root down.
    pub fn of(
        surface: &DigitalSurface,
        run: &Run,
        visit: impl Fn(CellKey) -> Result<Fate, VolumeError> + Sync,
    ) -> Result<Self, VolumeError> {
        run.stage("octants");
        let levels = surface.levels();
        let mut found = Self {
            sheets: Vec::new(),
            octants: vec![0; levels as usize + 1],
            rejected: BTreeMap::new(),
        };
        let mut level = if surface.is_empty() { Vec::new() } else { vec![CellKey::ROOT] };
        while let Some(first) = level.first() {
            let depth = first.level();
            let fates = par::blocks(run, level.len(), BLOCK, |range| {
                level[range].iter().map(|&o| visit(o)).collect::<Result<Vec<_>, _>>()
            })?;
            let fates = fates.into_iter().collect::<Result<Vec<_>, _>>()?;
            let mut next = Vec::new();
            for (octant, fate) in level.iter().zip(fates.into_iter().flatten()) {
                match fate {
                    Fate::Skipped => {}
                    Fate::Accepted(sheets) => {
                        found.octants[depth as usize] += 1;
                        found.sheets.extend(sheets);
                    }
                    Fate::Divided(reason) => {
                        *found.rejected.entry(reason).or_insert(0) += 1;
                        if depth < levels {
                            next.extend((0..8).map(|o| octant.child(o, levels)));
                        }
                    }
                }
            }
            level = next;
        }
        // A loop is found once in its octant, and loops of one octant stay in their order.
        found.sheets.sort_by_key(|sheet| sheet.octant);
        Ok(found)
    }

    /// What can be told before cracks are closed.
    pub fn account(&self, raw: Tally) -> OctreeAccount {
        OctreeAccount {
            levels: self.octants.len() as u32 - 1,
            octants: self.octants.iter().sum(),
            octants_by_level: self.octants.clone(),
            loops: self.sheets.len(),
            rejected: self.rejected.clone(),
            raw,
            ..OctreeAccount::default()
        }
    }

    /// The triangles of all sheets by the names of their points.
    pub fn triangles(&self) -> Vec<[VertexName; 3]> {
        let named = |sheet: &Sheet| {
            let name = |i: u32| sheet.ring[i as usize].vertex;
            sheet.triangles.iter().map(|t| t.map(name)).collect::<Vec<_>>()
        };
        self.sheets.iter().flat_map(named).collect()
    }
}

/// Triangles that share points, by name: the mesh before its points have positions. Triangles
/// that name a point twice are left out; the sides that they join close without them.
#[derive(Debug, Clone, PartialEq)]
pub struct Woven {
    /// Distinct names, sorted.
    pub vertices: Vec<VertexName>,
    /// Triangles by places in `vertices`.
    pub triangles: Vec<[u32; 3]>,
}

impl Woven {
    /// Numbers the points.
    pub fn new(triangles: &[[VertexName; 3]]) -> Result<Self, VolumeError> {
        let proper = |&&[a, b, c]: &&[VertexName; 3]| a != b && b != c && c != a;
        let proper: Vec<_> = triangles.iter().filter(proper).copied().collect();
        let mut vertices = proper.as_flattened().to_vec();
        par::sort(&mut vertices);
        vertices.dedup();
        if vertices.len() >= u32::MAX as usize {
            return Err(VolumeError::TooManyPoints);
        }
        let numbers: FxHashMap<_, _> =
            vertices.iter().enumerate().map(|(i, &v)| (v, i as u32)).collect();
        let triangles = par::map(&proper, |t| t.map(|v| numbers[&v]));
        Ok(Self { vertices, triangles })
    }

    /// Counts triangles and edges that are not shared by two.
    pub fn tally(&self, run: &Run) -> Result<Tally, Cancelled> {
        let topology = Topology::of(self.vertices.len(), &self.triangles, run)?;
        Ok(Tally {
            triangles: self.triangles.len(),
            open_edges: topology.boundary_edges.count,
            nonmanifold_edges: topology.nonmanifold_edges.count,
            euler: topology.euler(),
        })
    }

    /// The mesh in world coordinates; `position` tells where a point lies in lattice points.
    pub fn mesh(
        self,
        surface: &DigitalSurface,
        position: impl Fn(VertexName) -> Result<[f64; 3], VolumeError> + Sync,
        run: &Run,
    ) -> Result<Mesh, VolumeError> {
        let points = par::blocks(run, self.vertices.len(), 1 << 12, |range| {
            let placed = |&v: &VertexName| position(v).map(|at| surface.place(at));
            self.vertices[range].iter().map(placed).collect::<Result<Vec<_>, _>>()
        })?;
        let points = points.into_iter().collect::<Result<Vec<_>, VolumeError>>()?.concat();
        let mut triangles = self.triangles;
        let placement = surface.placement();
        if placement.determinant() < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Ok(Mesh { points, triangles, unit: placement.unit, ..Mesh::default() })
    }
}

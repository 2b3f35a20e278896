//! What is wrong with a model before its repair.

use crate::measure::{Topology, weld_points};
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use rustc_hash::FxHashMap;

/// Counts of an input, its points welded where they are equal.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Census {
    /// All triangles.
    pub triangles: usize,
    /// Sets of triangles connected across edges.
    pub components: usize,
    /// Edges with one triangle.
    pub boundary_edges: usize,
    /// Connected sets of these: holes and rims.
    pub boundary_loops: usize,
    /// Edges with three triangles or more.
    pub nonmanifold_edges: usize,
    /// Points whose triangles form more than one fan.
    pub nonmanifold_points: usize,
    /// Edges whose two triangles run along them the same way.
    pub misoriented_edges: usize,
    /// Triangles that name a point twice.
    pub degenerate_triangles: usize,
    /// Triangles on the same three points as an earlier one.
    pub duplicate_triangles: usize,
}

impl Census {
    /// Counts.
    pub fn of(mesh: &Mesh, run: &Run) -> Result<Self, Cancelled> {
        run.stage("census");
        let welding = weld_points(&mesh.points, run)?;
        let triangles = par::map(&mesh.triangles, |t| t.map(|p| welding.of[p as usize]));
        let found = Topology::of(welding.points.len(), &triangles, run)?;
        Ok(Self {
            triangles: triangles.len(),
            components: found.components,
            boundary_edges: found.boundary_edges.count,
            boundary_loops: boundary_loops(&triangles),
            nonmanifold_edges: found.nonmanifold_edges.count,
            nonmanifold_points: found.nonmanifold_points.count,
            misoriented_edges: found.misoriented_edges.count,
            degenerate_triangles: found.degenerate_triangles.count,
            duplicate_triangles: found.duplicate_triangles.count,
        })
    }
}

/// Connected sets of edges with one triangle.
fn boundary_loops(triangles: &[[u32; 3]]) -> usize {
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .filter(|[a, b]| a != b)
        .collect();
    par::sort(&mut edges);
    let rims = edges.chunk_by(|a, b| a == b).filter(|c| c.len() == 1).map(|c| c[0]);
    let mut sets: FxHashMap<u32, u32> = FxHashMap::default();
    let mut loops = 0;
    for ends in rims {
        let mut roots = [0; 2];
        for (root, end) in roots.iter_mut().zip(ends) {
            if let std::collections::hash_map::Entry::Vacant(free) = sets.entry(end) {
                free.insert(end);
                loops += 1;
            }
            *root = end;
            while sets[root] != *root {
                let up = sets[&sets[root]];
                sets.insert(*root, up);
                *root = up;
            }
        }
        if roots[0] != roots[1] {
            sets.insert(roots[0], roots[1]);
            loops -= 1;
        }
    }
    loops
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rims_are_counted_once() {
        assert_eq!(boundary_loops(&[[0, 1, 2]]), 1);
        assert_eq!(boundary_loops(&[[0, 1, 2], [3, 4, 5]]), 2);
        assert_eq!(boundary_loops(&[[0, 1, 2], [2, 1, 0], [7, 7, 8]]), 0);
        let tube = [[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]];
        assert_eq!(boundary_loops(&tube), 2);
    }
}

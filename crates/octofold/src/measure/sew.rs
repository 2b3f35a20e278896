//! Sewing: borders that are apart by no more than rounding become one.
//!
//! Programs that write a model face by face compute its seams twice, and not always to the same last
//! bit: one face ends at height 0, its neighbour at -2.7e-16. Welding by equal positions leaves a crack
//! there that nobody can see. Only points on borders are joined, only over [`REACH`], and never
//! two of one triangle.

use super::borders::borders;
use super::weld::weld;
use crate::mesh::{Mesh, bounds};
use crate::run::{Cancelled, Finding, Run};
use crate::sets::Sets;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// How far apart points are that are joined, as a share of the longest side of the mesh's box.
pub const REACH: f64 = 1e-6;

/// A mesh whose borders are sewn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sewn {
    /// The mesh, its points welded.
    pub mesh: Mesh,
    /// Points that were joined to another one.
    pub joined: usize,
    /// The furthest that a point has moved.
    pub moved: f64,
}

impl Sewn {
    /// Tells of the points that were joined, if there are any.
    pub fn tell(&self, run: &Run) {
        if self.joined > 0 {
            let text = "points on open edges lay within a millionth of the model's size of others, \
                        as by rounding, and were joined";
            run.finding(Finding::note("sewn", text).of(self.joined as u64));
        }
    }
}

/// The most points of one cell that a point is compared with: a seam has a few.
const CROWD: usize = 16;

/// Welds a mesh, and then sews its borders.
pub fn sew(mesh: &Mesh, run: &Run) -> Result<Sewn, Cancelled> {
    let mut mesh = weld(mesh, run)?;
    let mut rim = borders(&mesh.triangles, run)?.into_flattened();
    rim.sort_unstable();
    rim.dedup();
    let joins = joins(&mesh, &rim);
    let mut moved: f64 = 0.0;
    for &[from, to] in &joins {
        let [p, q] = [from, to].map(|p| DVec3::from(mesh.points[p as usize]));
        moved = moved.max(p.distance(q));
        mesh.points[from as usize] = q.to_array();
    }
    if !joins.is_empty() {
        mesh = weld(&mesh, run)?;
    }
    Ok(Sewn { mesh, joined: joins.len(), moved })
}

/// Points of the rim, each with the one of a lower number that it becomes.
fn joins(mesh: &Mesh, rim: &[u32]) -> Vec<[u32; 2]> {
    let Some(extent) = bounds(&mesh.points) else { return Vec::new() };
    let [low, high] = extent.map(DVec3::from);
    let reach = REACH * (high - low).max_element();
    let at = |i: u32| DVec3::from(mesh.points[rim[i as usize] as usize]);
    let near = |i: u32, j: u32| at(i).distance_squared(at(j)) <= reach * reach;
    let cell = |i: u32| ((at(i) - low) / reach).to_array().map(|x| x as i64);
    // The last point of each cell, and of each point the one before it in its cell.
    let (mut last, mut before) = (FxHashMap::default(), vec![None; rim.len()]);
    let mut sets = Sets::singles(rim.len());
    for i in 0..rim.len() as u32 {
        let [x, y, z] = cell(i);
        for k in 0..27 {
            let beside = [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1];
            let first = last.get(&beside).copied();
            let points = std::iter::successors(first, |&j: &u32| before[j as usize]);
            for j in points.take(CROWD).filter(|&j| near(i, j)) {
                sets.join(i, j);
            }
        }
        before[i as usize] = last.insert([x, y, z], i);
    }
    // What would make two corners of a triangle one stays as it is.
    let mut stays = vec![false; rim.len()];
    for t in &mesh.triangles {
        let roots = t.map(|p| rim.binary_search(&p).ok().map(|i| sets.root(i as u32)));
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            if let Some(root) = roots[a].filter(|_| roots[a] == roots[b]) {
                stays[root as usize] = true;
            }
        }
    }
    let join = |i: u32| {
        let to = sets.root(i);
        let joins = to != i && !stays[to as usize] && near(i, to);
        joins.then(|| [i, to].map(|i| rim[i as usize]))
    };
    (0..rim.len() as u32).filter_map(join).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Topology, self_intersections};
    use crate::random::Random;
    use crate::samples::Sample;
    use proptest::prelude::*;

    /// The triangles of a mesh, each with points of its own that are off by up to `noise`.
    fn torn(mesh: &Mesh, noise: f64, seed: u64) -> Mesh {
        let mut random = Random::new(seed);
        let mut off = || (2.0 * random.unit() - 1.0) * noise;
        let corners = (0..mesh.triangles.len()).flat_map(|t| mesh.corners(t));
        let points: Vec<[f64; 3]> = corners.map(|p| p.map(|x| x + off())).collect();
        let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        Mesh::new(points, triangles.collect()).unwrap()
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(32))]

        #[test]
        fn seams_that_only_rounding_opened_are_closed(seed: u64, share in 0.0..0.25f64) {
            let run = Run::default();
            let whole = Sample::from_name("gear").unwrap();
            let whole = weld(&whole.mesh(24, &run).unwrap().triangulate(), &run).unwrap();
            let [low, high] = whole.bounds().unwrap();
            let size = (DVec3::from(high) - DVec3::from(low)).max_element();
            let sewn = sew(&torn(&whole, share * REACH * size, seed), &run).unwrap();
            let [before, after] = [&whole, &sewn.mesh]
                .map(|m| Topology::of(m.points.len(), &m.triangles, &run).unwrap());
            prop_assert_eq!(after.points, before.points);
            prop_assert_eq!(after.boundary_edges.count, before.boundary_edges.count);
            prop_assert_eq!(self_intersections(&sewn.mesh, &run).unwrap().len(), 0);
            prop_assert!(sewn.moved <= REACH * size * 1.01);
        }

        #[test]
        fn what_is_further_apart_stays(seed: u64) {
            let run = Run::default();
            let square = Mesh::new(
                vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
                vec![[0, 1, 2], [0, 2, 3]],
            ).unwrap();
            let apart = torn(&square, 1e-3, seed);
            let sewn = sew(&apart, &run).unwrap();
            prop_assert_eq!((sewn.joined, sewn.moved), (0, 0.0));
            prop_assert_eq!(sewn.mesh, apart);
        }
    }

    #[test]
    fn small_triangles_keep_their_corners() {
        let run = Run::default();
        let small = Mesh::new(
            vec![[0.0; 3], [1e-8, 0.0, 0.0], [0.0, 1e-8, 0.0], [1.0, 1.0, 1.0], [1.0, 0.0, 0.0]],
            vec![[0, 1, 2], [0, 3, 4]],
        )
        .unwrap();
        assert_eq!(sew(&small, &run).unwrap().mesh, small);
        assert_eq!(sew(&Mesh::default(), &run).unwrap().joined, 0);
    }
}

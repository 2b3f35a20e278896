//! Pruning: parts of a mesh that are too small to matter are left out.

use crate::measure::weld_points;
use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use crate::sets::Sets;
use glam::DVec3;

/// What is too small.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PruneOptions {
    /// Parts whose box has a shorter diagonal are left out, in the mesh's unit.
    pub size: f64,
}

/// What was left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct PruneAccount {
    /// Parts of the mesh, connected through points.
    pub parts: usize,
    /// Those that were left out.
    pub parts_left_out: usize,
    /// Their triangles.
    pub triangles_left_out: usize,
}

/// A mesh without its small parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Pruned {
    /// What is left, in the same order.
    pub mesh: Mesh,
    /// What was done.
    pub account: PruneAccount,
}

/// Leaves out small parts, but never the largest; and points that no triangle uses then.
pub fn prune(mesh: &Mesh, options: &PruneOptions, run: &Run) -> Result<Pruned, Cancelled> {
    run.stage("prune");
    let welded = weld_points(&mesh.points, run)?;
    let mut sets = Sets::singles(welded.points.len());
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|p| welded.of[p as usize]);
        sets.join(a, b);
        sets.join(b, c);
    }
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let mut boxes = vec![none; welded.points.len()];
    let mut part = |p: u32| sets.root(welded.of[p as usize]) as usize;
    for &p in mesh.triangles.iter().flatten() {
        let at = DVec3::from(mesh.points[p as usize]);
        let [low, high] = &mut boxes[part(p)];
        (*low, *high) = (low.min(at), high.max(at));
    }
    let size = |root: usize| boxes[root][0].distance(boxes[root][1]);
    let parts: Vec<usize> = (0..boxes.len()).filter(|&root| boxes[root] != none).collect();
    let largest = parts.iter().map(|&root| size(root)).fold(0.0, f64::max);
    let stays = |root: usize| size(root) >= options.size.min(largest);
    let kept: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|&t| stays(part(mesh.triangles[t as usize][0])))
        .collect();
    let account = PruneAccount {
        parts: parts.len(),
        parts_left_out: parts.iter().filter(|&&root| !stays(root)).count(),
        triangles_left_out: mesh.triangles.len() - kept.len(),
    };
    let mut numbers = vec![u32::MAX; mesh.points.len()];
    let corners = kept.iter().flat_map(|&t| mesh.triangles[t as usize]);
    corners.for_each(|p| numbers[p as usize] = 0);
    let used: Vec<u32> =
        (0..mesh.points.len() as u32).filter(|&p| numbers[p as usize] == 0).collect();
    used.iter().zip(0..).for_each(|(&p, number)| numbers[p as usize] = number);
    let mesh = Mesh {
        points: used.iter().map(|&p| mesh.points[p as usize]).collect(),
        triangles: kept
            .iter()
            .map(|&t| mesh.triangles[t as usize].map(|p| numbers[p as usize]))
            .collect(),
        attributes: mesh.attributes.of(&used, &kept),
        unit: mesh.unit,
    };
    Ok(Pruned { mesh, account })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::Sample;

    #[test]
    fn small_parts_go_and_the_largest_stays() {
        let cube = Sample::Cube.polygons(1).unwrap().triangulate();
        let mut mesh = cube.clone();
        let small = cube.map(|p| p.map(|x| 3.0 + 0.01 * x));
        let first = mesh.points.len() as u32;
        mesh.points.extend(&small.points);
        mesh.triangles.extend(small.triangles.iter().map(|t| t.map(|p| p + first)));
        mesh.attributes = Default::default();
        mesh.attributes.face_labels = Some((0..mesh.triangles.len() as u32).collect());
        let pruned = |size| prune(&mesh, &PruneOptions { size }, &Run::default()).unwrap();
        assert_eq!(pruned(0.001).mesh, mesh);
        for size in [0.1, 100.0] {
            let Pruned { mesh: left, account } = pruned(size);
            assert_eq!((left.points.len(), left.triangles.len()), (first as usize, 12));
            assert_eq!(left.attributes.face_labels.unwrap(), (0..12).collect::<Vec<_>>());
            assert_eq!(
                account,
                PruneAccount { parts: 2, parts_left_out: 1, triangles_left_out: 12 }
            );
        }
    }
}

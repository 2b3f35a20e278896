//! Trees of hinges to start from.
//!
//! Steepest-edge cut trees (Schlickenrieder 1997): from each point the steepest edge is cut, for
//! many directions of up. Minimum spanning trees: flat and long hinges first.

use super::facets::Facets;
use super::hinges::{Hinge, Hinges};
use super::patch::Patch;
use super::sets::Sets;
use crate::random::Random;
use glam::DVec3;

/// The tree of hinges that are cheapest under `cost`, ties by number.
pub(super) fn cheapest(patch: &Patch, cost: impl Fn(u32) -> f64) -> Vec<u32> {
    let mut order: Vec<(f64, u32)> = (0..patch.hinges.len() as u32).map(|h| (cost(h), h)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut sets = Sets::singles(patch.len());
    let joins = |&(_, h): &(f64, u32)| {
        let [a, b] = patch.ends[h as usize];
        sets.join(a, b)
    };
    order.into_iter().filter(joins).map(|(_, h)| h).collect()
}

/// How little a hinge is worth keeping: sharp and short ones are cut first.
pub(super) fn weight(hinge: &Hinge, usual: f64) -> f64 {
    hinge.fold.abs() / std::f64::consts::PI - 0.05 * hinge.length / usual
}

/// The tree that is left where from each point the steepest edge towards a random direction is cut.
pub(super) fn steepest(
    mesh: &Facets,
    hinges: &Hinges,
    patch: &Patch,
    random: &mut Random,
) -> Vec<u32> {
    let up = random.direction();
    // Of each point of the patch, the steepest way and the hinge there.
    let mut ways: Vec<(u32, f64, u32)> = Vec::new();
    for (local, &h) in patch.hinges.iter().enumerate() {
        for &(edge, _) in &hinges.get(h).edges {
            let [p, q] = mesh.edges.sides(edge as usize)[0].ends();
            let [a, b]: [DVec3; 2] = [p, q].map(|p| mesh.points[p as usize]);
            let slope = (b - a).normalize_or_zero().dot(up);
            ways.push((p, slope, local as u32));
            ways.push((q, -slope, local as u32));
        }
    }
    ways.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
    ways.dedup_by_key(|way| way.0);
    let height = |p: u32| mesh.points[p as usize].dot(up);
    let top = ways.iter().map(|way| way.0).max_by(|&p, &q| height(p).total_cmp(&height(q)));
    let mut cut = vec![0.0; patch.hinges.len()];
    for (_, _, hinge) in ways.iter().filter(|way| Some(way.0) != top) {
        cut[*hinge as usize] = 8.0;
    }
    cheapest(patch, |h| {
        let hinge = hinges.get(patch.hinges[h as usize]);
        cut[h as usize] + weight(hinge, patch.size)
    })
}

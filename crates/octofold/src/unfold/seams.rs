//! What is glued to what. At an edge where facets are not held by a hinge, each sheet but one is
//! glued to another by a tab: of two sheets either may carry it, and a sheet that ends at one that
//! goes on carries it itself.

use super::facets::Facets;
use super::hinges::Hinges;
use glam::DVec3;

/// A side of a facet.
pub(super) type FacetSide = (u32, u32);

/// Two sides to glue together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Joint {
    /// The edge.
    pub edge: u32,
    /// Who may carry the tab, and under which facet that is glued, the best first.
    pub ways: Vec<[FacetSide; 2]>,
}

/// How the sides at an edge are held.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Held {
    /// Two sides held by a hinge, and the fold in radians.
    pub hinge: Option<([FacetSide; 2], f64)>,
}

/// The angle in radians by which a tab of the first side is folded away from the printed side to lie
/// under the second.
pub(super) fn tab_fold(mesh: &Facets, [on, under]: [FacetSide; 2]) -> f64 {
    let [own, other] = [on, under].map(|side| inward(mesh, side));
    let normal = mesh.facets[on.0 as usize].normal;
    (-normal.dot(other)).atan2(-own.dot(other))
}

/// The direction in which a facet lies, seen from one of its sides.
fn inward(mesh: &Facets, (facet, side): FacetSide) -> DVec3 {
    let facet = &mesh.facets[facet as usize];
    let ends = facet.sides[side as usize].map(|c| facet.corners[c as usize]);
    let [a, b] = ends.map(|p| mesh.points[p as usize]);
    facet.normal.cross(b - a).normalize_or_zero()
}

/// What holds each edge, given which hinges are kept.
pub(super) fn held(mesh: &Facets, hinges: &Hinges, kept: &[bool]) -> Vec<Held> {
    let mut held = vec![Held::default(); mesh.edges.len()];
    for (hinge, _) in hinges.hinges.iter().zip(kept).filter(|(_, kept)| **kept) {
        for &(edge, [a, b]) in &hinge.edges {
            let sides = [(hinge.facets[0], a), (hinge.facets[1], b)];
            held[edge as usize].hinge = Some((sides, hinge.fold));
        }
    }
    held
}

/// All joints, in order of their edges.
pub(super) fn joints(mesh: &Facets, held: &[Held]) -> Vec<Joint> {
    (0..mesh.edges.len()).flat_map(|edge| joints_at(mesh, held, edge)).collect()
}

fn joints_at(mesh: &Facets, held: &[Held], edge: usize) -> Vec<Joint> {
    let sides: Vec<FacetSide> = mesh.edges.sides(edge).iter().map(|s| (s.face, s.number)).collect();
    let goes_on = |&side: &FacetSide| {
        let hinged = held[edge].hinge.is_some_and(|(pair, _)| pair.contains(&side));
        hinged || sides.iter().filter(|other| other.0 == side.0).count() > 1
    };
    let (mut base, mut ends): (Vec<FacetSide>, Vec<FacetSide>) =
        sides.iter().partition(|&side| goes_on(side));
    let alone = base.is_empty();
    if alone && !ends.is_empty() {
        base.push(ends.remove(0));
    }
    let joint = |end: &FacetSide| {
        let away = -inward(mesh, *end);
        let mut under = base.clone();
        under.sort_by(|a, b| inward(mesh, *b).dot(away).total_cmp(&inward(mesh, *a).dot(away)));
        let mut ways: Vec<[FacetSide; 2]> = under.into_iter().map(|u| [*end, u]).collect();
        if alone {
            ways.push([base[0], *end]);
        }
        Joint { edge: edge as u32, ways }
    };
    ends.iter().map(joint).collect()
}

//! What stands against building a model as it is.

use crate::measure::{self, Measures, Nearest, Weld};
use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use crate::sets::Sets;
use glam::DVec3;

/// Why a model must be repaired before it is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Cause {
    /// Faces cut each other.
    Crossings,
    /// Borders run so near to each other that they were meant to be one.
    Cracks,
    /// There are many borders, or borders of many faces.
    Borders,
    /// A part may lie within another.
    Inside,
    /// Walls are so thin that a single sheet is better.
    Thin,
    /// Fewer faces could not be reached with its topology.
    Faces,
}

/// Width in millimetres on paper of what is a crack.
const CRACK: f64 = 1.0;

/// The most edges with one face of a model that is taken to be meant so.
const MOST_BORDERS: usize = 1000;

/// What stands against building `mesh` as it is, with so many millimetres on paper for each unit.
pub(super) fn cause(mesh: &Mesh, factor: f64, run: &Run) -> Result<Option<Cause>, Cancelled> {
    let welded = measure::sew(mesh, run)?.mesh;
    let measures = measure::measure(&welded, Weld::Off, run)?;
    Ok(if measures.self_intersections > 0 {
        Some(Cause::Crossings)
    } else if measures.boundary_edges > MOST_BORDERS {
        Some(Cause::Borders)
    } else if !measures.closed && has_cracks(&welded, CRACK / factor, run)? {
        Some(Cause::Cracks)
    } else if may_nest(&welded, &measures) {
        Some(Cause::Inside)
    } else if is_thin(&welded, super::THIN / factor) {
        Some(Cause::Thin)
    } else {
        None
    })
}

/// Share of the area that makes a model thin.
const THIN_SHARE: f64 = 0.1;

/// True where a good part of a mesh has another face behind it, turned away, nearer than `thickness`.
fn is_thin(mesh: &Mesh, thickness: f64) -> bool {
    let nearest = Nearest::new(mesh);
    let normal = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(DVec3::from);
        (b - a).cross(c - a)
    };
    let (mut thin, mut whole) = (0.0, 0.0);
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t).map(DVec3::from);
        let own = normal(t);
        whole += own.length();
        // Half as deep as what is thin, the other wall is nearer than this one.
        let deep = (a + b + c) / 3.0 - own.normalize_or_zero() * thickness / 2.0;
        let Some(hit) = nearest.nearest(deep.to_array()) else { continue };
        let other = normal(hit.triangle as usize);
        if own.dot(other) < -0.9 * own.length() * other.length() {
            thin += own.length();
        }
    }
    thin > THIN_SHARE * whole
}

/// True where two borders without a common end come nearer to each other than `width`.
fn has_cracks(mesh: &Mesh, width: f64, run: &Run) -> Result<bool, Cancelled> {
    let borders = measure::borders(&mesh.triangles, run)?;
    let at = |p: u32| DVec3::from(mesh.points[p as usize]);
    Ok(borders.iter().enumerate().any(|(i, &[a, b])| {
        borders[..i].iter().any(|&[c, d]| {
            let joined = [c, d].iter().any(|p| [a, b].contains(p));
            // Short steps along one border are near each other without being a crack.
            let long = at(a).distance(at(b)).max(at(c).distance(at(d))) > 2.0 * width;
            !joined && long && apart([at(a), at(b)], [at(c), at(d)]) < width
        })
    }))
}

/// A bound of the distance of two segments: that of their ends from the other one.
fn apart([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> f64 {
    let from = |p: DVec3, [a, b]: [DVec3; 2]| {
        let along = b - a;
        let way = (p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        p.distance(a + way.clamp(0.0, 1.0) * along)
    };
    [from(a, [c, d]), from(b, [c, d]), from(c, [a, b]), from(d, [a, b])]
        .into_iter()
        .fold(f64::INFINITY, f64::min)
}

/// True where the box of a part lies within that of another.
fn may_nest(mesh: &Mesh, measures: &Measures) -> bool {
    if measures.components < 2 {
        return false;
    }
    let mut sets = Sets::singles(mesh.points.len());
    for &[a, b, c] in &mesh.triangles {
        sets.join(a, b);
        sets.join(b, c);
    }
    let mut boxes = vec![None; mesh.points.len()];
    for &p in mesh.triangles.iter().flatten() {
        let at = DVec3::from(mesh.points[p as usize]);
        let [low, high] = boxes[sets.root(p) as usize].get_or_insert([at, at]);
        (*low, *high) = (low.min(at), high.max(at));
    }
    let boxes: Vec<[DVec3; 2]> = boxes.into_iter().flatten().collect();
    boxes.iter().enumerate().any(|(i, own)| {
        boxes.iter().enumerate().any(|(j, other)| {
            i != j && other[0].cmple(own[0]).all() && own[1].cmple(other[1]).all()
        })
    })
}

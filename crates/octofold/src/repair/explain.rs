//! What a repair changed, as one coloured mesh.
//!
//! The output is shown with what it took over from the input in gray and what was made to close gaps in
//! orange; among it lie in blue the parts of the input that the output does not show: what is inside,
//! walls that became one sheet with another, and what is smaller than a cell. Source: specification of
//! repair (D.10).

use crate::attributes::Attributes;
use crate::measure::Nearest;
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// What is further from the other surface than this share of a cell is not on it.
const OFF: f64 = 0.35;

/// Pieces of triangles are not cut where they are shorter than so many cells.
const SHORT: f64 = 2.0;

/// Triangles in a block of work.
const BLOCK: usize = 256;

/// What a triangle of the picture stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Change {
    Kept,
    Closed,
    Gone,
}

impl Change {
    const ALL: [Self; 3] = [Self::Kept, Self::Closed, Self::Gone];

    fn name(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Closed => "closed",
            Self::Gone => "gone",
        }
    }

    fn colour(self) -> [u8; 4] {
        match self {
            Self::Kept => [196, 196, 196, 255],
            Self::Closed => [240, 128, 16, 255],
            Self::Gone => [40, 96, 232, 255],
        }
    }
}

/// Shows what `output` kept of `input`, what it closed and what it left out, by colour and by label
/// (`kept`, `closed`, `gone`). `cell` is the side of the cells of the repair.
pub fn explain(input: &Mesh, output: &Mesh, cell: f64, run: &Run) -> Result<Mesh, Cancelled> {
    run.stage("explain");
    let mut shown = Mesh { unit: output.unit, ..Mesh::default() };
    let mut labels = Vec::new();
    for (mesh, other, on, off) in
        [(output, input, Some(Change::Kept), Change::Closed), (input, output, None, Change::Gone)]
    {
        let nearest = Nearest::new(other);
        let parts = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
            let mut pieces = Vec::new();
            for t in range {
                let corners = mesh.corners(t).map(DVec3::from_array);
                split(corners, &nearest, cell, &mut pieces);
            }
            pieces
        })?;
        for (corners, is_off) in parts.into_iter().flatten() {
            let change = if is_off { Some(off) } else { on };
            let Some(change) = change else { continue };
            let first = shown.points.len() as u32;
            shown.points.extend(corners.map(|p| p.to_array()));
            shown.triangles.push([first, first + 1, first + 2]);
            labels.push(change);
        }
    }
    shown.attributes = Attributes {
        face_colours: Some(labels.iter().map(|c| c.colour()).collect()),
        face_labels: Some(labels.iter().map(|&c| c as u32 + 1).collect()),
        label_names: Change::ALL.map(|c| (c as u32 + 1, c.name().into())).to_vec(),
        ..Attributes::default()
    };
    Ok(shown)
}

/// Cuts a triangle into pieces that are on the other surface or off it.
fn split(corners: [DVec3; 3], nearest: &Nearest, cell: f64, pieces: &mut Vec<([DVec3; 3], bool)>) {
    let is_off = |p: DVec3| nearest.nearest_within(p.to_array(), OFF * cell).is_none();
    let [a, b, c] = corners;
    let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
    let middle = is_off((a + b + c) / 3.0);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    if longest <= SHORT * cell || [a, b, c, ab, bc, ca].into_iter().all(|p| is_off(p) == middle) {
        pieces.push((corners, middle));
        return;
    }
    for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        split(part, nearest, cell, pieces);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{options, sphere};
    use super::super::{Gap, repair};
    use super::*;

    #[test]
    fn a_hole_is_shown_as_closed_and_an_inner_part_as_gone() {
        let run = Run::default();
        let mut input = sphere(24, |p| p[2] > 0.95);
        let whole = input.triangles.len();
        let inner = sphere(6, |_| false);
        let first = input.points.len() as u32;
        input.points.extend(inner.points.iter().map(|p| p.map(|x| 0.3 * x)));
        input.triangles.extend(inner.triangles.iter().map(|t| t.map(|p| p + first)));
        let found = repair(&input, &options(48, Gap::Width(0.8)), &run).unwrap();
        let shown = explain(&input, &found.solid.into_mesh(), found.account.cell, &run).unwrap();
        assert!(shown.check().is_ok());
        let labels = shown.attributes.face_labels.as_ref().unwrap();
        let of = |change: Change| {
            let label = change as u32 + 1;
            let own = (0..labels.len()).filter(move |&t| labels[t] == label);
            own.map(|t| shown.corners(t).map(DVec3::from_array)).collect::<Vec<_>>()
        };
        let lies = |t: &[DVec3; 3], test: &dyn Fn(DVec3) -> bool| t.iter().all(|&p| test(p));
        let gone = of(Change::Gone);
        assert!(gone.len() >= input.triangles.len() - whole);
        assert!(gone.iter().all(|t| lies(t, &|p| p.length() < 0.31)));
        let closed = of(Change::Closed);
        assert!(!closed.is_empty());
        assert!(closed.iter().all(|t| lies(t, &|p| p.z > 0.8 && p.length() < 1.1)));
        assert!(of(Change::Kept).len() > closed.len());
    }
}

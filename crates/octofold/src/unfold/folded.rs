//! A pattern folded again: from the coordinates on paper and the folds alone, as scissors and glue do.

use super::pattern::{Fold, Pattern, Piece, Tile, millimetres};
use crate::mesh::Mesh;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use std::collections::{BTreeMap, VecDeque};

/// What a pattern folds into.
#[derive(Debug, Clone, PartialEq)]
pub struct Folded {
    /// Each piece for itself, its number as label, its faces in colour where the pattern has any.
    pub mesh: Mesh,
    /// Furthest that a corner is from its point of the pattern's mesh, in millimetres.
    pub error: f64,
}

impl Pattern {
    /// Where points of the page come to lie that are on a tile, in the coordinates of the pattern's mesh.
    pub fn in_space(&self, tile: &Tile) -> impl Fn([f64; 2]) -> [f64; 3] + use<> {
        let place = in_space(self, tile);
        move |[x, y]| place.transform_point3(DVec3::new(x, y, 0.0)).to_array()
    }

    /// Folds all pieces and sets each where its first face belongs.
    pub fn folded(&self) -> Folded {
        let mut folded = Folded { mesh: Mesh::default(), error: 0.0 };
        let (mut colours, mut labels) = (Vec::new(), Vec::new());
        for (number, piece) in (1..).zip(&self.pieces) {
            for (tile, place) in places(self, piece) {
                let first = folded.mesh.points.len() as u32;
                let mut flat = Vec::with_capacity(tile.corners.len());
                for corner in &tile.corners {
                    let at = place.transform_point3(on_paper(corner.at));
                    let meant = DVec3::from(self.mesh.points[corner.point as usize]);
                    folded.error = folded.error.max(at.distance(meant));
                    folded.mesh.points.push(at.to_array());
                    flat.push(on_paper(corner.at).truncate().to_array());
                }
                let mut cut: Vec<u32> = Vec::new();
                earcut::Earcut::new().earcut(flat, &[], &mut cut);
                let triangles = cut.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|c| first + c));
                let before = folded.mesh.triangles.len();
                folded.mesh.triangles.extend(triangles);
                labels.resize(folded.mesh.triangles.len(), number);
                if let Some(of_faces) = &self.mesh.colours {
                    let [r, g, b] = of_faces[tile.face as usize];
                    let own = folded.mesh.triangles.len() - before;
                    colours.extend(std::iter::repeat_n([r, g, b, 255], own));
                }
            }
        }
        folded.mesh.attributes.face_labels = Some(labels);
        folded.mesh.attributes.face_colours = self.mesh.colours.is_some().then_some(colours);
        folded
    }
}

/// The tiles of a piece that hang together, and where each comes to lie.
fn places<'a>(pattern: &Pattern, piece: &'a Piece) -> Vec<(&'a Tile, DAffine3)> {
    let mut at_edge: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (number, tile) in piece.tiles.iter().enumerate() {
        let hinges = tile.corners.iter().filter(|c| matches!(c.fold, Fold::Hinge(_)));
        hinges.for_each(|c| at_edge.entry(c.edge).or_default().push(number));
    }
    let mut place: Vec<Option<DAffine3>> = vec![None; piece.tiles.len()];
    let Some(first) = piece.tiles.first() else { return Vec::new() };
    place[0] = Some(in_space(pattern, first));
    let mut queue = VecDeque::from([0]);
    while let Some(number) = queue.pop_front() {
        let Some(own) = place[number] else { continue };
        for (a, b) in piece.tiles[number].sides() {
            let Fold::Hinge(fold) = a.fold else { continue };
            for &other in at_edge.get(&a.edge).into_iter().flatten() {
                if place[other].is_some() {
                    continue;
                }
                let [a, b] = [a.at, b.at].map(|p| own.transform_point3(on_paper(p)));
                let turn =
                    DQuat::from_axis_angle((b - a).normalize_or(DVec3::X), fold.to_radians());
                let about = DAffine3::from_translation(a)
                    * DAffine3::from_quat(turn)
                    * DAffine3::from_translation(-a);
                place[other] = Some(about * own);
                queue.push_back(other);
            }
        }
    }
    piece.tiles.iter().zip(place).filter_map(|(tile, place)| Some((tile, place?))).collect()
}

fn on_paper(spot: super::pattern::Spot) -> DVec3 {
    DVec3::new(millimetres(spot[0]), millimetres(spot[1]), 0.0)
}

/// The motion that takes a tile from paper to its face: onto its longest side, and into its plane.
fn in_space(pattern: &Pattern, tile: &Tile) -> DAffine3 {
    let flat: Vec<DVec3> = tile.corners.iter().map(|c| on_paper(c.at)).collect();
    let meant: Vec<DVec3> =
        tile.corners.iter().map(|c| DVec3::from(pattern.mesh.points[c.point as usize])).collect();
    let n = flat.len();
    let length = |&i: &usize| flat[i].distance_squared(flat[(i + 1) % n]);
    let side = (0..n).max_by(|i, j| length(i).total_cmp(&length(j))).unwrap_or(0);
    let frame = |points: &[DVec3]| {
        let normal: DVec3 = (0..n).map(|i| points[i].cross(points[(i + 1) % n])).sum();
        let along = (points[(side + 1) % n] - points[side]).normalize_or(DVec3::X);
        let up = normal.reject_from_normalized(along).normalize_or(along.any_orthonormal_vector());
        DMat3::from_cols(along, up.cross(along), up)
    };
    let turn = frame(&meant) * frame(&flat).transpose();
    DAffine3::from_translation(meant[side])
        * DAffine3::from_mat3(turn)
        * DAffine3::from_translation(-flat[side])
}

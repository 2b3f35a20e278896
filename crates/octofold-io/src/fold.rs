//! Papercraft sheets as FOLD (Demaine, Ku and Lang 2016): crease patterns that other programs fold.
//!
//! Pages stand side by side. Angles are those of FOLD, positive for valleys.

use octofold::unfold::Pattern;
use octofold::unfold::pattern::{Fold, STEPS, Spot, millimetres, steps};
use rustc_hash::FxHashMap;
use serde_json::json;

/// Space between pages in millimetres.
const BETWEEN: f64 = 20.0;

/// The text of a whole pattern.
pub(crate) fn document(pattern: &Pattern, title: &str) -> String {
    let (mut points, mut faces, mut edges) = (Vec::new(), Vec::new(), Vec::new());
    let (mut assignment, mut angles) = (Vec::new(), Vec::new());
    for piece in &pattern.pieces {
        let left = i64::from(piece.page) * steps(pattern.page[0] + BETWEEN);
        let mut known: FxHashMap<Spot, usize> = FxHashMap::default();
        let mut drawn: FxHashMap<[usize; 2], ()> = FxHashMap::default();
        for tile in &piece.tiles {
            let mut number = |spot: Spot| {
                *known.entry(spot).or_insert_with(|| {
                    points.push([millimetres(spot[0] + left), millimetres(spot[1])]);
                    points.len() - 1
                })
            };
            let corners: Vec<usize> = tile.corners.iter().map(|c| number(c.at)).collect();
            for (i, corner) in tile.corners.iter().enumerate() {
                let [a, b] = [corners[i], corners[(i + 1) % corners.len()]];
                if drawn.insert([a.min(b), a.max(b)], ()).is_some() {
                    continue;
                }
                edges.push([a, b]);
                let (letter, angle) = match corner.fold {
                    Fold::Hinge(fold) if fold > 0.0 => ("M", Some(-fold)),
                    Fold::Hinge(fold) if fold < 0.0 => ("V", Some(-fold)),
                    Fold::Hinge(_) => ("F", Some(0.0)),
                    Fold::Seam | Fold::Border => ("B", None),
                };
                assignment.push(letter);
                angles.push(angle);
            }
            faces.push(corners);
        }
    }
    let document = json!({
        "file_spec": 1.1,
        "file_creator": "Octofold",
        "file_title": title,
        "file_classes": ["singleModel"],
        "frame_classes": ["creasePattern"],
        "frame_attributes": ["2D"],
        "frame_unit": "mm",
        "frame_precision": 1.0 / STEPS as f64,
        "vertices_coords": points,
        "faces_vertices": faces,
        "edges_vertices": edges,
        "edges_assignment": assignment,
        "edges_foldAngle": angles,
    });
    format!("{document}\n")
}

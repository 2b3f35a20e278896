//! Colours, materials, labels and texture coordinates of a repaired mesh, from the input next to it.
//!
//! Each output triangle takes those of the input triangle that is nearest to its middle, each output
//! point the colour at the nearest point of the input. Source: specification of repair (D.9).

use crate::attributes::Attributes;
use crate::measure::Nearest;
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// The columns that `to` takes from `from`; none where there are none.
pub fn inherit(from: &Mesh, to: &Mesh, run: &Run) -> Result<Attributes, Cancelled> {
    let columns = &from.attributes;
    let of_points = columns.point_colours.is_some();
    let of_faces = columns.corner_uvs.is_some()
        || columns.face_colours.is_some()
        || columns.face_materials.is_some()
        || columns.face_labels.is_some();
    let mut found = Attributes::default();
    if !of_points && !of_faces {
        return Ok(found);
    }
    run.stage("attributes");
    let nearest = Nearest::new(from);
    if let Some(colours) = &columns.point_colours {
        let hits = nearest.nearest_all(&to.points, run)?;
        found.point_colours = Some(par::map(&hits, |hit| {
            let Some(hit) = hit else { return [255; 4] };
            let t = hit.triangle as usize;
            let shares = shares(from.corners(t), hit.point);
            let corners = from.triangles[t].map(|p| colours[p as usize]);
            let mean = |c: usize| (0..3).map(|i| shares[i] * f64::from(corners[i][c])).sum::<f64>();
            std::array::from_fn(|c| mean(c).round() as u8)
        }));
    }
    if of_faces {
        let numbers: Vec<usize> = (0..to.triangles.len()).collect();
        let middles = par::map(&numbers, |&t| {
            let [a, b, c] = to.corners(t).map(DVec3::from_array);
            ((a + b + c) / 3.0).to_array()
        });
        let hits = nearest.nearest_all(&middles, run)?;
        let next = par::map(&hits, |hit| hit.map_or(0, |hit| hit.triangle as usize));
        found.face_colours = pick(&columns.face_colours, &next);
        found.face_materials = pick(&columns.face_materials, &next);
        found.face_labels = pick(&columns.face_labels, &next);
        found.corner_uvs = columns.corner_uvs.as_ref().map(|uvs| {
            let corners = par::map(&numbers, |&t| {
                let own = next[t];
                to.corners(t).map(|p| {
                    let shares = shares(from.corners(own), p);
                    std::array::from_fn(|i| {
                        (0..3).map(|c| shares[c] * f64::from(uvs[3 * own + c][i])).sum::<f64>()
                            as f32
                    })
                })
            });
            corners.concat()
        });
        found.materials.clone_from(&columns.materials);
        found.label_names.clone_from(&columns.label_names);
    }
    Ok(found)
}

fn pick<T: Copy>(column: &Option<Vec<T>>, from: &[usize]) -> Option<Vec<T>> {
    column.as_ref().map(|c| from.iter().map(|&i| c[i]).collect())
}

/// Barycentric coordinates of a point over a triangle, none below zero.
fn shares(corners: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(DVec3::from_array);
    let p = DVec3::from_array(p);
    let normal = (b - a).cross(c - a);
    let area = |q: DVec3, r: DVec3| (q - p).cross(r - p).dot(normal).max(0.0);
    let parts = [area(b, c), area(c, a), area(a, b)];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|x| x / sum) } else { [1.0, 0.0, 0.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_follow_the_nearest_place() {
        let points = vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [9.0, 9.0, 9.0]];
        let mut from = Mesh::new(points, vec![[0, 1, 2], [1, 2, 3]]).unwrap();
        from.attributes.point_colours =
            Some(vec![[0, 0, 0, 255], [200, 0, 0, 255], [0, 100, 0, 255], [9; 4]]);
        from.attributes.face_labels = Some(vec![7, 8]);
        from.attributes.corner_uvs =
            Some(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [5.0, 5.0], [5.0, 5.0], [5.0, 5.0]]);
        let points = vec![[1.0, 0.0, 0.1], [0.0, 1.0, 0.1], [0.0, 0.0, 0.1]];
        let to = Mesh::new(points, vec![[0, 1, 2]]).unwrap();
        let found = inherit(&from, &to, &Run::default()).unwrap();
        let colours = found.point_colours.unwrap();
        assert_eq!(colours, [[100, 0, 0, 255], [0, 50, 0, 255], [0, 0, 0, 255]]);
        assert_eq!(found.face_labels, Some(vec![7]));
        assert_eq!(found.corner_uvs, Some(vec![[0.5, 0.0], [0.0, 0.5], [0.0, 0.0]]));
    }
}

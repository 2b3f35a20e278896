//! Welding: points at exactly the same position become one.
//!
//! STL, GLB and files with normals or uv repeat points; without welding every triangle of theirs
//! is an island. Positions are compared exactly (0.0 equals -0.0), never by distance. The points
//! that stay keep the order of their first occurrence.

use crate::attributes::Attributes;
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;

/// Whether points at the same position count as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Weld {
    /// Points at exactly the same position are one.
    #[default]
    Exact,
    /// The mesh's own indices.
    Off,
}

/// Distinct positions, and where each original point went.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Welding {
    /// Distinct positions, in order of first occurrence.
    pub points: Vec<[f64; 3]>,
    /// Index into `points` for each original point.
    pub of: Vec<u32>,
}

/// Maps share no positions, so that each can be filled on its own thread.
const SHARDS: usize = 8;

/// Finds the distinct positions among `points`.
pub fn weld_points(points: &[[f64; 3]], run: &Run) -> Result<Welding, Cancelled> {
    // Adding zero makes -0.0 into 0.0, so that equal numbers have equal bits.
    let bits = |p: &[f64; 3]| p.map(|x| (x + 0.0).to_bits());
    let shards = par::map(points, |p| (FxBuildHasher.hash_one(bits(p)) >> 32) as u8 % SHARDS as u8);
    let repeats = par::blocks(run, SHARDS, 1, |range| {
        let shard = range.start as u8;
        let mut first = FxHashMap::with_capacity_and_hasher(points.len() / SHARDS, FxBuildHasher);
        let mut repeats = Vec::new();
        for i in (0..points.len()).filter(|&i| shards[i] == shard) {
            let before = *first.entry(bits(&points[i])).or_insert(i as u32);
            if before != i as u32 {
                repeats.push((i as u32, before));
            }
        }
        repeats
    })?;
    let mut of: Vec<u32> = (0..points.len() as u32).collect();
    for (i, before) in repeats.into_iter().flatten() {
        of[i as usize] = before;
    }
    let mut distinct = Vec::with_capacity(points.len());
    for i in 0..points.len() {
        if of[i] == i as u32 {
            of[i] = distinct.len() as u32;
            distinct.push(points[i]);
        } else {
            of[i] = of[of[i] as usize];
        }
    }
    Ok(Welding { points: distinct, of })
}

/// The same triangles on distinct positions.
///
/// Columns over corners and faces stay as they are; columns over points keep the entry of the
/// first point at each position.
pub fn weld(mesh: &Mesh, run: &Run) -> Result<Mesh, Cancelled> {
    let Welding { points, of } = weld_points(&mesh.points, run)?;
    let mut firsts = Vec::with_capacity(points.len());
    for (i, &to) in of.iter().enumerate() {
        if to as usize == firsts.len() {
            firsts.push(i);
        }
    }
    let columns = &mesh.attributes;
    let attributes = Attributes {
        point_colours: columns.point_colours.as_ref().map(|c| pick(c, &firsts)),
        point_normals: columns.point_normals.as_ref().map(|c| pick(c, &firsts)),
        point_columns: columns.point_columns.iter().map(|c| c.pick(&firsts)).collect(),
        ..columns.clone()
    };
    let triangles = par::map(&mesh.triangles, |t| t.map(|p| of[p as usize]));
    Ok(Mesh { points, triangles, attributes, unit: mesh.unit })
}

fn pick<T: Copy>(column: &[T], entries: &[usize]) -> Vec<T> {
    entries.iter().map(|&i| column[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn first_occurrences_stay_in_order(
            points in prop::collection::vec(prop::array::uniform3(-1i8..=1), 0..60),
        ) {
            let points: Vec<[f64; 3]> =
                points.iter().map(|p| p.map(|x| if x == 0 { -0.0 } else { f64::from(x) })).collect();
            let welding = weld_points(&points, &Run::default()).unwrap();
            let mut distinct: Vec<[f64; 3]> = Vec::new();
            for p in &points {
                if !distinct.contains(p) {
                    distinct.push(*p);
                }
            }
            prop_assert_eq!(&welding.points, &distinct);
            for (i, p) in points.iter().enumerate() {
                prop_assert_eq!(&distinct[welding.of[i] as usize], p);
            }
        }
    }

    #[test]
    fn zeros_of_both_signs_are_one_and_columns_follow() {
        let mut mesh = Mesh::new(
            vec![[0.0; 3], [1.0, 0.0, 0.0], [-0.0, 0.0, -0.0], [0.0, 1.0, 0.0]],
            vec![[0, 1, 3], [2, 3, 1]],
        )
        .unwrap();
        mesh.attributes.point_colours = Some((0..4).map(|i| [i; 4]).collect());
        let welded = weld(&mesh, &Run::default()).unwrap();
        assert_eq!(welded.triangles, [[0, 1, 2], [0, 2, 1]]);
        assert_eq!(welded.attributes.point_colours, Some(vec![[0; 4], [1; 4], [3; 4]]));
        welded.check().unwrap();
    }
}

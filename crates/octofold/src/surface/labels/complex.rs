//! The interfaces between labels, stored once, and the closed surface of each label as a view.
//!
//! Source: specification of surfaces, D.4; the pair of labels beside each triangle is that of
//! vtkSurfaceNets3D.

use crate::LengthUnit;
use crate::mesh::Mesh;
use crate::par;
use rustc_hash::FxHashMap;

/// The walls between the labels of a volume, and those between labels and the background, 0.
///
/// Every wall is there once. An edge has as many triangles as labels meet along it: two within a
/// wall, three or four where walls meet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LabelComplex {
    /// Positions, in world coordinates.
    pub points: Vec<[f64; 3]>,
    /// Points of each triangle, counter-clockwise seen from where its lower label is.
    pub triangles: Vec<[u32; 3]>,
    /// The labels behind and in front of each triangle, the higher one first.
    pub sides: Vec<[u32; 2]>,
    /// The first of the points inside cells, which come last. Only there a label's surface may
    /// have more than one fan. Triangles at the same of them stand together, and have it last.
    pub(super) first_inner: u32,
    /// Unit of the coordinates, where known.
    pub unit: Option<LengthUnit>,
}

/// The closed surface of one label.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelMesh {
    /// The sample value.
    pub label: u32,
    /// Its surface, in world coordinates.
    pub mesh: Mesh,
}

impl LabelComplex {
    /// Every label but 0, in order.
    pub fn labels(&self) -> Vec<u32> {
        let mut labels: Vec<u32> = Vec::new();
        let mut last = [0; 2];
        for &sides in &self.sides {
            if sides != last {
                labels.extend(sides.iter().filter(|&&label| label != 0));
                last = sides;
            }
        }
        labels.sort_unstable();
        labels.dedup();
        labels
    }

    /// The surface of one label: closed, consistently wound and manifold, or empty where there is
    /// no such label. A point at which the surface touches itself is there once for each fan.
    pub fn shell(&self, label: u32) -> Mesh {
        let touches = |&t: &u32| self.sides[t as usize].contains(&label);
        let triangles: Vec<u32> = (0..self.sides.len() as u32).filter(touches).collect();
        self.view(label, &triangles)
    }

    /// The surfaces of all labels but 0, in order. The work is that of the triangles, however many
    /// labels there are.
    pub fn shells(&self) -> Vec<LabelMesh> {
        let labels = self.labels();
        let number = |label: u32| labels.binary_search(&label).ok();
        let mut of_label = vec![Vec::new(); labels.len()];
        let mut known = ([0; 2], [None; 2]);
        for (t, &sides) in self.sides.iter().enumerate() {
            if known.0 != sides {
                known = (sides, sides.map(number));
            }
            known.1.into_iter().flatten().for_each(|label| of_label[label].push(t as u32));
        }
        let groups: Vec<_> = labels.into_iter().zip(of_label).collect();
        par::map(&groups, |(label, triangles)| LabelMesh {
            label: *label,
            mesh: self.view(*label, triangles),
        })
    }

    /// The given triangles, with `label` behind them. Points are numbered in the order in which
    /// triangles name them.
    fn view(&self, label: u32, triangles: &[u32]) -> Mesh {
        let mut mesh = Mesh { unit: self.unit, ..Mesh::default() };
        mesh.triangles.reserve(triangles.len());
        let mut numbers: FxHashMap<u32, u32> = FxHashMap::default();
        let corners = |t: u32| {
            let [a, b, c] = self.triangles[t as usize];
            if self.sides[t as usize][0] == label { [a, b, c] } else { [b, a, c] }
        };
        let inner =
            |&t: &u32| Some(self.triangles[t as usize][2]).filter(|&c| c >= self.first_inner);
        for run in triangles.chunk_by(|s, t| inner(s).is_some() && inner(s) == inner(t)) {
            let mut number = |point: u32| {
                *numbers.entry(point).or_insert_with(|| {
                    mesh.points.push(self.points[point as usize]);
                    mesh.points.len() as u32 - 1
                })
            };
            if run.len() == 1 || inner(&run[0]).is_none() {
                mesh.triangles.extend(run.iter().map(|&t| corners(t).map(&mut number)));
                continue;
            }
            let mut fan: Vec<[u32; 3]> = run.iter().map(|&t| corners(t).map(&mut number)).collect();
            part_fans(&mut fan, &mut mesh.points);
            mesh.triangles.append(&mut fan);
        }
        mesh
    }
}

/// Gives every fan but the first round the last point of some triangles a copy of that point.
fn part_fans(triangles: &mut [[u32; 3]], points: &mut Vec<[f64; 3]>) {
    let mut seen = 0u32;
    let mut own = triangles[0][2];
    for start in 0..triangles.len() {
        if seen >> start & 1 == 1 {
            continue;
        }
        if start > 0 {
            points.push(points[own as usize]);
            own = points.len() as u32 - 1;
        }
        let mut at = start;
        while seen >> at & 1 == 0 {
            seen |= 1 << at;
            triangles[at][2] = own;
            let next = triangles.iter().position(|t| t[0] == triangles[at][1]);
            at = next.unwrap_or(start);
        }
    }
}

//! The interfaces between labels, stored once, and the closed surface of each label as a view.
//!
//! Source: specification of surfaces, D.4; the pair of labels beside each triangle is that of
//! vtkSurfaceNets3D.

use crate::LengthUnit;
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};

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
        self.view(label, &triangles, &mut vec![UNNAMED; self.points.len()])
    }

    /// The surfaces of all labels but 0, in order. The work is that of the triangles, however many
    /// labels there are.
    pub fn shells(&self, run: &Run) -> Result<Vec<LabelMesh>, Cancelled> {
        let labels = self.labels();
        let (starts, triangles) = self.by_label(&labels);
        // Labels with about half as many triangles as there are points share their numbers.
        let share = 1 + self.points.len() / 2;
        let numbered: Vec<usize> = (0..labels.len()).collect();
        let groups: Vec<_> =
            numbered.chunk_by(|&i, &j| starts[i] / share == starts[j] / share).collect();
        let parts = par::blocks(run, groups.len(), 1, |group| {
            let mut numbers = vec![UNNAMED; self.points.len()];
            let of_label = |&i: &usize| LabelMesh {
                label: labels[i],
                mesh: self.view(labels[i], &triangles[starts[i]..starts[i + 1]], &mut numbers),
            };
            groups[group].concat().iter().map(of_label).collect::<Vec<_>>()
        })?;
        Ok(parts.into_iter().flatten().collect())
    }

    /// The triangles of each label, one label after the other, and where they start.
    fn by_label(&self, labels: &[u32]) -> (Vec<usize>, Vec<u32>) {
        let mut known = ([0; 2], [None; 2]);
        let mut numbers = |sides: [u32; 2]| {
            if known.0 != sides {
                known = (sides, sides.map(|label| labels.binary_search(&label).ok()));
            }
            known.1.into_iter().flatten()
        };
        let mut starts = vec![0; labels.len() + 1];
        for &sides in &self.sides {
            numbers(sides).for_each(|label| starts[label + 1] += 1);
        }
        for label in 0..labels.len() {
            starts[label + 1] += starts[label];
        }
        let mut ends = starts.clone();
        let mut triangles = vec![0; starts[labels.len()]];
        for (t, &sides) in self.sides.iter().enumerate() {
            for label in numbers(sides) {
                triangles[ends[label]] = t as u32;
                ends[label] += 1;
            }
        }
        (starts, triangles)
    }

    /// The given triangles, with `label` behind them. Points are numbered in the order in which
    /// triangles name them; `numbers` is [`UNNAMED`] for every point, and is again afterwards.
    fn view(&self, label: u32, triangles: &[u32], numbers: &mut [u32]) -> Mesh {
        let mut named: Vec<u32> = Vec::with_capacity(triangles.len() / 2 + 2);
        let mut number = |point: u32, named: &mut Vec<u32>| {
            let number = &mut numbers[point as usize];
            if *number == UNNAMED {
                *number = named.len() as u32;
                named.push(point);
            }
            *number
        };
        let mut corners = |t: u32, named: &mut Vec<u32>| {
            let [a, b, c] = self.triangles[t as usize];
            let forth = self.sides[t as usize][0] == label;
            if forth { [a, b, c] } else { [b, a, c] }.map(|point| number(point, named))
        };
        let last = |t: u32| self.triangles[t as usize][2];
        let mut faces: Vec<[u32; 3]> = Vec::with_capacity(triangles.len());
        let mut at = 0;
        while let Some(&t) = triangles.get(at) {
            let first = faces.len();
            faces.push(corners(t, &mut named));
            at += 1;
            if last(t) >= self.first_inner {
                while let Some(&other) = triangles.get(at).filter(|&&u| last(u) == last(t)) {
                    faces.push(corners(other, &mut named));
                    at += 1;
                }
                part_fans(&mut faces[first..], &mut named);
            }
        }
        let points = named.iter().map(|&point| self.points[point as usize]).collect();
        named.iter().for_each(|&point| numbers[point as usize] = UNNAMED);
        Mesh { points, triangles: faces, unit: self.unit, ..Mesh::default() }
    }
}

/// The number of a point that no triangle has named yet.
const UNNAMED: u32 = u32::MAX;

/// Gives every fan but the first round the last point of some triangles a copy of that point.
fn part_fans(triangles: &mut [[u32; 3]], named: &mut Vec<u32>) {
    let mut seen = 0u32;
    let mut own = triangles[0][2];
    for start in 0..triangles.len() {
        if seen >> start & 1 == 1 {
            continue;
        }
        if start > 0 {
            named.push(named[own as usize]);
            own = named.len() as u32 - 1;
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

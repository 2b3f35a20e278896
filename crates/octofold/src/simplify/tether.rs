//! What holds the mesh to its input: both distances, proved at each step.
//!
//! *From the input.* Every triangle of the input is held by faces: each point of it lies within the
//! limit of one of those. Where faces change, the triangles that they hold are proved again, by
//! one new face or, cut in pieces, by several of them and of their neighbours; those hold them then.
//!
//! *From the mesh.* Each face knows a bound of its distance from the input. Where the changed
//! faces and what they were before are graphs over the same place, the largest difference in height
//! is added to the bound; where that passes the limit, the new faces are proved from the input
//! itself.

use super::clearance::Patch;
use super::complex::Complex;
use crate::measure::nearest::{Face, Nearest};
use crate::measure::within::Reach;
use crate::mesh::Mesh;
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// Share of the error that is left for rounding.
const MARGIN: f64 = 1e-6;

/// What coordinates, which are about 1, may be off by rounding.
const GRAIN: f64 = 1.0 / (1u64 << 38) as f64;

/// Shares of the limit at which faces are proved from the input, lowest first, so that there is
/// something left to add.
const STEPS: [f64; 3] = [0.5, 0.8, 1.0];

/// The input, and what holds it.
#[derive(Debug)]
pub struct Tether {
    corners: Vec<[DVec3; 3]>,
    index: Nearest,
    limit: f64,
    /// Triangles of the input that a face holds.
    held: Vec<Vec<u32>>,
    /// Bounds of the distances of faces from the input.
    away: Vec<f64>,
    /// Marks of triangles.
    seen: Vec<u32>,
    mark: u32,
    /// Who shall hold what, if the step is made.
    plan: Vec<(u32, u32)>,
    /// The bound for the new faces.
    bound: f64,
}

impl Tether {
    /// Ties a mesh to itself, as it is, within `error`.
    pub fn new(complex: &Complex, error: f64) -> Self {
        let mesh = Mesh {
            points: complex.at.iter().map(|p| p.to_array()).collect(),
            triangles: complex.faces.iter().map(|f| f.corners).collect(),
            ..Mesh::default()
        };
        let faces = mesh.triangles.len();
        Self {
            corners: (0..faces).map(|t| mesh.corners(t).map(DVec3::from)).collect(),
            index: Nearest::new(&mesh),
            limit: (error * (1.0 - MARGIN) - GRAIN).max(0.0),
            held: (0..faces as u32).map(|t| vec![t]).collect(),
            away: vec![0.0; faces],
            seen: vec![0; faces],
            mark: 0,
            plan: Vec::new(),
            bound: 0.0,
        }
    }

    /// Whether the limit outlives that the faces `old` are replaced by `new`, among faces `beside`;
    /// `rise` is the largest difference in height between them, where that is known.
    pub fn holds(
        &mut self,
        old: &[u32],
        new: &[(u32, Patch)],
        beside: &[(u32, Patch)],
        rise: Option<f64>,
        run: &Run,
    ) -> Result<bool, Cancelled> {
        Ok(self.holds_faces(old, new, rise, run)? && self.holds_input(old, new, beside, run)?)
    }

    /// Whether what `old` faces hold is near the new ones.
    fn holds_input(
        &mut self,
        old: &[u32],
        new: &[(u32, Patch)],
        beside: &[(u32, Patch)],
        run: &Run,
    ) -> Result<bool, Cancelled> {
        let Self { corners, held, seen, mark, plan, limit, .. } = self;
        plan.clear();
        if *mark == u32::MAX {
            seen.fill(0);
            *mark = 0;
        }
        *mark += 1;
        let face = |(_, patch): &(u32, Patch)| Face::new(patch.at.map(|p| p.to_array()));
        let mut faces: Vec<Face> = new.iter().map(face).collect();
        let squared = *limit * *limit;
        let mut waiting = Vec::new();
        let mut last = 0;
        for &t in old.iter().flat_map(|&f| &held[f as usize]) {
            if std::mem::replace(&mut seen[t as usize], *mark) == *mark {
                continue;
            }
            let near = |i: &usize| {
                corners[t as usize].iter().all(|&c| faces[*i].distance_squared(c) <= squared)
            };
            let first = (!new.is_empty()).then_some(last);
            match first.into_iter().chain(0..new.len()).find(near) {
                Some(i) => {
                    plan.push((new[i].0, t));
                    last = i;
                }
                None => waiting.push(t),
            }
        }
        if waiting.is_empty() {
            return Ok(true);
        }
        faces.extend(beside.iter().map(face));
        let name = |i: usize| if i < new.len() { new[i].0 } else { beside[i - new.len()].0 };
        let mut reach = Reach::new(&faces, *limit, GRAIN);
        for t in waiting {
            if !reach.holds(corners[t as usize], run)? {
                return Ok(false);
            }
            let mut met = reach.met().to_vec();
            met.sort_unstable();
            met.dedup();
            plan.extend(met.into_iter().map(|i| (name(i), t)));
        }
        Ok(true)
    }

    /// Whether the new faces are near the input.
    fn holds_faces(
        &mut self,
        old: &[u32],
        new: &[(u32, Patch)],
        rise: Option<f64>,
        run: &Run,
    ) -> Result<bool, Cancelled> {
        let first = new.first().map(|(_, patch)| patch.at[0].to_array());
        if first.is_some_and(|p| self.index.nearest_within(p, self.limit).is_none()) {
            return Ok(false);
        }
        let before = old.iter().map(|&f| self.away[f as usize]).fold(0.0, f64::max);
        if let Some(rise) = rise
            && before + rise + GRAIN <= self.limit
        {
            self.bound = before + rise + GRAIN;
            return Ok(true);
        }
        for share in STEPS {
            self.bound = share * self.limit;
            let mut reach = Reach::new(&self.index, self.bound, GRAIN);
            let mut all = true;
            for (_, patch) in new {
                all = all && reach.holds(patch.at, run)?;
            }
            if all {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Makes the step that was proved last.
    pub fn take(&mut self, old: impl Iterator<Item = u32>, new: impl Iterator<Item = u32>) {
        old.for_each(|f| self.held[f as usize].clear());
        for (face, t) in self.plan.drain(..) {
            let held = &mut self.held[face as usize];
            if !held.contains(&t) {
                held.push(t);
            }
        }
        new.for_each(|f| self.away[f as usize] = self.bound);
    }

    /// Follows new numbers of faces.
    pub fn renumber(&mut self, numbers: &[u32], count: usize) {
        for (old, &new) in numbers.iter().enumerate().filter(|(_, n)| **n != u32::MAX) {
            self.held.swap(old, new as usize);
            self.away[new as usize] = self.away[old];
        }
        self.held.truncate(count);
        self.away.truncate(count);
    }
}

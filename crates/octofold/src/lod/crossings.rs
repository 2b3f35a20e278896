//! Where a surface crosses the edges of the finest grid: each edge once, decided in integers.
//!
//! Vertices lie on odd sub-steps, so that none lies on a plane of the grid, and a line that meets an
//! edge of a triangle counts as moved a little, so that it crosses one of two triangles that share
//! the edge. All octants round an edge then see the same crossings: flags of neighbours never differ.
//! Source: specification of LOD, A.9 no. 1 and 2.

use crate::lattice::Lattice;
use crate::octree::key::morton;
use crate::par;
use crate::radix::{self, Equal, Tagged};
use crate::run::{Cancelled, Run};
use crate::scan::{self, Facet, Lines};
use crate::tint::Tint;
use crate::voxelize;
use glam::{DVec3, I64Vec3, Vec3, Vec4};

/// One crossing of an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// How far along the edge, 0 to 1.
    pub along: f32,
    /// Unit normal of the surface, in the grid.
    pub normal: Vec3,
}

/// An edge of the finest grid that is crossed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Edge {
    /// Morton code of its low end.
    pub low: u64,
    /// The axis that it runs along.
    pub axis: u8,
    /// Its low end is inside: the surface is left along it first.
    pub inside: bool,
    /// The first of its samples.
    pub first: u32,
}

/// All crossed edges in Morton order of their low ends.
#[derive(Debug, Default)]
pub(super) struct Crossings {
    pub edges: Vec<Edge>,
    /// Samples, those of an edge side by side.
    pub samples: Vec<Sample>,
    /// Linear light and alpha of each sample, where the surface has colours.
    pub colours: Option<Vec<Vec4>>,
}

impl Crossings {
    /// The samples of edge `i`, as a range.
    pub(super) fn of(&self, i: usize) -> std::ops::Range<usize> {
        let end = self.edges.get(i + 1).map_or(self.samples.len(), |next| next.first as usize);
        self.edges[i].first as usize..end
    }

    /// The crossings of a mesh whose triangles lie on the lattice as `facets`.
    pub(super) fn of_mesh(
        facets: &[Facet],
        tint: Option<&Tint<'_>>,
        lattice: &Lattice,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        run.stage("crossings");
        let sub_bits = lattice.sub_bits();
        let found = par::blocks(run, facets.len(), voxelize::block_of(facets.len()), |block| {
            let mut found = Vec::with_capacity(block.len());
            for t in block {
                for axis in 0..3 {
                    scan::crossings(&facets[t], sub_bits, axis, Lines::Corners, |c| {
                        let mut low = [0; 3];
                        low[axis] = c.step >> sub_bits;
                        low[(axis + 1) % 3] = c.row[0];
                        low[(axis + 2) % 3] = c.row[1];
                        let within = c.step & ((1 << sub_bits) - 1);
                        let tag = (t as u64) << 32 | u64::from(within << 1 | u32::from(c.leaving));
                        found.push(Tagged { key: morton(low) << 2 | axis as u64, tag });
                    });
                }
            }
            found
        })?;
        run.stage("edges");
        let size = f64::from(1u32 << sub_bits);
        let read = |record: Tagged| {
            let (triangle, rest) = ((record.tag >> 32) as u32, record.tag as u32);
            let along = (f64::from(rest >> 1) + 0.5) / size;
            let normal = normal(&facets[triangle as usize]).as_vec3();
            Read {
                leaving: rest & 1 == 1,
                sample: Sample { along: along as f32, normal },
                source: triangle,
            }
        };
        let colour = tint.map(|tint| {
            move |source: u32, at: DVec3| {
                let place = DVec3::from(lattice.origin()) + at * lattice.cell();
                tint.at(source, place)
            }
        });
        Ok(Self::sorted(found, read, colour))
    }

    /// Sorts records by edge, with what `read` tells of them.
    pub(super) fn sorted(
        found: Vec<Vec<Tagged>>,
        read: impl Fn(Tagged) -> Read + Sync + Send,
        colour: Option<impl Fn(u32, DVec3) -> Vec4 + Sync + Send>,
    ) -> Self {
        let shares = radix::sort(found, 0, Equal::Keep);
        let parts = par::map(&shares, |share| {
            let mut part = Self { colours: colour.as_ref().map(|_| Vec::new()), ..Self::default() };
            for group in share.chunk_by(|a, b| a.key == b.key) {
                let (low, axis) = (group[0].key >> 2, (group[0].key & 3) as u8);
                let first = part.samples.len() as u32;
                let mut edge = Edge { low, axis, inside: false, first };
                let mut nearest = f32::INFINITY;
                for &record in group {
                    let Read { leaving, sample, source } = read(record);
                    if sample.along < nearest {
                        (nearest, edge.inside) = (sample.along, leaving);
                    }
                    part.samples.push(sample);
                    if let (Some(colours), Some(colour)) = (&mut part.colours, &colour) {
                        colours.push(colour(source, edge.at(&sample)));
                    }
                }
                part.edges.push(edge);
            }
            part
        });
        let mut all = Self { colours: colour.as_ref().map(|_| Vec::new()), ..Self::default() };
        for part in parts {
            let before = all.samples.len() as u32;
            all.edges.extend(part.edges.iter().map(|e| Edge { first: e.first + before, ..*e }));
            all.samples.extend(part.samples);
            if let (Some(all), Some(part)) = (&mut all.colours, part.colours) {
                all.extend(part);
            }
        }
        all
    }
}

impl Crossings {
    /// Tells inside from outside by how often lines were crossed: whatever overlaps or faces the wrong
    /// way, all edges agree, as long as every line is crossed evenly. Parts that overlap an even number
    /// of times are outside.
    pub(super) fn judge_by_parity(&mut self) {
        let key = |(i, edge): (usize, &Edge)| {
            let low = crate::octree::key::unmorton(edge.low).map(u64::from);
            let axis = edge.axis as usize;
            let row = low[(axis + 1) % 3] << 16 | low[(axis + 2) % 3];
            let key = (edge.axis as u64) << 48 | row << 16 | low[axis];
            Tagged { key, tag: i as u64 }
        };
        let keys: Vec<Tagged> = self.edges.iter().enumerate().map(key).collect();
        let blocks = keys.chunks(1 << 16).map(<[_]>::to_vec).collect();
        let (mut row, mut inside) = (u64::MAX, false);
        for record in radix::sort(blocks, 0, Equal::Keep).into_iter().flatten() {
            if record.key >> 16 != row {
                (row, inside) = (record.key >> 16, false);
            }
            let i = record.tag as usize;
            self.edges[i].inside = inside;
            inside ^= self.of(i).len() % 2 == 1;
        }
    }
}

/// What a record tells.
pub(super) struct Read {
    /// The surface is left along the axis here.
    pub leaving: bool,
    pub sample: Sample,
    /// What the surface's colour is asked for by.
    pub source: u32,
}

impl Edge {
    /// Where a sample of the edge lies, in finest cells.
    pub(super) fn at(&self, sample: &Sample) -> DVec3 {
        let mut place = crate::octree::key::unmorton(self.low).map(f64::from);
        place[self.axis as usize] += f64::from(sample.along);
        DVec3::from(place)
    }
}

/// The unit normal of a triangle on the lattice.
fn normal(facet: &Facet) -> DVec3 {
    let [p, q, r] = facet.map(|p| I64Vec3::from(p.map(i64::from)));
    let (a, b) = ((q - p).as_dvec3(), (r - p).as_dvec3());
    a.cross(b).normalize_or(DVec3::Z)
}

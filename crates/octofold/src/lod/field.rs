//! Where the surface of a volume crosses the edges between its samples.
//!
//! The grid's points are the samples and a ring of outside samples round them: point (1, 1, 1) is the
//! first sample. An edge whose ends differ is crossed once, where the value is the iso value between
//! them; towards the ring halfway.

use super::LodError;
use super::crossings::{Crossings, Read, Sample};
use crate::octree::key::morton;
use crate::par;
use crate::radix::Tagged;
use crate::run::Run;
use crate::surface::{CubesOptions, Inside};
use crate::volume::{Block, Region, Volume, VolumeError};
use glam::{DVec3, Vec4};
use std::ops::Range;

/// Layers of one block of work.
const SLAB: usize = 16;

/// The crossings of the surface of `volume`.
pub(super) fn crossings(
    volume: &dyn Volume,
    options: &CubesOptions,
    run: &Run,
) -> Result<Crossings, LodError> {
    run.stage("crossings");
    let dims = volume.dims();
    let iso = if volume.is_binary() { 0.5 } else { options.iso };
    let slabs = par::blocks(run, dims[2], SLAB, |own| {
        let layers = own.start.saturating_sub(1)..(own.end + 2).min(dims[2]);
        let region = Region { start: [0, 0, layers.start], end: [dims[0], dims[1], layers.end] };
        let block = volume.read(region)?;
        let slab = Slab { block, dims, layers, iso, options };
        Ok(slab.crossings(own))
    })?;
    let slabs = slabs.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
    run.stage("edges");
    let mut found = Vec::new();
    let mut samples = Vec::new();
    for (mut records, own) in slabs {
        records.iter_mut().for_each(|r| r.tag += (samples.len() as u64) << 1);
        found.push(records);
        samples.extend(own);
    }
    let read = |record: Tagged| {
        let source = record.tag >> 1;
        Read {
            leaving: record.tag & 1 == 1,
            sample: samples[source as usize],
            source: source as u32,
        }
    };
    Ok(Crossings::sorted(found, read, None::<fn(u32, DVec3) -> Vec4>))
}

/// Layers of a volume.
struct Slab<'a> {
    block: Block<'a>,
    dims: [usize; 3],
    layers: Range<usize>,
    iso: f64,
    options: &'a CubesOptions,
}

impl Slab<'_> {
    fn value(&self, [x, y, z]: [usize; 3]) -> f64 {
        self.block.value(((z - self.layers.start) * self.dims[1] + y) * self.dims[0] + x)
    }

    fn inside(&self, value: f64) -> bool {
        match self.options.inside {
            Inside::Above => value >= self.iso,
            Inside::Below => value < self.iso,
        }
    }

    /// The way in which values change at a sample.
    fn gradient(&self, at: [usize; 3]) -> DVec3 {
        let along = |a: usize| {
            let [first, last] = match a {
                2 => [self.layers.start, self.layers.end - 1],
                _ => [0, self.dims[a] - 1],
            };
            let step = |to: usize| {
                let mut beside = at;
                beside[a] = to;
                beside
            };
            let [low, high] = [at[a].max(first + 1) - 1, (at[a] + 1).min(last)];
            if low == high {
                return 0.0;
            }
            (self.value(step(high)) - self.value(step(low))) / (high - low) as f64
        };
        DVec3::new(along(0), along(1), along(2))
    }

    /// The crossings of the edges that begin in layers `own`, and of those before the first sample of
    /// a row.
    fn crossings(&self, own: Range<usize>) -> (Vec<Tagged>, Vec<Sample>) {
        let (mut records, mut samples) = (Vec::new(), Vec::new());
        let mut push = |low: [usize; 3], axis: usize, leaving: bool, along: f64, normal: DVec3| {
            let low = low.map(|i| i as u32);
            let tag = (samples.len() as u64) << 1 | u64::from(leaving);
            records.push(Tagged { key: morton(low) << 2 | axis as u64, tag });
            samples.push(Sample { along: along as f32, normal: normal.as_vec3() });
        };
        let outward = if self.options.inside == Inside::Above { -1.0 } else { 1.0 };
        for z in own {
            for y in 0..self.dims[1] {
                for x in 0..self.dims[0] {
                    let at = [x, y, z];
                    let value = self.value(at);
                    let inside = self.inside(value);
                    for axis in 0..3 {
                        let along_axis = DVec3::AXES[axis];
                        let point = at.map(|i| i + 1);
                        if at[axis] == 0 && inside && !self.options.open {
                            let mut low = point;
                            low[axis] -= 1;
                            push(low, axis, false, 0.5, -along_axis);
                        }
                        if at[axis] + 1 == self.dims[axis] {
                            if inside && !self.options.open {
                                push(point, axis, true, 0.5, along_axis);
                            }
                            continue;
                        }
                        let mut next = at;
                        next[axis] += 1;
                        let beyond = self.value(next);
                        if self.inside(beyond) == inside {
                            continue;
                        }
                        let share = ((self.iso - value) / (beyond - value)).clamp(0.001, 0.999);
                        let share = if share.is_finite() { share } else { 0.5 };
                        let slope = self.gradient(at).lerp(self.gradient(next), share);
                        let way = along_axis * if inside { 1.0 } else { -1.0 };
                        let normal = (slope * outward).normalize_or(way);
                        // Where values are noise, the normal must still not point inside.
                        let normal = if normal.dot(way) > 0.0 { normal } else { way };
                        push(point, axis, inside, share, normal);
                    }
                }
            }
        }
        (records, samples)
    }
}

//! A solid whose surface voxels carry labels or colours.
//!
//! Values belong to nodes, so they cost what the surface costs; the inside has none. As a volume a
//! painted solid is its solid. Meshes of it take the values of the nodes that their faces are nearest to.
//! Source: specification (A6, "labels and colours").

use super::nearest::Nearest;
use super::numbered::Numbered;
use super::{Network, NetworkError};
use crate::mesh::Mesh;
use crate::par;
use crate::payload::{Kinds, Payload, Value};
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Block, Placement, Region, ScalarType, Volume, VolumeError};
use glam::DVec3;

/// Nodes, points or faces that one unit of work takes.
pub(super) const BLOCK: usize = 4096;

/// Why a solid is not painted.
#[derive(Debug, thiserror::Error)]
pub enum PaintError {
    /// It has no network.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The volume behind it could not be read.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

/// A solid and what its nodes carry.
#[derive(Debug, Clone, PartialEq)]
pub struct Painted {
    solid: Spans,
    network: Network,
    payload: Payload,
}

impl Painted {
    /// A solid with one value for each node; `None` where there are more or fewer.
    pub fn new(solid: Spans, payload: Payload, run: &Run) -> Result<Option<Self>, NetworkError> {
        let network = Network::new(&solid, run)?;
        let fits = network.count() == payload.values().len() as u64;
        Ok(fits.then_some(Self { solid, network, payload }))
    }

    /// A binary volume whose surface voxels carry something; `None` of any other.
    pub fn of(volume: &dyn Volume, run: &Run) -> Result<Option<Self>, PaintError> {
        let Some(payload) = volume.payload() else { return Ok(None) };
        let solid = Spans::at_least(volume, 0.5, run)?;
        Ok(Self::new(solid, payload.clone(), run)?)
    }

    /// A solid whose nodes get their values one by one, by places in order.
    pub(super) fn with(
        solid: Spans,
        kinds: Kinds,
        run: &Run,
        value: impl Fn(&Network, [u32; 3]) -> Value + Sync,
    ) -> Result<Self, NetworkError> {
        Self::found(solid, kinds, run, |network| {
            let nodes = network.nodes();
            let parts = par::blocks(run, nodes.len(), BLOCK, |range| {
                nodes[range].iter().map(|n| value(network, n.at())).collect::<Vec<_>>()
            })?;
            Ok(parts.concat())
        })
    }

    /// A solid with the values of its nodes, which `values` finds in order.
    pub(super) fn found<E: From<NetworkError>>(
        solid: Spans,
        kinds: Kinds,
        run: &Run,
        values: impl FnOnce(&Network) -> Result<Vec<Value>, E>,
    ) -> Result<Self, E> {
        let network = Network::new(&solid, run)?;
        run.stage("payload");
        let payload = Payload::new(kinds, values(&network)?);
        Ok(Self { solid, network, payload })
    }

    /// A solid of whose nodes nothing is known.
    pub fn plain(solid: Spans, run: &Run) -> Result<Self, NetworkError> {
        Self::with(solid, Kinds::default(), run, |_, _| Value::PLAIN)
    }

    /// The solid.
    pub fn solid(&self) -> &Spans {
        &self.solid
    }

    /// The solid alone.
    pub fn into_solid(self) -> Spans {
        self.solid
    }

    /// Its network.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// What its nodes carry.
    pub fn payload(&self) -> &Payload {
        &self.payload
    }

    /// The same solid placed anew.
    #[must_use]
    pub fn placed(mut self, placement: Placement) -> Self {
        self.solid.placement = placement;
        self.network.placement = placement;
        self
    }

    /// What nodes carry, by place.
    pub(super) fn values(&self) -> Values<'_> {
        Values { numbered: Numbered::new(&self.network), values: self.payload.values() }
    }

    /// What the node nearest to each of some places in voxels carries.
    pub(super) fn nearest(&self) -> NearestValues<'_> {
        let values = self.values();
        let nearest = Nearest::new(&values.numbered.nodes, sides(&self.solid.placement));
        NearestValues { values, nearest }
    }

    /// Colours the points of a mesh of this solid, and labels its faces, by the nodes nearest to them.
    pub fn dress(&self, mesh: &mut Mesh, run: &Run) -> Result<(), Cancelled> {
        let Some(to_voxels) = self.solid.placement.inverse() else { return Ok(()) };
        run.stage("payload");
        let nearest = self.nearest();
        let kinds = self.payload.kinds();
        if kinds.colours {
            let parts = par::blocks(run, mesh.points.len(), BLOCK, |range| {
                let points = mesh.points[range].iter();
                points.map(|&p| nearest.at(to_voxels.place(p)).colour).collect::<Vec<_>>()
            })?;
            mesh.attributes.point_colours = Some(parts.concat());
        }
        if kinds.labels {
            let parts = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
                let middle = |t: usize| {
                    let [a, b, c] = mesh.corners(t).map(DVec3::from);
                    ((a + b + c) / 3.0).to_array()
                };
                range.map(|t| nearest.at(to_voxels.place(middle(t))).label).collect::<Vec<_>>()
            })?;
            mesh.attributes.face_labels = Some(parts.concat());
        }
        Ok(())
    }
}

/// Lengths of a voxel's sides.
pub(super) fn sides(placement: &Placement) -> [f64; 3] {
    placement.axes.map(|axis| DVec3::from(axis).length())
}

/// What nodes carry, by place.
pub(super) struct Values<'a> {
    pub numbered: Numbered<'a>,
    values: &'a [Value],
}

impl Values<'_> {
    /// What the node at a place carries, where there is one.
    pub fn at(&self, at: [u32; 3]) -> Option<Value> {
        self.numbered.find(at).map(|n| self.values[n as usize])
    }
}

/// What the nodes nearest to places carry.
pub(super) struct NearestValues<'a> {
    values: Values<'a>,
    nearest: Nearest,
}

impl NearestValues<'_> {
    /// What the node nearest to a place in voxels carries.
    pub fn at(&self, at: [f64; 3]) -> Value {
        // A node whose own voxel holds the place, and not on its border, is nearer than all others.
        let whole = at.map(f64::round);
        let within = (0..3).all(|a| whole[a] >= 0.0 && (at[a] - whole[a]).abs() < 0.5);
        let own = if within { self.values.at(whole.map(|v| v as u32)) } else { None };
        own.unwrap_or_else(|| {
            let number = self.nearest.find(at);
            number.map_or(Value::PLAIN, |n| self.values.values[n as usize])
        })
    }
}

impl Volume for Painted {
    fn dims(&self) -> [usize; 3] {
        self.solid.dims()
    }

    fn placement(&self) -> Placement {
        self.solid.placement
    }

    fn scalar_type(&self) -> ScalarType {
        self.solid.scalar_type()
    }

    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError> {
        self.solid.read(region)
    }

    fn bounds(&self, region: Region) -> Option<[f64; 2]> {
        self.solid.bounds(region)
    }

    fn nonzero(&self) -> Option<u64> {
        self.solid.nonzero()
    }

    fn runs(&self, y: usize, z: usize) -> Option<&[[u32; 2]]> {
        self.solid.runs(y, z)
    }

    fn is_binary(&self) -> bool {
        true
    }

    fn payload(&self) -> Option<&Payload> {
        Some(&self.payload)
    }
}

#[cfg(test)]
mod tests;

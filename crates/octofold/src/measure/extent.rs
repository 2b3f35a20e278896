//! Area and volume, as sums in a fixed order.

use crate::exact;
use crate::mesh::{Mesh, bounds};
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec3;

const BLOCK: usize = 4096;

/// Sums over all triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Extent {
    /// Sum of the triangles' areas.
    pub area: f64,
    /// Signed volume, positive where triangles wind counter-clockwise seen from outside. It means
    /// something only where the surface is balanced (see `Topology::is_balanced`).
    pub volume: f64,
    /// Triangles whose corners lie exactly on one line.
    pub zero_area_triangles: usize,
}

impl Extent {
    /// Sums block by block, blocks in order. Volumes are taken from the middle of the box, where
    /// the least is lost to rounding.
    pub fn of(mesh: &Mesh, run: &Run) -> Result<Self, Cancelled> {
        let [low, high] = bounds(&mesh.points).unwrap_or_default().map(DVec3::from);
        let middle = low.midpoint(high);
        let parts = par::blocks(run, mesh.triangles.len(), BLOCK, |range| {
            range.fold(Self::default(), |sum, t| {
                let corners = mesh.corners(t);
                let [a, b, c] = corners.map(|p| DVec3::from(p) - middle);
                Self {
                    area: sum.area + (b - a).cross(c - a).length() / 2.0,
                    volume: sum.volume + a.dot(b.cross(c)) / 6.0,
                    zero_area_triangles: sum.zero_area_triangles
                        + usize::from(exact::is_flat(corners)),
                }
            })
        })?;
        Ok(parts.iter().fold(Self::default(), |sum, part| Self {
            area: sum.area + part.area,
            volume: sum.volume + part.volume,
            zero_area_triangles: sum.zero_area_triangles + part.zero_area_triangles,
        }))
    }
}

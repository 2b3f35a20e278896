//! What adds up along the tree: all that an octant must know of the surface inside.

use super::crossings::Sample;
use super::edges::HALVES;
use super::spread::Spread;
use super::tree::Crossed;
use crate::quadric::Quadric;
use glam::{DVec3, Vec4};

/// Sums over the crossings, vertices and borders in an octant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sum {
    quadric: Quadric,
    crossings: DVec3,
    crossing_count: f64,
    normals: DVec3,
    corners: DVec3,
    corner_count: f64,
    colours: Vec4,
    colour_count: f32,
    spread: Spread,
    any: u16,
    odd: u16,
    /// Edges whose low end is inside.
    inside: u16,
    border: bool,
}

impl Sum {
    /// Of nothing.
    pub(super) const NOTHING: Self = Self {
        quadric: Quadric::NOTHING,
        crossings: DVec3::ZERO,
        crossing_count: 0.0,
        normals: DVec3::ZERO,
        corners: DVec3::ZERO,
        corner_count: 0.0,
        colours: Vec4::ZERO,
        colour_count: 0.0,
        spread: Spread::NONE,
        any: 0,
        odd: 0,
        inside: 0,
        border: false,
    };

    /// Adds an edge of the octant that is crossed so often.
    pub(super) fn edge(&mut self, edge: usize, crossings: usize, inside: bool) {
        self.any |= 1 << edge;
        self.odd |= ((crossings & 1) as u16) << edge;
        self.inside |= u16::from(inside) << edge;
    }

    /// Adds a crossing of one of its edges.
    pub(super) fn crossing(&mut self, sample: &Sample, at: DVec3, colour: Option<Vec4>) {
        let normal = sample.normal.as_dvec3();
        self.quadric += Quadric::plane(normal, at, 1.0);
        self.crossings += at;
        self.crossing_count += 1.0;
        self.normals += normal;
        self.spread.add(&Spread::one(normal));
        if let Some(colour) = colour {
            self.colours += colour;
            self.colour_count += 1.0;
        }
    }

    /// Adds a vertex of the surface inside.
    pub(super) fn corner(&mut self, at: DVec3) {
        self.corners += at;
        self.corner_count += 1.0;
    }

    /// Notes that a border of the surface runs through.
    pub(super) fn border(&mut self) {
        self.border = true;
    }

    /// Adds child `octant`.
    pub(super) fn child(&mut self, octant: u32, child: &Self) {
        self.quadric += child.quadric;
        self.crossings += child.crossings;
        self.crossing_count += child.crossing_count;
        self.normals += child.normals;
        self.corners += child.corners;
        self.corner_count += child.corner_count;
        self.colours += child.colours;
        self.colour_count += child.colour_count;
        self.spread.add(&child.spread);
        self.border |= child.border;
        if child.any == 0 {
            return;
        }
        // Children come in order: the half at the low end before the other.
        let halves = HALVES[octant as usize];
        self.inside |= child.inside & halves & !self.any;
        self.any |= child.any & halves;
        self.odd ^= child.odd & halves;
    }

    /// How the surface crosses the octant's edges.
    pub(super) fn crossed(&self) -> Crossed {
        Crossed { any: self.any, odd: self.odd, negative: self.odd & !self.inside }
    }

    /// The paper's vertex, cases (a) to (d) of section 3.2: the mean of the surface's vertices inside,
    /// else of its crossings.
    pub(super) fn mean(&self) -> Option<DVec3> {
        if self.corner_count > 0.0 {
            return Some(self.corners / self.corner_count);
        }
        (self.crossing_count > 0.0).then(|| self.crossings / self.crossing_count)
    }

    /// The point of least squared distances to the planes of all crossings, in the octant from `low`
    /// to `high`.
    pub(super) fn lowest(&self, low: DVec3, high: DVec3) -> Option<DVec3> {
        /// Pulls towards the mean, the weakest that keeps the point inside is taken.
        const PULLS: [f64; 3] = [0.02, 0.1, 0.5];
        let home = self.mean_crossing()?;
        let inside = |p: &DVec3| p.cmpge(low).all() && p.cmple(high).all();
        let lowest = PULLS.iter().filter_map(|&pull| self.quadric.lowest(home, pull)).find(inside);
        Some(lowest.unwrap_or(home))
    }

    fn mean_crossing(&self) -> Option<DVec3> {
        (self.crossing_count > 0.0)
            .then(|| self.crossings / self.crossing_count)
            .or_else(|| self.mean())
    }

    /// The mean normal; where normals cancel out, one of them.
    pub(super) fn normal(&self) -> DVec3 {
        if self.normals.length() < 0.1 * self.crossing_count || self.crossing_count == 0.0 {
            return self.spread.any();
        }
        self.normals.normalize_or(DVec3::Z)
    }

    /// The mean colour in linear light.
    pub(super) fn colour(&self) -> Option<Vec4> {
        (self.colour_count > 0.0).then(|| self.colours / self.colour_count)
    }

    /// How flat the surface is, by formula 1.
    pub(super) fn flatness(&self) -> f64 {
        self.spread.flatness()
    }

    /// Whether a border runs through.
    pub(super) fn is_border(&self) -> bool {
        self.border
    }
}

//! A cut: octants of any levels, one on every way from the root to a leaf.

use super::LodError;
use super::tree::Lod;
use crate::run::Run;
use glam::DVec3;
use std::ops::Range;

/// Which octants are taken: on each way down, the first that this holds for, else the leaf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// All octants of one level.
    Level(u32),
    /// The surface is no further than this from the patches, in the world's unit.
    Tolerance(f64),
    /// The surface is no further from the patches than so many pixels, as seen by an eye.
    Pixels(Eye),
    /// As published in 2003, section 2.2: `S > S_t` with `S` of formula 1 and `S_t` of formula 2.
    Wakatsuki {
        /// Where the eye is, in the world.
        eye: [f64; 3],
        /// The length on the screen that an edge of a flat octant should have, as a share of the
        /// distance of eye and screen: `x_s / d_s`.
        share: f64,
    },
}

/// A perspective view; the direction does not matter.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Eye {
    /// Where it is, in the world.
    pub position: [f64; 3],
    /// Angle from the lower to the upper border of the picture, in radians.
    pub fov: f64,
    /// Pixels from the lower to the upper border.
    pub height: f64,
    /// The largest error, in pixels.
    pub pixels: f64,
}

/// An octant on the way of a walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Octant {
    /// Its node in the model.
    pub node: u32,
    /// Its level.
    pub level: u32,
    /// Its low corner in finest cells.
    pub corner: [u32; 3],
    /// Its side in finest cells.
    pub size: u32,
}

/// Stands for no octant.
pub(super) const NONE: u32 = u32::MAX;

/// An octant of a cut's tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Entry {
    /// Its node in the model.
    pub node: u32,
    /// The first child in the cut's tree; [`NONE`] where it is in the cut itself.
    pub first: u32,
    /// The parent in the cut's tree; the root's is itself.
    pub parent: u32,
    /// Low corner in finest cells.
    pub corner: [u16; 3],
    /// Children that there are, where it is not in the cut itself.
    pub mask: u8,
}

/// A cut with all octants above it, breadth-first as in the model: the octants that it is made of are
/// the leaves of this smaller tree.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Cut {
    pub(super) entries: Vec<Entry>,
    /// First entry of each level, and one past the last.
    pub(super) starts: Vec<u32>,
    levels: u32,
}

impl Cut {
    /// The cut that a criterion chooses.
    ///
    /// # Errors
    /// Where the work is interrupted.
    pub fn select(lod: &Lod, criterion: &Criterion, run: &Run) -> Result<Self, LodError> {
        run.stage("select");
        run.check()?;
        let mut cut = Self::default();
        cut.reselect(lod, criterion);
        Ok(cut)
    }

    /// The same as [`Self::select`], in the memory of another cut.
    pub fn reselect(&mut self, lod: &Lod, criterion: &Criterion) {
        match *criterion {
            Criterion::Level(level) => self.walk(lod, |o| o.level >= level),
            Criterion::Tolerance(most) => {
                let cells = most / lod.stretch();
                self.walk(lod, |o| lod.error(o.node) <= cells);
            }
            Criterion::Pixels(eye) => {
                let view = View::new(lod, &eye);
                self.walk(lod, |o| view.takes(lod.error(o.node), o));
            }
            Criterion::Wakatsuki { eye, share } => {
                let eye = in_cells(lod, eye);
                let root = f64::from(1u32 << lod.levels());
                self.walk(lod, |o| {
                    let distance = (middle(o) - eye).length();
                    let wanted = (root / (share * distance)).log2();
                    lod.flatness(o.node) * f64::from(o.level) > wanted
                });
            }
        }
    }

    /// The cut of the first octants on each way down that `take` accepts, asked breadth-first.
    pub fn by(lod: &Lod, take: impl FnMut(&Octant) -> bool) -> Self {
        let mut cut = Self::default();
        cut.walk(lod, take);
        cut
    }

    /// The cut of the least tolerance that has no more than `octants` octants; the root alone where
    /// there is none.
    pub fn of_at_most(lod: &Lod, octants: usize) -> Self {
        let errors = &lod.parts().errors;
        let of = |step: u8| Self::by(lod, |o| errors[o.node as usize] <= step);
        let (mut low, mut high) = (0, 255);
        while low < high {
            let middle = low + (high - low) / 2;
            if of(middle).len() <= octants { high = middle } else { low = middle + 1 }
        }
        of(low)
    }

    #[inline]
    fn walk(&mut self, lod: &Lod, mut take: impl FnMut(&Octant) -> bool) {
        let nodes = lod.nodes();
        self.levels = lod.levels();
        let entries = &mut self.entries;
        entries.clear();
        self.starts.clear();
        entries.push(Entry { node: 0, first: NONE, parent: 0, corner: [0; 3], mask: 0 });
        let (mut start, mut level) = (0, 0);
        while start < entries.len() {
            let end = entries.len();
            self.starts.push(start as u32);
            let size = 1u32 << (self.levels - level);
            let half = (size / 2) as u16;
            for i in start..end {
                let Entry { node, corner, .. } = entries[i];
                let own = nodes[node as usize];
                let mut mask = own.children();
                let corner32 = corner.map(u32::from);
                if mask == 0 || take(&Octant { node, level, corner: corner32, size }) {
                    continue;
                }
                entries[i].first = entries.len() as u32;
                entries[i].mask = mask;
                let mut child = own.first_child();
                while mask != 0 {
                    let octant = mask.trailing_zeros() as u16;
                    mask &= mask - 1;
                    let corner = [
                        corner[0] + (octant & 1) * half,
                        corner[1] + (octant >> 1 & 1) * half,
                        corner[2] + (octant >> 2) * half,
                    ];
                    let parent = i as u32;
                    entries.push(Entry { node: child, first: NONE, parent, corner, mask: 0 });
                    child += 1;
                }
            }
            start = end;
            level += 1;
        }
        self.starts.push(entries.len() as u32);
    }

    /// Octants that it is made of.
    pub fn len(&self) -> usize {
        self.entries.iter().filter(|e| e.first == NONE).count()
    }

    /// True for a cut that was never chosen.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Places in the cut's tree: octants that it is made of and those above, level by level.
    pub fn places(&self) -> Range<u32> {
        0..self.entries.len() as u32
    }

    /// Whether the octant at a place is one of those that the cut is made of.
    pub fn is_front(&self, place: u32) -> bool {
        self.entries[place as usize].first == NONE
    }

    /// The octant at a place.
    pub fn octant(&self, place: u32) -> Octant {
        let Entry { node, corner, .. } = self.entries[place as usize];
        let level = self.level_of(place);
        Octant { node, level, corner: corner.map(u32::from), size: 1 << (self.levels - level) }
    }

    /// The place of the octant one level up; the root's is its own.
    pub fn parent(&self, place: u32) -> u32 {
        self.entries[place as usize].parent
    }

    /// Octants that it is made of, by level.
    pub fn census(&self) -> Vec<u64> {
        let levels = self.starts.windows(2);
        let count = |w: &[u32]| {
            let level = &self.entries[w[0] as usize..w[1] as usize];
            level.iter().filter(|e| e.first == NONE).count() as u64
        };
        levels.map(count).collect()
    }

    pub(super) fn level_of(&self, place: u32) -> u32 {
        self.starts.partition_point(|&start| start <= place) as u32 - 1
    }
}

/// How much further patches between octants of different levels may be from the surface than those of
/// either level: more than was ever found (`cargo xtask sweep lod-views`).
const MIXED: f64 = 1.4;

/// A view in finest cells, ready for many octants.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub eye: DVec3,
    /// An error may be so large a share of the distance to it.
    share: f64,
}

impl View {
    pub(super) fn new(lod: &Lod, eye: &Eye) -> Self {
        let slope = (eye.fov / 2.0).tan();
        // A pixel in the corner of a square picture is a smaller angle than one in the middle.
        let pixel = 2.0 * slope / eye.height / (1.0 + 2.0 * slope * slope);
        // Lengths grow by at most the stretch on the way to the world; distances by the shortest.
        let share = eye.pixels / MIXED * pixel * shortest(lod) / lod.stretch();
        Self { eye: in_cells(lod, eye.position), share }
    }

    /// How far the eye may go before the choice of an octant may turn.
    pub(super) fn wait(&self, error: f64, octant: &Octant) -> f64 {
        let radius = f64::from(octant.size) * (3f64.sqrt() / 2.0);
        let distance = (middle(octant) - self.eye).length();
        (distance - (error / self.share + error + radius)).abs()
    }

    /// How many times as large an error looks as it may; of what is not taken more than once.
    pub(super) fn excess(&self, error: f64, octant: &Octant) -> f64 {
        let radius = f64::from(octant.size) * (3f64.sqrt() / 2.0);
        let distance = (middle(octant) - self.eye).length() - radius - error;
        if distance > 0.0 { error / (self.share * distance) } else { f64::INFINITY }
    }

    #[inline]
    pub(super) fn takes(&self, error: f64, octant: &Octant) -> bool {
        // Balls round octants hold those of their children, so that what is taken never depends on
        // what is further down.
        let radius = f64::from(octant.size) * (3f64.sqrt() / 2.0);
        let distance = (middle(octant) - self.eye).length() - radius - error;
        error <= self.share * distance
    }
}

/// The least length in the world of a step of one finest cell, or a little less.
fn shortest(lod: &Lod) -> f64 {
    let linear = glam::DMat3::from_cols_array_2d(&lod.frame().axes);
    let stretch = super::tree::stretch(linear.inverse());
    if stretch.is_finite() && stretch > 0.0 { 1.0 / stretch } else { 0.0 }
}

#[inline]
fn middle(octant: &Octant) -> DVec3 {
    DVec3::from(octant.corner.map(f64::from)) + f64::from(octant.size) / 2.0
}

/// A place in the world, in finest cells.
fn in_cells(lod: &Lod, place: [f64; 3]) -> DVec3 {
    let inverse = lod.frame().inverse();
    inverse.map_or(DVec3::ZERO, |inverse| DVec3::from(inverse.place(place)))
}

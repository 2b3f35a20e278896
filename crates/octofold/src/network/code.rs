//! Solids as bytes: the boundary of a solid, coded voxel by voxel in the context of those before it.
//!
//! Nearly every voxel is what the voxels around it say, and is not coded at all; what is coded are
//! voxels at the surface, about three for each surface voxel, with a chance that comes from a model.
//! [`Mode::Fast`] counts one context, [`Mode::Archive`] mixes many. A solid is one stream, from slice
//! to slice and readable so ([`Writer`], [`Reader`]), or [`bricks`] for access at any place. Nothing is
//! lost, and every platform gets the same bytes. Source: specification (D3.3, D3.4, D3.7).

pub mod bricks;
mod direct;
mod mixture;
mod neighbourhood;
pub mod payload;
mod prior;
mod regression;
#[cfg(test)]
mod tests;
mod walk;

use crate::range::{Coder, Decoder, Encoder};
use crate::rows::Rows;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Volume};
use direct::Direct;
use mixture::Mixture;
use neighbourhood::Slice;
use walk::Walk;

/// Slices that are read or written at a time.
pub const SLAB: usize = 64;

/// The most runs of voxels that a solid may be read into.
pub const MOST_RUNS: u64 = 1 << 28;

/// How chances are found: how fast and how small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// One context, counted.
    #[default]
    Fast,
    /// Eight contexts and a regression, mixed: about half the bytes in ten times the time.
    Archive,
}

/// Why bytes are no solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CodeError {
    /// There is more to tell than bytes to tell it.
    #[error("the stream ends before the solid does")]
    CutOff,
    /// The stream tells of more than was promised.
    #[error("the stream holds more than {0} runs of voxels")]
    TooMany(u64),
    /// The stream says something that cannot be.
    #[error("the stream is damaged")]
    Damaged,
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A model of either mode.
#[derive(Debug)]
enum Chances {
    Fast(Box<Direct>),
    Archive(Box<Mixture>),
}

impl Chances {
    fn new(mode: Mode) -> Self {
        match mode {
            Mode::Fast => Self::Fast(Box::new(Direct::large())),
            Mode::Archive => Self::Archive(Box::default()),
        }
    }

    /// Codes a slice.
    fn slice<'w, 's>(
        &mut self,
        walk: &'w mut Walk,
        coder: &mut impl Coder,
        source: impl FnMut(u32) -> &'s [[u32; 2]],
    ) -> Option<&'w Slice> {
        match self {
            Self::Fast(model) => walk.slice(&mut **model, coder, source),
            Self::Archive(model) => walk.slice(&mut **model, coder, source),
        }
    }
}

/// Codes a solid, slab after slab.
#[derive(Debug)]
pub struct Writer {
    walk: Walk,
    chances: Chances,
    coder: Encoder,
    runs: u64,
}

impl Writer {
    /// Before the first slice of `width` by `height` voxels.
    pub fn new([width, height]: [usize; 2], mode: Mode) -> Self {
        Self {
            walk: Walk::new(width as u32, height as u32),
            chances: Chances::new(mode),
            coder: Encoder::default(),
            runs: 0,
        }
    }

    /// Adds the next slices.
    pub fn push(&mut self, slab: &Spans, run: &Run) -> Result<(), Cancelled> {
        let depth = slab.dims()[2];
        for z in 0..depth {
            run.check()?;
            run.progress(z as u64, depth as u64);
            let source = |y| slab.row(y as usize, z);
            if let Some(slice) = self.chances.slice(&mut self.walk, &mut self.coder, source) {
                self.runs += slice.runs().len() as u64;
            }
        }
        Ok(())
    }

    /// The bytes, and how many runs they hold.
    pub fn finish(self) -> (Vec<u8>, u64) {
        (self.coder.finish(), self.runs)
    }
}

/// Reads a solid, slab after slab.
#[derive(Debug)]
pub struct Reader<'a> {
    size: [usize; 2],
    walk: Walk,
    chances: Chances,
    coder: Decoder<'a>,
    most: u64,
    left: u64,
}

impl<'a> Reader<'a> {
    /// Before the first slice of `width` by `height` voxels; a stream of more than `most` runs is
    /// refused.
    pub fn new(size: [usize; 2], mode: Mode, bytes: &'a [u8], most: u64) -> Self {
        let [width, height] = size.map(|n| n as u32);
        Self {
            size,
            walk: Walk::new(width, height).with_most(most),
            chances: Chances::new(mode),
            coder: Decoder::new(bytes),
            most,
            left: most,
        }
    }

    /// The next slices, as a solid of that depth.
    pub fn pull(&mut self, slices: usize, run: &Run) -> Result<Spans, CodeError> {
        let [width, height] = self.size;
        let mut rows = Rows::default();
        for z in 0..slices {
            run.check()?;
            run.progress(z as u64, slices as u64);
            let slice = self.chances.slice(&mut self.walk, &mut self.coder, |_| &[]);
            if self.coder.is_overrun() {
                return Err(CodeError::CutOff);
            }
            let slice = slice.ok_or(CodeError::TooMany(self.most))?;
            let count = slice.runs().len() as u64;
            self.left = self.left.checked_sub(count).ok_or(CodeError::TooMany(self.most))?;
            slice.append_to(&mut rows);
            rows.end_slice();
        }
        Ok(Spans::from_rows([width, height, slices], Placement::default(), [rows]))
    }
}

//! Solids as bytes.

pub mod range;
mod counted;
mod direct;
mod logistic;
mod mixture;
mod neighbourhood;
mod walk;

use crate::rows::Rows;
use crate::run::{Cancelled, Run};
use crate::spans::Spans;
use crate::volume::{Placement, Volume};
use direct::Direct;
use mixture::Mixture;
use range::{Decoder, Encoder};
use walk::{Model, Walk};

pub fn encode(solid: &Spans, archive: bool, run: &Run) -> Result<Vec<u8>, Cancelled> {
    if archive { enc::<Mixture>(solid, Default::default(), run) } else { enc::<Direct>(solid, Default::default(), run) }
}
pub fn decode(dims: [usize; 3], bytes: &[u8], archive: bool, run: &Run) -> Result<Spans, Cancelled> {
    if archive { dec::<Mixture>(dims, bytes, Default::default(), run) } else { dec::<Direct>(dims, bytes, Default::default(), run) }
}
/// Codes a solid.
fn enc<M: Model>(solid: &Spans, mut model: M, run: &Run) -> Result<Vec<u8>, Cancelled> {
    let [width, height, depth] = solid.dims();
    let mut walk = Walk::new(width as u32, height as u32);
    let mut coder = Encoder::default();
    for z in 0..depth {
        run.check()?;
        walk.slice(&mut model, &mut coder, |y| solid.row(y as usize, z), |_| true);
    }
    Ok(coder.finish())
}

/// The solid of bytes.
fn dec<M: Model>(dims: [usize; 3], bytes: &[u8], mut model: M, run: &Run) -> Result<Spans, Cancelled> {
    let [width, height, depth] = dims;
    let mut walk = Walk::new(width as u32, height as u32);
    let mut coder = Decoder::new(bytes);
    let mut rows = Rows::default();
    for _ in 0..depth {
        run.check()?;
        let slice = walk.slice(&mut model, &mut coder, |_| &[], |_| true);
        for y in 0..height {
            rows.extend(slice.row(y as i64));
            rows.end_row(y as u32);
        }
        rows.end_slice();
    }
    Ok(Spans::from_rows(dims, Placement::default(), [rows]))
}

//! Volumes as a stream: every writer takes its samples from here, a slab of z at a time.

use crate::WriteError;
use octofold::volume::{Block, Region};
use octofold::{Run, Volume};
use std::borrow::Cow;
use std::io::Write;
use std::path::PathBuf;

/// Bytes of one slab, unless a single slice of z is larger.
const SLAB: usize = 4 << 20;

/// The slabs of a volume, from the lowest z to the highest.
pub(crate) fn slabs(volume: &dyn Volume) -> impl Iterator<Item = Region> {
    let dims @ [nx, ny, nz] = volume.dims();
    let slice = (nx * ny * volume.scalar_type().size()).max(1);
    let thickness = (SLAB / slice).max(1);
    (0..nz)
        .step_by(thickness)
        .map(move |z| Region { start: [0, 0, z], end: [dims[0], dims[1], (z + thickness).min(nz)] })
}

/// Writes all samples little-endian, x fastest.
pub(crate) fn write_samples(
    volume: &dyn Volume,
    out: &mut dyn Write,
    run: &Run,
) -> Result<(), WriteError> {
    let depth = volume.dims()[2] as u64;
    for slab in slabs(volume) {
        run.check()?;
        run.progress(slab.start[2] as u64, depth);
        let block = volume.read(slab)?;
        out.write_all(&little_endian(&block)).map_err(lost)?;
    }
    Ok(())
}

/// An error of the system, whose path the front door fills in.
pub(crate) fn lost(source: std::io::Error) -> WriteError {
    WriteError::Io { path: PathBuf::new(), source }
}

fn little_endian<'a>(block: &'a Block<'_>) -> Cow<'a, [u8]> {
    let bytes: &[u8] = octofold::with_samples!(block, samples => bytemuck::cast_slice(samples));
    let size = bytes.len() / block.len().max(1);
    if size > 1 && cfg!(target_endian = "big") {
        let mut swapped = bytes.to_vec();
        swapped.chunks_exact_mut(size).for_each(<[u8]>::reverse);
        return swapped.into();
    }
    bytes.into()
}

/// Tells that a format holds the samples alone, where the placement says more than that.
pub(crate) fn tell_of_lost_placement(format: &'static str, volume: &dyn Volume, run: &Run) {
    if volume.placement() != octofold::Placement::default() {
        let text = format!("{format} holds no placement: its samples will lie 1 apart");
        run.finding(octofold::Finding::warning("placement-lost", text));
    }
}

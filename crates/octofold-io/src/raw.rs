//! Bare samples: dimensions and type come from the user.

use crate::mapped::{Layout, MappedVolume, Stored};
use crate::{At, ReadError, Sink, Source, WriteError, slabs};
use octofold::{Finding, Run, Volume, volume::ScalarType};

const FORMAT: &str = "raw";

/// What a raw file does not say itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawLayout {
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Type of the samples.
    pub scalar: ScalarType,
    /// Bytes to skip at the start.
    pub offset: u64,
    /// Samples are big-endian.
    pub big_endian: bool,
}

/// Reads a volume straight from the file. Too few bytes are an error, too many a finding.
pub fn read(source: &Source, layout: RawLayout, run: &Run) -> Result<Box<dyn Volume>, ReadError> {
    let RawLayout { dims, scalar, offset, big_endian } = layout;
    let packed = usize::try_from(offset)
        .ok()
        .and_then(|offset| Layout::packed(Stored::Scalar(scalar), big_endian, offset, dims));
    let Some(packed) = packed else {
        let [x, y, z] = dims;
        let fact = format!("{x} x {y} x {z} samples are more than this machine can address");
        return Err(ReadError::malformed(FORMAT, At::File, fact));
    };
    let volume = MappedVolume::new(FORMAT, source.bytes.clone(), packed, run)?;
    let rest = source.bytes.len() - packed.end().unwrap_or(0);
    if rest > 0 {
        let text = format!("{rest} bytes follow the samples: are the dimensions and type right?");
        run.finding(Finding::warning("trailing-data", text).of(rest as u64));
    }
    Ok(Box::new(volume))
}

/// Writes the samples alone, little-endian, x fastest.
pub fn write(volume: &dyn Volume, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    slabs::tell_of_lost_placement(FORMAT, volume, run);
    slabs::write_samples(volume, sink.out, run)
}

#[cfg(test)]
mod tests {
    use super::*;
    use octofold::volume::{Block, Region};

    fn layout(dims: [usize; 3]) -> RawLayout {
        RawLayout { dims, scalar: ScalarType::U16, offset: 2, big_endian: true }
    }

    #[test]
    fn reads_what_the_layout_says() {
        let source = Source::from_bytes("x.raw", [9, 9, 0, 1, 0, 2, 1, 0]);
        let volume = read(&source, layout([3, 1, 1]), &Run::default()).unwrap();
        let all = Region::all([3, 1, 1]);
        assert_eq!(volume.read(all).unwrap(), Block::U16(vec![1, 2, 256].into()));
    }

    #[test]
    fn too_short_is_an_error() {
        let source = Source::from_bytes("x.raw", [0; 9]);
        let error = read(&source, layout([2, 2, 1]), &Run::default()).err().unwrap();
        assert!(error.to_string().contains("end at byte 10, but there are 9"), "{error}");
        assert!(read(&source, layout([usize::MAX; 3]), &Run::default()).is_err());
        assert!(read(&source, layout([0, 1, 1]), &Run::default()).is_err());
    }
}

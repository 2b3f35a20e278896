//! How often each value occurs in a volume, counted over streamed blocks.
//!
//! Samples are read a slab at a time; what stays of a slab is one table of counts, folded at the end.
//! Counts are whole numbers, so the result is the same for any number of threads.

use crate::par;
use crate::run::Run;
use crate::volume::{Region, Scalar, ScalarType, Volume, VolumeError};
use crate::with_samples;

/// Bins of a histogram whose values do not each get their own.
const BINS: usize = 4096;
/// The widest range of whole numbers in which each gets its own bin.
const EXACT_BINS: f64 = 65536.0;
/// Samples that are read at once, roughly.
const SLAB: usize = 1 << 22;

/// Counts of the finite values of a volume, in bins of equal width.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Lowest and highest finite value; `None` where there is none.
    pub range: Option<[f64; 2]>,
    /// Samples that are NaN or infinite.
    pub not_finite: u64,
    /// Samples in each bin, from the lowest value up.
    pub counts: Vec<u64>,
    /// Each bin stands for one whole number.
    pub exact: bool,
}

impl Histogram {
    /// Reads the whole volume twice: once for its range, once to count.
    pub fn of(volume: &dyn Volume, run: &Run) -> Result<Self, VolumeError> {
        run.stage("value range");
        let parts = slabs(volume, run, extent)?;
        let mut not_finite = 0;
        let mut range: Option<[f64; 2]> = None;
        for (part, odd) in parts {
            not_finite += odd;
            range = match (range, part) {
                (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
                (a, b) => a.or(b),
            };
        }
        let Some([low, high]) = range else {
            return Ok(Self { range, not_finite, counts: Vec::new(), exact: true });
        };
        let whole = volume.scalar_type().is_integer();
        let exact = whole && high - low < EXACT_BINS;
        let bins = if exact { (high - low) as usize + 1 } else { BINS };
        let scale = if exact { 1.0 } else { per_unit(bins, low, high) };
        run.stage("histogram");
        let mut counts = vec![0; bins];
        for part in slabs(volume, run, |s| tally(s, low, scale, bins))? {
            for (sum, n) in counts.iter_mut().zip(part) {
                *sum += n;
            }
        }
        Ok(Self { range, not_finite, counts, exact })
    }

    /// Distinct values and how often each occurs, where every bin stands for one whole number.
    pub fn values(&self) -> Option<Vec<(i64, u64)>> {
        let [low, _] = self.range?;
        let used = self.counts.iter().enumerate().filter(|&(_, &n)| n > 0);
        self.exact.then(|| used.map(|(i, &n)| (low as i64 + i as i64, n)).collect())
    }
}

/// Bins per unit of value; 0 where all values are the same.
fn per_unit(bins: usize, low: f64, high: f64) -> f64 {
    if high > low { bins as f64 / (high - low) } else { 0.0 }
}

/// Runs `work` over slabs of whole slices and returns the results in order.
fn slabs<T: Send>(
    volume: &dyn Volume,
    run: &Run,
    work: impl Fn(&crate::volume::Block<'_>) -> T + Sync,
) -> Result<Vec<T>, VolumeError> {
    let [nx, ny, nz] = volume.dims();
    let thick = (SLAB / (nx * ny).max(1)).max(1);
    par::blocks(run, nz, thick, |z| {
        let region = Region { start: [0, 0, z.start], end: [nx, ny, z.end] };
        volume.read(region).map(|block| work(&block))
    })?
    .into_iter()
    .collect()
}

/// Lowest and highest finite value, and how many are not finite.
fn extent(block: &crate::volume::Block<'_>) -> (Option<[f64; 2]>, u64) {
    fn typed<T: Scalar>(samples: &[T]) -> (Option<[f64; 2]>, u64) {
        let finite = |s: &T| !matches!(T::TYPE, ScalarType::F32 | ScalarType::F64) || is_finite(*s);
        let mut odd = 0;
        let mut range: Option<[T; 2]> = None;
        for s in samples {
            if !finite(s) {
                odd += 1;
                continue;
            }
            range = Some(match range {
                None => [*s, *s],
                Some([a, b]) => [if *s < a { *s } else { a }, if *s > b { *s } else { b }],
            });
        }
        (range.map(|r| r.map(Scalar::to_f64)), odd)
    }
    with_samples!(block, s => typed(s))
}

fn tally(block: &crate::volume::Block<'_>, low: f64, scale: f64, bins: usize) -> Vec<u64> {
    fn typed<T: Scalar>(samples: &[T], low: f64, scale: f64, bins: usize) -> Vec<u64> {
        let mut counts = vec![0; bins];
        for s in samples.iter().filter(|s| is_finite(**s)) {
            let bin = ((s.to_f64() - low) * scale) as usize;
            counts[bin.min(bins - 1)] += 1;
        }
        counts
    }
    with_samples!(block, s => typed(s, low, scale, bins))
}

fn is_finite<T: Scalar>(sample: T) -> bool {
    sample.to_f64().is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{DenseVolume, Placement};

    fn volume<T: Scalar>(samples: Vec<T>) -> DenseVolume<T> {
        DenseVolume::new([samples.len(), 1, 1], samples, Placement::default()).unwrap()
    }

    #[test]
    fn whole_numbers_each_get_a_bin() {
        let h = Histogram::of(&volume(vec![-2i16, 3, 3, 0]), &Run::default()).unwrap();
        assert_eq!(h.range, Some([-2.0, 3.0]));
        assert_eq!(h.values(), Some(vec![(-2, 1), (0, 1), (3, 2)]));
    }

    #[test]
    fn nan_and_infinity_are_counted_apart() {
        let samples = vec![f32::NAN, 1.0, f32::INFINITY, 5.0];
        let h = Histogram::of(&volume(samples), &Run::default()).unwrap();
        assert_eq!((h.range, h.not_finite), (Some([1.0, 5.0]), 2));
        assert_eq!(h.counts.iter().sum::<u64>(), 2);
        assert_eq!(h.values(), None);
    }

    #[test]
    fn no_samples_no_range() {
        let h = Histogram::of(&volume(Vec::<u8>::new()), &Run::default()).unwrap();
        assert_eq!(h.range, None);
        let h = Histogram::of(&volume(vec![f64::NAN]), &Run::default()).unwrap();
        assert_eq!((h.range, h.not_finite), (None, 1));
    }
}

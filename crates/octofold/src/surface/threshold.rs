//! The value at which a gray volume falls into two classes (Otsu 1979).
//!
//! The threshold that maximises the variance between the two classes. Where a whole range of
//! thresholds does so equally well (no sample lies between), the middle of that range is taken.

use crate::histogram::Histogram;

/// Otsu's threshold; `None` where all values are the same or there is none.
///
/// For whole numbers the threshold lies between two of them, never on one.
pub fn otsu(histogram: &Histogram) -> Option<f64> {
    let [low, high] = histogram.range?;
    let counts = &histogram.counts;
    let total: u64 = counts.iter().sum();
    let moment: f64 = counts.iter().enumerate().map(|(i, &n)| i as f64 * n as f64).sum();
    let (mut below, mut moment_below) = (0u64, 0.0);
    let mut best: Option<(f64, usize, usize)> = None;
    for (i, &n) in counts.iter().enumerate() {
        below += n;
        moment_below += i as f64 * n as f64;
        let above = total - below;
        if below == 0 || above == 0 {
            continue;
        }
        let (b, a) = (below as f64, above as f64);
        let apart = (moment - moment_below) / a - moment_below / b;
        let variance = a * b * apart * apart;
        match &mut best {
            Some((v, _, last)) if n == 0 && *last + 1 == i && variance == *v => *last = i,
            Some((v, ..)) if variance <= *v => {}
            _ => best = Some((variance, i, i)),
        }
    }
    let (_, first, last) = best?;
    let cut = (first + last) as f64 / 2.0;
    Some(if histogram.exact {
        low + cut.floor() + 0.5
    } else {
        low + (cut + 1.0) * (high - low) / counts.len() as f64
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use crate::volume::{DenseVolume, Placement, Scalar};

    fn of<T: Scalar>(samples: Vec<T>) -> Option<f64> {
        let dims = [samples.len(), 1, 1];
        let volume = DenseVolume::new(dims, samples, Placement::default()).unwrap();
        otsu(&Histogram::of(&volume, &Run::default()).unwrap())
    }

    #[test]
    fn two_values_are_cut_midway() {
        assert_eq!(of(vec![0u8, 255, 255, 0, 0]), Some(127.5));
        assert_eq!(of(vec![0u8, 1]), Some(0.5));
        let iso = of(vec![-1.0f32, 1.0, 1.0]).unwrap();
        assert!(iso.abs() < 0.01, "{iso}");
    }

    #[test]
    fn two_humps_are_cut_between() {
        let samples: Vec<u16> = (0..400u16).map(|i| 100 + i % 7 + 1000 * (i % 2)).collect();
        let iso = of(samples).unwrap();
        assert!((106.0..1100.0).contains(&iso), "{iso}");
    }

    #[test]
    fn one_value_has_no_threshold() {
        assert_eq!(of(vec![7u8, 7]), None);
        assert_eq!(of(vec![0.5f64; 9]), None);
        assert_eq!(of(Vec::<f32>::new()), None);
    }
}

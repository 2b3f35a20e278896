//! A polygon into triangles between its own points, by the share of gray along chords (section
//! 3.3).
//!
//! Every two points that are not neighbours are joined by a chord that is sampled once a voxel;
//! `Gr` is the share of its samples that lie in gray voxels, its ends left out (G18, G19). The
//! polygon is cut at the chord of greatest `Gr`, the longer of equal ones, and so are its parts.
//! There is no threshold (G21), chords within a face are not forbidden (G22), and nothing keeps
//! triangles from folding (G23): so it was published.

use super::Voxel;
use super::polyline::Point;
use crate::surface::digital::DigitalSurface;
use std::cmp::Ordering;

/// How well a chord follows the surface.
#[derive(Debug, Clone, Copy)]
struct Gray {
    gray: u64,
    samples: u64,
    /// Squared length.
    length: u64,
}

/// The triangles of a polygon by places in it; `None` where a part has no chord with gray between
/// its ends.
pub fn split(ring: &[Point], surface: &DigitalSurface) -> Option<Vec<[u32; 3]>> {
    let points = ring.len();
    let mut chords = vec![Gray { gray: 0, samples: 1, length: 0 }; points * points];
    if points > 3 {
        for i in 0..points {
            for j in i + 1..points {
                chords[i * points + j] = Gray::along(ring[i].voxel, ring[j].voxel, surface);
            }
        }
    }
    let chord = |i: u32, j: u32| chords[i.min(j) as usize * points + i.max(j) as usize];
    let mut triangles = Vec::new();
    let mut parts: Vec<Vec<u32>> = vec![(0..points as u32).collect()];
    while let Some(part) = parts.pop() {
        if let &[a, b, c] = part.as_slice() {
            triangles.push([a, b, c]);
            continue;
        }
        let last = part.len() - 1;
        let mut best: Option<(Gray, usize, usize)> = None;
        for i in 0..part.len() {
            for j in (i + 2..part.len()).filter(|&j| (i, j) != (0, last)) {
                let gray = chord(part[i], part[j]);
                if best.is_none_or(|(b, ..)| gray.compare(&b) == Ordering::Greater) {
                    best = Some((gray, i, j));
                }
            }
        }
        let (gray, i, j) = best?;
        if gray.gray == 0 {
            return None;
        }
        parts.push(part[i..=j].to_vec());
        parts.push(part[j..].iter().chain(&part[..=i]).copied().collect());
    }
    Some(triangles)
}

/// Triangles from the first point of a polygon to all of its sides.
pub fn fan(points: usize) -> Vec<[u32; 3]> {
    (2..points as u32).map(|i| [0, i - 1, i]).collect()
}

impl Gray {
    fn along(from: Voxel, to: Voxel, surface: &DigitalSurface) -> Self {
        let along: [i64; 3] = std::array::from_fn(|a| i64::from(to[a]) - i64::from(from[a]));
        let length = along.iter().map(|d| (d * d) as u64).sum();
        let steps = along.iter().map(|d| d.abs()).max().unwrap_or(0);
        match steps {
            0 => return Self { gray: 0, samples: 1, length },
            // Neighbours have nothing between them that could be white.
            1 => return Self { gray: 1, samples: 1, length },
            _ => {}
        }
        let sample = |k: i64| -> Voxel {
            // Rounded to the nearest voxel, half up.
            std::array::from_fn(|a| {
                let up = (2 * k * along[a] + steps).div_euclid(2 * steps);
                (i64::from(from[a]) + up) as u32
            })
        };
        let gray = (1..steps).filter(|&k| surface.is_mixed(sample(k))).count() as u64;
        Self { gray, samples: steps as u64 - 1, length }
    }

    fn compare(&self, other: &Self) -> Ordering {
        let share = (self.gray * other.samples).cmp(&(other.gray * self.samples));
        share.then(self.length.cmp(&other.length))
    }
}

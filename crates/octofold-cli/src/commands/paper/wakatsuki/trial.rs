//! One cut, drawn by patches and by marching cubes: how long that takes, and how good it is.

use anyhow::Result;
use octofold::lod::{
    Cubes, Cut, Diagonal, Drawn, Gaps, Lod, Marching, Mode, Patchwork, Seams, drawn,
};
use octofold::measure::Nearest;
use octofold::{Mesh, Run};
use serde::Serialize;
use std::time::Instant;

/// Timings are repeated, and the least taken, until they took so many seconds in all.
const TIMED_SECONDS: f64 = 0.1;
const LEAST_TIMED: usize = 5;
/// The original's distance is looked for so far along its normals, in the paper's unit.
const REACH: f64 = 12.0;
/// Steps of the histogram of patch areas, as in Fig. 13.
const AREA_STEP: f64 = 0.1;
const AREA_STEPS: usize = 200;

/// How a cut becomes a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Multi-scale patches.
    Patches,
    /// Marching cubes with stitched cracks.
    Stitched,
    /// Marching cubes with filled cracks.
    Filled,
    /// Marching cubes with open cracks.
    Open,
}

impl Method {
    pub const ALL: [Self; 4] = [Self::Patches, Self::Stitched, Self::Filled, Self::Open];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Patches => "MP",
            Self::Stitched => "CS",
            Self::Filled => "MC filled",
            Self::Open => "MC open",
        }
    }

    fn seams(self) -> Option<Seams> {
        match self {
            Self::Patches => None,
            Self::Stitched => Some(Seams::Stitched),
            Self::Filled => Some(Seams::Filled),
            Self::Open => Some(Seams::Open),
        }
    }
}

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Spread {
    pub mean: f64,
    pub deviation: f64,
    pub max: f64,
}

impl Spread {
    fn of(values: &[f64]) -> Self {
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
        let max = values.iter().copied().fold(0.0, f64::max);
        Self { mean, deviation: (squares / count).sqrt(), max }
    }
}

/// What one method made of one cut; lengths in the paper's unit.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    pub method: Method,
    pub patches: usize,
    pub triangles: usize,
    /// For making patches of a cut that was chosen.
    pub milliseconds: f64,
    /// Distance of the original along its normals, at its vertices and the middles of its triangles.
    pub error: Spread,
    /// The share of these that found nothing within reach.
    pub missed: f64,
    pub area: Spread,
    /// Patches by area, in steps of a tenth.
    pub areas: Vec<u32>,
    /// Octants that marching cubes leave out at the border of an open surface.
    pub undecided: u64,
    /// What stays open between octants.
    pub gaps: Option<Gaps>,
}

/// Where the original is looked at.
pub struct Probes {
    places: Vec<([f64; 3], [f64; 3])>,
    unit: f64,
}

impl Probes {
    /// Those of the paper: vertices and middles, with their normals.
    pub fn of(mesh: &Mesh, unit: f64) -> Self {
        let mut normals = vec![[0.0; 3]; mesh.points.len()];
        let mut places = Vec::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(t);
            let way = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
            let normal = cross(way(b), way(c));
            for &p in triangle {
                let sum = &mut normals[p as usize];
                *sum = std::array::from_fn(|x| sum[x] + normal[x]);
            }
            let middle = std::array::from_fn(|x| (a[x] + b[x] + c[x]) / 3.0);
            places.push((middle, normal));
        }
        places.extend(mesh.points.iter().copied().zip(normals));
        let scaled = |(place, normal): ([f64; 3], [f64; 3])| {
            let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            (length > 0.0).then(|| (place, normal.map(|x| x / length * unit)))
        };
        Self { places: places.into_iter().filter_map(scaled).collect(), unit }
    }

    /// How far a mesh is from them along the normals, and the share that found nothing.
    fn measure(&self, mesh: &Mesh) -> (Spread, f64) {
        let nearest = Nearest::new(mesh);
        let far = |&(place, normal): &([f64; 3], [f64; 3])| nearest.crossing(place, normal, REACH);
        let found = octofold::par::map(&self.places, far);
        let values: Vec<f64> = found.iter().flatten().map(|at| at.abs()).collect();
        let missed = 1.0 - values.len() as f64 / found.len().max(1) as f64;
        (Spread::of(&values), missed)
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|x| {
        let (y, z) = ((x + 1) % 3, (x + 2) % 3);
        a[y] * b[z] - a[z] * b[y]
    })
}

/// A cut as a mesh.
pub struct Made {
    pub mesh: Mesh,
    /// The first triangle of each patch.
    pub firsts: Vec<u32>,
    /// Octants that were left out.
    pub undecided: u64,
    /// What stays open between octants.
    pub gaps: Option<Gaps>,
}

/// A model and what is measured on it.
pub struct Bench<'a> {
    pub lod: &'a Lod,
    pub cubes: &'a Cubes,
    pub probes: &'a Probes,
    pub run: &'a Run,
}

impl Bench<'_> {
    /// Draws a cut by one method and measures the result.
    pub fn trial(&self, cut: &Cut, method: Method) -> Result<Trial> {
        let Made { mesh, firsts, undecided, gaps } = self.made(cut, method)?;
        let (error, missed) = self.probes.measure(&mesh);
        let areas = areas(&mesh, &firsts, self.probes.unit);
        let mut histogram = vec![0; AREA_STEPS];
        for area in areas.iter().filter(|a| **a < AREA_STEP * AREA_STEPS as f64) {
            histogram[(area / AREA_STEP) as usize] += 1;
        }
        Ok(Trial {
            method,
            patches: firsts.len(),
            triangles: mesh.triangles.len(),
            milliseconds: self.milliseconds(cut, method),
            error,
            missed,
            area: Spread::of(&areas),
            areas: histogram,
            undecided,
            gaps,
        })
    }

    /// The mesh of a cut by one method.
    pub fn made(&self, cut: &Cut, method: Method) -> Result<Made> {
        if let Some(seams) = method.seams() {
            let mut marching = Marching::new(self.lod, self.cubes);
            let marched = marching.make(cut, seams);
            let (firsts, undecided) = (marched.patches.clone(), marched.undecided);
            let gaps = (seams != Seams::Filled).then(|| marching.gaps(cut));
            return Ok(Made { mesh: marching.mesh(), firsts, undecided, gaps });
        }
        let mut patchwork = Patchwork::default();
        let patches = patchwork.make(self.lod, cut, Mode::Any);
        let mut next = 0;
        let mut firsts = Vec::with_capacity(patches.len());
        for patch in patches {
            firsts.push(next);
            next += patch.corners().count() as u32 - 2;
        }
        let Drawn { mesh, .. } =
            drawn(self.lod, cut, patches, Mode::Any, Diagonal::Flatter, self.run)?;
        Ok(Made { mesh, firsts, undecided: 0, gaps: None })
    }

    /// The least time for the patches of a cut, in memory that is used again and on one thread.
    pub fn milliseconds(&self, cut: &Cut, method: Method) -> f64 {
        match method.seams() {
            None => {
                let mut patchwork = Patchwork::default();
                least(|| patchwork.make(self.lod, cut, Mode::Any).len())
            }
            Some(seams) => {
                let mut marching = Marching::new(self.lod, self.cubes);
                least(|| marching.make(cut, seams).triangles.len())
            }
        }
    }
}

/// The least milliseconds of many runs; the first, which asks the system for memory, does not count.
pub fn least(mut work: impl FnMut() -> usize) -> f64 {
    std::hint::black_box(work());
    let (mut best, mut spent, mut times) = (f64::INFINITY, 0.0, 0);
    while spent < TIMED_SECONDS || times < LEAST_TIMED {
        let begin = Instant::now();
        std::hint::black_box(work());
        let took = begin.elapsed().as_secs_f64();
        (best, spent, times) = (best.min(took), spent + took, times + 1);
    }
    best * 1e3
}

/// The areas of patches in squares of the unit.
fn areas(mesh: &Mesh, firsts: &[u32], unit: f64) -> Vec<f64> {
    let ends = firsts.iter().skip(1).copied().chain([mesh.triangles.len() as u32]);
    let of = |t: u32| {
        let [a, b, c] = mesh.corners(t as usize);
        let way = |p: [f64; 3]| std::array::from_fn(|x| p[x] - a[x]);
        let normal = cross(way(b), way(c));
        normal.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0 / (unit * unit)
    };
    firsts.iter().zip(ends).map(|(&first, end)| (first..end).map(of).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use octofold::lod::{BuildOptions, build_with_cubes};
    use octofold::samples::Sample;

    #[test]
    fn a_fine_model_is_near_and_patches_have_its_area() {
        let mesh = Sample::Torus.polygons(60).map(|s| s.triangulate()).unwrap();
        let run = Run::default();
        let options = BuildOptions { level: 6, ..BuildOptions::default() };
        let (lod, cubes) = build_with_cubes(&mesh, &options, &run).unwrap();
        let probes = Probes::of(&mesh, lod.stretch());
        let bench = Bench { lod: &lod, cubes: &cubes, probes: &probes, run: &run };
        let cut = Cut::by(&lod, |o| o.level >= 6);
        let unit = lod.stretch();
        let whole: f64 =
            areas(&mesh, &(0..mesh.triangles.len() as u32).collect::<Vec<_>>(), unit).iter().sum();
        for method in Method::ALL {
            let trial = bench.trial(&cut, method).unwrap();
            assert!(trial.error.mean < 0.1 && trial.missed < 0.01, "{method:?}: {trial:?}");
            let area = trial.area.mean * trial.patches as f64;
            assert!((area / whole - 1.0).abs() < 0.02, "{method:?}: {area} {whole}");
            assert!(trial.areas.iter().map(|&n| n as usize).sum::<usize>() <= trial.patches);
        }
    }

    #[test]
    fn spreads_are_means_and_deviations() {
        let spread = Spread::of(&[1.0, 3.0]);
        assert_eq!((spread.mean, spread.deviation, spread.max), (2.0, 1.0, 3.0));
        assert_eq!(Spread::of(&[]), Spread::default());
    }
}

//! How far two meshes are from each other.
//!
//! Distances are measured from all points that triangles use (each position once) and from samples
//! spread evenly over the area to the exact nearest point of the other mesh. Samples are equal
//! steps along the running sum of areas, placed within their triangle by a sequence of low
//! discrepancy (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018): there
//! is no seed, and they are the same for any number of threads.

use super::extent::Extent;
use super::nearest::Nearest;
use super::topology::Topology;
use super::weld::weld_points;
use crate::attributes::LengthUnit;
use crate::mesh::Mesh;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec3;
use serde::Serialize;

const BLOCK: usize = 1024;

/// Distances from one mesh to another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distances {
    /// The largest.
    pub max: f64,
    /// Their mean.
    pub mean: f64,
    /// The root of the mean of their squares.
    pub rms: f64,
    /// Where the largest was found.
    #[serde(skip)]
    pub farthest: [f64; 3],
}

/// Two meshes side by side, in the unit of the first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// From the first mesh to the second; `None` where one of them has no triangles.
    pub a_to_b: Option<Distances>,
    /// From the second mesh to the first.
    pub b_to_a: Option<Distances>,
    /// The larger of the two largest distances.
    pub hausdorff: Option<f64>,
    /// Diagonal of the second mesh's box, to judge distances by.
    pub diagonal: Option<f64>,
    /// Volume of the first mesh, where its surface bounds one.
    pub volume_a: Option<f64>,
    /// Volume of the second mesh.
    pub volume_b: Option<f64>,
    /// Area of the first mesh.
    pub area_a: f64,
    /// Area of the second mesh.
    pub area_b: f64,
    /// Triangles of the first mesh.
    pub triangles_a: usize,
    /// Triangles of the second mesh.
    pub triangles_b: usize,
}

/// Compares `a` and `b` by all their points and `samples` more places on each.
///
/// Where both have a unit, and not the same, `b` is converted to the unit of `a`.
pub fn compare(a: &Mesh, b: &Mesh, samples: usize, run: &Run) -> Result<Comparison, Cancelled> {
    let a = Side::new(a, 1.0, run)?;
    let b = Side::new(b, LengthUnit::scale(b.unit, a.mesh.unit), run)?;
    let (a_to_b, b_to_a) = if a.mesh.triangles.is_empty() || b.mesh.triangles.is_empty() {
        (None, None)
    } else {
        run.stage("distances from a to b");
        let forth = a.distances_to(&Nearest::new(&b.mesh), samples, run)?;
        run.stage("distances from b to a");
        (forth, b.distances_to(&Nearest::new(&a.mesh), samples, run)?)
    };
    Ok(Comparison {
        a_to_b,
        b_to_a,
        hausdorff: a_to_b.zip(b_to_a).map(|(a, b)| a.max.max(b.max)),
        diagonal: b.mesh.bounds().map(|[low, high]| DVec3::from(low).distance(high.into())),
        volume_a: a.volume,
        volume_b: b.volume,
        area_a: a.extent.area,
        area_b: b.extent.area,
        triangles_a: a.mesh.triangles.len(),
        triangles_b: b.mesh.triangles.len(),
    })
}

/// One of the meshes: welded, scaled, and without columns.
struct Side {
    mesh: Mesh,
    extent: Extent,
    volume: Option<f64>,
}

impl Side {
    fn new(mesh: &Mesh, scale: f64, run: &Run) -> Result<Self, Cancelled> {
        let welding = weld_points(&mesh.points, run)?;
        let mesh = Mesh {
            points: par::map(&welding.points, |p| p.map(|x| x * scale)),
            triangles: par::map(&mesh.triangles, |t| t.map(|p| welding.of[p as usize])),
            unit: mesh.unit,
            ..Mesh::default()
        };
        let extent = Extent::of(&mesh, run)?;
        let topology = Topology::of(mesh.points.len(), &mesh.triangles, run)?;
        let volume = topology.is_balanced().then_some(extent.volume);
        Ok(Self { mesh, extent, volume })
    }

    fn distances_to(
        &self,
        other: &Nearest,
        samples: usize,
        run: &Run,
    ) -> Result<Option<Distances>, Cancelled> {
        let used = self.used_points();
        let samples = Samples::new(&self.mesh, samples);
        let parts = par::blocks(run, used.len() + samples.count, BLOCK, |range| {
            let mut sum = Sum::default();
            for i in range {
                let p = match used.get(i) {
                    Some(&p) => self.mesh.points[p as usize],
                    None => samples.place(i - used.len()),
                };
                if let Some(hit) = other.nearest(p) {
                    sum.add(p, hit.distance_squared);
                }
            }
            sum
        })?;
        Ok(parts.into_iter().fold(Sum::default(), Sum::plus).distances())
    }

    fn used_points(&self) -> Vec<u32> {
        let mut used = vec![false; self.mesh.points.len()];
        self.mesh.triangles.iter().flatten().for_each(|&p| used[p as usize] = true);
        (0..used.len() as u32).filter(|&p| used[p as usize]).collect()
    }
}

#[derive(Clone, Copy, Default)]
struct Sum {
    count: usize,
    distances: f64,
    squares: f64,
    largest_squared: f64,
    farthest: [f64; 3],
}

impl Sum {
    fn add(&mut self, at: [f64; 3], squared: f64) {
        if self.count == 0 || squared > self.largest_squared {
            (self.largest_squared, self.farthest) = (squared, at);
        }
        self.count += 1;
        self.distances += squared.sqrt();
        self.squares += squared;
    }

    fn plus(mut self, other: Self) -> Self {
        if self.count == 0 || other.largest_squared > self.largest_squared {
            (self.largest_squared, self.farthest) = (other.largest_squared, other.farthest);
        }
        self.count += other.count;
        self.distances += other.distances;
        self.squares += other.squares;
        self
    }

    fn distances(self) -> Option<Distances> {
        let count = self.count as f64;
        (self.count > 0).then(|| Distances {
            max: self.largest_squared.sqrt(),
            mean: self.distances / count,
            rms: (self.squares / count).sqrt(),
            farthest: self.farthest,
        })
    }
}

/// Places spread evenly over the area of a mesh.
struct Samples<'a> {
    mesh: &'a Mesh,
    /// Area of all triangles up to and with each one.
    running: Vec<f64>,
    /// None where there is no area.
    count: usize,
}

impl<'a> Samples<'a> {
    fn new(mesh: &'a Mesh, count: usize) -> Self {
        let mut running: Vec<f64> = par::map(&mesh.triangles, |t| {
            let [a, b, c] = t.map(|p| DVec3::from(mesh.points[p as usize]));
            (b - a).cross(c - a).length() / 2.0
        });
        let mut sum = 0.0;
        for area in &mut running {
            sum += *area;
            *area = sum;
        }
        Self { mesh, running, count: if sum > 0.0 { count } else { 0 } }
    }

    fn place(&self, i: usize) -> [f64; 3] {
        let total = self.running.last().copied().unwrap_or(0.0);
        let along = total * ((i as f64 + 0.5) / self.count as f64);
        let t = self.running.partition_point(|&sum| sum < along).min(self.running.len() - 1);
        let [a, b, c] = self.mesh.corners(t).map(DVec3::from);
        let [u, v] = quasirandom(i as u64);
        // The half of the square beyond the diagonal is folded back onto the triangle.
        let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
        (a + (b - a) * u + (c - a) * v).to_array()
    }
}

/// Point `i` of Roberts' two-dimensional sequence in the unit square.
fn quasirandom(i: u64) -> [f64; 2] {
    // One over the plastic number and over its square, as odd fractions of 2^64.
    const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];
    STEPS.map(|step| (step.wrapping_mul(i + 1) >> 11) as f64 / (1u64 << 53) as f64)
}

//! A scan-like soup: a noisy pebble with planted defects, and the list of what was planted.
//!
//! Defects lie apart, so that each is found again by counting edges: none touches the faces
//! around another.

use crate::random::Random;
use crate::soup::{Soup, SoupBuilder};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// What to plant. Every number is a wish: where no room is left, fewer are planted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ScanPlan {
    /// Where all chance comes from.
    pub seed: u64,
    /// Faces around the pebble.
    pub resolution: usize,
    /// Places without faces, one or two rings of faces wide.
    pub holes: usize,
    /// Single faces turned over.
    pub flipped: usize,
    /// Single faces that stand there twice.
    pub duplicates: usize,
    /// Edges with a further point on one side only.
    pub t_junctions: usize,
    /// Small closed shells inside.
    pub inner_parts: usize,
    /// Patches scanned a second time, tilted, so that they cross the surface.
    pub overlaps: usize,
}

impl Default for ScanPlan {
    fn default() -> Self {
        Self {
            seed: 1,
            resolution: 128,
            holes: 6,
            flipped: 12,
            duplicates: 8,
            t_junctions: 10,
            inner_parts: 3,
            overlaps: 4,
        }
    }
}

/// What was planted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ScanCensus {
    /// Holes.
    pub holes: usize,
    /// Faces taken out for them.
    pub removed_faces: usize,
    /// Faces turned over.
    pub flipped_faces: usize,
    /// Faces that stand there a second time.
    pub duplicate_faces: usize,
    /// Edges split on one side only.
    pub t_junctions: usize,
    /// Closed shells inside.
    pub inner_parts: usize,
    /// Faces of those shells.
    pub inner_faces: usize,
    /// Open patches that cross the surface.
    pub overlaps: usize,
    /// Faces of those patches.
    pub overlap_faces: usize,
    /// Edges with one face: around holes and patches, and three at every T-junction.
    pub boundary_edges: usize,
}

/// Smallest number of faces around: the shape is a cube of 4 x 4 squares a side.
const COARSEST: usize = 16;
/// Largest: the points of the cube's surface then fit 32-bit indices with room to spare.
const FINEST: usize = 1 << 14;
/// Middle radius of the pebble; its relief stays within 0.1 of it.
const RADIUS: f64 = 0.36;
const INNER_RADIUS: f64 = 0.03;
/// Tries to find a free place before giving up.
const TRIES: usize = 2000;

impl ScanPlan {
    /// The soup and what is wrong with it.
    pub fn plant(&self) -> (Soup, ScanCensus) {
        let mut random = Random::new(self.seed);
        let mut scan = Scan::pebble(self.resolution.clamp(COARSEST, FINEST), &mut random);
        let mut census = ScanCensus::default();
        for nth in 0..self.holes {
            scan.hole(1 + nth % 2, &mut random, &mut census);
        }
        for _ in 0..self.overlaps {
            scan.overlap(&mut random, &mut census);
        }
        for _ in 0..self.flipped {
            scan.flip(&mut random, &mut census);
        }
        for _ in 0..self.duplicates {
            scan.duplicate(&mut random, &mut census);
        }
        for _ in 0..self.t_junctions {
            scan.t_junction(&mut random, &mut census);
        }
        scan.inner_parts(self.inner_parts, &mut random, &mut census);
        (scan.soup(), census)
    }
}

/// Closed surface of a cube cut into n x n squares a side, each into two triangles, as integer
/// points of the cube from 0 to n and triangles that face outwards.
fn cube_surface(n: usize) -> (Vec<[usize; 3]>, Vec<[u32; 3]>) {
    let mut points = Vec::new();
    let mut known = FxHashMap::default();
    let mut triangles = Vec::with_capacity(12 * n * n);
    for axis in 0..3 {
        for high in [false, true] {
            let mut corner = |u: usize, v: usize| {
                let mut p = [0; 3];
                p[axis] = if high { n } else { 0 };
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                *known.entry(p).or_insert_with(|| {
                    points.push(p);
                    points.len() as u32 - 1
                })
            };
            for (u, v) in (0..n * n).map(|i| (i % n, i / n)) {
                let [a, b] = [corner(u, v), corner(u + 1, v)];
                let [c, d] = [corner(u + 1, v + 1), corner(u, v + 1)];
                // The short diagonal alternates, as a scanner's triangles have no direction.
                let pair =
                    if (u + v) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                triangles.extend(pair.map(|[a, b, c]| if high { [a, b, c] } else { [a, c, b] }));
            }
        }
    }
    (points, triangles)
}

/// Direction of a point of the cube's surface, such that squares become of like size.
fn direction(p: [usize; 3], n: usize) -> DVec3 {
    let spread = p.map(|i| {
        let x = 2.0 * i as f64 / n as f64 - 1.0;
        // Everitt's polynomial, close to tan(x pi / 4).
        x * (0.745_558_715_593 + x * x * (0.130_546_850_193 + x * x * 0.123_894_434_214))
    });
    DVec3::from(spread).normalize()
}

/// The soup in the making.
struct Scan {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Faces of the pebble that are no longer there, or are there in another form.
    removed: Vec<bool>,
    /// Faces of the pebble around each of its points.
    around: Vec<Vec<u32>>,
    /// Points of the pebble whose faces belong to a defect.
    taken: Vec<bool>,
    /// Faces beside those of the pebble.
    extra: Vec<[u32; 3]>,
}

impl Scan {
    fn pebble(resolution: usize, random: &mut Random) -> Self {
        let n = resolution / 4;
        let (lattice, triangles) = cube_surface(n);
        // Waves of falling height, longest first.
        let waves: Vec<(DVec3, f64, f64)> = (0..4)
            .flat_map(|octave| [f64::from(octave); 4])
            .map(|octave| {
                let wave = random.direction() * 2.6 * 1.9f64.powi(octave as i32);
                (wave, random.unit() * std::f64::consts::TAU, 0.012 * 0.5f64.powi(octave as i32))
            })
            .collect();
        let noise = 0.04 * RADIUS / n as f64;
        let points: Vec<DVec3> = lattice
            .iter()
            .map(|&p| {
                let d = direction(p, n);
                let relief: f64 = waves.iter().map(|&(w, at, h)| h * (w.dot(d) + at).sin()).sum();
                let flat = DVec3::new(1.0, 0.9, 0.8);
                0.5 + flat * d * (RADIUS + relief + noise * (2.0 * random.unit() - 1.0))
            })
            .collect();
        let mut around = vec![Vec::new(); points.len()];
        for (face, triangle) in triangles.iter().enumerate() {
            triangle.iter().for_each(|&p| around[p as usize].push(face as u32));
        }
        Self {
            removed: vec![false; triangles.len()],
            taken: vec![false; points.len()],
            points,
            triangles,
            around,
            extra: Vec::new(),
        }
    }

    /// Faces within `rings` rings around a point.
    fn disc(&self, centre: u32, rings: usize) -> Vec<u32> {
        let (mut points, mut faces) = (vec![centre], Vec::new());
        for _ in 0..rings {
            faces = points.iter().flat_map(|&p| &self.around[p as usize]).copied().collect();
            faces.sort_unstable();
            faces.dedup();
            points = faces.iter().flat_map(|&f| self.triangles[f as usize]).collect();
            points.sort_unstable();
            points.dedup();
        }
        faces
    }

    /// A random point around which `rings` rings of faces are free; they and the next ring are
    /// taken from now on.
    fn site(&mut self, rings: usize, random: &mut Random) -> Option<u32> {
        for _ in 0..TRIES {
            let centre = random.below(self.around.len()) as u32;
            let points: Vec<u32> = self
                .disc(centre, rings + 1)
                .iter()
                .flat_map(|&f| self.triangles[f as usize])
                .collect();
            if points.iter().all(|&p| !self.taken[p as usize]) {
                points.iter().for_each(|&p| self.taken[p as usize] = true);
                return Some(centre);
            }
        }
        None
    }

    /// A random face whose neighbours are free, and taken from now on.
    fn free_face(&mut self, random: &mut Random) -> Option<usize> {
        let centre = self.site(1, random)?;
        Some(self.around[centre as usize][0] as usize)
    }

    fn hole(&mut self, rings: usize, random: &mut Random, census: &mut ScanCensus) {
        let Some(centre) = self.site(rings, random) else { return };
        let faces = self.disc(centre, rings);
        census.holes += 1;
        census.removed_faces += faces.len();
        census.boundary_edges += self.rim(&faces);
        faces.iter().for_each(|&f| self.removed[f as usize] = true);
    }

    /// Edges of a set of faces that only one of them has.
    fn rim(&self, faces: &[u32]) -> usize {
        let mut edges: Vec<[u32; 2]> =
            faces.iter().flat_map(|&f| edges(self.triangles[f as usize])).collect();
        edges.sort_unstable();
        edges.iter().filter(|[a, b]| edges.binary_search(&[*b, *a]).is_err()).count()
    }

    fn overlap(&mut self, random: &mut Random, census: &mut ScanCensus) {
        let rings = 3;
        let Some(centre) = self.site(rings, random) else { return };
        let faces = self.disc(centre, rings);
        let middle = self.points[centre as usize];
        let normal: DVec3 = self.around[centre as usize].iter().map(|&f| self.area(f)).sum();
        let axis = normal.any_orthogonal_vector().normalize();
        let tilt = glam::DQuat::from_axis_angle(axis, 0.12);
        // Moved a little along the tilt's axis as well, so that no two points fall together.
        let shift = axis
            * 0.1
            * (self.points[self.triangles[faces[0] as usize][0] as usize] - middle).length();
        let mut copies = FxHashMap::default();
        for &f in &faces {
            let copy = self.triangles[f as usize].map(|p| {
                *copies.entry(p).or_insert_with(|| {
                    let moved = middle + tilt * (self.points[p as usize] - middle) + shift;
                    self.points.push(moved);
                    self.points.len() as u32 - 1
                })
            });
            self.extra.push(copy);
        }
        census.overlaps += 1;
        census.overlap_faces += faces.len();
        census.boundary_edges += self.rim(&faces);
    }

    /// Twice the area of a face, along its normal.
    fn area(&self, face: u32) -> DVec3 {
        let [a, b, c] = self.triangles[face as usize].map(|p| self.points[p as usize]);
        (b - a).cross(c - a)
    }

    fn flip(&mut self, random: &mut Random, census: &mut ScanCensus) {
        let Some(face) = self.free_face(random) else { return };
        self.triangles[face].reverse();
        census.flipped_faces += 1;
    }

    fn duplicate(&mut self, random: &mut Random, census: &mut ScanCensus) {
        let Some(face) = self.free_face(random) else { return };
        let [a, b, c] = self.triangles[face];
        self.extra.push([b, c, a]);
        census.duplicate_faces += 1;
    }

    fn t_junction(&mut self, random: &mut Random, census: &mut ScanCensus) {
        let Some(face) = self.free_face(random) else { return };
        let [a, b, c] = self.triangles[face];
        let middle = self.points.len() as u32;
        self.points.push((self.points[a as usize] + self.points[b as usize]) / 2.0);
        self.removed[face] = true;
        self.extra.extend([[a, middle, c], [middle, b, c]]);
        census.t_junctions += 1;
        census.boundary_edges += 3;
    }

    fn inner_parts(&mut self, count: usize, random: &mut Random, census: &mut ScanCensus) {
        let n = 4;
        let (lattice, triangles) = cube_surface(n);
        let mut centres: Vec<DVec3> = Vec::new();
        for _ in 0..TRIES {
            if centres.len() == count {
                break;
            }
            // The pebble's own radius is at least 0.8 (RADIUS - 0.1).
            let centre = 0.5 + random.direction() * 0.15 * random.unit();
            if centres.iter().all(|c| c.distance(centre) > 2.5 * INNER_RADIUS) {
                centres.push(centre);
            }
        }
        for &centre in &centres {
            let first = self.points.len() as u32;
            self.points.extend(lattice.iter().map(|&p| centre + INNER_RADIUS * direction(p, n)));
            self.extra.extend(triangles.iter().map(|t| t.map(|p| first + p)));
        }
        census.inner_parts = centres.len();
        census.inner_faces = centres.len() * triangles.len();
    }

    /// All faces that are there, over the points that they use.
    fn soup(self) -> Soup {
        let kept = self.triangles.iter().zip(&self.removed).filter(|(_, removed)| !**removed);
        let faces: Vec<[u32; 3]> = kept.map(|(t, _)| *t).chain(self.extra).collect();
        let mut renamed = vec![u32::MAX; self.points.len()];
        let mut soup = SoupBuilder::default();
        for face in faces {
            let corners = face.map(|p| {
                let name = &mut renamed[p as usize];
                if *name == u32::MAX {
                    *name = soup.points.len() as u32;
                    soup.points.push(self.points[p as usize].into());
                }
                *name
            });
            soup.face(&corners);
        }
        super::built(soup)
    }
}

/// The three directed edges of a triangle.
fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

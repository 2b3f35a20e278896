//! Triangles in one plane become one region, and the points of a region come to lie in its plane.
//!
//! A region grows from its largest triangle over neighbours within an angle and a distance of that
//! triangle's plane. Then each point moves by the least distance onto the planes of all regions
//! round it. Where that is further than allowed, or there is no such place, the smallest region there
//! gives up its triangles at the point, which are planes of their own. Triangles without height go with
//! the neighbour across their longest side.

use super::edges::{Edges, Side};
use glam::DVec3;

/// What triangles of one region have in common: what they are painted with, and a part of a face
/// that was cut.
pub(super) type Paint = (u64, u32);

/// How flat a region must be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flatness {
    /// Furthest that a point may be off the plane, in the unit of the points.
    pub distance: f64,
    /// Largest angle between the normals, in radians.
    pub angle: f64,
}

/// Regions of triangles, and how far their points moved.
#[derive(Debug, Clone)]
pub(super) struct Regions {
    /// Triangles of each region, in order of growth: the first one is its plane's.
    pub regions: Vec<Vec<u32>>,
    /// Region of each triangle.
    pub of: Vec<u32>,
    /// The furthest that a point was moved.
    pub moved: f64,
}

struct Plane {
    normal: DVec3,
    offset: f64,
}

impl Plane {
    fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }
}

impl Regions {
    /// Finds regions and moves `points` onto their planes. Triangles of different `paint` stay
    /// apart.
    pub fn new(
        points: &mut [[f64; 3]],
        triangles: &[[u32; 3]],
        edges: &Edges,
        paint: &dyn Fn(u32) -> Paint,
        flat: Flatness,
    ) -> Self {
        let neighbours = neighbours(triangles.len(), edges);
        let mut regions = Self::grow(points, triangles, &neighbours, paint, flat);
        regions.settle(points, triangles, &neighbours, flat);
        regions
    }

    fn grow(
        points: &[[f64; 3]],
        triangles: &[[u32; 3]],
        neighbours: &[[Option<u32>; 3]],
        paint: &dyn Fn(u32) -> Paint,
        flat: Flatness,
    ) -> Self {
        let corner = |p: u32| DVec3::from_array(points[p as usize]);
        let normals: Vec<DVec3> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(corner);
                (b - a).cross(c - a)
            })
            .collect();
        let longest: Vec<f64> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(corner);
                a.distance(b).max(b.distance(c)).max(c.distance(a))
            })
            .collect();
        let is_needle =
            |t: u32| normals[t as usize].length() <= longest[t as usize] * flat.distance * 0.1;
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        order.sort_by(|&s, &t| {
            let [p, q] = [s, t].map(|t| normals[t as usize].length_squared());
            q.total_cmp(&p).then(s.cmp(&t))
        });
        let mut of = vec![u32::MAX; triangles.len()];
        let mut regions: Vec<Vec<u32>> = Vec::new();
        let least = flat.angle.cos();
        for seed in order {
            if of[seed as usize] != u32::MAX {
                continue;
            }
            let normal = normals[seed as usize].normalize_or_zero();
            let plane = Plane { normal, offset: normal.dot(corner(triangles[seed as usize][0])) };
            let number = regions.len() as u32;
            of[seed as usize] = number;
            let mut region = vec![seed];
            let mut next = 0;
            while next < region.len() {
                let t = region[next];
                next += 1;
                for other in neighbours[t as usize].into_iter().flatten() {
                    let own = normals[other as usize];
                    let even = if is_needle(other) {
                        // Its longest side must be the one it is reached by, or it would bridge a fold.
                        reached_by_longest(points, triangles, t, other, longest[other as usize])
                    } else {
                        own.dot(normal) >= least * own.length()
                    };
                    let near = |&p: &u32| plane.height(corner(p)).abs() <= flat.distance;
                    if of[other as usize] == u32::MAX
                        && even
                        && paint(other) == paint(seed)
                        && triangles[other as usize].iter().all(near)
                    {
                        of[other as usize] = number;
                        region.push(other);
                    }
                }
            }
            regions.push(region);
        }
        Self { regions, of, moved: 0.0 }
    }

    /// Moves points onto planes; regions for which that fails give up triangles.
    fn settle(
        &mut self,
        points: &mut [[f64; 3]],
        triangles: &[[u32; 3]],
        neighbours: &[[Option<u32>; 3]],
        flat: Flatness,
    ) {
        let before: Vec<DVec3> = points.iter().map(|&p| DVec3::from_array(p)).collect();
        let size = before.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let exact = 1e-13 * size.max(f64::MIN_POSITIVE);
        loop {
            let planes: Vec<Option<Plane>> =
                self.regions.iter().map(|r| plane(r, &before, triangles)).collect();
            let mut failed: Vec<u32> = Vec::new();
            self.moved = 0.0;
            for (p, regions) in self.round(points.len(), triangles).iter().enumerate() {
                let all: Vec<&Plane> =
                    regions.iter().filter_map(|&r| planes[r as usize].as_ref()).collect();
                match meeting_point(before[p], &all, exact) {
                    Some(to) if to.distance(before[p]) <= 2.0 * flat.distance => {
                        self.moved = self.moved.max(to.distance(before[p]));
                        points[p] = to.to_array();
                    }
                    _ => failed.push(p as u32),
                }
            }
            if failed.is_empty() {
                return;
            }
            self.release(&failed, triangles, neighbours);
        }
    }

    /// Regions of at least two triangles round each of `count` points.
    fn round(&self, count: usize, triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
        let mut round: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (number, region) in self.regions.iter().enumerate().filter(|(_, r)| r.len() > 1) {
            for &p in region.iter().flat_map(|&t| &triangles[t as usize]) {
                let known = &mut round[p as usize];
                if known.last() != Some(&(number as u32)) {
                    known.push(number as u32);
                }
            }
        }
        round
    }

    /// Lets points go: the smallest region round each gives up its triangles there. False where no
    /// region was left to do so.
    fn release(
        &mut self,
        points: &[u32],
        triangles: &[[u32; 3]],
        neighbours: &[[Option<u32>; 3]],
    ) -> bool {
        let count = triangles.iter().flatten().max().map_or(0, |&p| p as usize + 1);
        let round = self.round(count, triangles);
        let least = |&p: &u32| {
            let regions = round[p as usize].iter();
            let least = regions.min_by_key(|&&r| (self.regions[r as usize].len(), r));
            least.map(|&r| (r, p))
        };
        let mut failed: Vec<(u32, u32)> = points.iter().filter_map(least).collect();
        failed.sort_unstable();
        failed.dedup();
        self.shed(&failed, triangles, neighbours);
        !failed.is_empty()
    }

    /// Lets points go and moves all others anew.
    pub fn without(
        &mut self,
        released: &[u32],
        points: &mut [[f64; 3]],
        triangles: &[[u32; 3]],
        edges: &Edges,
        flat: Flatness,
    ) -> bool {
        let neighbours = neighbours(triangles.len(), edges);
        let any = self.release(released, triangles, &neighbours);
        self.settle(points, triangles, &neighbours, flat);
        any
    }

    /// Takes the triangles at points out of regions; what is left of a region stays together where
    /// it does.
    fn shed(
        &mut self,
        failed: &[(u32, u32)],
        triangles: &[[u32; 3]],
        neighbours: &[[Option<u32>; 3]],
    ) {
        for of_region in failed.chunk_by(|a, b| a.0 == b.0) {
            let region = of_region[0].0;
            let gone = |t: u32| {
                let corners = &triangles[t as usize];
                of_region.iter().any(|(_, p)| corners.contains(p))
            };
            let members = std::mem::take(&mut self.regions[region as usize]);
            let waits = u32::MAX;
            members.iter().for_each(|&t| self.of[t as usize] = waits);
            let mut number = region;
            for &seed in &members {
                if self.of[seed as usize] != waits {
                    continue;
                }
                if number != region {
                    self.regions.push(Vec::new());
                }
                self.of[seed as usize] = number;
                let mut part = vec![seed];
                let mut next = 0;
                while next < part.len() && !gone(seed) {
                    for other in neighbours[part[next] as usize].into_iter().flatten() {
                        if self.of[other as usize] == waits && !gone(other) {
                            self.of[other as usize] = number;
                            part.push(other);
                        }
                    }
                    next += 1;
                }
                self.regions[number as usize] = part;
                number = self.regions.len() as u32;
            }
        }
    }

    /// Each triangle of these regions becomes a region of its own.
    pub fn dissolve(&mut self, regions: &[u32]) {
        for &r in regions {
            for t in self.regions[r as usize].split_off(1) {
                self.of[t as usize] = self.regions.len() as u32;
                self.regions.push(vec![t]);
            }
        }
    }
}

/// The triangle on the other side of each side, where there is exactly one and it runs the other
/// way.
fn neighbours(count: usize, edges: &Edges) -> Vec<[Option<u32>; 3]> {
    let mut all = vec![[None; 3]; count];
    for sides in edges.iter() {
        if let [a, b] = sides
            && a.opposes(b)
            && a.face != b.face
        {
            let mut set = |s: &Side, other| all[s.face as usize][s.number as usize] = Some(other);
            set(a, b.face);
            set(b, a.face);
        }
    }
    all
}

fn reached_by_longest(
    points: &[[f64; 3]],
    triangles: &[[u32; 3]],
    from: u32,
    to: u32,
    longest: f64,
) -> bool {
    let [from, to] = [from, to].map(|t| triangles[t as usize]);
    let shared: Vec<DVec3> = to
        .iter()
        .filter(|p| from.contains(p))
        .map(|&p| DVec3::from_array(points[p as usize]))
        .collect();
    matches!(shared[..], [a, b] if a.distance(b) >= longest)
}

/// The mean plane of a region of at least two triangles: a single one has its own for sure.
fn plane(region: &[u32], points: &[DVec3], triangles: &[[u32; 3]]) -> Option<Plane> {
    if region.len() < 2 {
        return None;
    }
    let (mut normal, mut centre, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for &t in region {
        let [a, b, c] = triangles[t as usize].map(|p| points[p as usize]);
        let area = (b - a).cross(c - a);
        normal += area;
        centre += area.length() * (a + b + c) / 3.0;
        weight += area.length();
    }
    let normal = normal.try_normalize()?;
    Some(Plane { normal, offset: normal.dot(centre / weight) })
}

/// The point nearest to `p` that lies on all planes, where there is one.
fn meeting_point(p: DVec3, planes: &[&Plane], exact: f64) -> Option<DVec3> {
    if planes.iter().all(|plane| plane.height(p).abs() <= exact) {
        return Some(p);
    }
    // Directions that are spoken for, square to each other (Gram and Schmidt).
    let mut taken: Vec<DVec3> = Vec::new();
    let mut at = p;
    for plane in planes {
        let own = taken.iter().fold(plane.normal, |n, &d| n - n.dot(d) * d);
        let length = own.length();
        if length > 1e-3 && taken.len() < 3 {
            let along = own / length;
            at -= plane.height(at) / length * along;
            taken.push(along);
        }
    }
    planes.iter().all(|plane| plane.height(at).abs() <= 8.0 * exact).then_some(at)
}

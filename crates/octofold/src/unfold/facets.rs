//! The faces that are unfolded: polygons with all their triangles in one plane.
//!
//! A region with one plain border becomes one polygon. One with holes, slits or pinched corners
//! stays in triangles that move together. Points at which nothing meets, between the same facets
//! on a straight edge, are left out.

use super::edges::{Edges, Side};
use super::plane::{Bounds, convex_meet, doubled_area, is_convex};
use super::regions::{Flatness, Paint, Regions};
use glam::{DVec2, DVec3};

/// A flat face. Corners are numbered within the facet.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Facet {
    /// Points of the mesh at the corners.
    pub corners: Vec<u32>,
    /// The corners in the facet's own plane, seen from the printed side.
    pub flat: Vec<DVec2>,
    /// Simple polygons that it is drawn in, counter-clockwise.
    pub tiles: Vec<Vec<u32>>,
    /// Convex polygons that it consists of, counter-clockwise.
    pub parts: Vec<Vec<u32>>,
    /// Its border, counter-clockwise round what is inside.
    pub sides: Vec<[u32; 2]>,
    /// Unit normal of the printed side.
    pub normal: DVec3,
    /// Triangles of the input that it covers.
    pub triangles: Vec<u32>,
}

impl Facet {
    /// The ends of side `side` in the facet's own plane.
    pub fn side(&self, side: u32) -> [DVec2; 2] {
        self.sides[side as usize].map(|c| self.flat[c as usize])
    }

    /// Its area.
    pub fn area(&self) -> f64 {
        self.parts.iter().map(|part| doubled_area(&gathered(part, &self.flat))).sum::<f64>() / 2.0
    }

    /// The angles in radians inside the facet at the ends of side `side`.
    pub fn corner_angles(&self, side: u32) -> [f64; 2] {
        let [first, second] = self.sides[side as usize];
        let at = |c: u32| self.flat[c as usize];
        let narrowest = |from: u32, to: u32, others: &mut dyn Iterator<Item = u32>| {
            let along = at(to) - at(from);
            others.map(|c| along.angle_to(at(c) - at(from)).abs()).fold(f64::INFINITY, f64::min)
        };
        let mut before = self.sides.iter().filter(|s| s[1] == first).map(|s| s[0]);
        let mut after = self.sides.iter().filter(|s| s[0] == second).map(|s| s[1]);
        [narrowest(first, second, &mut before), narrowest(second, first, &mut after)]
    }
}

/// All facets of a mesh.
#[derive(Debug, Clone)]
pub(super) struct Facets {
    /// Points, in the order of the input; those that no facet uses are left out.
    pub points: Vec<DVec3>,
    /// The facets.
    pub facets: Vec<Facet>,
    /// Their sides, edge by edge.
    pub edges: Edges,
    /// The furthest that a point was moved so that facets are flat.
    pub moved: f64,
    /// Triangles without area that no facet covers.
    pub lost: usize,
}

impl Facets {
    /// Merges oriented triangles into facets.
    pub fn new(
        mut points: Vec<[f64; 3]>,
        triangles: &[[u32; 3]],
        paint: &dyn Fn(u32) -> Paint,
        flat: Flatness,
    ) -> Self {
        let edges = Edges::of_triangles(triangles);
        let mut regions = Regions::new(&mut points, triangles, &edges, paint, flat);
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
        let mut plain = vec![true; regions.regions.len()];
        loop {
            plain.resize(regions.regions.len(), true);
            let borders = Borders::new(&regions, triangles, &edges, &mut plain);
            let kept = borders.kept(&points, &plain, flat.distance);
            let mut facets = Vec::with_capacity(regions.regions.len());
            let (mut lost, mut torn, mut knotted) = (0, Vec::new(), Vec::new());
            for (r, region) in regions.regions.iter().enumerate() {
                let facet = if plain[r] {
                    let ring = borders.loops[r].iter().copied().filter(|&p| kept[p as usize]);
                    polygon(ring.collect(), region, &points, triangles)
                } else {
                    tiled(&borders.sides[r], region, &points, triangles)
                };
                match facet {
                    Some(facet) if overlaps_itself(&facet) => torn.push(r as u32),
                    Some(facet) => facets.push(facet),
                    None if region.len() == 1 => lost += 1,
                    None if plain[r] => knotted.push(r),
                    None => torn.push(r as u32),
                }
            }
            if torn.is_empty() && knotted.is_empty() {
                let points = used_points(&points, &mut facets);
                let edges = edges_of(&facets);
                return Self { points, facets, edges, moved: regions.moved, lost };
            }
            knotted.into_iter().for_each(|r| plain[r] = false);
            regions.dissolve(&torn);
        }
    }
}

/// What surrounds each region.
struct Borders {
    /// Border sides of each region, as pairs of points.
    sides: Vec<Vec<[u32; 2]>>,
    /// The one loop of each plain region.
    loops: Vec<Vec<u32>>,
}

impl Borders {
    /// Collects borders; regions without one plain loop lose their mark.
    fn new(regions: &Regions, triangles: &[[u32; 3]], edges: &Edges, plain: &mut [bool]) -> Self {
        let mut sides: Vec<Vec<[u32; 2]>> = vec![Vec::new(); regions.regions.len()];
        for at in edges.iter() {
            let inner = match at {
                [a, b] => {
                    a.opposes(b) && regions.of[a.face as usize] == regions.of[b.face as usize]
                }
                _ => false,
            };
            for side in at.iter().filter(|_| !inner) {
                sides[regions.of[side.face as usize] as usize].push([side.from, side.to]);
            }
        }
        let mut loops = vec![Vec::new(); regions.regions.len()];
        for (r, region) in regions.regions.iter().enumerate() {
            if region.len() == 1 {
                loops[r] = triangles[region[0] as usize].to_vec();
            } else if plain[r] {
                match single_loop(&sides[r]) {
                    Some(ring) => loops[r] = ring,
                    None => plain[r] = false,
                }
            }
        }
        Self { sides, loops }
    }

    /// Which points stay corners.
    fn kept(&self, points: &[DVec3], plain: &[bool], straight: f64) -> Vec<bool> {
        // Where every facet at a point comes from and goes to the same two points.
        let mut ways: Vec<Option<[u32; 2]>> = vec![None; points.len()];
        let mut kept = vec![false; points.len()];
        for (r, ring) in self.loops.iter().enumerate() {
            if !plain[r] {
                self.sides[r].iter().flatten().for_each(|&p| kept[p as usize] = true);
            }
            for (i, &p) in ring.iter().enumerate().filter(|_| plain[r]) {
                let (a, b) = (ring[(i + ring.len() - 1) % ring.len()], ring[(i + 1) % ring.len()]);
                let way = [a.min(b), a.max(b)];
                match ways[p as usize] {
                    None => ways[p as usize] = Some(way),
                    Some(known) => kept[p as usize] |= known != way,
                }
            }
        }
        let mut seen = kept.clone();
        for p in 0..points.len() as u32 {
            if !seen[p as usize] && ways[p as usize].is_some() {
                let chain = chain(p, &ways, &kept);
                chain.iter().for_each(|&q| seen[q as usize] = true);
                straightened(&chain, points, straight)
                    .into_iter()
                    .for_each(|q| kept[q as usize] = true);
            }
        }
        for (_, ring) in self.loops.iter().enumerate().filter(|&(r, _)| plain[r]) {
            if ring.iter().filter(|&&p| kept[p as usize]).count() < 3 {
                ring.iter().for_each(|&p| kept[p as usize] = true);
            }
        }
        kept
    }
}

/// The points of `sides` in order, where these make one loop that passes each point once.
fn single_loop(sides: &[[u32; 2]]) -> Option<Vec<u32>> {
    let mut order = sides.to_vec();
    order.sort_unstable();
    if order.windows(2).any(|w| w[0][0] == w[1][0]) {
        return None;
    }
    let first = order.first()?[0];
    let mut ring = vec![first];
    loop {
        let at = *ring.last()?;
        let next = order[order.binary_search_by_key(&at, |s| s[0]).ok()?][1];
        if next == first {
            return (ring.len() == sides.len()).then_some(ring);
        }
        if ring.len() == sides.len() {
            return None;
        }
        ring.push(next);
    }
}

/// The points from one kept point past `p` to the next, or once round where none is kept.
fn chain(p: u32, ways: &[Option<[u32; 2]>], kept: &[bool]) -> Vec<u32> {
    let Some([back, onward]) = ways[p as usize] else { return vec![p] };
    let walk = |mut before: u32, mut at: u32| {
        let mut passed = vec![at];
        while !kept[at as usize] && at != p {
            let Some([a, b]) = ways[at as usize] else { break };
            (before, at) = (at, if a == before { b } else { a });
            passed.push(at);
        }
        passed
    };
    let ahead = walk(p, onward);
    if ahead.last() == Some(&p) {
        return std::iter::once(p).chain(ahead).collect();
    }
    let mut all = walk(p, back);
    all.reverse();
    all.push(p);
    all.extend(ahead);
    all
}

/// The corners of a chain: from each as far on as the way is straight.
fn straightened(chain: &[u32], points: &[DVec3], straight: f64) -> Vec<u32> {
    let at = |i: usize| points[chain[i] as usize];
    let off = |i: usize, [a, b]: [usize; 2]| {
        let along = at(b) - at(a);
        let way = (at(i) - at(a)).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        if !(0.0..=1.0).contains(&way) {
            return f64::INFINITY;
        }
        at(i).distance(at(a) + way * along)
    };
    let mut corners = vec![chain[0]];
    let mut from = 0;
    while from + 1 < chain.len() {
        let mut to = from + 1;
        while to + 1 < chain.len() && (from + 1..=to).all(|i| off(i, [from, to + 1]) <= straight) {
            to += 1;
        }
        corners.push(chain[to]);
        from = to;
    }
    corners
}

/// A facet with one plain border; `None` where that crosses itself or encloses nothing.
fn polygon(
    corners: Vec<u32>,
    region: &[u32],
    points: &[DVec3],
    triangles: &[[u32; 3]],
) -> Option<Facet> {
    let normal = normal(region, points, triangles)?;
    let flat = flatten(&corners, points, normal);
    let area = doubled_area(&flat);
    let n = corners.len() as u32;
    let whole: Vec<u32> = (0..n).collect();
    let parts = if is_convex(&flat, 0.0) {
        vec![whole.clone()]
    } else {
        let mut cut = Vec::new();
        earcut::Earcut::new().earcut(flat.iter().map(|p| p.to_array()), &[], &mut cut);
        let parts: Vec<Vec<u32>> = cut.chunks_exact(3).map(|t| t.to_vec()).collect();
        parts.into_iter().map(|t| counter_clockwise(t, &flat)).collect()
    };
    let covered: f64 = parts.iter().map(|t| doubled_area(&gathered(t, &flat))).sum();
    let sound = area > 0.0 && (covered - area).abs() <= 1e-9 * area;
    sound.then(|| Facet {
        sides: whole.iter().map(|&i| [i, (i + 1) % n]).collect(),
        corners,
        flat,
        tiles: vec![whole],
        parts,
        normal,
        triangles: region.to_vec(),
    })
}

/// A facet that stays in triangles; `None` where one of these has no area.
fn tiled(
    sides: &[[u32; 2]],
    region: &[u32],
    points: &[DVec3],
    triangles: &[[u32; 3]],
) -> Option<Facet> {
    let normal = normal(region, points, triangles)?;
    let mut corners: Vec<u32> = region.iter().flat_map(|&t| triangles[t as usize]).collect();
    corners.sort_unstable();
    corners.dedup();
    let local = |p: u32| corners.partition_point(|&q| q < p) as u32;
    let tiles: Vec<Vec<u32>> =
        region.iter().map(|&t| triangles[t as usize].map(local).to_vec()).collect();
    let sides = sides.iter().map(|side| side.map(local)).collect();
    let flat = flatten(&corners, points, normal);
    let low = |tile: &Vec<u32>| {
        let polygon = gathered(tile, &flat);
        doubled_area(&polygon) <= 1e-6 * Bounds::of(&polygon).size().max_element()
    };
    if tiles.iter().any(low) {
        return None;
    }
    Some(Facet {
        parts: tiles.clone(),
        tiles,
        flat,
        corners,
        sides,
        normal,
        triangles: region.to_vec(),
    })
}

fn normal(region: &[u32], points: &[DVec3], triangles: &[[u32; 3]]) -> Option<DVec3> {
    let area = |&t: &u32| {
        let [a, b, c] = triangles[t as usize].map(|p| points[p as usize]);
        (b - a).cross(c - a)
    };
    region.iter().map(area).sum::<DVec3>().try_normalize()
}

/// Points of a plane square to `normal`, in coordinates of that plane.
fn flatten(corners: &[u32], points: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let origin = points[corners[0] as usize];
    let along = points[corners[1] as usize] - origin;
    let u = (along - along.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
    let v = normal.cross(u);
    let place = |&p: &u32| {
        let d = points[p as usize] - origin;
        DVec2::new(u.dot(d), v.dot(d))
    };
    corners.iter().map(place).collect()
}

fn counter_clockwise(mut triangle: Vec<u32>, flat: &[DVec2]) -> Vec<u32> {
    if doubled_area(&gathered(&triangle, flat)) < 0.0 {
        triangle.reverse();
    }
    triangle
}

/// The corners `polygon` of a facet, in its plane.
pub(super) fn gathered(polygon: &[u32], flat: &[DVec2]) -> Vec<DVec2> {
    polygon.iter().map(|&c| flat[c as usize]).collect()
}

/// True where parts of the facet lie on one another.
fn overlaps_itself(facet: &Facet) -> bool {
    let mut parts: Vec<(Bounds, Vec<DVec2>)> = facet
        .parts
        .iter()
        .map(|part| gathered(part, &facet.flat))
        .map(|part| (Bounds::of(&part), part))
        .collect();
    let slack = 1e-9 * Bounds::of(&facet.flat).size().max_element();
    parts.sort_by(|a, b| a.0.low.x.total_cmp(&b.0.low.x));
    parts.iter().enumerate().any(|(i, (bounds, part))| {
        let reach = parts[i + 1..].iter().take_while(|(b, _)| b.low.x < bounds.high.x);
        reach.into_iter().any(|(b, other)| bounds.meet(b, slack) && convex_meet(part, other, slack))
    })
}

/// Leaves out the points that are no corner.
fn used_points(points: &[DVec3], facets: &mut [Facet]) -> Vec<DVec3> {
    let mut used = vec![false; points.len()];
    facets.iter().flat_map(|f| &f.corners).for_each(|&p| used[p as usize] = true);
    let mut place = vec![0; points.len()];
    let mut left = Vec::new();
    for p in (0..points.len()).filter(|&p| used[p]) {
        place[p] = left.len() as u32;
        left.push(points[p]);
    }
    facets.iter_mut().flat_map(|f| &mut f.corners).for_each(|p| *p = place[*p as usize]);
    left
}

fn edges_of(facets: &[Facet]) -> Edges {
    let sides = facets.iter().enumerate().flat_map(|(f, facet)| {
        facet.sides.iter().enumerate().map(move |(number, side)| {
            let [from, to] = side.map(|c| facet.corners[c as usize]);
            Side { from, to, face: f as u32, number: number as u32 }
        })
    });
    Edges::new(sides.collect())
}

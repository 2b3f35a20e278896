//! How far the patches round an octant's vertex are from the surface inside.
//!
//! On the finest level the crossings of an octant's edges are measured against the patch of their
//! edge, and the surface's vertices against all patches round the octant. Above, the vertices of an
//! octant's children are measured against the patches round its own vertex, and what is found is
//! added to the children's bounds: the distance of three surfaces is at most the sum of two. Quads
//! are measured with both diagonals. The other way, an octant's vertex and the middles of patches that
//! are not nearly flat are measured against the patches round the children, and the larger of both sums
//! is taken. Where no edge of an octant is crossed, its whole extent is taken. Patches stop short of where
//! an open surface ends: pieces of its border are measured against the patches of every level.
//! Source: specification of LOD, D.2 "Pixel bound", by sums of levels instead of samples at each.

use super::crossings::Crossings;
use super::direction;
use super::edges::LOCAL;
use super::leaves::{Found, Leaves};
use super::pyramid::{Level, firsts};
use super::rim::{Piece, Rim};
use crate::measure::nearest::Face;
use crate::par;
use crate::run::{Cancelled, Run};
use glam::DVec3;
use std::ops::Range;

const BLOCK: usize = 1 << 12;
const NONE: u32 = u32::MAX;

/// Where no patch is near a piece of the border, it counts as so many octants away.
const FAR: f64 = 5.0;

/// Vertices of octants that are so flat, in steps of [`Level::shapes`], lie on the surface.
const EVEN: u8 = 243;

/// The reach of what has no patches.
const BARE: f64 = -1.0;

/// Neighbours of the octants of one level, by way `2 axis + side`.
type Neighbours = Vec<[u32; 6]>;

/// The bound of each octant of each level in finest cells, the root's level first.
pub(super) fn bounds(
    levels: &[Level],
    leaves: &Leaves,
    crossings: &Crossings,
    vertices: &[DVec3],
    rim: &Rim,
    run: &Run,
) -> Result<Vec<Vec<f32>>, Cancelled> {
    run.stage("bounds");
    let (mut own, mut back, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    let height = levels.len() - 1;
    let mut star = Stars::new(&levels[0], vec![[NONE; 6]], 1 << height, run)?;
    for (height, below) in (0..height).rev().zip(&levels[1..]) {
        ends.push(of_rim(&star, rim, 3 * (height + 1) as u32, run)?);
        let firsts = firsts(star.level);
        let next = descended(star.level, below, &firsts, &star.neighbours, run)?;
        let finer = Stars::new(below, next, 1 << height, run)?;
        own.push(of_octants(&star, &finer, &firsts, run)?);
        let mut bounds = vec![0f32; star.level.codes.len()];
        for (octant, bound) in of_patches(&star, &finer, &firsts, run)? {
            bounds[octant as usize] = bounds[octant as usize].max(bound);
        }
        back.push(bounds);
        star = finer;
    }
    ends.push(of_rim(&star, rim, 0, run)?);
    let last = of_leaves(&star, leaves, crossings, vertices, run)?;
    back.push(of_vertices(&star, &last, leaves, crossings, run)?);
    own.push(last);
    summed(&mut own, levels);
    summed(&mut back, levels);
    for (own, back) in own.iter_mut().flatten().zip(back.iter().flatten()) {
        *own = own.max(*back);
    }
    raised(&mut own, levels, ends);
    Ok(own)
}

/// Raises bounds to those of borders, with all octants above.
fn raised(bounds: &mut [Vec<f32>], levels: &[Level], ends: Vec<Vec<(u32, f32)>>) {
    for (depth, found) in ends.into_iter().enumerate().rev() {
        for (octant, bound) in found {
            let own = &mut bounds[depth][octant as usize];
            *own = own.max(bound);
        }
        let (above, below) = bounds.split_at_mut(depth + 1);
        let Some(below) = below.first() else { continue };
        let mut children = below.iter();
        for (bound, mask) in above[depth].iter_mut().zip(&levels[depth].masks) {
            let children = children.by_ref().take(mask.count_ones() as usize);
            *bound = children.fold(*bound, |most, &child| most.max(child));
        }
    }
}

/// Adds the largest of its children's bounds to each octant's.
fn summed(own: &mut [Vec<f32>], levels: &[Level]) {
    for depth in (0..own.len() - 1).rev() {
        let (above, below) = own.split_at_mut(depth + 1);
        let (above, mut children) = (&mut above[depth], below[0].iter());
        for (bound, mask) in above.iter_mut().zip(&levels[depth].masks) {
            let worst =
                children.by_ref().take(mask.count_ones() as usize).fold(0f32, |a, &b| a.max(b));
            *bound += worst;
        }
    }
}

/// The neighbours of a level's octants, from those of their parents.
fn descended(
    level: &Level,
    below: &Level,
    firsts: &[u32],
    neighbours: &Neighbours,
    run: &Run,
) -> Result<Neighbours, Cancelled> {
    let child = |of: u32, octant: u32| {
        if of == NONE || level.masks[of as usize] >> octant & 1 == 0 {
            return NONE;
        }
        let before = level.masks[of as usize] & ((1 << octant) - 1) as u8;
        firsts[of as usize] + before.count_ones()
    };
    let parts = par::blocks(run, level.codes.len(), BLOCK, |block| {
        let mut part = Vec::with_capacity(4 * block.len());
        for i in block {
            for octant in (0..8).filter(|o| level.masks[i] >> o & 1 == 1) {
                part.push(std::array::from_fn(|way| {
                    let (bit, side) = (1 << (way / 2), way as u32 & 1);
                    let inside = (octant & bit != 0) != (side == 1);
                    let of = if inside { i as u32 } else { neighbours[i][way] };
                    child(of, octant ^ bit)
                }));
            }
        }
        part
    })?;
    let all = parts.concat();
    debug_assert_eq!(all.len(), below.codes.len());
    Ok(all)
}

/// The patches round the octants of one level.
struct Stars<'a> {
    level: &'a Level,
    /// Vertices, in finest cells.
    vertices: Vec<DVec3>,
    neighbours: Neighbours,
    size: u32,
}

impl<'a> Stars<'a> {
    fn new(
        level: &'a Level,
        neighbours: Neighbours,
        size: u32,
        run: &Run,
    ) -> Result<Self, Cancelled> {
        let parts = par::blocks(run, level.codes.len(), BLOCK, |block| {
            block.map(|i| level.vertex(i, size)).collect::<Vec<_>>()
        })?;
        Ok(Self { level, vertices: parts.concat(), neighbours, size })
    }

    /// The vertices round edge `edge` of octant `i`, in the order of the ring.
    fn ring(&self, i: usize, edge: usize) -> Option<[DVec3; 4]> {
        let octants = self.octants(i, edge)?;
        Some(octants.map(|octant| self.vertices[octant as usize]))
    }

    /// How far the patches round each octant reach from its vertex; [`BARE`] where there are none.
    fn reaches(&self, run: &Run) -> Result<Vec<f64>, Cancelled> {
        let parts = par::blocks(run, self.vertices.len(), BLOCK, |block| {
            let reach = |i: usize| {
                let from = self.vertices[i];
                let rings = bits(self.level.crossed[i].any).filter_map(|edge| self.ring(i, edge));
                let squares = rings.flat_map(|ring| ring.map(|at| from.distance_squared(at)));
                squares.reduce(f64::max).map_or(BARE, f64::sqrt)
            };
            block.map(reach).collect::<Vec<_>>()
        })?;
        Ok(parts.concat())
    }

    /// The octants round edge `edge` of octant `i`, in the order of the ring.
    fn octants(&self, i: usize, edge: usize) -> Option<[u32; 4]> {
        let local = &LOCAL[edge];
        let first = self.neighbours[i][local.ways[0]];
        let second = self.neighbours[i][local.ways[1]];
        if first == NONE || second == NONE {
            return None;
        }
        let third = self.neighbours[first as usize][local.ways[1]];
        if third == NONE {
            return None;
        }
        let mut ring = [NONE; 4];
        for (octant, place) in [i as u32, first, second, third].into_iter().zip(local.places) {
            ring[place] = octant;
        }
        Some(ring)
    }

    /// The triangles round octant `i`, for each diagonal.
    fn faces(&self, i: usize, faces: &mut [Vec<Face>; 2]) {
        faces.iter_mut().for_each(Vec::clear);
        for ring in bits(self.level.crossed[i].any).filter_map(|edge| self.ring(i, edge)) {
            for (faces, cut) in faces.iter_mut().zip(cuts(ring)) {
                faces.extend(cut);
            }
        }
    }

    /// The same; for an octant without patches of its own, those round the nearest octants that have
    /// some, a few steps away at most.
    fn faces_near(&self, i: usize, faces: &mut [Vec<Face>; 2], near: &mut [Vec<Face>; 2]) {
        const STEPS: usize = 4;
        self.faces(i, faces);
        let (mut met, mut done) = (vec![i as u32], 0);
        for _ in 0..STEPS {
            if !faces[0].is_empty() {
                return;
            }
            for at in std::mem::replace(&mut done, met.len())..met.len() {
                for n in self.neighbours[met[at] as usize] {
                    if n == NONE || met.contains(&n) {
                        continue;
                    }
                    met.push(n);
                    self.faces(n as usize, near);
                    for (all, part) in faces.iter_mut().zip(near.iter()) {
                        all.extend(part);
                    }
                }
            }
        }
    }

    /// The diagonal of an octant: no two of its points are further apart.
    fn extent(&self) -> f64 {
        f64::from(self.size) * 3f64.sqrt()
    }
}

/// The bits that are set, by their numbers.
fn bits(mut of: u16) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = of.trailing_zeros() as usize;
        of &= of.wrapping_sub(1);
        (bit < 16).then_some(bit)
    })
}

/// The patches of the level below, by the octants whose children they are round.
struct Below<'a> {
    stars: &'a Stars<'a>,
    masks: &'a [u8],
    firsts: &'a [u32],
    reaches: &'a [f64],
}

impl Below<'_> {
    /// The largest of the distances of places from the patches round the children of some octants.
    fn furthest<const N: usize, const M: usize>(
        &self,
        places: [DVec3; N],
        octants: [u32; M],
    ) -> f64 {
        let families = octants.map(|i| {
            let first = self.firsts[i as usize];
            first..first + self.masks[i as usize].count_ones()
        });
        // Vertices are on the patches round them.
        let mut starts = places.map(|place| {
            let children = families.iter().cloned().flatten().map(|child| child as usize);
            let held = children.filter(|&child| self.reaches[child] != BARE);
            let squares = held.map(|child| place.distance_squared(self.stars.vertices[child]));
            (squares.fold(f64::INFINITY, f64::min).sqrt(), place)
        });
        starts.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let mut most = 0.0;
        for (start, place) in starts {
            if start <= most {
                break;
            }
            most = self.distance(place, start, most, &families).max(most);
        }
        most
    }

    /// The distance of a place from the patches round some children, one of which is no further than
    /// `least`; anything up to `enough` where it is no more than that.
    fn distance(&self, place: DVec3, mut least: f64, enough: f64, families: &[Range<u32>]) -> f64 {
        let is_held = |octant: u32| families.iter().any(|family| family.contains(&octant));
        for child in families.iter().cloned().flatten() {
            let i = child as usize;
            let within = least + self.reaches[i];
            if place.distance_squared(self.stars.vertices[i]) >= within * within {
                continue;
            }
            for edge in bits(self.stars.level.crossed[i].any) {
                let Some(octants) = self.stars.octants(i, edge) else { continue };
                // A patch is met at the first of its octants.
                if octants.iter().any(|&other| other < child && is_held(other)) {
                    continue;
                }
                let [a, b, c, d] = octants.map(|octant| self.stars.vertices[octant as usize]);
                for face in [face(a, b, c), face(a, c, d)] {
                    least = least.min(face.distance_squared(place).sqrt());
                }
            }
            if least <= enough {
                break;
            }
        }
        least
    }
}

/// A quad as two triangles, in both ways.
fn cuts([a, b, c, d]: [DVec3; 4]) -> [[Face; 2]; 2] {
    [[face(a, b, c), face(a, c, d)], [face(b, c, d), face(b, d, a)]]
}

fn face(p: DVec3, q: DVec3, r: DVec3) -> Face {
    Face::new([p, q, r].map(|p| p.to_array()))
}

/// The distance of a point from the nearest of some faces, squared; anything up to `enough` where it
/// is no more than that.
fn distance_squared(faces: &[Face], p: DVec3, enough: f64) -> f64 {
    let mut least = f64::INFINITY;
    for face in faces {
        least = least.min(face.distance_squared(p));
        if least <= enough {
            break;
        }
    }
    least
}

/// The larger of a bound and the distances of a point from both cuts, but no more than `extent`. What
/// is within the bound is not measured to the end.
fn grown(bound: f64, faces: &[Vec<Face>; 2], p: DVec3, extent: f64) -> f64 {
    let enough = bound * bound;
    let [first, second] = [0, 1].map(|cut| distance_squared(&faces[cut], p, enough));
    bound.max(first.max(second).sqrt().min(extent))
}

fn of_octants(
    stars: &Stars<'_>,
    finer: &Stars<'_>,
    firsts: &[u32],
    run: &Run,
) -> Result<Vec<f32>, Cancelled> {
    let level = stars.level;
    let parts = par::blocks(run, level.codes.len(), BLOCK, |block| {
        let mut faces = [Vec::new(), Vec::new()];
        let bound = |i: usize| {
            if level.crossed[i].any == 0 {
                return stars.extent() as f32;
            }
            stars.faces(i, &mut faces);
            let first = firsts[i] as usize;
            let children = first..first + level.masks[i].count_ones() as usize;
            let extent = stars.extent();
            children.fold(0.0, |b, c| grown(b, &faces, finer.vertices[c], extent)) as f32
        };
        block.map(bound).collect::<Vec<_>>()
    })?;
    Ok(parts.concat())
}

/// How far the patches of a level are from those round the children of their octants, for each octant
/// of a patch.
fn of_patches(
    stars: &Stars<'_>,
    finer: &Stars<'_>,
    firsts: &[u32],
    run: &Run,
) -> Result<Vec<(u32, f32)>, Cancelled> {
    let level = stars.level;
    let reaches = finer.reaches(run)?;
    let below = Below { stars: finer, masks: &level.masks, firsts, reaches: &reaches };
    let extent = stars.extent();
    let parts = par::blocks(run, level.codes.len(), BLOCK, |block| {
        let mut found = Vec::new();
        for i in block {
            if level.crossed[i].any != 0 && level.shapes[i] < EVEN {
                let off = below.furthest([stars.vertices[i]], [i as u32]);
                found.push((i as u32, off.min(extent) as f32));
            }
            // Each edge by the octant on whose low sides it lies.
            for edge in [0, 4, 8].into_iter().filter(|e| level.crossed[i].any >> e & 1 == 1) {
                let Some(octants) = stars.octants(i, edge) else { continue };
                let ring = octants.map(|o| stars.vertices[o as usize]);
                if is_flat(level, octants, ring, stars.size) {
                    continue;
                }
                let off = below.furthest(middles(ring), octants);
                found.extend(octants.map(|octant| (octant, off.min(extent) as f32)));
            }
        }
        found
    })?;
    Ok(parts.concat())
}

/// The middles of both diagonals of a patch, and of the triangles that these make.
fn middles([a, b, c, d]: [DVec3; 4]) -> [DVec3; 6] {
    let [p, q, r, s] = [a + b + c, a + c + d, b + c + d, b + d + a].map(|sum| sum / 3.0);
    [(a + c) / 2.0, (b + d) / 2.0, p, q, r, s]
}

/// Whether a patch is so flat, and its octants face so much the same way, that it keeps near to what its
/// octants hold.
fn is_flat(level: &Level, octants: [u32; 4], ring: [DVec3; 4], size: u32) -> bool {
    const SAME_WAY: f64 = 0.9;
    const FLAT: f64 = 0.05;
    let [a, b, c, d] = ring;
    let normal = (c - a).cross(d - b).normalize_or_zero();
    let apart = (b - a).dot(normal).abs().max((d - a).dot(normal).abs());
    let normals = octants.map(|o| direction::unpacked(level.normals[o as usize]));
    let first = normals[0];
    apart <= FLAT * f64::from(size) && normals.iter().all(|n| n.dot(first) >= SAME_WAY)
}

/// How far patches are from the surface on the finest level: as far as the surface from them, or as the
/// octant's vertex from the nearest plane of its crossings.
fn of_vertices(
    stars: &Stars<'_>,
    own: &[f32],
    leaves: &Leaves,
    crossings: &Crossings,
    run: &Run,
) -> Result<Vec<f32>, Cancelled> {
    let level = stars.level;
    let parts = par::blocks(run, own.len(), BLOCK, |block| {
        let bound = |i: usize| {
            if level.crossed[i].any == 0 || level.shapes[i] >= EVEN {
                return own[i];
            }
            let vertex = stars.vertices[i];
            let mut least = f64::INFINITY;
            for found in leaves.found(i) {
                let Found::Edge(edge, _) = found else { continue };
                for sample in &crossings.samples[crossings.of(edge)] {
                    let way = vertex - crossings.edges[edge].at(sample);
                    least = least.min(way.dot(sample.normal.as_dvec3()).abs());
                }
            }
            own[i].max(least as f32)
        };
        block.map(bound).collect::<Vec<_>>()
    })?;
    Ok(parts.concat())
}

/// How far pieces of the border are from the patches round the octants of a level that they lie in.
/// Morton codes of finest cells have `shift` bits more than those of the level.
fn of_rim(
    stars: &Stars<'_>,
    rim: &Rim,
    shift: u32,
    run: &Run,
) -> Result<Vec<(u32, f32)>, Cancelled> {
    let groups: Vec<&[Piece]> =
        rim.pieces.chunk_by(|a, b| a.code >> shift == b.code >> shift).collect();
    let parts = par::blocks(run, groups.len(), BLOCK, |block| {
        let (mut faces, mut near) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        let mut found = Vec::with_capacity(block.len());
        for group in &groups[block] {
            let Ok(i) = stars.level.codes.binary_search(&(group[0].code >> shift)) else {
                continue;
            };
            stars.faces_near(i, &mut faces, &mut near);
            let bound = group.iter().fold(0.0, |b: f64, p| b.max(off(&faces, p.ends)));
            found.push((i as u32, bound.min(FAR * stars.extent()) as f32));
        }
        found
    })?;
    Ok(parts.concat())
}

/// How far no point of a piece is from either cut: that is no further from a face than its ends are.
fn off(faces: &[Vec<Face>; 2], ends: [DVec3; 2]) -> f64 {
    let of = |faces: &Vec<Face>| {
        let far = |face: &Face| face.distance_squared(ends[0]).max(face.distance_squared(ends[1]));
        faces.iter().map(far).fold(f64::INFINITY, f64::min)
    };
    of(&faces[0]).max(of(&faces[1])).sqrt()
}

fn of_leaves(
    stars: &Stars<'_>,
    leaves: &Leaves,
    crossings: &Crossings,
    vertices: &[DVec3],
    run: &Run,
) -> Result<Vec<f32>, Cancelled> {
    let count = leaves.codes.len();
    // Each edge once, by the octant on whose low sides it lies.
    let found = par::blocks(run, count, BLOCK, |block| {
        let mut found = Vec::new();
        for i in block {
            for what in leaves.found(i) {
                let Found::Edge(edge, local) = what else { continue };
                if local & 3 != 0 {
                    continue;
                }
                let bound = stars.ring(i, local).map_or(stars.extent(), |ring| {
                    let [first, second] = cuts(ring);
                    let of = |s: usize| {
                        let at = crossings.edges[edge].at(&crossings.samples[s]);
                        distance_squared(&first, at, 0.0).max(distance_squared(&second, at, 0.0))
                    };
                    crossings.of(edge).map(of).fold(0.0, f64::max).sqrt()
                });
                found.push((edge as u32, bound as f32));
            }
        }
        found
    })?;
    let mut of_edge = vec![0f32; crossings.edges.len()];
    for (edge, bound) in found.into_iter().flatten() {
        of_edge[edge as usize] = bound;
    }
    let parts = par::blocks(run, count, BLOCK, |block| {
        let (mut faces, mut near) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        let bound = |i: usize| {
            let mut bound = 0f64;
            let mut met = false;
            for what in leaves.found(i) {
                match what {
                    Found::Edge(edge, _) => bound = bound.max(of_edge[edge].into()),
                    Found::Vertex(v) => {
                        if !met {
                            // A vertex alone in its octant is near the patches beside it.
                            stars.faces_near(i, &mut faces, &mut near);
                            met = true;
                        }
                        bound = grown(bound, &faces, vertices[v], stars.extent());
                    }
                    Found::Border => {}
                }
            }
            let is_bare = !met && stars.level.crossed[i].any == 0;
            (if is_bare { stars.extent() } else { bound }) as f32
        };
        block.map(bound).collect::<Vec<_>>()
    })?;
    Ok(parts.concat())
}

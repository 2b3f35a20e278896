//! The mesh while it is simplified: a 2-complex of triangles whose edges may have any number of them.
//!
//! Points and faces are numbered along a space-filling curve and keep their numbers until the
//! next [`Complex::compact`]. The corners of each point form a linked list. A corner is numbered
//! 4 f + i; the side from corner i to the next one of face f goes by the same number.

use super::clearance::Patch;
use crate::octree::key::morton;
use crate::par;
use crate::quadric::Quadric;
use crate::radix::{self, Equal};
use glam::{DVec3, Vec3};

/// No face, no point, no corner.
pub const NONE: u32 = u32::MAX;

/// Faces of more points are not looked at in one block.
const BLOCK: usize = 1 << 14;

/// A face, and for each corner the next one at the same point.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    pub corners: [u32; 3],
    next: [u32; 3],
}

/// How free a point is, by the sides at it that are special: those that have not two faces, and seams.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// No special sides, and one fan.
    Free,
    /// On a curve of special sides.
    Curve,
    /// Where curves end, meet or touch, or more than one fan does.
    Corner,
}

/// The mesh.
#[derive(Debug)]
pub struct Complex {
    pub at: Vec<DVec3>,
    pub quadrics: Vec<Quadric>,
    pub ranks: Vec<Rank>,
    first: Vec<u32>,
    pub faces: Vec<Face>,
    /// Bit i tells that side i is a seam, on this face at least.
    pub seams: Vec<u8>,
    /// Sum of the areas of what a face stands for in the input, as vectors.
    pub stands_for: Vec<Vec3>,
    /// Numbers in the input.
    pub point_names: Vec<u32>,
    pub face_names: Vec<u32>,
    /// Faces that are left.
    pub count: usize,
}

/// An edge as seen from one of its ends.
#[derive(Debug, Clone, Copy)]
pub struct Spoke {
    /// The other end.
    pub to: u32,
    /// The least of the sides that lie on it.
    pub side: u32,
    pub faces: u32,
    pub seam: bool,
}

impl Spoke {
    /// What is kept in shape: borders, junctions and seams.
    pub fn is_special(&self) -> bool {
        self.faces != 2 || self.seam
    }
}

impl Complex {
    /// The complex of faces that name three points each, without seams and with all points free.
    pub fn new(points: &[DVec3], faces: &[[u32; 3]]) -> Self {
        let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let steps = (1u64 << place_bits(points.len().max(faces.len()))) - 1;
        let scale = steps as f64 / (high - low).max_element().max(f64::MIN_POSITIVE);
        let code = |p: DVec3| morton(((p - low) * scale).to_array().map(|x| x as u32));
        let mut used = vec![false; points.len()];
        faces.iter().flatten().for_each(|&p| used[p as usize] = true);
        let point_names = along_curve(points.len(), |i| used[i].then(|| code(points[i])));
        let mut numbers = vec![NONE; points.len()];
        point_names.iter().enumerate().for_each(|(new, &old)| numbers[old as usize] = new as u32);
        let face_names = along_curve(faces.len(), |f| {
            let [a, b, c] = faces[f].map(|p| points[p as usize]);
            Some(code((a + b + c) / 3.0))
        });
        let renumbered = par::map(&face_names, |&f| Face {
            corners: faces[f as usize].map(|p| numbers[p as usize]),
            next: [NONE; 3],
        });
        let mut complex = Self {
            at: par::map(&point_names, |&p| points[p as usize]),
            quadrics: vec![Quadric::default(); point_names.len()],
            ranks: vec![Rank::Free; point_names.len()],
            first: vec![NONE; point_names.len()],
            seams: vec![0; faces.len()],
            stands_for: Vec::new(),
            count: renumbered.len(),
            faces: renumbered,
            point_names,
            face_names,
        };
        complex.link();
        let areas = par::map(&complex.faces, |f| {
            let [a, b, c] = f.corners.map(|p| complex.at[p as usize]);
            ((b - a).cross(c - a) / 2.0).as_vec3()
        });
        complex.stands_for = areas;
        complex
    }

    /// Lists the corners of each point, the least first.
    fn link(&mut self) {
        for f in (0..self.faces.len()).rev() {
            for i in 0..3 {
                let first = &mut self.first[self.faces[f].corners[i] as usize];
                self.faces[f].next[i] = std::mem::replace(first, (4 * f + i) as u32);
            }
        }
    }

    pub fn is_alive(&self, face: u32) -> bool {
        self.faces[face as usize].corners[0] != NONE
    }

    pub fn places(&self, face: u32) -> [DVec3; 3] {
        self.faces[face as usize].corners.map(|p| self.at[p as usize])
    }

    /// A face with its places.
    pub fn patch(&self, face: u32) -> Patch {
        Patch { corners: self.faces[face as usize].corners, at: self.places(face) }
    }

    /// The corners at a point.
    pub fn around(&self, point: u32) -> impl Iterator<Item = u32> + '_ {
        let mut at = self.first[point as usize];
        std::iter::from_fn(move || {
            while at != NONE {
                let here = at;
                let face = &self.faces[(here >> 2) as usize];
                at = face.next[(here & 3) as usize];
                if face.corners[0] != NONE {
                    return Some(here);
                }
            }
            None
        })
    }

    /// Both ends of a side.
    pub fn ends(&self, side: u32) -> [u32; 2] {
        let (corners, i) = (self.faces[(side >> 2) as usize].corners, (side & 3) as usize);
        [corners[i], corners[(i + 1) % 3]]
    }

    /// The edges at a point, by their other ends.
    pub fn spokes(&self, point: u32, spokes: &mut Vec<Spoke>) {
        spokes.clear();
        for corner in self.around(point) {
            let (f, i) = (corner >> 2, corner & 3);
            let before = (i + 2) % 3;
            for (side, to) in [(i, (i + 1) % 3), (before, before)] {
                let seam = self.seams[f as usize] >> side & 1 == 1;
                let to = self.faces[f as usize].corners[to as usize];
                spokes.push(Spoke { to, side: 4 * f + side, faces: 1, seam });
            }
        }
        spokes.sort_unstable_by_key(|s| (s.to, s.side));
        spokes.dedup_by(|next, spoke| {
            let same = next.to == spoke.to;
            if same {
                spoke.faces += 1;
                spoke.seam |= next.seam;
            }
            same
        });
    }

    /// The sides of all edges with two faces for whose sides `holds`.
    pub fn sides_where(&self, holds: impl Fn(u32, u32) -> bool) -> Vec<u32> {
        let mut found = Vec::new();
        let mut sides = Vec::new();
        for p in 0..self.at.len() as u32 {
            sides.clear();
            for corner in self.around(p) {
                let (f, i) = (corner >> 2, corner & 3);
                for side in [4 * f + i, 4 * f + (i + 2) % 3] {
                    let [a, b] = self.ends(side);
                    sides.push((if a == p { b } else { a }, side));
                }
            }
            sides.retain(|&(to, _)| to > p);
            sides.sort_unstable();
            for edge in sides.chunk_by(|a, b| a.0 == b.0) {
                if let &[(_, one), (_, other)] = edge
                    && holds(one, other)
                {
                    found.extend([one, other]);
                }
            }
        }
        found
    }

    /// Ranks all points anew, and gives the least side of every edge with its faces.
    pub fn rank(&mut self) -> Vec<Spoke> {
        let starts: Vec<usize> = (0..self.at.len()).step_by(BLOCK).collect();
        let parts = par::map(&starts, |&start| {
            let (mut ranks, mut edges, mut spokes) = (Vec::new(), Vec::new(), Vec::new());
            for p in start as u32..(start + BLOCK).min(self.at.len()) as u32 {
                self.spokes(p, &mut spokes);
                ranks.push(self.rank_of(p, &spokes));
                edges.extend(spokes.iter().filter(|s| s.to > p));
            }
            (ranks, edges)
        });
        let (ranks, edges): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        self.ranks = ranks.concat();
        edges.concat()
    }

    fn rank_of(&self, point: u32, spokes: &[Spoke]) -> Rank {
        let special = |s: &&Spoke| s.is_special();
        let mut ends = spokes.iter().filter(special);
        let rank = match (ends.next(), ends.next(), ends.next()) {
            (None, ..) => Rank::Free,
            (Some(a), Some(b), None) if (a.faces, a.seam) == (b.faces, b.seam) => Rank::Curve,
            _ => return Rank::Corner,
        };
        if self.is_one_fan(point, spokes) { rank } else { Rank::Corner }
    }

    /// Whether the faces round a point hang together by edges at it.
    fn is_one_fan(&self, point: u32, spokes: &[Spoke]) -> bool {
        let place = |p: u32| spokes.partition_point(|s| s.to < p);
        let mut sets: Vec<usize> = (0..spokes.len()).collect();
        fn root(sets: &mut [usize], mut i: usize) -> usize {
            while sets[i] != i {
                sets[i] = sets[sets[i]];
                i = sets[i];
            }
            i
        }
        let mut parts = spokes.len();
        for corner in self.around(point) {
            let (face, i) = (self.faces[(corner >> 2) as usize], (corner & 3) as usize);
            let [a, b] = [1, 2].map(|k| place(face.corners[(i + k) % 3]));
            let (a, b) = (root(&mut sets, a), root(&mut sets, b));
            if a != b {
                sets[a] = b;
                parts -= 1;
            }
        }
        parts <= 1
    }

    /// Lets `gone` become `kept`, at `place`: the faces in `dying`, which have both, end.
    pub fn collapse(&mut self, kept: u32, gone: u32, place: DVec3, dying: &[u32]) {
        for &f in dying {
            self.hand_on(kept, gone, f);
        }
        for &f in dying {
            self.faces[f as usize].corners[0] = NONE;
        }
        self.count -= dying.len();
        // One list of the corners at both.
        let mut tail = NONE;
        let mut first = NONE;
        for point in [kept, gone] {
            let mut at = self.first[point as usize];
            while at != NONE {
                let (f, i) = ((at >> 2) as usize, (at & 3) as usize);
                let next = self.faces[f].next[i];
                if self.faces[f].corners[0] != NONE {
                    self.faces[f].corners[i] = kept;
                    match tail {
                        NONE => first = at,
                        tail => {
                            self.faces[(tail >> 2) as usize].next[(tail & 3) as usize] = at;
                        }
                    }
                    tail = at;
                }
                at = next;
            }
        }
        if tail != NONE {
            self.faces[(tail >> 2) as usize].next[(tail & 3) as usize] = NONE;
        }
        self.first[kept as usize] = first;
        self.first[gone as usize] = NONE;
        self.at[kept as usize] = place;
        let quadric = self.quadrics[gone as usize];
        self.quadrics[kept as usize] += quadric;
        let rank = self.ranks[kept as usize].max(self.ranks[gone as usize]);
        self.ranks[kept as usize] = rank;
    }

    /// What a dying face stands for goes to its neighbours, and so do its seams.
    fn hand_on(&mut self, kept: u32, gone: u32, dying: u32) {
        let corners = self.faces[dying as usize].corners;
        let Some(&apex) = corners.iter().find(|&&p| p != kept && p != gone) else { return };
        let half = self.stands_for[dying as usize] / 2.0;
        for end in [kept, gone] {
            let seam = (0..3).any(|i| {
                let side = [corners[i], corners[(i + 1) % 3]];
                self.seams[dying as usize] >> i & 1 == 1 && !side.contains(&(kept + gone - end))
            });
            let neighbour = self.around(end).map(|c| c >> 2).find(|&f| {
                let corners = self.faces[f as usize].corners;
                f != dying && corners.contains(&apex) && !corners.contains(&(kept + gone - end))
            });
            let Some(f) = neighbour else { continue };
            self.stands_for[f as usize] += half;
            if seam {
                let corners = self.faces[f as usize].corners;
                let on = |i: usize| {
                    let side = [corners[i], corners[(i + 1) % 3]];
                    side.contains(&apex) && side.contains(&end)
                };
                self.seams[f as usize] |= (0..3).filter(|&i| on(i)).map(|i| 1 << i).sum::<u8>();
            }
        }
    }

    /// Closes the gaps that gone points and faces have left. Gives the new number of every face.
    pub fn compact(&mut self) -> Vec<u32> {
        let mut face_numbers = vec![NONE; self.faces.len()];
        let mut point_numbers = vec![NONE; self.at.len()];
        let mut faces = 0;
        for f in 0..self.faces.len() {
            let corners = self.faces[f].corners;
            if corners[0] != NONE {
                corners.iter().for_each(|&p| point_numbers[p as usize] = 0);
                face_numbers[f] = faces as u32;
                self.faces[faces] = self.faces[f];
                self.seams[faces] = self.seams[f];
                self.stands_for[faces] = self.stands_for[f];
                self.face_names[faces] = self.face_names[f];
                faces += 1;
            }
        }
        self.faces.truncate(faces);
        self.seams.truncate(faces);
        self.stands_for.truncate(faces);
        self.face_names.truncate(faces);
        let mut points = 0;
        for p in 0..self.at.len() {
            if point_numbers[p] != NONE {
                point_numbers[p] = points as u32;
                self.at[points] = self.at[p];
                self.quadrics[points] = self.quadrics[p];
                self.ranks[points] = self.ranks[p];
                self.point_names[points] = self.point_names[p];
                points += 1;
            }
        }
        self.at.truncate(points);
        self.quadrics.truncate(points);
        self.ranks.truncate(points);
        self.point_names.truncate(points);
        for face in &mut self.faces {
            face.corners = face.corners.map(|p| point_numbers[p as usize]);
        }
        self.first.clear();
        self.first.resize(points, NONE);
        self.link();
        face_numbers
    }
}

/// The numbers below `count` in the order of their codes; those without one are left out.
fn along_curve(count: usize, code: impl Fn(usize) -> Option<u64> + Sync) -> Vec<u32> {
    let starts: Vec<usize> = (0..count).step_by(BLOCK).collect();
    let bits = number_bits(count);
    let blocks = par::map(&starts, |&start| {
        let range = start..(start + BLOCK).min(count);
        range.filter_map(|i| Some(code(i)? << bits | i as u64)).collect()
    });
    let number = |k: u64| (k & ((1 << bits) - 1)) as u32;
    radix::sort(blocks, 0, Equal::Keep).concat().into_iter().map(number).collect()
}

/// Bits of the numbers below `count`.
fn number_bits(count: usize) -> u32 {
    usize::BITS - count.leading_zeros()
}

/// Bits along each axis of codes that leave room for numbers up to `count`.
fn place_bits(count: usize) -> u32 {
    ((u64::BITS - number_bits(count)) / 3).min(21)
}

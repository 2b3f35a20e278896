//! A vertex for each sheet of the surface in an octant.
//!
//! Where two octants meet, the crossed edges on the border of their common face are an even number on
//! a closed surface. They are paired, so that the inside is cut off between the two of a pair; patches
//! on paired edges belong to one sheet, in both octants. A sheet's patches then form one ring round its
//! vertex, and an edge between two vertices has two patches, unless two pairs on one face join the same
//! two sheets: such pairs swap partners, which parts both sheets, until there are none.
//! Source: specification of LOD, A.9 no. 9; Schaefer, Ju, Warren, "Manifold Dual Contouring", 2007.

use super::cut::{Cut, Octant};
use super::edges::LOCAL;
use super::patches::Patch;
use super::tree::Lod;
use crate::radix::{self, Equal, Tagged};
use crate::run::{Cancelled, Run};
use glam::DVec3;

/// The vertices of patches, where an octant may have several.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Sheets {
    /// The vertex at each corner of each patch.
    pub rings: Vec<[u32; 4]>,
    /// The place in the cut of each vertex's octant.
    pub places: Vec<u32>,
    /// Vertices that share their octant with others: where they lie in finest cells, and which way
    /// their sheets face.
    pub apart: Vec<Option<(DVec3, DVec3)>>,
}

/// Two patches on the border of a common face, by the corner of each that comes before the face; on the way
/// round the face the inside begins at the first and ends at the second.
type Pair = [u32; 2];

/// The pairs on the face of two octants.
struct Face {
    octants: [u32; 2],
    pairs: Vec<Pair>,
}

impl Sheets {
    /// The sheets of the patches of a cut.
    pub(super) fn of(
        lod: &Lod,
        cut: &Cut,
        patches: &[Patch],
        run: &Run,
    ) -> Result<Self, Cancelled> {
        run.stage("sheets");
        let mut sides = Vec::with_capacity(4 * patches.len());
        for (i, patch) in patches.iter().enumerate() {
            for k in 0..4 {
                let (a, b) = (patch.ring[k], patch.ring[(k + 1) % 4]);
                if a != b {
                    let key = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
                    sides.push(Tagged { key, tag: (4 * i + k) as u64 });
                }
            }
        }
        run.check()?;
        let (mut simple, mut ambiguous) = (Vec::new(), Vec::new());
        for share in radix::sort(vec![sides], 0, Equal::Keep) {
            for group in share.chunk_by(|a, b| a.key == b.key) {
                let corners: Vec<u32> = group.iter().map(|side| side.tag as u32).collect();
                match corners[..] {
                    [] | [_] => {}
                    [p, q] => simple.push([p, q]),
                    _ => {
                        let octants = [(group[0].key >> 32) as u32, group[0].key as u32];
                        let ordered = around(cut, patches, octants, corners);
                        let pairs = ordered.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
                        ambiguous.push(Face { octants, pairs });
                    }
                }
            }
        }
        let mut touched = vec![false; if ambiguous.is_empty() { 0 } else { cut.entries.len() }];
        let mut known = 0;
        loop {
            run.check()?;
            let mut classes = Classes::new(patches);
            for &pair in &simple {
                classes.link(patches, pair);
            }
            for face in &ambiguous {
                face.pairs.iter().for_each(|&pair| classes.link(patches, pair));
            }
            let mut swapped = false;
            // A swap parts sheets; at borders of open surfaces it may not, and could go on for ever.
            let count = classes.count();
            if count <= known {
                return Ok(classes.sheets(lod, cut, patches));
            }
            known = count;
            touched.iter_mut().for_each(|t| *t = false);
            for face in &mut ambiguous {
                // Sheets that were parted in this round are looked at in the next.
                if face.octants.iter().any(|&o| touched[o as usize]) {
                    continue;
                }
                if let Some([i, j]) = face.doubled(patches, &mut classes) {
                    let ([a, b], [c, d]) = (face.pairs[i], face.pairs[j]);
                    // Either still begins where the inside does.
                    (face.pairs[i], face.pairs[j]) = ([a, d], [c, b]);
                    face.octants.iter().for_each(|&o| touched[o as usize] = true);
                    swapped = true;
                }
            }
            if !swapped {
                return Ok(classes.sheets(lod, cut, patches));
            }
        }
    }
}

impl Face {
    /// Two pairs that join the same two sheets.
    fn doubled(&self, patches: &[Patch], classes: &mut Classes) -> Option<[usize; 2]> {
        let mut joined =
            |pair: Pair| self.octants.map(|o| classes.find(corner_of(patches, pair[0], o)));
        let sheets: Vec<[u32; 2]> = self.pairs.iter().map(|&pair| joined(pair)).collect();
        let pairs = (0..sheets.len()).flat_map(|i| (0..i).map(move |j| [j, i]));
        pairs.into_iter().find(|&[i, j]| sheets[i] == sheets[j])
    }
}

/// The corner of octant `octant` at the side that begins at corner `side`.
fn corner_of(patches: &[Patch], side: u32, octant: u32) -> u32 {
    let (patch, k) = (side / 4, side % 4);
    let next = (k + 1) % 4;
    if patches[patch as usize].ring[k as usize] == octant { side } else { 4 * patch + next }
}

/// Sides in order round the face of two octants, beginning where the inside does.
fn around(cut: &Cut, patches: &[Patch], octants: [u32; 2], mut sides: Vec<u32>) -> Vec<u32> {
    let [a, b] = octants.map(|place| cut.octant(place));
    let (small, large) = if a.size <= b.size { (a, b) } else { (b, a) };
    let beside = |axis: &usize| {
        small.corner[*axis] == large.corner[*axis] + large.size
            || small.corner[*axis] + small.size == large.corner[*axis]
    };
    let axis = (0..3).find(beside).unwrap_or(0);
    let across = [(axis + 1) % 3, (axis + 2) % 3];
    let whole = 2 * small.size;
    // Twice the middle of a patch's edge in the face, how far that is round it, and whether the way
    // round runs along the edge's axis.
    let round = |side: u32| {
        let patch = &patches[side as usize / 4];
        let [u, v] = middle_doubled(cut, patch, across, small);
        let far = if v == 0 {
            u
        } else if u == whole {
            whole + v
        } else if v == whole {
            3 * whole - u
        } else {
            4 * whole - v
        };
        let with = far < 2 * whole;
        (far, with)
    };
    sides.sort_by_key(|&side| round(side).0);
    let first = sides[0];
    let patch = &patches[first as usize / 4];
    let leaves = patch.along == round(first).1;
    if leaves {
        sides.rotate_left(1);
    }
    sides
}

fn middle_doubled(cut: &Cut, patch: &Patch, across: [usize; 2], face: Octant) -> [u32; 2] {
    let owner = cut.octant(patch.owner);
    let local = &LOCAL[patch.edge as usize];
    across.map(|axis| {
        let at = if axis == local.axis {
            2 * owner.corner[axis] + owner.size
        } else {
            let way = usize::from(local.ways[1] / 2 == axis);
            2 * (owner.corner[axis] + local.sides[way] * owner.size)
        };
        at.saturating_sub(2 * face.corner[axis])
    })
}

/// Which corners belong together.
struct Classes {
    parents: Vec<u32>,
}

impl Classes {
    fn new(patches: &[Patch]) -> Self {
        let mut classes = Self { parents: (0..4 * patches.len() as u32).collect() };
        for (i, patch) in patches.iter().enumerate() {
            for k in 0..4 {
                let next = (k + 1) % 4;
                if patch.ring[k] == patch.ring[next] {
                    classes.join((4 * i + k) as u32, (4 * i + next) as u32);
                }
            }
        }
        classes
    }

    fn count(&self) -> usize {
        self.parents.iter().enumerate().filter(|&(corner, &above)| corner == above as usize).count()
    }

    fn find(&mut self, mut corner: u32) -> u32 {
        while self.parents[corner as usize] != corner {
            let above = self.parents[self.parents[corner as usize] as usize];
            self.parents[corner as usize] = above;
            corner = above;
        }
        corner
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }

    /// Joins the corners of two patches in both octants of the face between them.
    fn link(&mut self, patches: &[Patch], [p, q]: Pair) {
        let [patch, k] = [p / 4, p % 4];
        let octants = [k, (k + 1) % 4].map(|k| patches[patch as usize].ring[k as usize]);
        for octant in octants {
            self.join(corner_of(patches, p, octant), corner_of(patches, q, octant));
        }
    }

    fn sheets(mut self, lod: &Lod, cut: &Cut, patches: &[Patch]) -> Sheets {
        // Vertices in the order of their octants, then of their first corners.
        let mut roots = Vec::new();
        for (i, patch) in patches.iter().enumerate() {
            for k in 0..4 {
                let corner = (4 * i + k) as u32;
                if self.find(corner) == corner {
                    roots.push((patch.ring[k], corner));
                }
            }
        }
        roots.sort_unstable();
        let mut number = vec![0; 4 * patches.len()];
        let mut sheets = Sheets::default();
        for (i, &(place, root)) in roots.iter().enumerate() {
            number[root as usize] = i as u32;
            sheets.places.push(place);
        }
        let alone = |i: usize| {
            let place = |i: usize| roots.get(i).map(|r| r.0);
            (i == 0 || place(i - 1) != place(i)) && place(i + 1) != place(i)
        };
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO, 0.0); roots.len()];
        for (i, patch) in patches.iter().enumerate() {
            let mut vertex = |k: usize| number[self.find((4 * i + k) as u32) as usize];
            let ring = [0, 1, 2, 3].map(&mut vertex);
            sheets.rings.push(ring);
            let owner = cut.octant(patch.owner);
            let local = &LOCAL[patch.edge as usize];
            let mut middle = DVec3::from(owner.corner.map(f64::from));
            middle[local.axis] += f64::from(owner.size) / 2.0;
            for (way, side) in local.ways.into_iter().zip(local.sides) {
                middle[way / 2] += f64::from(side * owner.size);
            }
            let along = lod.along(local.axis);
            let facing = if patch.along { along } else { -along };
            for k in 0..4 {
                if ring[k] != ring[(k + 3) % 4] {
                    let sum = &mut sums[ring[k] as usize];
                    *sum = (sum.0 + middle, sum.1 + facing, sum.2 + 1.0);
                }
            }
        }
        sheets.apart = (0..roots.len())
            .map(|i| {
                let (middles, facing, count) = sums[i];
                let Octant { node, corner, size, .. } = cut.octant(sheets.places[i]);
                let middle = middles / f64::max(count, 1.0);
                let place = (lod.vertex(node, corner, size) + middle) / 2.0;
                (!alone(i)).then(|| (place, facing.normalize_or(lod.normal(node))))
            })
            .collect();
        sheets
    }
}

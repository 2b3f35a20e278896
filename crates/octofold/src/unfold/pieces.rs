//! Pieces: parts of a patch that are cut out of paper as one. Where a tree has facets on one
//! another, it is cut at hinges that part all such pairs (Straub and Prautzsch 2011); pieces are
//! joined again wherever that is possible.

use super::grid::Grid;
use super::hanging::{Hanging, NONE};
use super::patch::{Outline, Patch};
use super::plane::{Bounds, Motion, hull};
use super::room::Room;
use super::sets::Sets;
use glam::DVec2;

/// Facets that hang together by a tree of hinges.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Piece {
    /// The facets, in order.
    pub facets: Vec<u32>,
    /// Their hinges, in order, one fewer.
    pub tree: Vec<u32>,
}

impl Piece {
    /// A spanning tree of the whole patch.
    pub fn whole(patch: &Patch, tree: Vec<u32>) -> Self {
        Self { facets: (0..patch.len() as u32).collect(), tree }
    }

    /// What is left when hinges are cut.
    pub fn without(&self, patch: &Patch, cut: &[u32]) -> Vec<Self> {
        let kept: Vec<u32> = self.tree.iter().copied().filter(|h| !cut.contains(h)).collect();
        let local = |f: u32| self.facets.partition_point(|&g| g < f) as u32;
        let mut sets = Sets::singles(self.facets.len());
        for &h in &kept {
            let [a, b] = patch.ends[h as usize].map(local);
            sets.join(a, b);
        }
        let groups = sets.groups();
        let mut of = vec![0; self.facets.len()];
        let mut pieces: Vec<Self> = Vec::with_capacity(groups.len());
        for (number, group) in groups.into_iter().enumerate() {
            group.iter().for_each(|&i| of[i as usize] = number);
            let facets = group.into_iter().map(|i| self.facets[i as usize]).collect();
            pieces.push(Self { facets, tree: Vec::new() });
        }
        for h in kept {
            pieces[of[local(patch.ends[h as usize][0]) as usize]].tree.push(h);
        }
        pieces
    }
}

/// Hinges that part all facets which lie on one another: again and again the hinge between most such
/// pairs.
pub(super) fn parting(patch: &Patch, hanging: &Hanging<'_>) -> Vec<u32> {
    let mut paths: Vec<Vec<u32>> =
        hanging.list_pairs().into_iter().map(|[a, b]| path(patch, hanging, a, b)).collect();
    let mut counts = vec![0u32; patch.hinges.len()];
    paths.iter().flatten().for_each(|&h| counts[h as usize] += 1);
    let mut cut = Vec::new();
    while !paths.is_empty() {
        let most =
            (0..counts.len() as u32).max_by_key(|&h| (counts[h as usize], std::cmp::Reverse(h)));
        let Some(most) = most else { break };
        cut.push(most);
        paths.retain(|path| {
            let parted = path.contains(&most);
            if parted {
                path.iter().for_each(|&h| counts[h as usize] -= 1);
            }
            !parted
        });
    }
    cut
}

/// The hinges between two facets.
fn path(patch: &Patch, hanging: &Hanging<'_>, a: u32, b: u32) -> Vec<u32> {
    let climb = |mut at: u32| {
        let mut way = Vec::new();
        while hanging.parent(at) != NONE {
            way.push(hanging.by(at));
            at = patch.other(hanging.by(at), at);
        }
        way
    };
    let (mut up, mut down) = (climb(a), climb(b));
    while let (Some(x), Some(y)) = (up.last(), down.last())
        && x == y
    {
        up.pop();
        down.pop();
    }
    up.append(&mut down);
    up
}

/// Joins pieces at hinges, in the order given, wherever the facets of both stay apart and the
/// result fits the room.
pub(super) fn join(
    patch: &Patch,
    pieces: Vec<Piece>,
    order: &[u32],
    room: Option<&Room>,
) -> Vec<Piece> {
    let mut places = vec![Motion::REST; patch.len()];
    let mut of = vec![0u32; patch.len()];
    let mut laid: Vec<Option<Laid>> = Vec::with_capacity(pieces.len());
    for (number, piece) in pieces.into_iter().enumerate() {
        for (f, motion) in patch.spread(piece.facets[0], &piece.tree) {
            places[f as usize] = motion;
            of[f as usize] = number as u32;
        }
        laid.push(Some(Laid::new(patch, piece, &places)));
    }
    for &h in order {
        let [a, b] = patch.ends[h as usize];
        let [i, j] = [a, b].map(|f| of[f as usize] as usize);
        if i == j {
            continue;
        }
        let (Some(x), Some(y)) = (laid[i].take(), laid[j].take()) else { continue };
        let swap = x.piece.facets.len() < y.piece.facets.len();
        let (mut large, small, f, g) = if swap { (y, x, b, a) } else { (x, y, a, b) };
        let beside = places[f as usize].after(&patch.beyond(h, f));
        let motion = beside.after(&places[g as usize].inverse());
        let [kept, gone] = if swap { [j, i] } else { [i, j] };
        if large.takes(patch, &small, &motion, &places, room) {
            for &f in &small.piece.facets {
                places[f as usize] = motion.after(&places[f as usize]);
                of[f as usize] = kept as u32;
            }
            large.add(patch, small, &motion, h, &places);
            laid[kept] = Some(large);
        } else {
            (laid[kept], laid[gone]) = (Some(large), Some(small));
        }
    }
    let mut pieces: Vec<Piece> = laid.into_iter().flatten().map(|l| l.piece).collect();
    for piece in &mut pieces {
        piece.facets.sort_unstable();
        piece.tree.sort_unstable();
    }
    pieces.sort_unstable_by_key(|p| p.facets[0]);
    pieces
}

/// A piece in the plane.
struct Laid {
    piece: Piece,
    outlines: Vec<(Bounds, Outline)>,
    grid: Grid,
    hull: Vec<DVec2>,
    area: f64,
}

impl Laid {
    fn new(patch: &Patch, piece: Piece, places: &[Motion]) -> Self {
        let place = |&f: &u32| {
            let outline = patch.outlines[f as usize].placed(&places[f as usize]);
            (outline.bounds(), outline)
        };
        let outlines: Vec<(Bounds, Outline)> = piece.facets.iter().map(place).collect();
        let mut grid = Grid::new(outlines.len(), patch.size);
        for (i, (bounds, _)) in outlines.iter().enumerate() {
            grid.insert(i as u32, bounds);
        }
        let mut points: Vec<DVec2> =
            outlines.iter().flat_map(|(_, o)| o.points().to_vec()).collect();
        let area = outlines.iter().map(|(_, o)| o.area()).sum();
        Self { piece, outlines, grid, hull: hull(&mut points), area }
    }

    /// True where `small`, moved, stays off this piece and both fit the room together.
    fn takes(
        &self,
        patch: &Patch,
        small: &Self,
        motion: &Motion,
        places: &[Motion],
        room: Option<&Room>,
    ) -> bool {
        if let Some(room) = room {
            let moved = small.hull.iter().map(|&p| motion.at(p));
            let mut points: Vec<DVec2> = self.hull.iter().copied().chain(moved).collect();
            if self.area + small.area > room.area() || room.excess(&hull(&mut points)) > 1.0 {
                return false;
            }
        }
        small.piece.facets.iter().all(|&f| {
            let motion = motion.after(&places[f as usize]);
            let outline = patch.outlines[f as usize].placed(&motion);
            let bounds = outline.bounds();
            let mut meets = false;
            self.grid.near(&bounds, |i| {
                let (other, shape) = &self.outlines[i as usize];
                meets = bounds.meet(other, patch.slack) && outline.meets(shape, patch.slack);
                meets
            });
            !meets
        })
    }

    fn add(&mut self, patch: &Patch, small: Self, motion: &Motion, hinge: u32, places: &[Motion]) {
        let before = self.outlines.len();
        self.area += small.area;
        self.hull.extend(small.hull.iter().map(|&p| motion.at(p)));
        self.hull = hull(&mut self.hull);
        for &f in &small.piece.facets {
            let outline = patch.outlines[f as usize].placed(&places[f as usize]);
            self.outlines.push((outline.bounds(), outline));
        }
        self.piece.facets.extend(small.piece.facets);
        self.piece.tree.extend(small.piece.tree);
        self.piece.tree.push(hinge);
        let from = if self.outlines.len().ilog2() > before.ilog2() {
            self.grid = Grid::new(2 * self.outlines.len(), patch.size);
            0
        } else {
            before
        };
        for i in from..self.outlines.len() {
            self.grid.insert(i as u32, &self.outlines[i].0);
        }
    }
}

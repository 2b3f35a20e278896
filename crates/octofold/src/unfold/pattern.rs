//! The result of unfolding, as numbers: pages of pieces, each a chain of flat faces.
//!
//! Coordinates on paper are whole [`STEP`]s from the lower left corner of the page, x to the right
//! and y up, seen from the printed side. Where two faces of a piece share a corner they have the very
//! same coordinates, and so has what is written of them.

/// Steps per millimetre.
pub const STEPS: i64 = 100_000_000;

/// Length of a step in millimetres: the eighth decimal.
pub const STEP: f64 = 1.0 / STEPS as f64;

/// A point on paper, in steps.
pub type Spot = [i64; 2];

/// Sheets of paper with everything on them.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// The faces that are unfolded, in millimetres.
    pub mesh: PatternMesh,
    /// Width and height of a page in millimetres.
    pub page: [f64; 2],
    /// How many pages there are.
    pub pages: u32,
    /// Pieces to cut out.
    pub pieces: Vec<Piece>,
    /// Loose hinges to cut out.
    pub strips: Vec<Strip>,
    /// Edges of the mesh that are glued, as they are numbered on paper from 1 on: how many.
    pub seams: u32,
}

/// Polygons whose coordinates are in millimetres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PatternMesh {
    /// Points.
    pub points: Vec<[f64; 3]>,
    /// Points of each face, counter-clockwise seen from the printed side. A face with holes visits
    /// some points twice.
    pub faces: Vec<Vec<u32>>,
    /// Triangles of the input that each face covers.
    pub triangles: Vec<Vec<u32>>,
    /// Colour of each face, where the model has any.
    pub colours: Option<Vec<[u8; 3]>>,
    /// Millimetres for each unit of the model.
    pub scale: f64,
    /// What lies at the origin, in the model's coordinates.
    pub middle: [f64; 3],
}

impl PatternMesh {
    /// A place in the model's coordinates.
    pub fn in_model(&self, place: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| place[axis] / self.scale + self.middle[axis])
    }
}

/// A piece of paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// The page that it is on, counted from 0.
    pub page: u32,
    /// Its faces.
    pub tiles: Vec<Tile>,
    /// Its tabs.
    pub tabs: Vec<Tab>,
}

/// A polygon of a piece: a face, or a part of one that has holes.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// The face of the mesh.
    pub face: u32,
    /// Its corners, counter-clockwise.
    pub corners: Vec<Corner>,
}

/// A corner of a tile, and the side that begins there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Point of the mesh.
    pub point: u32,
    /// Where it lies.
    pub at: Spot,
    /// Number of the edge from here to the next corner. Seams come first, counted from 1.
    pub edge: u32,
    /// What happens there.
    pub fold: Fold,
}

/// What happens at a side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fold {
    /// The neighbour is turned away from the printed side by this many degrees, towards it where
    /// that is negative.
    Hinge(f64),
    /// It is cut, and glued to the other sides of the same number.
    Seam,
    /// It is cut: the model ends here.
    Border,
}

/// A tab, which is glued under another face.
#[derive(Debug, Clone, PartialEq)]
pub struct Tab {
    /// Number of the edge that it holds.
    pub edge: u32,
    /// Its outline, counter-clockwise; it begins with the ends of its side.
    pub outline: Vec<Spot>,
    /// Degrees by which it is folded away from the printed side.
    pub fold: f64,
}

/// A loose hinge, which is glued under both faces at an edge.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    /// Number of the edge that it holds.
    pub edge: u32,
    /// The page that it is on, counted from 0.
    pub page: u32,
    /// Its outline, counter-clockwise.
    pub outline: Vec<Spot>,
    /// The ends of the fold along its middle.
    pub fold: [Spot; 2],
}

/// A line of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crease {
    /// Its ends.
    pub ends: [Spot; 2],
    /// Degrees by which it is folded away from the printed side.
    pub fold: f64,
    /// A tab begins here.
    pub tab: bool,
}

/// Folds of fewer degrees than this are not drawn.
const FLAT: f64 = 0.1;

impl Tile {
    /// Its corners and the next ones.
    pub fn sides(&self) -> impl Iterator<Item = (&Corner, &Corner)> {
        self.corners.iter().zip(self.corners.iter().cycle().skip(1))
    }
}

impl Piece {
    /// Where scissors go: closed lines round the piece with its tabs, and round its holes.
    pub fn outlines(&self) -> Vec<Vec<Spot>> {
        let mut steps: Vec<[Spot; 2]> = Vec::new();
        let tab_on =
            |ends: [Spot; 2]| self.tabs.iter().find(|tab| tab.outline[..2] == [ends[1], ends[0]]);
        for (a, b) in self.tiles.iter().flat_map(Tile::sides) {
            if matches!(a.fold, Fold::Hinge(_)) {
                continue;
            }
            match tab_on([a.at, b.at]) {
                Some(tab) => {
                    let way: Vec<Spot> = tab.outline[1..].iter().copied().chain([b.at]).collect();
                    steps.extend(way.windows(2).map(|w| [w[0], w[1]]));
                }
                None => steps.push([a.at, b.at]),
            }
        }
        closed_lines(steps)
    }

    /// Where it is folded; flat folds inside a face are left out.
    pub fn creases(&self) -> Vec<Crease> {
        let mut creases = Vec::new();
        for (a, b) in self.tiles.iter().flat_map(Tile::sides) {
            match a.fold {
                // Either neighbour has the side; one of them is enough.
                Fold::Hinge(fold) if a.at < b.at && fold.abs() > FLAT => {
                    creases.push(Crease { ends: [a.at, b.at], fold, tab: false });
                }
                _ => {}
            }
        }
        creases.extend(self.tabs.iter().map(|tab| Crease {
            ends: [tab.outline[1], tab.outline[0]],
            fold: tab.fold,
            tab: true,
        }));
        creases
    }

    /// The sides that are glued, with their numbers, from corner to corner.
    pub fn seams(&self) -> impl Iterator<Item = (u32, [Spot; 2])> {
        let sides = self.tiles.iter().flat_map(Tile::sides);
        sides.filter(|(a, _)| a.fold == Fold::Seam).map(|(a, b)| (a.edge, [a.at, b.at]))
    }
}

/// Joins steps end to end into closed lines. Where several go on from one spot, the sharpest left
/// turn keeps lines apart that only touch.
fn closed_lines(mut steps: Vec<[Spot; 2]>) -> Vec<Vec<Spot>> {
    steps.sort_unstable();
    let mut used = vec![false; steps.len()];
    let mut lines = Vec::new();
    for first in 0..steps.len() {
        if used[first] {
            continue;
        }
        let mut line = Vec::new();
        let mut at = first;
        loop {
            used[at] = true;
            let [from, to] = steps[at];
            line.push(from);
            let begin = steps.partition_point(|s| s[0] < to);
            let onward = (begin..steps.len()).take_while(|&i| steps[i][0] == to);
            let open = onward.filter(|&i| !used[i]);
            let turn = |i: usize| turn(from, to, steps[i][1]);
            match open.max_by(|&i, &j| turn(i).total_cmp(&turn(j))) {
                Some(next) => at = next,
                None => break,
            }
        }
        lines.push(line);
    }
    lines
}

/// The angle by which the way from `a` over `b` to `c` turns left.
fn turn(a: Spot, b: Spot, c: Spot) -> f64 {
    let way = |p: Spot, q: Spot| glam::DVec2::new((q[0] - p[0]) as f64, (q[1] - p[1]) as f64);
    way(a, b).angle_to(way(b, c))
}

/// A length in steps as millimetres.
pub fn millimetres(steps: i64) -> f64 {
    steps as f64 / STEPS as f64
}

/// The nearest whole step to a length in millimetres.
pub fn steps(millimetres: f64) -> i64 {
    (millimetres * STEPS as f64).round() as i64
}

//! The walls in a slab of cells: how many there are, and then their points and triangles.

use super::crossings::{Cells, Crossings, Grid, Lattice};
use super::junction::{self, FIRST_INNER, STEPS};
use crate::bits;
use crate::surface::cell::{PATCHES, Patch};
use crate::volume::{Placement, Scalar};
use std::sync::LazyLock;

/// Of each mask, whether its corners hang together along edges, and the others do: no edge between
/// two of them is crossed, so there are two labels.
static TWO_PARTS: LazyLock<[bool; 256]> = LazyLock::new(|| {
    std::array::from_fn(|mask| [mask, 255 ^ mask].into_iter().all(hangs_together))
});

fn hangs_together(mask: usize) -> bool {
    let mut reached = mask & mask.wrapping_neg();
    for _ in 0..8 {
        let beside = (0..8).filter(|c| reached >> c & 1 == 1);
        reached |= beside.fold(0, |m, c| m | 1 << (c ^ 1) | 1 << (c ^ 2) | 1 << (c ^ 4)) & mask;
    }
    reached == mask
}

/// A slab of cells, with how much there is to write.
pub struct Slab {
    /// Where labels change, unless it is to be found again.
    pub crossings: Option<Crossings>,
    /// Own points on edges and faces.
    pub points: usize,
    /// Points inside cells.
    pub inner: usize,
    /// Triangles.
    pub triangles: usize,
}

impl Slab {
    /// Counts what is between the layers of `crossings`.
    pub fn of<T: Scalar + Into<u32>>(lattice: &Lattice<'_, T>, crossings: Crossings) -> Self {
        let (mut inner, mut triangles) = (0, 0);
        for (y, layer) in crossings.rows_of_cells() {
            let rows = crossings.samples(lattice, y, layer);
            let row = crossings.row_of_cells(y, layer);
            for w in 0..crossings.words {
                let Some(cells) = row.cells(w) else { continue };
                bits::ones(cells.mixed, |bit| {
                    let apart = cells.mask(bit);
                    if cells.is_even(bit) && TWO_PARTS[apart] {
                        // One loop, with as many triangles whichever side is inside.
                        triangles += PATCHES[apart].triangles().len();
                        return;
                    }
                    match Wall::of(&rows, &cells, 64 * w + bit, bit) {
                        Wall::Two { inside, .. } => triangles += PATCHES[inside].triangles().len(),
                        Wall::Many(labels) => {
                            let patch = junction::patch(&labels);
                            inner += patch.inner.len();
                            triangles += patch.triangles.len();
                        }
                    }
                });
            }
        }
        Self { points: crossings.own_points(), inner, triangles, crossings: Some(crossings) }
    }
}

/// What is between the labels of a cell.
enum Wall {
    /// Two labels: the higher one holds the corners in `inside`.
    Two { inside: usize, sides: [u32; 2] },
    /// The labels of the corners, three or more.
    Many([u32; 8]),
}

impl Wall {
    #[inline]
    fn of<T: Scalar + Into<u32>>(rows: &[&[T]; 4], cells: &Cells, x: usize, bit: usize) -> Self {
        let apart = cells.mask(bit);
        if cells.is_even(bit) && TWO_PARTS[apart] {
            let here = label(rows, x, 0);
            let other = label(rows, x, apart.trailing_zeros() as usize);
            let inside = if other > here { apart } else { 255 ^ apart };
            return Self::Two { inside, sides: [here.max(other), here.min(other)] };
        }
        Self::by_labels(std::array::from_fn(|c| label(rows, x, c)))
    }

    fn by_labels(labels: [u32; 8]) -> Self {
        let low = labels.into_iter().fold(u32::MAX, u32::min);
        let high = labels.into_iter().fold(0, u32::max);
        let mask = |of: u32| (0..8).fold(0, |m, c| m | usize::from(labels[c] == of) << c);
        let inside = mask(high);
        if inside | mask(low) == 255 {
            Self::Two { inside, sides: [high, low] }
        } else {
            Self::Many(labels)
        }
    }
}

/// The label at a corner of the cell at lattice index `x` of four rows.
#[inline]
fn label<T: Scalar + Into<u32>>(rows: &[&[T]; 4], x: usize, corner: usize) -> u32 {
    // Lattice index 0 is the ring.
    let index = (x + (corner & 1)).wrapping_sub(1);
    rows[corner >> 1].get(index).map_or(0, |&sample| sample.into())
}

/// Where a slab writes what it counted.
pub struct Place<'a> {
    /// Own points on edges and faces.
    pub points: &'a mut [[f64; 3]],
    /// Points inside cells.
    pub inner: &'a mut [[f64; 3]],
    /// Triangles, counter-clockwise seen from the lower label.
    pub triangles: &'a mut [[u32; 3]],
    /// Labels behind and in front of each triangle, the higher one first.
    pub sides: &'a mut [[u32; 2]],
    /// Number of the first own point; on the layer that the slab shares with the next one, numbers
    /// go on into those of the next slab.
    pub start: u32,
    /// Number of the first point inside a cell.
    pub inner_start: u32,
}

/// Writes the walls of a slab.
pub fn write<T: Scalar + Into<u32>>(
    lattice: &Lattice<'_, T>,
    crossings: &Crossings,
    placement: &Placement,
    mut place: Place<'_>,
) {
    let mut patches = *PATCHES;
    let mirrored = placement.determinant() < 0.0;
    if mirrored {
        patches.iter_mut().for_each(Patch::reverse);
    }
    let numbers = Numbers::new(crossings, placement, &mut place);
    let (written, inner) = (0, 0);
    let mut march =
        March { lattice, crossings, numbers, placement, patches, mirrored, place, written, inner };
    for (y, layer) in crossings.rows_of_cells() {
        march.row(y, layer);
    }
}

/// The number of the first point on each row of edges and of faces.
struct Numbers {
    edges: [Vec<u32>; 3],
    faces: [Vec<u32>; 3],
}

impl Numbers {
    /// Numbers all points layer by layer, and places those that are the slab's own.
    fn new(crossings: &Crossings, placement: &Placement, place: &mut Place<'_>) -> Self {
        let Crossings { layers, rows, edges: [x, y, z], faces: [fx, fy, fz], .. } = crossings;
        let mut numbers = Self { edges: Default::default(), faces: Default::default() };
        let Self { edges: [nx, ny, nz], faces: [nfx, nfy, nfz] } = &mut numbers;
        let mut next = 0;
        let mut number = |firsts: &mut Vec<u32>, grid: &Grid, at: [usize; 2], off: [f64; 3]| {
            let [y, layer] = at;
            firsts.push(place.start + next as u32);
            for (w, &word) in grid.row(y, layer).iter().enumerate() {
                if crossings.owns(layer) {
                    bits::ones(word, |bit| {
                        let index = [64 * w + bit, y, layers.start + layer];
                        // Lattice index 0 is the ring.
                        let index = std::array::from_fn(|a| index[a] as f64 - 1.0 + off[a]);
                        place.points[next] = placement.place(index);
                        next += 1;
                    });
                } else {
                    next += word.count_ones() as usize;
                }
            }
        };
        for layer in 0..=layers.len() {
            for row in 0..*rows {
                number(nx, x, [row, layer], [0.5, 0.0, 0.0]);
                number(ny, y, [row, layer], [0.0, 0.5, 0.0]);
                number(nfz, fz, [row, layer], [0.5, 0.5, 0.0]);
            }
            for row in (0..*rows).filter(|_| layer < layers.len()) {
                number(nz, z, [row, layer], [0.0, 0.0, 0.5]);
                number(nfx, fx, [row, layer], [0.0, 0.5, 0.5]);
                number(nfy, fy, [row, layer], [0.5, 0.0, 0.5]);
            }
        }
        numbers
    }
}

/// The way through the cells of a slab.
struct March<'a, T> {
    lattice: &'a Lattice<'a, T>,
    crossings: &'a Crossings,
    numbers: Numbers,
    placement: &'a Placement,
    patches: [Patch; 256],
    mirrored: bool,
    place: Place<'a>,
    /// Triangles written.
    written: usize,
    /// Points inside cells written.
    inner: usize,
}

impl<T: Scalar + Into<u32>> March<'_, T> {
    /// The walls in row `y` of the cells above `layer`.
    fn row(&mut self, y: usize, layer: usize) {
        let crossings = self.crossings;
        let samples = crossings.samples(self.lattice, y, layer);
        let four = [(y, layer), (y + 1, layer), (y, layer + 1), (y + 1, layer + 1)];
        let [low, beside, above, _] = four;
        // Number of the next point on each of the rows beside the cells: between mixed cells there
        // is none, so the numbers stand still there.
        let number =
            |firsts: &[u32], (y, layer): (usize, usize)| firsts[layer * crossings.rows + y];
        let [edges, faces] = [&self.numbers.edges, &self.numbers.faces];
        let mut next_x = four.map(|at| number(&edges[0], at));
        let mut next_y = [low, above].map(|at| number(&edges[1], at));
        let mut next_z = [low, beside].map(|at| number(&edges[2], at));
        let mut next_face = [
            [number(&faces[0], low); 2],
            [low, beside].map(|at| number(&faces[1], at)),
            [low, above].map(|at| number(&faces[2], at)),
        ];
        let row = crossings.row_of_cells(y, layer);
        for w in 0..crossings.words {
            let Some(cells) = row.cells(w) else { continue };
            bits::ones(cells.mixed, |bit| {
                let here = |word: u64| (word >> bit & 1) as u32;
                let mut points = [0; FIRST_INNER];
                points[..4].copy_from_slice(&next_x);
                for r in 0..2 {
                    points[4 + 2 * r] = next_y[r];
                    points[8 + 2 * r] = next_z[r];
                    next_y[r] += here(cells.on_y[r][0]);
                    next_z[r] += here(cells.on_z[r][0]);
                    points[5 + 2 * r] = next_y[r];
                    points[9 + 2 * r] = next_z[r];
                }
                for r in 0..4 {
                    next_x[r] += here(cells.on_x[r]);
                }
                match Wall::of(&samples, &cells, 64 * w + bit, bit) {
                    Wall::Two { inside, sides } => self.between_two(inside, sides, &points),
                    Wall::Many(labels) => {
                        let [fx, fy, fz] = &mut next_face;
                        let found = |axis: usize, (y, layer): (usize, usize)| {
                            here(crossings.faces[axis].row(y, layer)[w])
                        };
                        fx[1] = fx[0] + found(0, low);
                        for (axis, next) in [&*fx, &*fy, &*fz].into_iter().enumerate() {
                            points[12 + 2 * axis..14 + 2 * axis].copy_from_slice(next);
                        }
                        fx[0] = fx[1];
                        *fy = [fy[0] + found(1, low), fy[1] + found(1, beside)];
                        *fz = [fz[0] + found(2, low), fz[1] + found(2, above)];
                        let cell = [64 * w + bit, y, crossings.layers.start + layer];
                        self.between_many(&labels, &points, cell);
                    }
                }
            });
        }
    }

    #[inline]
    fn between_two(&mut self, inside: usize, sides: [u32; 2], points: &[u32; FIRST_INNER]) {
        for t in self.patches[inside].triangles() {
            self.place.triangles[self.written] = t.map(|e| points[e as usize]);
            self.place.sides[self.written] = sides;
            self.written += 1;
        }
    }

    fn between_many(&mut self, labels: &[u32; 8], points: &[u32; FIRST_INNER], cell: [usize; 3]) {
        let patch = junction::patch(labels);
        let first_inner = self.place.inner_start + self.inner as u32;
        for inner in &patch.inner {
            let off = inner.map(|steps| f64::from(steps) / f64::from(STEPS));
            let index = std::array::from_fn(|a| cell[a] as f64 - 1.0 + off[a]);
            self.place.inner[self.inner] = self.placement.place(index);
            self.inner += 1;
        }
        let number = |point: u8| match usize::from(point).checked_sub(FIRST_INNER) {
            Some(inner) => first_inner + inner as u32,
            None => points[point as usize],
        };
        for facet in &patch.triangles {
            let [a, b, c] = facet.points.map(number);
            let [behind, front] = [facet.behind, facet.front].map(|c| labels[c as usize]);
            let turned = (behind < front) != self.mirrored;
            self.place.triangles[self.written] = if turned { [b, a, c] } else { [a, b, c] };
            self.place.sides[self.written] = [behind.max(front), behind.min(front)];
            self.written += 1;
        }
    }
}

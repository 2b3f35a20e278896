//! The walls in a slab of cells: its points, and the triangles between them.

use super::crossings::{Crossings, Grid, Lattice};
use super::junction::{self, FIRST_INNER, STEPS};
use crate::bits;
use crate::surface::cell::{PATCHES, Patch};
use crate::volume::{Placement, Scalar};
use std::ops::Range;

/// What a slab yields. Its points are numbered: first its own on edges and faces, then those of the
/// next slab on the layer between both, then its own inside cells.
pub struct Walls {
    /// Own points on edges and faces.
    pub points: Vec<[f64; 3]>,
    /// Points inside cells.
    pub inner: Vec<[f64; 3]>,
    /// Number of the first point inside a cell.
    pub first_inner: u32,
    /// Triangles, counter-clockwise seen from the lower label.
    pub triangles: Vec<[u32; 3]>,
    /// Labels behind and in front of each triangle, the higher one first.
    pub sides: Vec<[u32; 2]>,
}

impl Walls {
    /// The walls in some layers of cells.
    pub fn of<T: Scalar + Into<u32>>(
        lattice: &Lattice<'_, T>,
        layers: Range<usize>,
        placement: &Placement,
    ) -> Self {
        let crossings = Crossings::of(lattice, layers);
        let mut patches = *PATCHES;
        let mirrored = placement.determinant() < 0.0;
        if mirrored {
            patches.iter_mut().for_each(Patch::reverse);
        }
        let (points, numbers) = Numbers::new(&crossings, lattice.dims[2] + 1, placement);
        let mut walls = Self {
            points,
            inner: Vec::new(),
            first_inner: numbers.next,
            triangles: Vec::new(),
            sides: Vec::new(),
        };
        let march = March { lattice, crossings: &crossings, numbers, placement, patches, mirrored };
        for layer in 0..crossings.layers.len() {
            for y in 0..crossings.rows - 1 {
                march.row(y, layer, &mut walls);
            }
        }
        walls
    }
}

/// The number of the first point on each row of edges and of faces.
struct Numbers {
    edges: [Vec<u32>; 3],
    faces: [Vec<u32>; 3],
    next: u32,
}

impl Numbers {
    /// Numbers all points layer by layer, and makes those that are the slab's own: those on its
    /// last layer are the next slab's, unless it is `top`, the last of all.
    fn new(crossings: &Crossings, top: usize, placement: &Placement) -> (Vec<[f64; 3]>, Self) {
        let Crossings { layers, rows, edges: [x, y, z], faces: [fx, fy, fz], .. } = crossings;
        let mut points = Vec::new();
        let mut numbers = Self { edges: Default::default(), faces: Default::default(), next: 0 };
        let Self { edges: [nx, ny, nz], faces: [nfx, nfy, nfz], next } = &mut numbers;
        let mut number = |firsts: &mut Vec<u32>, grid: &Grid, at: [usize; 2], off: [f64; 3]| {
            let [y, layer] = at;
            let own = layer < layers.len() || layers.end == top;
            firsts.push(*next);
            for (w, &word) in grid.row(y, layer).iter().enumerate() {
                *next += word.count_ones();
                if own {
                    bits::ones(word, |bit| {
                        let index = [64 * w + bit, y, layers.start + layer];
                        // Lattice index 0 is the ring.
                        let index = std::array::from_fn(|a| index[a] as f64 - 1.0 + off[a]);
                        points.push(placement.place(index));
                    });
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
        (points, numbers)
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
}

impl<T: Scalar + Into<u32>> March<'_, T> {
    /// The walls in row `y` of the cells above `layer`.
    fn row(&self, y: usize, layer: usize, walls: &mut Walls) {
        let Crossings { layers, words, rows, edges, faces } = self.crossings;
        let four = [(y, layer), (y + 1, layer), (y, layer + 1), (y + 1, layer + 1)];
        let [low, beside, above, _] = four;
        let samples = four.map(|(y, layer)| self.lattice.row(y, layers.start + layer));
        let x_rows = four.map(|(y, layer)| edges[0].row(y, layer));
        let y_rows = [low, above].map(|(y, layer)| edges[1].row(y, layer));
        let z_rows = [low, beside].map(|(y, layer)| edges[2].row(y, layer));
        // Number of the next point on each of the rows beside the cells: between mixed cells there
        // is none, so the numbers stand still there.
        let number = |firsts: &[u32], (y, layer): (usize, usize)| firsts[layer * rows + y];
        let mut next_x = four.map(|at| number(&self.numbers.edges[0], at));
        let mut next_y = [low, above].map(|at| number(&self.numbers.edges[1], at));
        let mut next_z = [low, beside].map(|at| number(&self.numbers.edges[2], at));
        let mut next_face = [
            [low, low].map(|at| number(&self.numbers.faces[0], at)),
            [low, beside].map(|at| number(&self.numbers.faces[1], at)),
            [low, above].map(|at| number(&self.numbers.faces[2], at)),
        ];
        for w in 0..*words {
            let pair = |row: &[u64]| [row[w], bits::next(row, w)];
            let on_x = x_rows.map(|row| row[w]);
            let (on_y, on_z) = (y_rows.map(pair), z_rows.map(pair));
            let crossed = on_x.iter().chain(on_y.as_flattened()).chain(on_z.as_flattened());
            bits::ones(crossed.fold(0, |a, b| a | b), |bit| {
                let here = |word: u64| (word >> bit & 1) as u32;
                let mut points = [0; 18];
                points[..4].copy_from_slice(&next_x);
                for r in 0..2 {
                    points[4 + 2 * r] = next_y[r];
                    points[5 + 2 * r] = next_y[r] + here(on_y[r][0]);
                    points[8 + 2 * r] = next_z[r];
                    points[9 + 2 * r] = next_z[r] + here(on_z[r][0]);
                    next_y[r] = points[5 + 2 * r];
                    next_z[r] = points[9 + 2 * r];
                }
                for r in 0..4 {
                    next_x[r] += here(on_x[r]);
                }
                let x = 64 * w + bit;
                let labels = corners(&samples, x);
                if self.between_two(&labels, &points, walls) {
                    return;
                }
                let [fx, fy, fz] = &mut next_face;
                let found = |grid: &Grid, (y, layer): (usize, usize)| here(grid.row(y, layer)[w]);
                fx[1] = fx[0] + found(&faces[0], low);
                for (axis, next) in [&*fx, &*fy, &*fz].into_iter().enumerate() {
                    points[12 + 2 * axis..14 + 2 * axis].copy_from_slice(next);
                }
                fx[0] = fx[1];
                for (side, at) in [low, beside].into_iter().enumerate() {
                    fy[side] += found(&faces[1], at);
                }
                for (side, at) in [low, above].into_iter().enumerate() {
                    fz[side] += found(&faces[2], at);
                }
                self.between_many(&labels, &points, [x, y, layers.start + layer], walls);
            });
        }
    }

    /// Places the wall in a cell of two labels, and tells whether it is one.
    fn between_two(&self, labels: &[u32; 8], points: &[u32; 18], walls: &mut Walls) -> bool {
        let (low, high) = labels
            .iter()
            .fold((u32::MAX, 0), |(low, high), &label| (low.min(label), high.max(label)));
        let mask = |of: u32| (0..8).fold(0, |m, c| m | usize::from(labels[c] == of) << c);
        let inside = mask(high);
        if inside | mask(low) != 255 {
            return false;
        }
        for t in self.patches[inside].triangles() {
            walls.triangles.push(t.map(|e| points[e as usize]));
            walls.sides.push([high, low]);
        }
        true
    }

    /// Places the walls in a cell of three labels or more.
    fn between_many(
        &self,
        labels: &[u32; 8],
        points: &[u32; 18],
        cell: [usize; 3],
        walls: &mut Walls,
    ) {
        let patch = junction::patch(labels);
        let first_inner = walls.first_inner + walls.inner.len() as u32;
        for inner in &patch.inner {
            let off = inner.map(|steps| f64::from(steps) / f64::from(STEPS));
            let index = std::array::from_fn(|a| cell[a] as f64 - 1.0 + off[a]);
            walls.inner.push(self.placement.place(index));
        }
        let number = |point: u8| match usize::from(point).checked_sub(FIRST_INNER) {
            Some(inner) => first_inner + inner as u32,
            None => points[point as usize],
        };
        for facet in &patch.triangles {
            let [a, b, c] = facet.points.map(number);
            let [behind, front] = [facet.behind, facet.front].map(|c| labels[c as usize]);
            let turned = (behind < front) != self.mirrored;
            walls.triangles.push(if turned { [b, a, c] } else { [a, b, c] });
            walls.sides.push([behind.max(front), behind.min(front)]);
        }
    }
}

/// The labels at the corners of the cell at lattice index `x` of four rows.
fn corners<T: Scalar + Into<u32>>(rows: &[&[T]; 4], x: usize) -> [u32; 8] {
    let mut labels = [0; 8];
    for (r, row) in rows.iter().enumerate() {
        if let Some(below) = x.checked_sub(1) {
            labels[2 * r] = row[below].into();
        }
        if let Some(&sample) = row.get(x) {
            labels[2 * r + 1] = sample.into();
        }
    }
    labels
}

//! The walls in a slab of cells: how many there are, and then their points and triangles.

use super::crossings::{Cells, Grid, Lattice, Level, Rise, Window};
use super::junction::{self, FIRST_INNER, Patch, STEPS};
use crate::bits;
use crate::surface::cell::{PATCHES, crossed};
use crate::volume::{Placement, Scalar};
use std::ops::Range;

/// How much there is to write for a slab of cells.
#[derive(Debug, Clone, Copy, Default)]
pub struct Size {
    /// Own points on edges and faces; those on the last layer are the next slab's.
    pub points: usize,
    /// Points inside cells.
    pub inner: usize,
    /// Triangles.
    pub triangles: usize,
}

impl Size {
    /// Counts what is in some layers of cells.
    pub fn of<T: Scalar + Into<u32>>(lattice: &Lattice<'_, T>, layers: Range<usize>) -> Self {
        let mut window = Window::below(lattice, layers.start);
        let mut size = Self { points: window.high.points(), ..Self::default() };
        for z in layers.clone() {
            window.raise(z);
            size.points += window.rise.points();
            if z + 1 < layers.end || lattice.is_top(z + 1) {
                size.points += window.high.points();
            }
            for y in 0..lattice.rows() - 1 {
                size.add_row(lattice, &window, [y, z]);
            }
        }
        size
    }

    fn add_row<T: Scalar + Into<u32>>(
        &mut self,
        lattice: &Lattice<'_, T>,
        window: &Window<'_, T>,
        [y, z]: [usize; 2],
    ) {
        let rows = lattice.rows_of_cells(y, z);
        let row = window.row_of_cells(y);
        for w in 0..lattice.words() {
            let mixed = row.mixed(w);
            if mixed == 0 {
                continue;
            }
            let cells = row.cells(w);
            self.triangles += cells.simple_triangles();
            bits::ones(mixed & !cells.simple, |bit| match Wall::of(labels(&rows, 64 * w + bit)) {
                Wall::Two { inside, .. } => {
                    self.triangles += PATCHES[inside].triangles().len();
                }
                Wall::Many { patch, .. } => {
                    self.inner += patch.inner.len();
                    self.triangles += patch.triangles.len();
                }
            });
        }
    }
}

/// What is between the labels of a cell.
enum Wall {
    /// Two labels: the higher one holds the corners in `inside`.
    Two { inside: usize, sides: [u32; 2] },
    /// Three labels or more.
    Many { labels: [u32; 8], patch: &'static Patch },
}

impl Wall {
    fn of(labels: [u32; 8]) -> Self {
        let low = labels.into_iter().fold(u32::MAX, u32::min);
        let high = labels.into_iter().fold(0, u32::max);
        let [lowest, inside] = [low, high].map(|label| junction::corners(&labels, label));
        if inside | lowest == 255 {
            Self::Two { inside, sides: [high, low] }
        } else {
            Self::Many { labels, patch: junction::patch_of_many(&labels, lowest, inside) }
        }
    }
}

/// The labels of the cell at lattice index `x` of four rows.
fn labels<T: Scalar + Into<u32>>(rows: &[&[T]; 4], x: usize) -> [u32; 8] {
    std::array::from_fn(|corner| label(rows, x, corner))
}

/// The label at a corner of the cell at lattice index `x` of four rows.
#[inline]
fn label<T: Scalar + Into<u32>>(rows: &[&[T]; 4], x: usize, corner: usize) -> u32 {
    // Lattice index 0 is the ring.
    let index = (x + (corner & 1)).wrapping_sub(1);
    rows[corner >> 1 & 3].get(index).map_or(0, |&sample| sample.into())
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

/// Writes the walls in some layers of cells.
pub fn write<T: Scalar + Into<u32>>(
    lattice: &Lattice<'_, T>,
    layers: Range<usize>,
    placement: &Placement,
    place: Place<'_>,
) {
    let mirrored = placement.determinant() < 0.0;
    let stencils = std::array::from_fn(|inside| Stencil::of(inside, mirrored));
    let (made, written, inner) = (0, 0, 0);
    let mut march = March { lattice, placement, stencils, mirrored, place, made, written, inner };
    let mut window = Window::below(lattice, layers.start);
    let mut low = LevelNumbers::default();
    let mut high = march.number_level(&window.high, layers.start, true);
    for z in layers.clone() {
        window.raise(z);
        std::mem::swap(&mut low, &mut high);
        let rise = march.number_rise(&window.rise, z);
        let own = z + 1 < layers.end || lattice.is_top(z + 1);
        high = march.number_level(&window.high, z + 1, own);
        for y in 0..lattice.rows() - 1 {
            march.row(&window, Counters::new(y, [&low, &high], &rise), [y, z]);
        }
    }
}

/// The number of the first point on each row of a lattice layer.
#[derive(Default)]
struct LevelNumbers {
    edges: [Vec<u32>; 2],
    faces: Vec<u32>,
}

/// The number of the first point on each row between two lattice layers.
struct RiseNumbers {
    edges: Vec<u32>,
    faces: [Vec<u32>; 2],
}

/// Numbers of the next point on each of the rows beside a row of cells: between mixed cells there
/// is none, so they stand still there.
struct Counters {
    /// The four rows of edges along x, two along y, two along z, and the point after the next one
    /// on each of the last four. They are read and written together, which costs least.
    edges: [u32; 16],
    /// The one row of faces across x, two across y, two across z.
    faces: [u32; 5],
}

impl Counters {
    fn new(y: usize, [low, high]: [&LevelNumbers; 2], rise: &RiseNumbers) -> Self {
        let ([low_x, low_y], [high_x, high_y]) = (&low.edges, &high.edges);
        let along_x = [low_x[y], low_x[y + 1], high_x[y], high_x[y + 1]];
        let [a, b, c, d] = [low_y[y], high_y[y], rise.edges[y], rise.edges[y + 1]];
        let [e, f, g, h] = along_x;
        let [x, across] = &rise.faces;
        Self {
            edges: [e, f, g, h, a, b, c, d, a + 1, b + 1, c + 1, d + 1, 0, 0, 0, 0],
            faces: [x[y], across[y], across[y + 1], low.faces[y], high.faces[y]],
        }
    }

    /// Goes on to the next cell.
    #[inline]
    fn step(&mut self, steps: [u32; 16]) {
        for (next, step) in self.edges.iter_mut().zip(steps) {
            *next += step;
        }
    }
}

/// Most triangles of a cell of two labels.
const MOST: usize = 5;

/// Most triangles of a simple cell.
const MOST_SIMPLE: usize = 4;

/// The patch of a cell of two labels, made for writing it without a branch.
#[derive(Clone, Copy)]
struct Stencil {
    count: usize,
    /// Places in [`Counters::edges`].
    triangles: [[u8; 3]; MOST],
    /// See [`steps`].
    steps: [u32; 16],
}

impl Stencil {
    fn of(inside: usize, mirrored: bool) -> Self {
        let mut patch = PATCHES[inside];
        if mirrored {
            patch.reverse();
        }
        let crossed = crossed(inside);
        let crossed: [u32; 12] = std::array::from_fn(|e| u32::from(crossed >> e & 1));
        // Of the edges along y and z, one row has two: the second comes after the first, if that is
        // crossed.
        let place = |e: u8| match e {
            0..4 => e,
            _ => {
                let row = 2 + e / 2;
                let second = e % 2 == 1 && crossed[usize::from(e) - 1] == 1;
                if second { row + 4 } else { row }
            }
        };
        let mut triangles = [[0; 3]; MOST];
        for (to, from) in triangles.iter_mut().zip(patch.triangles()) {
            *to = from.map(place);
        }
        Self { count: patch.triangles().len(), triangles, steps: steps(&crossed) }
    }
}

/// How many points [`Counters::edges`] go on from a cell to the next one, by its crossed edges. Those
/// at high x are on the way of the next cell.
fn steps(crossed: &[u32; 12]) -> [u32; 16] {
    let [x0, x1, x2, x3, y0, _, y1, _, z0, _, z1, _] = *crossed;
    [x0, x1, x2, x3, y0, y1, z0, z1, y0, y1, z0, z1, 0, 0, 0, 0]
}

/// The way through the cells of a slab.
struct March<'a, T> {
    lattice: &'a Lattice<'a, T>,
    placement: &'a Placement,
    stencils: [Stencil; 256],
    mirrored: bool,
    place: Place<'a>,
    /// Points on edges and faces, own or not.
    made: usize,
    /// Triangles written.
    written: usize,
    /// Points inside cells written.
    inner: usize,
}

impl<T: Scalar + Into<u32>> March<'_, T> {
    fn number_level(&mut self, level: &Level, z: usize, own: bool) -> LevelNumbers {
        let mut numbers = LevelNumbers::default();
        let ([on_x, on_y], [x, y]) = (&level.edges, &mut numbers.edges);
        for row in 0..self.lattice.rows() {
            x.push(self.number(on_x, [row, z], [0.5, 0.0, 0.0], own));
            y.push(self.number(on_y, [row, z], [0.0, 0.5, 0.0], own));
            numbers.faces.push(self.number(&level.faces, [row, z], [0.5, 0.5, 0.0], own));
        }
        numbers
    }

    fn number_rise(&mut self, rise: &Rise, z: usize) -> RiseNumbers {
        let mut numbers = RiseNumbers { edges: Vec::new(), faces: Default::default() };
        let ([across_x, across_y], [x, y]) = (&rise.faces, &mut numbers.faces);
        for row in 0..self.lattice.rows() {
            numbers.edges.push(self.number(&rise.edges, [row, z], [0.0, 0.0, 0.5], true));
            x.push(self.number(across_x, [row, z], [0.0, 0.5, 0.5], true));
            y.push(self.number(across_y, [row, z], [0.5, 0.0, 0.5], true));
        }
        numbers
    }

    /// Numbers the points of a row, and places those that are the slab's own, `off` away from the
    /// lattice points. The number of the first one.
    fn number(&mut self, grid: &Grid, [y, z]: [usize; 2], off: [f64; 3], own: bool) -> u32 {
        let first = self.place.start + self.made as u32;
        for (w, &word) in grid.row(y).iter().enumerate().filter(|(_, word)| **word != 0) {
            let count = word.count_ones() as usize;
            if own {
                let placement = *self.placement;
                let mut left = word;
                for point in &mut self.place.points[self.made..self.made + count] {
                    let index = [64 * w + left.trailing_zeros() as usize, y, z];
                    // Lattice index 0 is the ring.
                    let index = std::array::from_fn(|a| index[a] as f64 - 1.0 + off[a]);
                    *point = placement.place(index);
                    left &= left - 1;
                }
            }
            self.made += count;
        }
        first
    }

    /// The walls in row `y` of the cells above layer `z`.
    fn row(&mut self, window: &Window<'_, T>, mut next: Counters, [y, z]: [usize; 2]) {
        let rows = self.lattice.rows_of_cells(y, z);
        let row = window.row_of_cells(y);
        for w in 0..self.lattice.words() {
            let mixed = row.mixed(w);
            if mixed == 0 {
                continue;
            }
            let cells = row.cells(w);
            for group in 0..8 {
                let mixed = mixed >> (8 * group) & 255;
                if mixed == 0 {
                    continue;
                }
                let masks = cells.masks(group);
                bits::ones(mixed, |place| {
                    let bit = 8 * group + place;
                    let x = 64 * w + bit;
                    if cells.simple >> bit & 1 == 1 {
                        let apart = usize::from(masks[place & 7]);
                        let here = label(&rows, x, 0);
                        let other = label(&rows, x, apart.trailing_zeros() as usize);
                        let inside = if other > here { apart } else { 255 ^ apart };
                        let sides = [here.max(other), here.min(other)];
                        self.between_two::<MOST_SIMPLE>(inside, sides, &mut next);
                        return;
                    }
                    match Wall::of(labels(&rows, x)) {
                        Wall::Two { inside, sides } => {
                            self.between_two::<MOST>(inside, sides, &mut next);
                        }
                        Wall::Many { labels, patch } => {
                            let points = points_of_many(window, &cells, [x, y], &mut next);
                            self.between_many(&labels, patch, &points, [x, y, z]);
                        }
                    }
                });
            }
        }
    }

    /// Writes the walls of a cell of two labels, which are at most `N` triangles.
    #[inline]
    fn between_two<const N: usize>(&mut self, inside: usize, sides: [u32; 2], next: &mut Counters) {
        let &Stencil { count, ref triangles, ref steps } = &self.stencils[inside & 255];
        let triangle = |t: &[u8; 3]| t.map(|place| next.edges[usize::from(place) % 16]);
        let Place { triangles: to, sides: to_sides, .. } = &mut self.place;
        // As many every time, as long as there is room: what is too much is overwritten.
        let most = self.written..self.written + N;
        if let (Some(to), Some(to_sides)) = (to.get_mut(most.clone()), to_sides.get_mut(most)) {
            for (to, t) in to.iter_mut().zip(&triangles[..N]) {
                *to = triangle(t);
            }
            to_sides.fill(sides);
        } else {
            let room = self.written..self.written + count;
            for (to, t) in to[room.clone()].iter_mut().zip(triangles) {
                *to = triangle(t);
            }
            to_sides[room].fill(sides);
        }
        self.written += count;
        next.step(*steps);
    }

    fn between_many(
        &mut self,
        labels: &[u32; 8],
        patch: &Patch,
        points: &[u32; FIRST_INNER],
        cell: [usize; 3],
    ) {
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

/// The points on the edges and faces of the cell at lattice index `x` of row `y`.
fn points_of_many<T>(
    window: &Window<'_, T>,
    cells: &Cells,
    [x, y]: [usize; 2],
    next: &mut Counters,
) -> [u32; FIRST_INNER] {
    let crossed = cells.crossed(x % 64);
    let mut points = [0; FIRST_INNER];
    points[..4].copy_from_slice(&next.edges[..4]);
    for row in 4..8 {
        let e = 2 * row - 4;
        points[e] = next.edges[row];
        points[e + 1] = next.edges[row] + crossed[e];
    }
    next.step(steps(&crossed));
    let found = |grid: &Grid, y: usize| (grid.row(y)[x / 64] >> (x % 64) & 1) as u32;
    let [across_x, across_y] = &window.rise.faces;
    let [fx, faces @ ..] = &mut next.faces;
    points[12] = *fx;
    *fx += found(across_x, y);
    points[13] = *fx;
    points[14..].copy_from_slice(faces);
    let steps = [
        found(across_y, y),
        found(across_y, y + 1),
        found(&window.low.faces, y),
        found(&window.high.faces, y),
    ];
    for (next, step) in faces.iter_mut().zip(steps) {
        *next += step;
    }
    points
}

//! The mixed cells of a volume in bricks of 8^3, all in Morton order.
//!
//! Only bricks that the surface meets are kept: 512 bits that tell the mixed cells, 512 that tell
//! which samples are inside, and a rank, so that any cell is found in a few steps and the cells of
//! any octant are one slice. All other bricks are two bits in a grid.
//!
//! Sample 0 of each axis lies at [`Cells::shift`], a power of two above the number of samples: the
//! octree's planes fall on the volume's own, whether or not a ring of outside samples closes it.

use crate::bits;
use crate::octree::key::morton;
use crate::par;
use crate::run::Run;
use crate::surface::cell::{PATCHES, crossed, edge_axis, edge_corner};
use crate::surface::slab::{Frame, Slab};
use crate::volume::{Volume, VolumeError};
use glam::DVec3;
use std::ops::Range;

/// Cells along an edge of a brick.
pub const BRICK: u32 = 8;

/// Cells along an edge of the blocks whose bits are one word.
pub const WORD: u32 = 4;

/// Cells along an edge of a block of the grid of bricks.
const BLOCK: u32 = 64;

/// Vertices lie on multiples of one part in this many of a sample's distance: coordinates of up to
/// 2^14 samples are exact in single precision.
pub const STEPS: f64 = 1024.0;

/// The most samples along an axis.
const MOST_SAMPLES: usize = 1 << 14;

/// The crossed edges of a mask, in order.
struct Cut {
    count: u8,
    edges: [u8; 12],
}

static CUTS: [Cut; 256] = {
    let mut cuts = [const { Cut { count: 0, edges: [0; 12] } }; 256];
    let mut mask = 0;
    while mask < 256 {
        let (edges, mut e) = (crossed(mask), 0);
        while e < 12 {
            if edges >> e & 1 == 1 {
                let cut = &mut cuts[mask];
                cut.edges[cut.count as usize] = e;
                cut.count += 1;
            }
            e += 1;
        }
        mask += 1;
    }
    cuts
};

/// The middle of each edge of a cell.
const MIDDLES: [DVec3; 12] = {
    let mut middles = [DVec3::ZERO; 12];
    let mut e = 0;
    while e < 12 {
        let corner = edge_corner(e);
        let mut at = [(corner & 1) as f64, (corner >> 1 & 1) as f64, (corner >> 2 & 1) as f64];
        at[edge_axis(e)] = 0.5;
        middles[e] = DVec3::from_array(at);
        e += 1;
    }
    middles
};

/// What a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Wholly outside.
    Outside,
    /// Wholly inside.
    Inside,
    /// The surface meets it; its number.
    Mixed(u32),
}

/// A brick that the surface meets; bits and cells in Morton order.
#[derive(Debug, Clone, Copy, Default)]
struct Brick {
    mixed: [u64; 8],
    /// Whether the low corner of each cell is inside.
    inside: [u64; 8],
    /// Mixed cells in the words before each word.
    rank: [u16; 8],
    /// Number of the first mixed cell.
    first: u32,
}

/// All mixed cells of a volume.
pub struct Cells {
    /// Coordinate of sample 0 on each axis.
    pub shift: u32,
    /// Lowest and highest lattice points, the ring included.
    pub bounds: [[u32; 3]; 2],
    bricks: Vec<Brick>,
    masks: Vec<u8>,
    at: Vec<[u16; 3]>,
    /// First share of each cell; empty where all crossings are in the middle of their edges.
    starts: Vec<u32>,
    /// Where the crossed edges of each cell are cut, in [`STEPS`] from their low ends.
    shares: Vec<u16>,
    /// No vertex of marching cubes' surface is farther than this from its place in steps, in samples.
    pub rounding: f64,
    grid: Grid,
}

impl Cells {
    /// Reads a volume in slabs of `height` layers, a multiple of [`BRICK`].
    pub fn read(
        volume: &dyn Volume,
        frame: &Frame,
        height: usize,
        run: &Run,
    ) -> Result<Self, VolumeError> {
        let samples = volume.dims().into_iter().max().unwrap_or(0);
        if samples > MOST_SAMPLES {
            return Err(VolumeError::TooLong { samples, most: MOST_SAMPLES });
        }
        let shift = (samples as u32 + 1).next_power_of_two().max(BRICK);
        let cells: [usize; 3] = std::array::from_fn(|a| frame.cells(a));
        let low = [shift - frame.pad as u32; 3];
        let high = std::array::from_fn(|a| low[a] + cells[a] as u32);
        let plan = Bricks::new([low, high]);
        let first_slab = height + frame.pad;
        let slabs = 1 + cells[2].saturating_sub(first_slab).div_ceil(height);
        run.stage("cells");
        let parts = par::blocks(run, slabs, 1, |number| {
            let start = if number.start == 0 { 0 } else { frame.pad + number.start * height };
            let layers = start..(frame.pad + number.end * height).min(cells[2]);
            frame.with_slab(volume, layers, |slab, share| {
                Part::new(slab, share, &plan, shift - frame.pad as u32, frame.binary)
            })
        })?;
        let parts = parts.into_iter().collect::<Result<Vec<_>, VolumeError>>()?;
        let mut order: Vec<(u64, u32, u32)> = Vec::new();
        for (p, part) in parts.iter().enumerate() {
            let places = part.bricks.iter().enumerate();
            order.extend(places.map(|(b, (at, _))| (morton(*at), p as u32, b as u32)));
        }
        par::sort(&mut order);
        let total: usize = parts.iter().map(|p| p.masks.len()).sum();
        if total >= u32::MAX as usize / 8 {
            return Err(VolumeError::TooManyPoints);
        }
        let surface = order.iter().map(|&(_, p, b)| parts[p as usize].bricks[b as usize].0);
        // Layers of bricks follow one another from part to part.
        let layers: Vec<&[u64]> =
            parts.iter().flat_map(|p| p.inside.chunks_exact(plan.words())).collect();
        let inside = |at: [u32; 3]| {
            let Some(z) = at[2].checked_sub(plan.low[2]) else { return false };
            let known = (0..2).all(|a| (at[a].wrapping_sub(plan.low[a]) as usize) < plan.dims[a]);
            known
                && layers.get(z as usize).is_some_and(|layer| {
                    let place = plan.place(at);
                    layer[place / 64] >> (place % 64) & 1 == 1
                })
        };
        let mut all = Self {
            shift,
            bounds: [low, high],
            bricks: Vec::with_capacity(order.len()),
            masks: Vec::with_capacity(total),
            at: Vec::with_capacity(total),
            starts: Vec::new(),
            shares: Vec::new(),
            rounding: parts.iter().map(|p| p.rounding).fold(0.0, f64::max),
            grid: Grid::new([low, high], surface, inside),
        };
        for &(_, p, b) in &order {
            let part = &parts[p as usize];
            let (_, mut brick) = part.bricks[b as usize];
            let range = brick.range();
            brick.first = all.masks.len() as u32;
            if !frame.binary {
                let shares = part.starts[range.start] as usize..part.starts[range.end] as usize;
                let ahead = (all.shares.len() as u32).wrapping_sub(shares.start as u32);
                let starts = part.starts[range.clone()].iter();
                all.starts.extend(starts.map(|s| s.wrapping_add(ahead)));
                all.shares.extend_from_slice(&part.shares[shares]);
            }
            all.masks.extend_from_slice(&part.masks[range.clone()]);
            all.at.extend_from_slice(&part.at[range]);
            all.bricks.push(brick);
        }
        if all.rounding > 0.0 {
            // The coordinates of that surface are in single precision.
            all.rounding += f64::from(f32::EPSILON) * samples as f64;
        }
        Ok(all)
    }

    /// Number of mixed cells.
    pub fn len(&self) -> usize {
        self.masks.len()
    }

    /// The mask of mixed cell `cell`.
    pub fn mask(&self, cell: u32) -> usize {
        self.masks[cell as usize] as usize
    }

    /// The low corner of mixed cell `cell`.
    pub fn corner(&self, cell: u32) -> [u32; 3] {
        self.at[cell as usize].map(u32::from)
    }

    /// What the cell with low corner `at` is; outside beyond the border.
    pub fn state(&self, at: [u32; 3]) -> State {
        match self.grid.brick([at[0] / BRICK, at[1] / BRICK, at[2] / BRICK]) {
            Content::Uniform(false) => State::Outside,
            Content::Uniform(true) => State::Inside,
            Content::Surface(brick) => {
                let brick = &self.bricks[brick as usize];
                let place = place(at);
                let (word, bit) = (place / 64, place % 64);
                if brick.mixed[word] >> bit & 1 == 1 {
                    let before = brick.mixed[word] & ((1 << bit) - 1);
                    let rank = u32::from(brick.rank[word]) + before.count_ones();
                    State::Mixed(brick.first + rank)
                } else if brick.inside[word] >> bit & 1 == 1 {
                    State::Inside
                } else {
                    State::Outside
                }
            }
        }
    }

    /// The mixed cell with low corner `at`, where there is one.
    pub fn find(&self, at: [u32; 3]) -> Option<u32> {
        match self.state(at) {
            State::Mixed(cell) => Some(cell),
            _ => None,
        }
    }

    /// Whether the lattice point `at` is inside.
    pub fn is_inside(&self, at: [u32; 3]) -> bool {
        match self.grid.brick([at[0] / BRICK, at[1] / BRICK, at[2] / BRICK]) {
            Content::Uniform(inside) => inside,
            Content::Surface(brick) => {
                let place = place(at);
                self.bricks[brick as usize].inside[place / 64] >> (place % 64) & 1 == 1
            }
        }
    }

    /// Where the surface cuts edge `edge` of a mixed cell.
    pub fn crossing(&self, cell: u32, edge: usize) -> [f64; 3] {
        let at = self.at[cell as usize];
        let corner = edge_corner(edge);
        let mut point: [f64; 3] =
            std::array::from_fn(|a| f64::from(at[a]) + (corner >> a & 1) as f64);
        point[edge_axis(edge)] += match self.starts.get(cell as usize) {
            None => 0.5,
            Some(&start) => {
                let before = crossed(self.mask(cell)) & ((1 << edge) - 1);
                f64::from(self.shares[(start + before.count_ones()) as usize]) / STEPS
            }
        };
        point
    }

    /// Where the surface cuts the crossed edges of a mixed cell, in the order of the edges.
    pub fn crossings(&self, cell: u32) -> impl Iterator<Item = DVec3> + Clone + '_ {
        let cut = &CUTS[self.mask(cell)];
        let at = DVec3::from(self.at[cell as usize].map(f64::from));
        let start = self.starts.get(cell as usize).copied();
        cut.edges[..cut.count as usize].iter().enumerate().map(move |(i, &edge)| {
            let mut p = at + MIDDLES[edge as usize];
            if let Some(start) = start {
                let share = self.shares[start as usize + i];
                p[edge_axis(edge as usize)] += f64::from(share) / STEPS - 0.5;
            }
            p
        })
    }

    /// The triangles of the surface in a mixed cell.
    pub fn triangles(&self, cell: u32) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        let triangles = PATCHES[self.mask(cell)].triangles();
        triangles.iter().map(move |t| t.map(|edge| self.crossing(cell, edge.into()).into()))
    }

    /// How many bricks the surface meets; they are numbered in Morton order.
    pub fn bricks(&self) -> usize {
        self.bricks.len()
    }

    /// The mixed cells of a brick.
    pub fn in_brick(&self, brick: u32) -> Range<u32> {
        let range = self.bricks[brick as usize].range();
        range.start as u32..range.end as u32
    }

    /// The mixed cells of block `word % 8` of brick `word / 8`; a block is an octant of half a
    /// brick's size.
    pub fn in_word(&self, word: u32) -> Range<u32> {
        let brick = &self.bricks[word as usize / 8];
        let word = word as usize % 8;
        let start = brick.first + u32::from(brick.rank[word]);
        start..start + brick.mixed[word].count_ones()
    }

    /// The number of the brick that holds a mixed cell.
    pub fn brick_of(&self, cell: u32) -> Option<u32> {
        match self.grid.brick(self.corner(cell).map(|x| x / BRICK)) {
            Content::Surface(brick) => Some(brick),
            Content::Uniform(_) => None,
        }
    }

    /// The number of the block that holds a mixed cell.
    pub fn word_of(&self, cell: u32) -> Option<u32> {
        let brick = self.brick_of(cell)?;
        let [x, y, z] = self.corner(cell).map(|x| x / WORD % 2);
        Some(8 * brick + (x | y << 1 | z << 2))
    }

    /// What the block of [`WORD`]^3 cells at `at`, in blocks, is; the number is that of the block
    /// among all, eight to a brick.
    pub fn word_state(&self, at: [u32; 3]) -> State {
        match self.grid.brick(at.map(|x| x / 2)) {
            Content::Uniform(false) => State::Outside,
            Content::Uniform(true) => State::Inside,
            Content::Surface(number) => {
                let brick = &self.bricks[number as usize];
                let word = (at[0] % 2 + 2 * (at[1] % 2) + 4 * (at[2] % 2)) as usize;
                if brick.mixed[word] != 0 {
                    State::Mixed(8 * number + word as u32)
                } else if brick.inside[word] & 1 == 1 {
                    State::Inside
                } else {
                    State::Outside
                }
            }
        }
    }
}

impl Brick {
    fn range(&self) -> Range<usize> {
        let first = self.first as usize;
        let count = u32::from(self.rank[7]) + self.mixed[7].count_ones();
        first..first + count as usize
    }
}

/// Place of a cell in its brick, in Morton order.
fn place(at: [u32; 3]) -> usize {
    const SPREAD: [u16; 8] = [0, 1, 8, 9, 64, 65, 72, 73];
    let spread = |x: u32| SPREAD[(x % BRICK) as usize] as usize;
    spread(at[0]) | spread(at[1]) << 1 | spread(at[2]) << 2
}

/// The cells of one slab; bricks in order of their layers and rows.
struct Part {
    /// Each brick with its place in the grid; numbers of cells are the part's own.
    bricks: Vec<([u32; 3], Brick)>,
    masks: Vec<u8>,
    at: Vec<[u16; 3]>,
    /// One more than there are cells.
    starts: Vec<u32>,
    shares: Vec<u16>,
    /// How far shares were moved to steps at most.
    rounding: f64,
    /// A bit for every brick, layer by layer, that is set where its low corner is inside.
    inside: Vec<u64>,
}

impl Part {
    /// `ahead` is the coordinate of lattice point 0.
    fn new(
        slab: &Slab,
        share: &dyn Fn([[usize; 3]; 2]) -> f32,
        plan: &Bricks,
        ahead: u32,
        binary: bool,
    ) -> Self {
        let mut part = Self {
            bricks: Vec::new(),
            masks: Vec::new(),
            at: Vec::new(),
            starts: vec![0],
            shares: Vec::new(),
            rounding: 0.0,
            inside: Vec::new(),
        };
        let brick_of = |i: usize| (i as u32 + ahead) / BRICK;
        let mut slots = vec![u32::MAX; plan.dims[0] * plan.dims[1]];
        let mut dense: Vec<[u8; 512]> = Vec::new();
        let mut z = slab.layers.start;
        while z < slab.layers.end {
            let layer = brick_of(z);
            let end = ((layer + 1) * BRICK - ahead).min(slab.layers.end as u32) as usize;
            slots.fill(u32::MAX);
            dense.clear();
            let first = part.bricks.len();
            for z in z..end {
                for y in 0..slab.rows - 1 {
                    slab.mixed(y, z, |x, mask| {
                        let brick = [brick_of(x), brick_of(y), layer];
                        let slot = &mut slots[plan.place(brick)];
                        if *slot == u32::MAX {
                            *slot = dense.len() as u32;
                            dense.push([0; 512]);
                            part.bricks.push((brick, Brick::default()));
                        }
                        let at = place([x as u32 + ahead, y as u32 + ahead, z as u32 + ahead]);
                        dense[*slot as usize][at] = mask as u8;
                        part.bricks[first + *slot as usize].1.mixed[at / 64] |= 1 << (at % 64);
                    });
                }
            }
            for (b, masks) in dense.iter().enumerate() {
                part.fill(first + b, masks, slab, z..end, ahead);
                if !binary {
                    part.share(first + b, share, ahead);
                }
            }
            part.note_inside(slab, plan, layer, ahead);
            z = end;
        }
        part
    }

    /// Numbers the cells of a brick and notes which samples are inside.
    fn fill(&mut self, b: usize, masks: &[u8; 512], slab: &Slab, layers: Range<usize>, ahead: u32) {
        let (at, brick) = &mut self.bricks[b];
        let low = at.map(|i| i * BRICK);
        brick.first = self.masks.len() as u32;
        let mut count = 0;
        for word in 0..8 {
            brick.rank[word] = count;
            count += brick.mixed[word].count_ones() as u16;
            bits::ones(brick.mixed[word], |bit| {
                let place = 64 * word + bit;
                self.masks.push(masks[place]);
                let inner = |axis: usize| {
                    (place >> axis & 1)
                        | (place >> (axis + 3) & 1) << 1
                        | (place >> (axis + 6) & 1) << 2
                };
                self.at.push(std::array::from_fn(|a| (low[a] as usize + inner(a)) as u16));
            });
        }
        for z in layers {
            for y in (low[1].max(ahead) - ahead) as usize
                ..((low[1] + BRICK - ahead) as usize).min(slab.rows)
            {
                let row = slab.row(y, z);
                let byte = byte_at(row, i64::from(low[0]) - i64::from(ahead));
                // Four neighbours along x take these bits of a word.
                const NIBBLE: [u64; 16] = {
                    let mut table = [0; 16];
                    let mut n = 0;
                    while n < 16 {
                        table[n] = (n as u64 & 1)
                            | (n as u64 >> 1 & 1) << 1
                            | (n as u64 >> 2 & 1) << 8
                            | (n as u64 >> 3 & 1) << 9;
                        n += 1;
                    }
                    table
                };
                let start = place([0, y as u32 + ahead, z as u32 + ahead]);
                brick.inside[start / 64] |= NIBBLE[byte as usize & 15] << (start % 64);
                brick.inside[start / 64 + 1] |= NIBBLE[byte as usize >> 4] << (start % 64);
            }
        }
    }

    /// Where the crossed edges of a brick's cells are cut.
    fn share(&mut self, b: usize, share: &dyn Fn([[usize; 3]; 2]) -> f32, ahead: u32) {
        for cell in self.bricks[b].1.range() {
            let at = self.at[cell].map(|x| x as usize - ahead as usize);
            bits::ones(crossed(self.masks[cell] as usize).into(), |edge| {
                let corner = edge_corner(edge);
                let low: [usize; 3] = std::array::from_fn(|a| at[a] + (corner >> a & 1));
                let mut high = low;
                high[edge_axis(edge)] += 1;
                let share = f64::from(share([low, high]));
                let steps = (share * STEPS).round().clamp(1.0, STEPS - 1.0);
                self.shares.push(steps as u16);
                self.rounding = self.rounding.max((share - steps / STEPS).abs());
            });
            self.starts.push(self.shares.len() as u32);
        }
    }

    /// Notes which bricks of a layer have their low corner inside.
    fn note_inside(&mut self, slab: &Slab, plan: &Bricks, layer: u32, ahead: u32) {
        let first = self.inside.len();
        self.inside.resize(first + plan.words(), 0);
        // Below the lattice all is outside.
        let Some(z) = (layer * BRICK).checked_sub(ahead) else { return };
        for row in 0..plan.dims[1] as u32 {
            let Some(y) = ((plan.low[1] + row) * BRICK).checked_sub(ahead) else { continue };
            let bits = slab.row(y as usize, z as usize);
            for column in 0..plan.dims[0] as u32 {
                let Some(x) = ((plan.low[0] + column) * BRICK).checked_sub(ahead) else { continue };
                if bits[x as usize / 64] >> (x % 64) & 1 == 1 {
                    let place = plan.place([plan.low[0] + column, plan.low[1] + row, layer]);
                    self.inside[first + place / 64] |= 1 << (place % 64);
                }
            }
        }
    }
}

/// Eight bits of a row from bit `start` on; zero beyond its ends.
fn byte_at(row: &[u64], start: i64) -> u8 {
    let word = |w: i64| usize::try_from(w).ok().and_then(|w| row.get(w)).copied().unwrap_or(0);
    let (w, bit) = (start.div_euclid(64), start.rem_euclid(64));
    let low = word(w) >> bit;
    let high = if bit > 56 { word(w + 1) << (64 - bit) } else { 0 };
    (low | high) as u8
}

/// What a brick holds.
enum Content {
    /// No mixed cell: inside or not.
    Uniform(bool),
    /// Number of its brick.
    Surface(u32),
}

/// Finds bricks: a grid of blocks of 8^3 bricks, of which only those that the surface meets are
/// spelled out.
struct Grid {
    /// The lowest block on each axis.
    low: [u32; 3],
    dims: [u32; 3],
    blocks: Vec<u32>,
    bricks: Vec<[u32; 512]>,
}

impl Grid {
    /// In place of a number: nothing, wholly outside or wholly inside.
    const OUTSIDE: u32 = u32::MAX;
    const INSIDE: u32 = u32::MAX - 1;

    /// `inside` tells whether a brick without mixed cells is inside.
    fn new(
        [low, high]: [[u32; 3]; 2],
        surface: impl Iterator<Item = [u32; 3]>,
        inside: impl Fn([u32; 3]) -> bool,
    ) -> Self {
        let low: [u32; 3] = low.map(|x| x / BLOCK);
        let dims: [u32; 3] = std::array::from_fn(|a| high[a] / BLOCK + 1 - low[a]);
        let mut grid = Self { low, dims, blocks: Vec::new(), bricks: Vec::new() };
        let named = |brick| if inside(brick) { Self::INSIDE } else { Self::OUTSIDE };
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                grid.blocks.extend((0..dims[0]).map(|x| {
                    named([x + low[0], y + low[1], z + low[2]].map(|i| i * (BLOCK / BRICK)))
                }));
            }
        }
        for (number, brick) in surface.enumerate() {
            let Some(block) = grid.block(brick) else { continue };
            if grid.blocks[block] >= Self::INSIDE {
                grid.blocks[block] = grid.bricks.len() as u32;
                let first = brick.map(|i| i & !7);
                grid.bricks.push(std::array::from_fn(|i| {
                    let i = i as u32;
                    named([first[0] + i % 8, first[1] + i / 8 % 8, first[2] + i / 64])
                }));
            }
            let slot = Self::slot(brick);
            grid.bricks[grid.blocks[block] as usize][slot] = number as u32;
        }
        grid
    }

    fn block(&self, brick: [u32; 3]) -> Option<usize> {
        let [x, y, z] = std::array::from_fn(|a| (brick[a] / 8).wrapping_sub(self.low[a]));
        let [nx, ny, nz] = self.dims;
        (x < nx && y < ny && z < nz).then(|| ((z * ny + y) * nx + x) as usize)
    }

    fn slot([x, y, z]: [u32; 3]) -> usize {
        (x % 8 + 8 * (y % 8) + 64 * (z % 8)) as usize
    }

    fn brick(&self, brick: [u32; 3]) -> Content {
        let Some(block) = self.block(brick) else { return Content::Uniform(false) };
        let mut number = self.blocks[block];
        if number < Self::INSIDE {
            number = self.bricks[number as usize][Self::slot(brick)];
        }
        match number {
            Self::OUTSIDE => Content::Uniform(false),
            Self::INSIDE => Content::Uniform(true),
            number => Content::Surface(number),
        }
    }
}

/// The bricks of the volume's box, one bit each.
struct Bricks {
    low: [u32; 3],
    dims: [usize; 3],
}

impl Bricks {
    fn new([low, high]: [[u32; 3]; 2]) -> Self {
        let low = low.map(|x| x / BRICK);
        Self { low, dims: std::array::from_fn(|a| (high[a] / BRICK + 1 - low[a]) as usize) }
    }

    /// Words of one layer of bricks.
    fn words(&self) -> usize {
        bits::words(self.dims[0] * self.dims[1])
    }

    /// Place of a brick in its layer.
    fn place(&self, at: [u32; 3]) -> usize {
        (at[1] - self.low[1]) as usize * self.dims[0] + (at[0] - self.low[0]) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::cubes::{CubesOptions, Inside, marching_cubes};
    use crate::volume::{DenseVolume, Placement};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(40))]

        #[test]
        fn cells_are_those_of_marching_cubes(
            dims in (1usize..40, 1usize..20, 1usize..40),
            seed in any::<u64>(),
            open in any::<bool>(),
            gray in any::<bool>(),
            fill in 1u64..40,
        ) {
            let (x, y, z) = dims;
            let mut state = seed;
            let samples: Vec<u8> = (0..x * y * z).map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let value = (state >> 33) % 40;
                if gray { value as u8 * 6 } else { u8::from(value < fill) }
            }).collect();
            let mut volume = DenseVolume::new([x, y, z], samples, Placement::default()).unwrap();
            volume.binary = !gray;
            let iso = if gray { 6.0 * fill as f64 - 1.0 } else { 0.5 };
            let options = CubesOptions { iso, inside: Inside::Above, open };
            let run = Run::default();
            let frame = Frame::new(&volume, &options);
            let cells = Cells::read(&volume, &frame, 16, &run).unwrap();
            let mesh = marching_cubes(&volume, &options, &run).unwrap();
            let expected: Vec<[[i64; 3]; 3]> = {
                let place = |p: [f64; 3]| p.map(|v| (v * STEPS).round() as i64);
                let mut all: Vec<_> =
                    (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(place)).collect();
                all.iter_mut().for_each(|t| t.sort_unstable());
                all.sort_unstable();
                all
            };
            let mut found = Vec::new();
            let shift = f64::from(cells.shift);
            for cell in 0..cells.len() as u32 {
                prop_assert_eq!(cells.state(cells.corner(cell)), State::Mixed(cell));
                for t in PATCHES[cells.mask(cell)].triangles() {
                    let mut corners = t.map(|e| {
                        cells.crossing(cell, e.into()).map(|v| ((v - shift) * STEPS) as i64)
                    });
                    corners.sort_unstable();
                    found.push(corners);
                }
            }
            found.sort_unstable();
            prop_assert_eq!(found, expected);
            // Every lattice point below the last layers is known to be inside or not.
            for (i, &sample) in volume.samples().iter().enumerate() {
                let at = [i % x, i / x % y, i / x / y];
                if open && (0..3).any(|a| at[a] + 1 == [x, y, z][a]) {
                    continue;
                }
                let at = at.map(|v| v as u32 + cells.shift);
                prop_assert_eq!(cells.is_inside(at), f64::from(sample) >= iso);
            }
        }
    }
}

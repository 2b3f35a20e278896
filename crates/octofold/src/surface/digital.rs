//! The digital surface of a volume: the mixed cells of its lattice as a sorted array, and on which
//! side any lattice point lies.
//!
//! Octants are powers of two of a root whose low corner is a lattice point of the volume. A ring
//! of outside samples closes the border. The root begins at the first sample, so that octants lie
//! as the file's own samples do, unless the surface comes nearer to the low border than asked for;
//! then it begins as many samples earlier as are needed. Memory grows with the surface: eight bytes
//! a mixed cell, and the runs of inside samples.

use super::cubes::{self, CubesOptions};
use super::slab::{Frame, Slab, share};
use crate::bits;
use crate::octree::{CellKey, VertexName, key};
use crate::par;
use crate::radix::{self, Equal};
use crate::run::Run;
use crate::spans::Spans;
use crate::volume::{Placement, Region, Volume, VolumeError};

/// Most samples along an axis: a cell's Morton code and its mask share a word.
const MOST_SAMPLES: usize = (1 << 18) - 3;

/// Slices shorter than this are looked through, not divided.
const SHORT: usize = 16;

/// The mixed cells and the inside of a volume.
pub struct DigitalSurface<'a> {
    volume: &'a dyn Volume,
    options: CubesOptions,
    inside: Spans,
    /// Sample index of lattice point (0, 0, 0).
    first: [i64; 3],
    levels: u32,
    /// Morton code of each mixed cell above its mask, sorted.
    cells: Vec<u64>,
}

/// A mixed cell: its low corner and which of its corners are inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MixedCell {
    /// The low corner in lattice points.
    pub low: [u32; 3],
    /// Bit c is set where corner c is inside.
    pub mask: u8,
}

impl MixedCell {
    fn new(code: u64) -> Self {
        Self { low: key::unmorton(code >> 8), mask: code as u8 }
    }
}

impl<'a> DigitalSurface<'a> {
    /// Finds the mixed cells of `volume`. At least `clear` (0 or 1) layers of cells without
    /// surface lie between the root's low faces and the surface.
    pub fn of(
        volume: &'a dyn Volume,
        options: &CubesOptions,
        clear: i64,
        run: &Run,
    ) -> Result<Self, VolumeError> {
        let options = CubesOptions { open: false, ..*options };
        let dims = volume.dims();
        let longest = dims.into_iter().max().unwrap_or(0);
        if longest > MOST_SAMPLES {
            return Err(VolumeError::TooLong { samples: longest, most: MOST_SAMPLES });
        }
        run.stage("cells");
        let frame = Frame::new(volume, &options);
        let layers = frame.cells(2);
        let parts = par::blocks(run, layers, cubes::SLAB, |range| {
            frame.slab(volume, range.clone()).map(|slab| Part::of(&slab, range, dims))
        })?;
        let parts = parts.into_iter().collect::<Result<Vec<_>, _>>()?;
        let (codes, runs): (Vec<_>, Vec<_>) = parts.into_iter().map(|p| (p.cells, p.runs)).unzip();
        let inside = Spans::from_runs(dims, volume.placement(), runs.into_iter().flatten());
        let ends = par::map(&codes, |codes| extent(codes))
            .into_iter()
            .reduce(|a, b| std::array::from_fn(|x| [a[x][0].min(b[x][0]), a[x][1].max(b[x][1])]));
        let ends = ends.unwrap_or([[i64::MAX, 0]; 3]);
        // Cell 0 of the frame lies before the first sample.
        let first = ends.map(|[least, _]| least.saturating_sub(clear).min(1) - 1);
        let side = (0..3).map(|a| (dims[a] as i64 - 1).max(ends[a][1]) - first[a]).max();
        let side = side.unwrap_or(1).max(1) as u64;
        let codes = par::map(&codes, |codes| {
            let moved = |&code: &u64| {
                let MixedCell { low, mask } = MixedCell::new(code);
                let low = std::array::from_fn(|a| (i64::from(low[a]) - 1 - first[a]) as u32);
                key::morton(low) << 8 | u64::from(mask)
            };
            codes.iter().map(moved).collect()
        });
        let cells = radix::sort(codes, 0, Equal::Keep).concat();
        let levels = side.next_power_of_two().trailing_zeros();
        Ok(Self { volume, options, inside, first, levels, cells })
    }

    /// Levels below the root.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// True where there is no surface.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Where the samples lie in the world.
    pub fn placement(&self) -> Placement {
        self.volume.placement()
    }

    /// World position of a place in lattice points.
    pub fn place(&self, at: [f64; 3]) -> [f64; 3] {
        self.placement().place(std::array::from_fn(|a| at[a] + self.first[a] as f64))
    }

    /// The mixed cells in an octant, in Morton order.
    pub fn in_octant(&self, octant: CellKey) -> impl Iterator<Item = MixedCell> {
        let end = octant.morton() + (1 << (3 * (self.levels - octant.level())));
        let start = self.cells.partition_point(|&c| c >> 8 < octant.morton());
        let count = self.cells[start..].partition_point(|&c| c >> 8 < end);
        self.cells[start..start + count].iter().map(|&c| MixedCell::new(c))
    }

    /// True where the cell with low corner `low` is mixed.
    pub fn is_mixed(&self, low: [u32; 3]) -> bool {
        let code = key::morton(low);
        let at = self.cells.partition_point(|&c| c >> 8 < code);
        self.cells.get(at).is_some_and(|&c| c >> 8 == code)
    }

    /// Whether `test` holds for all mixed cells from `low` to `high`, both included; the first
    /// failure ends it.
    pub fn all_between(
        &self,
        low: [u32; 3],
        high: [u32; 3],
        mut test: impl FnMut(MixedCell) -> bool,
    ) -> bool {
        self.all_below(CellKey::ROOT, &self.cells, [low, high], &mut test)
    }

    fn all_below(
        &self,
        octant: CellKey,
        cells: &[u64],
        between: [[u32; 3]; 2],
        test: &mut impl FnMut(MixedCell) -> bool,
    ) -> bool {
        let [low, high] = between;
        let (start, size) = (octant.corner(), octant.size(self.levels));
        if cells.is_empty() || (0..3).any(|a| start[a] > high[a] || start[a] + size <= low[a]) {
            return true;
        }
        let covered = (0..3).all(|a| low[a] <= start[a] && start[a] + size - 1 <= high[a]);
        if covered || cells.len() <= SHORT {
            let within = |c: &MixedCell| {
                covered || (0..3).all(|a| low[a] <= c.low[a] && c.low[a] <= high[a])
            };
            return cells.iter().map(|&c| MixedCell::new(c)).filter(within).all(test);
        }
        let mut rest = cells;
        (0..8).all(|o| {
            let child = octant.child(o, self.levels);
            let end = child.morton() + (1 << (3 * (self.levels - child.level())));
            let (own, after) = rest.split_at(rest.partition_point(|&c| c >> 8 < end));
            rest = after;
            self.all_below(child, own, between, test)
        })
    }

    /// Whether a lattice point is inside.
    pub fn is_inside(&self, point: [u32; 3]) -> bool {
        let sample = self.sample(point);
        let sample = sample.map(|i| u32::try_from(i).ok());
        matches!(sample, [Some(x), Some(y), Some(z)] if self.inside.contains([x, y, z]))
    }

    /// The name of the vertex where the surface crosses the lattice line from `low` to the point
    /// `size` (a power of two) further along `axis`; one end is inside, the other outside. Among
    /// several crossings bisection chooses, so that the choice depends on the two ends alone.
    pub fn crossing(&self, low: [u32; 3], axis: usize, size: u32) -> VertexName {
        let at_low = self.is_inside(low);
        let mut low = low;
        let mut size = size;
        while size > 1 {
            size /= 2;
            let mut middle = low;
            middle[axis] += size;
            if self.is_inside(middle) == at_low {
                low = middle;
            }
        }
        VertexName::on_edge(low, axis)
    }

    /// Where a vertex lies, in lattice points: on an edge where the isosurface cuts it, in a cell
    /// at its centre.
    pub fn position(&self, vertex: VertexName) -> Result<[f64; 3], VolumeError> {
        let low = vertex.low();
        let mut at = low.map(f64::from);
        match vertex.axis() {
            Some(axis) => at[axis] += self.share(low, axis)?,
            None => at = at.map(|x| x + 0.5),
        }
        Ok(at)
    }

    /// Where the isosurface cuts the unit edge that leaves `low` along `axis`.
    fn share(&self, low: [u32; 3], axis: usize) -> Result<f64, VolumeError> {
        let (start, dims) = (self.sample(low), self.volume.dims());
        let mut end = start.map(|i| i + 1);
        end[axis] += 1;
        let beyond = (0..3).any(|a| start[a] < 0 || end[a] > dims[a] as i64);
        if beyond || self.volume.is_binary() {
            return Ok(0.5);
        }
        let region = Region { start: start.map(|i| i as usize), end: end.map(|i| i as usize) };
        let pair = self.volume.read(region)?;
        Ok(f64::from(share(self.options.iso, pair.value(0), pair.value(1))))
    }

    fn sample(&self, point: [u32; 3]) -> [i64; 3] {
        std::array::from_fn(|a| i64::from(point[a]) + self.first[a])
    }
}

/// What one slab of layers holds.
struct Part {
    /// Morton code of each mixed cell of the frame above its mask, sorted.
    cells: Vec<u64>,
    /// Row `[y, z]` and `[start, end)` of each run of inside samples, in order.
    runs: Vec<([u32; 2], [u32; 2])>,
}

impl Part {
    fn of(slab: &Slab, layers: std::ops::Range<usize>, dims: [usize; 3]) -> Self {
        let mut cells = Vec::new();
        let mut runs = Vec::new();
        for z in layers {
            for y in 0..=dims[1] {
                slab.mixed(y, z, |x, mask| {
                    let code = key::morton([x, y, z].map(|i| i as u32));
                    cells.push(code << 8 | mask as u64);
                });
                if y > 0 && z > 0 {
                    let row = [y as u32 - 1, z as u32 - 1];
                    ones(slab.row(y, z), |run| runs.push((row, run.map(|x| x - 1))));
                }
            }
        }
        cells.sort_unstable();
        Self { cells, runs }
    }
}

/// Calls `visit` with the start and end of each run of set bits. The first and the last bit of a
/// row belong to the ring and are not set.
fn ones(row: &[u64], mut visit: impl FnMut([u32; 2])) {
    let mut start = None;
    for w in 0..row.len() {
        // Bit i tells that bit i + 1 of the row differs from bit i.
        bits::ones(row[w] ^ bits::next(row, w), |bit| {
            let after = (64 * w + bit + 1) as u32;
            match start.take() {
                None => start = Some(after),
                Some(first) => visit([first, after]),
            }
        });
    }
}

/// Least and greatest position of cells along each axis.
fn extent(codes: &[u64]) -> [[i64; 2]; 3] {
    codes.iter().fold([[i64::MAX, 0]; 3], |ends, &code| {
        let low = MixedCell::new(code).low.map(i64::from);
        std::array::from_fn(|a| [ends[a][0].min(low[a]), ends[a][1].max(low[a])])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Inside;
    use crate::volume::DenseVolume;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::sweep::cases(48))]

        #[test]
        fn cells_and_sides_are_those_of_the_samples(
            dims in (1usize..70, 1usize..8, 1usize..40),
            seed in any::<u64>(),
            clear in 0i64..2,
            dense in 1u64..5,
        ) {
            let dims: [usize; 3] = dims.into();
            let mut state = seed;
            let samples: Vec<u8> = (0..dims.iter().product::<usize>()).map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                u8::from(state >> 33 & 7 < dense)
            }).collect();
            let inside = |i: [i64; 3]| {
                (0..3).all(|a| 0 <= i[a] && i[a] < dims[a] as i64)
                    && samples[(i[2] as usize * dims[1] + i[1] as usize) * dims[0] + i[0] as usize] == 1
            };
            let volume = DenseVolume::new(dims, samples.clone(), Placement::default()).unwrap();
            let options = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };
            let surface = DigitalSurface::of(&volume, &options, clear, &Run::default()).unwrap();
            prop_assert!(surface.cells.is_sorted());
            let side = 1i64 << surface.levels();
            let mut mixed = 0;
            for z in -1..dims[2] as i64 {
                for y in -1..dims[1] as i64 {
                    for x in -1..dims[0] as i64 {
                        let corner = |c: i64| [x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)];
                        let mask = (0..8).fold(0, |m, c| m | u8::from(inside(corner(c))) << c);
                        if mask == 0 || mask == 255 {
                            continue;
                        }
                        mixed += 1;
                        let low = std::array::from_fn(|a| [x, y, z][a] - surface.first[a]);
                        prop_assert!(low.iter().all(|&i| clear <= i && i < side));
                        let low = low.map(|i| i as u32);
                        prop_assert!(surface.is_mixed(low));
                        let cell = MixedCell { low, mask };
                        let octant = CellKey::new(low, surface.levels());
                        prop_assert_eq!(surface.in_octant(octant).collect::<Vec<_>>(), [cell]);
                        for c in 0..8u32 {
                            let point = [low[0] + (c & 1), low[1] + (c >> 1 & 1), low[2] + (c >> 2)];
                            prop_assert_eq!(surface.is_inside(point), mask >> c & 1 == 1);
                        }
                    }
                }
            }
            prop_assert_eq!(surface.cells.len(), mixed);
            let mut found = 0;
            let high = [side as u32 / 2; 3];
            surface.all_between([1; 3], high, |_| { found += 1; true });
            let between = |c: &&u64| {
                MixedCell::new(**c).low.iter().all(|&i| 1 <= i && i <= high[0])
            };
            prop_assert_eq!(found, surface.cells.iter().filter(between).count());
        }
    }

    #[test]
    fn the_root_begins_at_the_first_sample_where_it_can() {
        let field = crate::samples::Sample::PartE.volume(16).unwrap();
        let options = CubesOptions { iso: 0.0, inside: Inside::Below, open: false };
        let run = Run::default();
        let [tight, clear] = [0, 1].map(|c| DigitalSurface::of(&field, &options, c, &run).unwrap());
        assert_eq!((tight.levels(), tight.first), (4, [0; 3]));
        // The part comes nearer to the border than a sample.
        assert_eq!((clear.levels(), clear.first), (5, [-1; 3]));
    }
}

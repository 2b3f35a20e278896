//! Meshes into cells: solids by exact crossings along rows, surfaces by exact overlap.
//!
//! Everything is read off the scan converter ([`crate::scan`]) and one radix sort; the inside is
//! never visited, so time and memory grow with the surface. Source: specification of network
//! (D3.2); thin surfaces after Laine 2013.

mod unclosed;

use crate::lattice::{Lattice, LatticeError};
use crate::measure::{Extent, Winding};
use crate::mesh::Mesh;
use crate::par;
use crate::radix::{self, Equal};
use crate::run::{Cancelled, Finding, Run};
use crate::scan::{self, Facet, Lines};
use crate::spans::Spans;
use rustc_hash::FxHashMap;
use unclosed::Unclosed;

/// How fine the grid is.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// Cells along the longest side of the bounding box.
    Resolution(u32),
    /// Edge of a cell in world units.
    Pitch(f64),
}

/// Which cells are set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fill {
    /// Cells whose centre is inside.
    #[default]
    Solid,
    /// Cells that a triangle touches. No path of cells that share at least a corner passes.
    Surface,
    /// Cells in which the surface crosses a line from the centre to a face, an edge or a corner.
    /// Still no path passes, with fewer cells.
    #[serde(rename = "thin26")]
    ThinSurface26,
    /// Cells in which the surface crosses a line from the centre to a face: no path of cells that
    /// share a face passes.
    #[serde(rename = "thin6")]
    ThinSurface6,
}

/// How a mesh becomes cells.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VoxelizeOptions {
    /// How fine the grid is.
    pub size: Size,
    /// Which cells are set.
    pub fill: Fill,
}

impl Default for VoxelizeOptions {
    fn default() -> Self {
        Self { size: Size::Resolution(128), fill: Fill::Solid }
    }
}

/// Why a mesh could not be made into cells.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VoxelizeError {
    /// No lattice fits.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// The surface alone has more cells than can be sorted in memory.
    #[error(
        "the surface would cover about {0:.1e} cells, more than {MOST_CELLS:.1e}: \
         choose a lower resolution or a larger pitch"
    )]
    TooManyCells(f64),
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Cells of the surface that are taken on; sixteen bytes each while they are sorted.
const MOST_CELLS: f64 = 5e8;

/// Makes a mesh into cells on a grid that begins at its bounding box's low corner.
pub fn voxelize(mesh: &Mesh, options: &VoxelizeOptions, run: &Run) -> Result<Spans, VoxelizeError> {
    let bounds = mesh.bounds().ok_or(LatticeError::Bounds)?;
    let lattice = match options.size {
        Size::Resolution(resolution) => Lattice::fit(bounds, resolution)?,
        Size::Pitch(pitch) => Lattice::with_pitch(bounds, pitch)?,
    };
    let squares = Extent::of(mesh, run)?.area / (lattice.cell() * lattice.cell());
    if squares > MOST_CELLS {
        return Err(VoxelizeError::TooManyCells(squares));
    }
    Ok(cells(mesh, &lattice, options.fill, run)?.in_unit(mesh.unit))
}

/// The triangles of `mesh` in sub-steps of `lattice`.
pub fn facets(mesh: &Mesh, lattice: &Lattice) -> Vec<Facet> {
    let steps = par::map(&mesh.points, |&p| lattice.snap(p));
    par::map(&mesh.triangles, |t| t.map(|p| steps[p as usize]))
}

/// What the triangles bound, judged on the lattice.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Boundary {
    /// Every edge is passed as often one way as the other.
    Oriented,
    /// Every edge has an even number of triangles.
    Even,
    /// These edges have an odd number of triangles.
    Open(Vec<[[i32; 3]; 2]>),
}

/// The cells whose centre is inside.
///
/// Inside is where the winding number of a closed and consistently oriented mesh is not zero (so
/// parts that overlap unite), where rows have crossed a closed mesh an odd number of times if its
/// orientation is not consistent, and where the generalized winding number is one half or more
/// for all other meshes; the last two leave a finding.
pub fn solid(mesh: &Mesh, lattice: &Lattice, run: &Run) -> Result<Spans, Cancelled> {
    run.stage("snap");
    let facets = facets(mesh, lattice);
    match boundary(&facets) {
        Boundary::Oriented => {
            fill_rows(lattice, borders(&facets, lattice, run)?, |w, _| w != 0, run)
        }
        Boundary::Even => {
            run.finding(Finding::warning(
                "parity-fill",
                "the mesh is closed, but its triangles are not consistently oriented: \
                 the inside was taken by parity",
            ));
            fill_rows(lattice, borders(&facets, lattice, run)?, |_, odd| odd, run)
        }
        Boundary::Open(open) => {
            let edges = open.len();
            run.finding(
                Finding::warning(
                    "winding-fill",
                    format!(
                        "the mesh is not closed ({edges} edges with an odd number of triangles): \
                         the inside was taken by the generalized winding number; \
                         repair the mesh for an exact result"
                    ),
                )
                .of(edges as u64),
            );
            let borders = borders(&facets, lattice, run)?;
            run.stage("scan surface");
            let unclosed = Unclosed {
                lattice,
                touched: touched(&facets, lattice, run, |_, _| true)?,
                borders: radix::sort(borders, X_BITS + 1, Equal::Keep).concat(),
                rims: unclosed::rims(&open, lattice),
                winding: Winding::new(mesh),
            };
            fill_rows(lattice, unclosed.fill(run)?, |w, _| w != 0, run)
        }
    }
}

fn boundary(facets: &[Facet]) -> Boundary {
    let mut names: FxHashMap<[i32; 3], u32> = FxHashMap::default();
    let mut points = Vec::new();
    let mut edges = Vec::with_capacity(3 * facets.len());
    for facet in facets {
        let ids = facet.map(|p| {
            *names.entry(p).or_insert_with(|| {
                points.push(p);
                points.len() as u32 - 1
            })
        });
        for i in 0..3 {
            let (a, b) = (ids[i], ids[(i + 1) % 3]);
            if a != b {
                edges.push(([a.min(b), a.max(b)], a < b));
            }
        }
    }
    par::sort(&mut edges);
    let mut open = Vec::new();
    let mut balanced = true;
    for edge in edges.chunk_by(|a, b| a.0 == b.0) {
        let forward = edge.iter().filter(|e| e.1).count();
        balanced &= 2 * forward == edge.len();
        if edge.len() % 2 == 1 {
            open.push(edge[0].0.map(|p| points[p as usize]));
        }
    }
    match (open.is_empty(), balanced) {
        (true, true) => Boundary::Oriented,
        (true, false) => Boundary::Even,
        _ => Boundary::Open(open),
    }
}

/// Facets in one unit of work: few enough that a handful of huge ones still runs in parallel.
pub(crate) fn block_of(facets: usize) -> usize {
    (facets / 256).clamp(1, 4096)
}

/// Bits of a cell index along a row, of one more than the last cell too.
const X_BITS: u32 = 17;

/// Where rows through cell centres enter and leave the surface.
fn borders(facets: &[Facet], lattice: &Lattice, run: &Run) -> Result<Vec<Vec<u64>>, Cancelled> {
    run.stage("cross rows");
    par::blocks(run, facets.len(), block_of(facets.len()), |block| {
        let mut borders = Vec::new();
        for facet in &facets[block] {
            scan::crossings(facet, lattice.sub_bits(), 0, Lines::Centres, |c| {
                borders.push(border(lattice, [c.first_centre(), c.row[0], c.row[1]], c.leaving));
            });
        }
        borders
    })
}

/// The place in front of cell `[x, y, z]` where its row enters or leaves the solid, as one number
/// that sorts by row and place.
fn border(lattice: &Lattice, cell: [u32; 3], leaving: bool) -> u64 {
    row_major(lattice, cell) << 1 | u64::from(leaving)
}

/// Fills rows between borders, wherever `inside(winding, odd)` holds for the number of borders
/// passed.
fn fill_rows(
    lattice: &Lattice,
    borders: Vec<Vec<u64>>,
    inside: impl Fn(i32, bool) -> bool + Sync,
    run: &Run,
) -> Result<Spans, Cancelled> {
    run.stage("fill rows");
    let shares = radix::sort(borders, X_BITS + 1, Equal::Keep);
    run.check()?;
    let rows = u64::from(lattice.cells()[1]);
    let runs = par::map(&shares, |share| {
        let mut runs = Vec::new();
        for row in share.chunk_by(|a, b| a >> (X_BITS + 1) == b >> (X_BITS + 1)) {
            let (mut winding, mut odd, mut start) = (0, false, None);
            let name = row[0] >> (X_BITS + 1);
            for place in row.chunk_by(|a, b| a >> 1 == b >> 1) {
                for border in place {
                    winding += if border & 1 == 0 { 1 } else { -1 };
                    odd = !odd;
                }
                let x = (place[0] >> 1) as u32 & ((1 << X_BITS) - 1);
                match (start, inside(winding, odd)) {
                    (None, true) => start = Some(x),
                    (Some(from), false) => {
                        runs.push(([(name % rows) as u32, (name / rows) as u32], [from, x]));
                        start = None;
                    }
                    _ => {}
                }
            }
        }
        runs
    });
    run.check()?;
    Ok(gather(lattice, runs))
}

/// Puts ordered shares of runs together.
fn gather(lattice: &Lattice, runs: Vec<Vec<([u32; 2], [u32; 2])>>) -> Spans {
    let dims = lattice.cells().map(|n| n as usize);
    Spans::from_runs(dims, lattice.placement(), runs.into_iter().flatten())
}

/// The cells of a lattice that `fill` sets.
pub fn cells(mesh: &Mesh, lattice: &Lattice, fill: Fill, run: &Run) -> Result<Spans, Cancelled> {
    let facets = || {
        run.stage("snap");
        let facets = facets(mesh, lattice);
        run.stage("scan surface");
        facets
    };
    match fill {
        Fill::Solid => solid(mesh, lattice, run),
        Fill::Surface => touched(&facets(), lattice, run, |_, _| true),
        Fill::ThinSurface26 => touched(&facets(), lattice, run, |cell, facet| {
            scan::crosses_star(facet, lattice.sub_bits(), cell)
        }),
        Fill::ThinSurface6 => crossed(&facets(), lattice, run),
    }
}

/// The cells in which a line through cell centres crosses the surface.
fn crossed(facets: &[Facet], lattice: &Lattice, run: &Run) -> Result<Spans, Cancelled> {
    let keys = par::blocks(run, facets.len(), block_of(facets.len()), |block| {
        let mut keys = Vec::new();
        for facet in &facets[block] {
            for axis in 0..3 {
                scan::crossings(facet, lattice.sub_bits(), axis, Lines::Centres, |c| {
                    let mut cell = [0; 3];
                    cell[axis] = c.half / 2;
                    cell[(axis + 1) % 3] = c.row[0];
                    cell[(axis + 2) % 3] = c.row[1];
                    keys.push(row_major(lattice, cell));
                });
            }
        }
        keys
    })?;
    Ok(from_cells(lattice, keys))
}

/// The touched cells that `keep` keeps.
fn touched(
    facets: &[Facet],
    lattice: &Lattice,
    run: &Run,
    keep: impl Fn([u32; 3], &Facet) -> bool + Sync,
) -> Result<Spans, Cancelled> {
    let keys = par::blocks(run, facets.len(), block_of(facets.len()), |block| {
        let mut keys = Vec::new();
        for facet in &facets[block] {
            scan::cells(facet, lattice.sub_bits(), |cell| {
                if keep(cell, facet) {
                    keys.push(row_major(lattice, cell));
                }
            });
        }
        keys
    })?;
    Ok(from_cells(lattice, keys))
}

fn row_major(lattice: &Lattice, [x, y, z]: [u32; 3]) -> u64 {
    (u64::from(z) * u64::from(lattice.cells()[1]) + u64::from(y)) << X_BITS | u64::from(x)
}

fn from_cells(lattice: &Lattice, keys: Vec<Vec<u64>>) -> Spans {
    let rows = u64::from(lattice.cells()[1]);
    let shares = radix::sort(keys, X_BITS, Equal::Merge);
    let runs = par::map(&shares, |share| {
        let mut runs = Vec::new();
        for run in share.chunk_by(|a, b| a + 1 == *b) {
            let (name, x) = (run[0] >> X_BITS, (run[0] & ((1 << X_BITS) - 1)) as u32);
            let row = [(name % rows) as u32, (name / rows) as u32];
            runs.push((row, [x, x + run.len() as u32]));
        }
        runs
    });
    gather(lattice, runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Volume;

    /// A box with outward triangles.
    fn cuboid(low: [f64; 3], high: [f64; 3]) -> Mesh {
        let points = (0..8)
            .map(|c| std::array::from_fn(|a| if c >> a & 1 == 1 { high[a] } else { low[a] }))
            .collect();
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        Mesh::new(points, triangles.collect()).unwrap()
    }

    fn join(a: Mesh, b: Mesh) -> Mesh {
        let start = a.points.len() as u32;
        let triangles = b.triangles.iter().map(|t| t.map(|p| p + start));
        Mesh::new(
            [a.points, b.points].concat(),
            a.triangles.iter().copied().chain(triangles).collect(),
        )
        .unwrap()
    }

    fn voxels(mesh: &Mesh, resolution: u32, fill: Fill) -> Spans {
        let options = VoxelizeOptions { size: Size::Resolution(resolution), fill };
        voxelize(mesh, &options, &Run::default()).unwrap()
    }

    #[test]
    fn a_box_fills_its_grid_and_its_surface_is_the_shell() {
        let mesh = cuboid([0.0; 3], [1.0; 3]);
        assert_eq!(voxels(&mesh, 10, Fill::Solid).count(), 1000);
        let shell = 1000 - 8 * 8 * 8;
        for fill in [Fill::Surface, Fill::ThinSurface26, Fill::ThinSurface6] {
            assert_eq!(voxels(&mesh, 10, fill).count(), shell, "{fill:?}");
        }
    }

    #[test]
    fn overlapping_parts_unite_and_cavities_stay_empty() {
        let both = join(cuboid([0.0; 3], [6.0; 3]), cuboid([3.0; 3], [8.0; 3]));
        let expected = 216 + 125 - 27;
        assert_eq!(voxels(&both, 8, Fill::Solid).count(), expected);
        let mut inner = cuboid([2.0; 3], [5.0; 3]);
        inner.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        let hollow = join(cuboid([0.0; 3], [8.0; 3]), inner);
        assert_eq!(voxels(&hollow, 8, Fill::Solid).count(), 512 - 27);
    }

    #[test]
    fn flipped_triangles_are_filled_by_parity() {
        let mut mesh = cuboid([0.0; 3], [1.0; 3]);
        mesh.triangles[3].swap(0, 1);
        assert_eq!(voxels(&mesh, 12, Fill::Solid).count(), 12 * 12 * 12);
    }

    #[test]
    fn a_box_without_a_triangle_is_filled_by_winding_number() {
        let mut mesh = cuboid([0.0; 3], [1.0; 3]);
        mesh.triangles.pop();
        let count = voxels(&mesh, 16, Fill::Solid).count();
        // Half a side is open: the level set of one half bulges there by a little.
        assert!((3600..=4096).contains(&count), "{count}");
    }

    /// True where a path of cells outside `wall` leads from one end of the grid to the other.
    fn leaks(wall: &Spans, neighbours: impl Fn([i64; 3]) -> bool) -> bool {
        let dims = wall.dims().map(|d| d as i64);
        let mut seen = std::collections::BTreeSet::new();
        let mut stack: Vec<[i64; 3]> =
            (0..dims[0] * dims[1]).map(|i| [i % dims[0], i / dims[0], 0]).collect();
        while let Some(cell) = stack.pop() {
            if (0..3).any(|a| cell[a] < 0 || cell[a] >= dims[a])
                || wall.contains(cell.map(|c| c as u32))
                || !seen.insert(cell)
            {
                continue;
            }
            if cell[2] == dims[2] - 1 {
                return true;
            }
            for d in 0..27 {
                let step = [d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1];
                if neighbours(step) {
                    stack.push([0, 1, 2].map(|a| cell[a] + step[a]));
                }
            }
        }
        false
    }

    #[test]
    fn surfaces_separate_what_they_promise() {
        for slope in [[0.0, 0.0], [0.31, 0.17], [0.77, -0.4], [1.0, 1.0], [1.9, 0.6]] {
            // A slanted sheet right across the grid, which reaches from z = 0 to z = 24.
            let height =
                |x: f64, y: f64| 12.0 + slope[0] * (x - 6.0) * 0.9 + slope[1] * (y - 6.0) * 0.9;
            let corners = [[0.0, 0.0], [12.0, 0.0], [12.0, 12.0], [0.0, 12.0]];
            let mut points: Vec<[f64; 3]> =
                corners.iter().map(|c| [c[0], c[1], height(c[0], c[1])]).collect();
            // Two stray points make the box tall enough.
            points.extend([[0.0, 0.0, 0.0], [12.0, 12.0, 24.0]]);
            let mesh = Mesh::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
            let touched = voxels(&mesh, 24, Fill::Surface);
            let thin26 = voxels(&mesh, 24, Fill::ThinSurface26);
            let thin6 = voxels(&mesh, 24, Fill::ThinSurface6);
            let faces = |s: [i64; 3]| s.iter().map(|c| c.abs()).sum::<i64>() == 1;
            assert!(!leaks(&touched, |_| true));
            assert!(!leaks(&thin26, |_| true));
            assert!(!leaks(&thin6, faces));
            assert!(thin6.count() <= thin26.count() && thin26.count() <= touched.count());
        }
    }

    #[test]
    fn threads_do_not_change_a_byte() {
        let mesh = join(cuboid([0.1; 3], [6.3, 5.0, 4.0]), cuboid([3.0; 3], [8.0; 3]));
        for fill in [Fill::Solid, Fill::Surface, Fill::ThinSurface26, Fill::ThinSurface6] {
            let all = [1, 2, 3, 8].map(|n| par::with_threads(n, || voxels(&mesh, 50, fill)));
            assert!(all.windows(2).all(|s| s[0] == s[1]));
        }
    }
}

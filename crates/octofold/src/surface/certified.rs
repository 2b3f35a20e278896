//! Certified TEL: few triangles, with a proof.
//!
//! The mesh stands for the surface of marching cubes of the same samples (the reference). It is
//! closed, or ends at the volume's border where that was asked for; it is oriented and 2-manifold;
//! no two of its triangles meet outside what they share; its topology is the reference's; and no
//! point of either lies farther than the tolerance from the other, in samples.
//!
//! - [`cells`]: the mixed cells, in Morton order, found in any octant and at any place.
//! - [`octant`]: the disc test and the loop of an octant. [`patch`]: polylines and triangles.
//! - [`leaves`]: which octants carry a patch.
//! - [`piece`], [`cover`], [`tube`]: both distances, proved.
//! - [`collapse`], [`patchwork`], [`bins`]: fewer triangles, step by proved step, at even volume.
//! - [`written`]: the coordinates as files have them, proved again.
//!
//! Source: the specification's A.8, A.9 and D.3, from Nishio, Kobori and Kutsuwa 1997.

mod bins;
mod cells;
mod collapse;
mod cover;
mod leaves;
mod octant;
mod patch;
mod patchwork;
mod piece;
mod tube;
mod written;

use super::cubes::CubesOptions;
use super::slab::Frame;
use crate::measure::Topology;
use crate::mesh::Mesh;
use crate::octree::VertexName;
use crate::par;
use crate::run::{Cancelled, Run};
use crate::volume::{Volume, VolumeError};
use cells::{BRICK, Cells};
use collapse::{Tile, Tiling};
use glam::DVec3;
use leaves::{Leaf, Settler};
use patch::Vertex;
use piece::Pieces;
use serde::Serialize;
use tube::{Face, Tube};
pub use written::Coordinates;
use written::Written;

/// Layers of cells that are read at once.
const SLAB: usize = 64;

/// Cells along an edge of the first boxes of the collapse.
const BOX: u32 = 64;

/// Tolerance of polylines, as a share of the tolerance.
const POLYLINE: f64 = 0.8;

/// How a certified mesh is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CertifiedOptions {
    /// Isovalue, inside and border.
    pub surface: CubesOptions,
    /// The largest distance between mesh and reference, in samples; at least [`LEAST_TOLERANCE`].
    pub tolerance: f64,
    /// Collapse edges across octants.
    pub collapse: bool,
}

/// Smaller tolerances are raised to this: at zero, the only mesh is the reference.
pub const LEAST_TOLERANCE: f64 = 1.0 / 64.0;

/// What is proved of a mesh, and what it was made from. Lengths are in samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// The tolerance: no point of the mesh lies farther from the reference.
    pub mesh_to_reference: f64,
    /// No point of the reference lies farther from the mesh.
    pub reference_to_mesh: f64,
    /// Volume within the mesh; `None` where it is open.
    pub volume: Option<f64>,
    /// Volume within the reference; `None` where it is open.
    pub reference_volume: Option<f64>,
    /// Area of the mesh.
    pub area: f64,
    /// Area of the reference.
    pub reference_area: f64,
    /// Points minus edges plus triangles, of both.
    pub euler: i64,
    /// Connected parts, of both.
    pub components: usize,
    /// Triangles of the reference.
    pub reference_triangles: u64,
    /// Octants with a patch, by the logarithm of their size in cells.
    pub octants: Vec<u64>,
    /// Triangles before the collapse.
    pub octant_triangles: u64,
    /// Volume within them; `None` where they are open.
    pub octant_volume: Option<f64>,
    /// Octants with a Steiner vertex.
    pub steiner: u64,
    /// What is proved of the world coordinates.
    pub coordinates: Coordinates,
    /// What the distances leave for rounding: of the reference to places that the proof can hold, and of
    /// world coordinates to single precision.
    pub rounding: f64,
}

/// Turns a volume into a certified mesh in world coordinates.
///
/// World coordinates are in single precision, as most files have them, and proved again where that
/// rounds them; see [`Coordinates`].
pub fn certified(
    volume: &dyn Volume,
    options: &CertifiedOptions,
    run: &Run,
) -> Result<(Mesh, Certificate), VolumeError> {
    in_parts(volume, options, SLAB, BOX, run)
}

/// With slabs of `slab` layers and boxes of `size` cells.
fn in_parts(
    volume: &dyn Volume,
    options: &CertifiedOptions,
    slab: usize,
    size: u32,
    run: &Run,
) -> Result<(Mesh, Certificate), VolumeError> {
    let frame = Frame::new(volume, &options.surface);
    let cells = Cells::read(volume, &frame, slab, run)?;
    run.stage("blocks");
    let pieces = Pieces::new(&cells);
    let written = Written::new(frame.placement, [0, 1, 2].map(|axis| frame.points(axis)));
    let allowed = options.tolerance.max(LEAST_TOLERANCE);
    let rounding = cells.rounding + written.rounding;
    let tolerance = allowed - rounding;
    let tube = Tube::new(&cells, &pieces, tolerance);
    let leaves = Settler { tube: &tube, polyline: POLYLINE * tolerance }.leaves(run)?;
    let mut octants = Vec::new();
    let mut steiner = 0;
    for leaf in &leaves {
        let level = leaf.octant.size.trailing_zeros() as usize;
        octants.resize(octants.len().max(level + 1), 0);
        octants[level] += 1;
        steiner += u64::from(leaf.patch.steiner.is_some());
    }
    let reference = Reference::of(&cells, run)?;
    let mut tiling = join(&tube, leaves, reference.volume);
    let octant_triangles = tiling.tiles.len() as u64;
    let octant_volume = tiling.volume();
    if options.collapse {
        tiling.reduce(&tube, size, run)?;
    }
    run.stage("certificate");
    let reference_to_mesh = farthest(&tube, &tiling, run)?;
    let (volume_within, area) = (tiling.volume(), tiling.area());
    let (points, mut triangles) = tiling.into_mesh();
    let topology = Topology::of(points.len(), &triangles, run)?;
    let closed = topology.is_closed() || triangles.is_empty();
    run.stage("coordinates");
    let shift = f64::from(cells.shift);
    let lattice = par::map(&points, |&p| p - shift);
    let (points, coordinates) = written.place(&lattice, &triangles, run)?;
    let certificate = Certificate {
        mesh_to_reference: allowed,
        reference_to_mesh: reference_to_mesh + rounding,
        volume: closed.then_some(volume_within),
        reference_volume: closed.then_some(reference.volume),
        area,
        reference_area: reference.area,
        euler: topology.euler(),
        components: topology.components,
        reference_triangles: reference.triangles,
        octants,
        octant_triangles,
        octant_volume: closed.then_some(octant_volume),
        steiner,
        coordinates,
        rounding,
    };
    if frame.placement.determinant() < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Ok((Mesh { points, triangles, unit: frame.placement.unit, ..Mesh::default() }, certificate))
}

/// Measures of the reference.
#[derive(Default)]
struct Reference {
    volume: f64,
    area: f64,
    triangles: u64,
}

impl Reference {
    fn of(cells: &Cells, run: &Run) -> Result<Self, Cancelled> {
        let home = DVec3::splat(f64::from(cells.shift));
        let bricks = cells.bricks();
        let parts = par::blocks(run, bricks, 256, |range| {
            let mut sum = Self::default();
            for cell in range.flat_map(|brick| cells.in_brick(brick as u32)) {
                for corners in cells.triangles(cell) {
                    let [a, b, c] = corners.map(|p| p - home);
                    let area = (b - a).cross(c - a);
                    sum.volume += a.dot(area) / 6.0;
                    sum.area += area.length() / 2.0;
                    sum.triangles += 1;
                }
            }
            sum
        })?;
        Ok(parts.into_iter().fold(Self::default(), |sum, part| Self {
            volume: sum.volume + part.volume,
            area: sum.area + part.area,
            triangles: sum.triangles + part.triangles,
        }))
    }
}

/// No point of the reference lies farther from the mesh than this: each piece from the triangle
/// that it is attached to.
fn farthest(tube: &Tube, tiling: &Tiling, run: &Run) -> Result<f64, Cancelled> {
    let parts = par::blocks(run, tiling.tiles.len(), 256, |range| {
        let mut most = 0.0f64;
        for tile in &tiling.tiles[range] {
            let face = Face::new(tile.corners.map(|p| tiling.points[p as usize]));
            let mut see = |p: DVec3| most = most.max(face.distance_squared(p));
            for piece in &tile.pieces {
                if piece.is_part() {
                    piece.corners(tube.cells).into_iter().for_each(&mut see);
                } else {
                    let cells = piece.cells(tube.cells);
                    cells.flat_map(|cell| tube.cells.crossings(cell)).for_each(&mut see);
                }
            }
        }
        most
    })?;
    Ok(parts.into_iter().fold(0.0, f64::max).sqrt())
}

/// One mesh of all leaves, vertices joined by name.
fn join(tube: &Tube, leaves: Vec<Leaf>, volume: f64) -> Tiling {
    let mut names: Vec<(VertexName, [f64; 3])> = Vec::new();
    for leaf in &leaves {
        names.extend(leaf.patch.polygon.iter().map(|v| (v.name, v.at)));
    }
    par::sort_by_key(&mut names, |n| n.0);
    names.dedup_by_key(|n| n.0);
    let mut points: Vec<DVec3> = names.iter().map(|n| n.1.into()).collect();
    let mut tiles = Vec::new();
    for leaf in leaves {
        let name = |v: &Vertex| names.partition_point(|n| n.0 < v.name) as u32;
        let mut ids: Vec<u32> = leaf.patch.polygon.iter().map(name).collect();
        if let Some(steiner) = leaf.patch.steiner {
            ids.push(points.len() as u32);
            points.push(steiner.into());
        }
        let first = tiles.len();
        let corners = leaf.patch.triangles.iter().map(|t| t.map(|i| ids[i as usize]));
        tiles.extend(corners.map(|c| Tile::new(c, Vec::new())));
        for (piece, t) in leaf.patch.pieces {
            tiles[first + t as usize].pieces.push(piece);
        }
    }
    Tiling::new(tube, points, tiles, volume)
}

const _: () = assert!(SLAB.is_multiple_of(BRICK as usize));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Weld, compare, measure};
    use crate::samples::Sample;
    use crate::surface::{Inside, marching_cubes, noise};
    use crate::volume::{DenseVolume, Placement};
    use proptest::prelude::*;

    const BINARY: CubesOptions = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };

    fn options(surface: CubesOptions, tolerance: f64) -> CertifiedOptions {
        CertifiedOptions { surface, tolerance, collapse: true }
    }

    /// A built-in shape as a mask in unit voxels.
    fn dense(sample: Sample, resolution: usize) -> DenseVolume<u8> {
        let field = sample.field().unwrap();
        let at = |i: usize| (i as f64 + 0.5) / resolution as f64;
        let inside = |i: usize| {
            let [x, y, z] = [i, i / resolution, i / resolution / resolution];
            u8::from(field([x % resolution, y % resolution, z].map(at)) < 0.0)
        };
        let samples = (0..resolution.pow(3)).map(inside).collect();
        let mut volume = DenseVolume::new([resolution; 3], samples, Placement::default()).unwrap();
        volume.binary = true;
        volume
    }

    /// Everything that is guaranteed, checked by other means than those that made it, the distances
    /// at `samples` points of each mesh.
    fn assert_certified(
        volume: &dyn Volume,
        options: &CertifiedOptions,
        samples: usize,
    ) -> Certificate {
        let run = Run::default();
        let (mesh, certificate) = certified(volume, options, &run).unwrap();
        let reference = marching_cubes(volume, &options.surface, &run).unwrap();
        let found = measure(&mesh, Weld::Off, &run).unwrap();
        let expected = measure(&reference, Weld::Off, &run).unwrap();
        assert_eq!(found.self_intersections, 0);
        assert_eq!(found.zero_area_triangles, 0);
        assert!(found.manifold || mesh.triangles.is_empty(), "{found:?}");
        assert!(found.oriented || mesh.triangles.is_empty());
        assert_eq!(found.closed, expected.closed);
        assert_eq!(
            (found.euler, found.components),
            (expected.euler, expected.components),
            "{} {}",
            found.boundary_edges,
            expected.boundary_edges
        );
        assert_eq!((certificate.euler, certificate.components), (found.euler, found.components));
        let near = compare(&mesh, &reference, samples, &run).unwrap();
        let slack = 1e-9;
        if let Some(most) = near.hausdorff {
            assert!(most <= options.tolerance + slack, "{most}");
            let back = near.b_to_a.unwrap().max;
            assert!(back <= certificate.reference_to_mesh + slack, "{back} {certificate:?}");
            assert!(certificate.reference_to_mesh <= options.tolerance);
        }
        if let (Some(volume), Some(expected)) = (certificate.reference_volume, expected.volume) {
            // Vertices of the reference lie on multiples of 1/1024.
            let slack = 1e-3 * expected.abs().max(certificate.reference_area) + 1e-6;
            assert!((volume - expected).abs() < slack, "{volume} {expected}");
        }
        certificate
    }

    #[test]
    fn every_pair_of_cells_is_certified() {
        for mask in 0..1u32 << 12 {
            let samples = (0..12).map(|i| (mask >> i & 1) as u8).collect();
            let mut volume = DenseVolume::new([3, 2, 2], samples, Placement::default()).unwrap();
            volume.binary = true;
            // A slice of all pairs; the sweep takes them all.
            if std::env::var_os("OCTOFOLD_SWEEP").is_some() || mask % 16 == 5 {
                assert_certified(&volume, &options(BINARY, 1.0), 4000);
            }
        }
    }

    #[test]
    fn blocks_of_three_are_certified() {
        crate::sweep::every([100, 1 << 20], 0u32..1 << 27, |mask| {
            let samples = (0..27).map(|i| (mask >> i & 1) as u8).collect();
            let mut volume = DenseVolume::new([3; 3], samples, Placement::default()).unwrap();
            volume.binary = true;
            assert_certified(&volume, &options(BINARY, 1.0), 400);
            Ok(())
        });
    }

    #[test]
    fn random_volumes_are_certified() {
        let dims = (1usize..20, 1usize..16, 1usize..20);
        let tolerances = prop::sample::select(vec![0.5, 0.75, 1.0, 1.5, 2.0]);
        let domain = (dims, any::<u64>(), 1u64..7, any::<bool>(), tolerances);
        crate::sweep::every([40, 100_000], domain, |(dims, seed, smooth, open, tolerance)| {
            let volume = noise([dims.0, dims.1, dims.2], seed, smooth);
            assert_certified(&volume, &options(CubesOptions { open, ..BINARY }, tolerance), 2000);
            Ok(())
        });
    }

    proptest! {
        #![proptest_config(crate::sweep::cases(20))]

        #[test]
        fn gray_volumes_are_certified(
            dims in (2usize..24, 2usize..16, 2usize..24),
            waves in prop::array::uniform3(prop::array::uniform3(0.0f64..0.9)),
            iso in -0.8f64..0.8,
            open in any::<bool>(),
            below in any::<bool>(),
        ) {
            let (x, y, z) = dims;
            let samples = (0..x * y * z).map(|i| {
                let at = [i % x, i / x % y, i / x / y].map(|v| v as f64);
                waves.iter().map(|w| (0..3).map(|a| w[a] * at[a]).sum::<f64>().sin()).sum::<f64>()
                    as f32 / 3.0
            }).collect();
            let volume = DenseVolume::new([x, y, z], samples, Placement::default()).unwrap();
            let inside = if below { Inside::Below } else { Inside::Above };
            assert_certified(&volume, &options(CubesOptions { iso, inside, open }, 1.0), 4000);
        }

    }

    proptest! {
        #![proptest_config(crate::sweep::cases(3))]

        #[test]
        fn threads_and_slabs_change_nothing_and_small_boxes_no_promise(seed in any::<u64>()) {
            let volume = noise([40, 20, 70], seed, 9);
            let options = options(BINARY, 1.0);
            let run = Run::default();
            let expected = certified(&volume, &options, &run).unwrap();
            for threads in [1, 2, 3, 8] {
                let found = par::with_threads(threads, || certified(&volume, &options, &run));
                prop_assert_eq!(&found.unwrap(), &expected);
            }
            for slab in [8, 48, 256] {
                prop_assert_eq!(&in_parts(&volume, &options, slab, BOX, &run).unwrap(), &expected);
            }
            let (mesh, _) = in_parts(&volume, &options, SLAB, 8, &run).unwrap();
            let found = measure(&mesh, Weld::Off, &run).unwrap();
            prop_assert!(found.closed && found.manifold && found.self_intersections == 0);
            let reference = marching_cubes(&volume, &BINARY, &run).unwrap();
            prop_assert_eq!(found.euler, measure(&reference, Weld::Off, &run).unwrap().euler);
            let near = compare(&mesh, &reference, 4000, &run).unwrap();
            prop_assert!(near.hausdorff.unwrap() <= 1.001);
        }
    }

    #[test]
    fn built_in_shapes_are_certified_with_few_triangles() {
        for (sample, share) in [
            (Sample::PartA, 0.003),
            (Sample::PartE, 0.003),
            (Sample::Sphere, 0.012),
            (Sample::Kettle, 0.02),
            (Sample::TapeCutter, 0.01),
            (Sample::Torus, 0.02),
        ] {
            let volume = dense(sample, 96);
            let found = assert_certified(&volume, &options(BINARY, 1.0), 4000);
            let run = Run::default();
            let (mesh, _) = certified(&volume, &options(BINARY, 1.0), &run).unwrap();
            let most = share * found.reference_triangles as f64;
            assert!(
                (mesh.triangles.len() as f64) < most,
                "{} {}",
                sample.name(),
                mesh.triangles.len()
            );
            let [volume, reference] = [found.volume, found.reference_volume].map(Option::unwrap);
            assert!((volume / reference - 1.0).abs() < 0.004, "{} {volume}", sample.name());
        }
    }
}

//! What is claimed of networks, on noise of every coarseness and on shapes.

use super::ball::{Ball, BallError, balled};
use super::census::{census, octree};
use super::combine::{Operation, combine};
use super::compress::{CompressOptions, Reading, compress};
use super::frame::framed;
use super::links::{Face, Rule, link, step, tangents};
use super::motion::{Motion, MotionError, Preimage, moved, transformed};
use super::patches::combine_patches;
use super::*;
use crate::samples::Sample;
use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

/// A solid by its voxels.
pub(super) fn solid(dims: [usize; 3], inside: impl Fn([usize; 3]) -> bool) -> Spans {
    let mut runs = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in (0..dims[0]).filter(|&x| inside([x, y, z])) {
                runs.push(([y as u32, z as u32], [x as u32, x as u32 + 1]));
            }
        }
    }
    Spans::from_runs(dims, Placement::default(), runs)
}

/// Noise of some coarseness, so that there are walls, cavities and wide planes.
pub(super) fn noise(dims: [usize; 3], seed: u64, coarse: usize, dense: u64) -> Spans {
    solid(dims, |at| {
        let [x, y, z] = at.map(|i| (i / coarse) as u64);
        let mut h = seed ^ (x << 40 | y << 20 | z);
        for _ in 0..3 {
            h = (h ^ h >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        }
        (h >> 33) % 100 < dense
    })
}

fn solids() -> impl Strategy<Value = Spans> {
    (1usize..16, 1usize..12, 1usize..12, any::<u64>(), 1usize..6, 5u64..96)
        .prop_map(|(x, y, z, seed, coarse, dense)| noise([x, y, z], seed, coarse, dense))
}

fn every_voxel(dims: [usize; 3]) -> impl Iterator<Item = [u32; 3]> {
    let [w, h, d] = dims.map(|n| n as u32);
    (0..w * h * d).map(move |i| [i % w, i / w % h, i / w / h])
}

proptest! {
    #![proptest_config(crate::sweep::cases(60))]

    #[test]
    fn a_network_says_what_its_solid_says(solid in solids()) {
        let network = Network::new(&solid, &Run::default()).unwrap();
        prop_assert_eq!(&network.spans(), &solid);
        for at in every_voxel(solid.dims()) {
            let exposed = |d: &Direction| !step(at, *d).is_some_and(|b| solid.contains(b));
            let mask = (0..6).filter(exposed).map(|d| 1 << d).sum();
            let expected = match (solid.contains(at), mask) {
                (false, _) => Side::Outside,
                (true, 0) => Side::Inside,
                (true, mask) => Side::Surface(mask),
            };
            prop_assert_eq!(network.side(at), expected);
        }
        let nodes = network.nodes();
        prop_assert_eq!(nodes.len() as u64, network.count());
        let again = Network::from_nodes(network.dims(), network.placement, nodes);
        prop_assert_eq!(again, network);
    }

    #[test]
    fn links_are_closed_and_bidirectional(solid in solids()) {
        let network = Network::new(&solid, &Run::default()).unwrap();
        let contains = |at| network.contains(at);
        for node in network.nodes() {
            for direction in (0..6).filter(|d| node.mask >> d & 1 == 1) {
                let face = Face { at: node.at(), direction };
                for rule in [Rule::Split, Rule::Join] {
                    for tangent in tangents(direction) {
                        let next = link(face, tangent, rule, contains);
                        let Side::Surface(mask) = network.side(next.at) else { panic!() };
                        prop_assert!(mask >> next.direction & 1 == 1);
                        let back = tangents(next.direction).into_iter();
                        prop_assert!(
                            back.map(|t| link(next, t, rule, contains)).any(|f| f == face)
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn compression_loses_nothing(solid in solids(), least_area in 1u32..6, reading in 0..3usize) {
        let network = Network::new(&solid, &Run::default()).unwrap();
        let reading = Reading::ALL[reading];
        let compressed = compress(&network, &CompressOptions { reading, least_area });
        prop_assert_eq!(&compressed.decompress(), &network);
        for plane in &compressed.planes {
            prop_assert_eq!(plane.nodes().len(), plane.area as usize);
            prop_assert_eq!(plane.loops.iter().filter(|l| l.is_outer()).count(), 1);
        }
    }

    #[test]
    fn operations_are_those_of_sets(
        dims in (1usize..16, 1usize..8, 1usize..8),
        seeds in prop::array::uniform3(any::<u64>()),
        coarse in 1usize..5,
        count in 1usize..4,
    ) {
        let dims = [dims.0, dims.1, dims.2];
        let solids = seeds.map(|seed| noise(dims, seed, coarse, 20 + seed % 60));
        let operands: Vec<&Spans> = solids.iter().take(count).collect();
        for operation in [
            Operation::Union,
            Operation::Intersection,
            Operation::Difference,
            Operation::SymmetricDifference,
        ] {
            let found = combine(operation, &operands, &Run::default()).unwrap().unwrap();
            let expected = solid(dims, |at| {
                let at = at.map(|i| i as u32);
                let inside: Vec<bool> = operands.iter().map(|s| s.contains(at)).collect();
                let all = inside.iter().filter(|&&i| i).count();
                match operation {
                    Operation::Union => all > 0,
                    Operation::Intersection => all == count,
                    Operation::Difference => inside[0] && all == 1,
                    Operation::SymmetricDifference => all % 2 == 1,
                }
            });
            prop_assert_eq!(&found, &expected);
            if let [a, b] = operands[..] {
                let [a, b] = [a, b].map(|s| Network::new(s, &Run::default()).unwrap());
                let patches = combine_patches(operation, &a, &b).unwrap();
                prop_assert_eq!(patches, Network::new(&expected, &Run::default()).unwrap());
            }
        }
    }
}

proptest! {
    #![proptest_config(crate::sweep::cases(40))]

    #[test]
    fn motion_is_what_its_definition_says(
        solid in solids(),
        turn in prop::array::uniform4(-1.0f64..1.0),
        scale in prop::array::uniform3(0.4f64..2.5),
        shift in prop::array::uniform3(-8.0f64..20.0),
        dims in (1usize..30, 1usize..24, 1usize..24),
        stretched in any::<bool>(),
    ) {
        let turn = DQuat::from_array(turn).normalize();
        let scale = if stretched { DVec3::from(scale) } else { DVec3::ONE };
        let linear = DMat3::from_quat(turn) * DMat3::from_diagonal(scale);
        let preimage = Preimage::new(linear, shift.into()).unwrap();
        let network = Network::new(&solid, &Run::default()).unwrap();
        let dims = [dims.0, dims.1, dims.2];
        let found =
            moved(&network, &preimage, dims, Placement::default(), &Run::default()).unwrap();
        let expected = self::solid(dims, |at| {
            let from = preimage.of(at.map(|i| i as u32));
            from.iter().all(|&i| i >= 0) && solid.contains(from.map(|i| i as u32))
        });
        prop_assert_eq!(found, expected);
    }
}

#[test]
fn a_grid_within_the_solid_is_full() {
    let solid = solid([40; 3], |at| at.iter().all(|i| (1..39).contains(i)));
    let network = Network::new(&solid, &Run::default()).unwrap();
    let preimage = Preimage::new(DMat3::IDENTITY, DVec3::splat(-15.0)).unwrap();
    let found = moved(&network, &preimage, [8; 3], Placement::default(), &Run::default()).unwrap();
    assert_eq!(found.count(), 512);
}

#[test]
fn symmetries_move_every_voxel() {
    let solid = noise([9, 7, 5], 3, 2, 50);
    let network = Network::new(&solid, &Run::default()).unwrap();
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for signs in 0..8 {
            // Axis a of the solid becomes axis order[a] of the result, turned over where its sign says.
            let mut linear = DMat3::ZERO;
            let (mut dims, mut shift) = ([0; 3], DVec3::ZERO);
            for a in 0..3 {
                let over = signs >> a & 1 == 1;
                linear.col_mut(a)[order[a]] = if over { -1.0 } else { 1.0 };
                dims[order[a]] = solid.dims()[a];
                shift[order[a]] = if over { solid.dims()[a] as f64 - 1.0 } else { 0.0 };
            }
            let preimage = Preimage::new(linear, shift).unwrap();
            let found =
                moved(&network, &preimage, dims, Placement::default(), &Run::default()).unwrap();
            assert_eq!(found.count(), solid.count());
            for at in every_voxel(solid.dims()) {
                let image = linear * DVec3::from(at.map(f64::from)) + shift;
                assert_eq!(found.contains(image.to_array().map(|x| x as u32)), solid.contains(at));
            }
        }
    }
    let flat = Preimage::new(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)), DVec3::ZERO);
    assert_eq!(flat, Err(MotionError::Flat));
}

proptest! {
    #![proptest_config(crate::sweep::cases(40))]

    #[test]
    fn solids_move_in_the_world(
        solid in solids(),
        turn in prop::array::uniform4(-1.0f64..1.0),
        scale in 0.5f64..2.0,
        shift in prop::array::uniform3(-8.0f64..20.0),
        about in prop::option::of(prop::array::uniform3(-3.0f64..9.0)),
        quarter in any::<bool>(),
    ) {
        let mut solid = solid;
        solid.placement = Placement { origin: [3.0, -1.0, 0.5], ..Placement::spacing([0.5; 3]) };
        let linear = if quarter {
            DMat3::from_cols_array(&[0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        } else {
            DMat3::from_quat(DQuat::from_array(turn).normalize()) * scale
        };
        let shift = if quarter { shift.map(|v| (2.0 * v).round() / 2.0) } else { shift };
        let motion = Motion { linear: linear.to_cols_array_2d(), about, shift };
        let found = transformed(&solid, &motion, &Run::default()).unwrap();
        let Some(extent) = solid.extent() else {
            prop_assert_eq!(found, solid);
            return Ok(());
        };
        let middle = [0, 1, 2].map(|a| (extent.start[a] + extent.end[a] - 1) as f64 / 2.0);
        let about = DVec3::from(about.unwrap_or_else(|| solid.placement.place(middle)));
        let back = solid.placement.inverse().unwrap();
        let mut sure = true;
        for at in every_voxel(found.dims()) {
            let world = DVec3::from(found.placement.place(at.map(f64::from)));
            let from = linear.inverse() * (world - about - DVec3::from(shift)) + about;
            let from = back.place(from.to_array());
            let tie = from.iter().any(|v| ((v - 0.5).round() - (v - 0.5)).abs() < 1e-5);
            let from = from.map(|v| (v + 0.5).floor());
            let inside = from.iter().all(|&v| v >= 0.0) && solid.contains(from.map(|v| v as u32));
            prop_assert!(tie || found.contains(at) == inside, "{:?} from {:?}", at, from);
            sure &= !tie;
        }
        if quarter && sure {
            prop_assert_eq!(found.count(), solid.count());
        }
    }

    #[test]
    fn solids_of_other_grids_are_brought_into_one(
        solid in solids(),
        other in solids(),
        by in prop::array::uniform3(-9i64..9),
        half in any::<bool>(),
    ) {
        let mut other = other;
        // A quarter of a voxel off, each voxel has one in the other grid that holds its centre.
        other.placement.origin = by.map(|v| v as f64 + if half { 0.25 } else { 0.0 });
        for operation in [Operation::Union, Operation::Difference, Operation::SymmetricDifference] {
            let both = vec![solid.clone(), other.clone()];
            let both = framed(operation, both, &Run::default()).unwrap();
            prop_assert_eq!(both[0].dims(), both[1].dims());
            prop_assert_eq!(both[0].placement, both[1].placement);
            for at in every_voxel(both[0].dims()) {
                let world = both[0].placement.place(at.map(f64::from)).map(|v| v as i64);
                let is_in = |solid: &Spans, at: [i64; 3]| {
                    at.iter().all(|&i| i >= 0) && solid.contains(at.map(|i| i as u32))
                };
                prop_assert_eq!(both[0].contains(at), is_in(&solid, world));
                let there = [0, 1, 2].map(|a| world[a] - by[a]);
                prop_assert_eq!(both[1].contains(at), is_in(&other, there));
            }
            if operation != Operation::Difference {
                prop_assert_eq!(both[0].count(), solid.count());
                prop_assert_eq!(both[1].count(), other.count());
            }
        }
    }

    #[test]
    fn octrees_are_counted_as_their_definition_says(solid in solids()) {
        fn mixed(solid: &Spans, at: [u32; 3], side: u32) -> u64 {
            let inside = |i: u32| {
                let own = [i % side, i / side % side, i / side / side];
                solid.contains(std::array::from_fn(|a| at[a] + own[a]))
            };
            let filled = (0..side.pow(3)).filter(|&i| inside(i)).count() as u32;
            if filled == 0 || filled == side.pow(3) {
                return 0;
            }
            let half = side / 2;
            let child = |i: u32| std::array::from_fn(|a| at[a] + half * (i >> a & 1));
            1 + (0..8).map(|i| mixed(solid, child(i), half)).sum::<u64>()
        }
        let count = octree(&solid);
        let side = solid.dims().into_iter().max().map_or(1, usize::next_power_of_two);
        prop_assert_eq!(count.mixed, mixed(&solid, [0; 3], side as u32));
        prop_assert_eq!(count.nodes, 1 + 8 * count.mixed);
    }
}

proptest! {
    #![proptest_config(crate::sweep::cases(40))]

    #[test]
    fn balls_reach_what_is_no_further_than_their_radius(
        solid in solids(),
        radius in 0.0f64..4.0,
        whole in any::<bool>(),
        side in prop::array::uniform3(0.6f64..2.0),
        lean in -0.5f64..0.5,
    ) {
        let mut solid = solid;
        let radius = if whole { radius.floor() } else { radius };
        solid.placement.axes = if whole {
            Placement::default().axes
        } else {
            [[side[0], 0.0, 0.0], [lean, side[1], 0.0], [0.0, -lean, side[2]]]
        };
        let far = |a: [i64; 3], b: [i64; 3]| {
            let axes = DMat3::from_cols_array_2d(&solid.placement.axes);
            (axes * DVec3::from([0, 1, 2].map(|i| (a[i] - b[i]) as f64))).length()
        };
        let dilated = balled(&solid, Ball::Dilate(radius), &Run::default()).unwrap();
        let eroded = balled(&solid, Ball::Erode(radius), &Run::default()).unwrap();
        prop_assert_eq!(eroded.dims(), solid.dims());
        let wide = [0, 1, 2].map(|a| (dilated.dims()[a] - solid.dims()[a]) as i64 / 2);
        let filled: Vec<[i64; 3]> = every_voxel(solid.dims())
            .filter(|&at| solid.contains(at)).map(|at| at.map(i64::from)).collect();
        for at in every_voxel(dilated.dims()) {
            let from = [0, 1, 2].map(|a| i64::from(at[a]) - wide[a]);
            let reached = filled.iter().any(|&b| far(from, b) <= radius + 1e-8);
            prop_assert_eq!(dilated.contains(at), reached, "{:?}", at);
        }
        let ends = solid.dims().map(|n| n as i64);
        let empty: Vec<[i64; 3]> = every_voxel(dilated.dims())
            .map(|at| [0, 1, 2].map(|a| i64::from(at[a]) - wide[a]))
            .filter(|at| (0..3).any(|a| at[a] < 0 || at[a] >= ends[a])
                || !solid.contains(at.map(|i| i as u32)))
            .collect();
        for at in every_voxel(solid.dims()) {
            let here = at.map(i64::from);
            // A ball that reaches nothing beyond the voxel's own still has that.
            let left = solid.contains(at) && empty.iter().all(|&b| far(here, b) > radius + 1e-8);
            prop_assert_eq!(eroded.contains(at), left, "{:?}", at);
        }
    }
}

#[test]
fn balls_without_a_fit_radius_are_refused() {
    let solid = noise([5, 4, 3], 1, 1, 50);
    for radius in [-1.0, f64::NAN, f64::INFINITY] {
        let refused = balled(&solid, Ball::Erode(radius), &Run::default());
        assert!(matches!(refused, Err(BallError::Radius(_))), "{radius}");
    }
    let refused = balled(&solid, Ball::Dilate(1e6), &Run::default());
    assert_eq!(refused, Err(BallError::TooLarge(1e6)));
}

#[test]
fn a_census_tells_all_three_counts() {
    let full = solid([12; 3], |at| at.iter().all(|i| (1..11).contains(i)));
    let census = census(&full, &Run::default()).unwrap();
    assert_eq!((census.voxels, census.surface_voxels, census.faces), (1000, 488, 600));
    let faces = &census.compressed[0];
    assert_eq!((faces.reading, faces.nodes), (Reading::Faces, 26));
    // Six loops around 8 x 8 voxels, 3 bits a step.
    assert_eq!((faces.data.chain, faces.items), (6 * 32, 26 + 6 + 18));
    let bits = 6 * 7 + 6 * 12 + 3 * 6 * 32 + 12 * 21 + 8 * 18;
    assert_eq!(faces.bytes, u64::div_ceil(bits, 8));
    // Of a 16^3 box: below each of 8 octants 8 nodes of side 4, and so on.
    assert_eq!(census.octree.nodes, 1 + 8 * census.octree.mixed);
}

#[test]
fn a_grid_too_long_for_nodes_is_refused() {
    let empty = |voxels| Spans::empty([voxels, 1, 1], Placement::default());
    let network = |voxels| Network::new(&empty(voxels), &Run::default());
    assert_eq!(network(MOST_VOXELS).unwrap().count(), 0);
    let voxels = MOST_VOXELS + 1;
    assert_eq!(network(voxels), Err(NetworkError::TooLong { voxels }));
}

#[test]
fn a_box_has_26_data_and_a_hollow_one_more() {
    let full = solid([12; 3], |at| at.iter().all(|i| (1..11).contains(i)));
    let hollow = solid([12; 3], |at| {
        at.iter().all(|i| (1..11).contains(i)) && !at.iter().all(|i| (2..10).contains(i))
    });
    let run = Run::default();
    let [full, hollow] = [full, hollow].map(|s| Network::new(&s, &run).unwrap());
    let count = compress(&full, &CompressOptions::default()).count();
    assert_eq!((count.planes, count.edges, count.voxels, count.loops), (6, 12, 8, 6));
    assert_eq!(count.nodes(), 26);
    // The same voxels with the same neighbours, told apart by their masks.
    assert!(full.nodes().iter().map(|n| n.at()).eq(hollow.nodes().iter().map(|n| n.at())));
    assert_ne!(full, hollow);
}

#[test]
fn shapes_have_the_data_that_the_specification_counts() {
    let mask = Sample::PartA.voxels(64).unwrap();
    let all = mask.read(crate::volume::Region::all(mask.dims())).unwrap();
    let solid = solid(mask.dims(), |[x, y, z]| all.value((z * 64 + y) * 64 + x) != 0.0);
    let network = Network::new(&solid, &Run::default()).unwrap();
    for reading in [Reading::Faces, Reading::Six] {
        let compressed = compress(&network, &CompressOptions { reading, least_area: 1 });
        assert_eq!(compressed.decompress(), network);
        assert!(compressed.count().nodes() < network.count() / 3, "{:?}", compressed.count());
    }
}

//! What is claimed of networks, on noise of every coarseness and on shapes.

use super::combine::{Operation, combine};
use super::compress::{CompressOptions, Reading, compress};
use super::links::{Face, Rule, link, step, tangents};
use super::motion::{MotionError, Preimage, moved};
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
    fn compression_loses_nothing(solid in solids(), least_area in 1u32..6, six in any::<bool>()) {
        let network = Network::new(&solid, &Run::default()).unwrap();
        let reading = if six { Reading::Six } else { Reading::Faces };
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

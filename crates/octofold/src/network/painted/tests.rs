//! What is claimed of payloads: each operation beside its definition, voxel by voxel.

use super::super::ball::Ball;
use super::super::carry::*;
use super::super::combine::Operation;
use super::super::links::step;
use super::super::motion::Motion;
use super::super::paint::{paint_mesh, paint_volume};
use super::super::palette::Labelled;
use super::super::tests::noise;
use super::*;
use crate::attributes::Material;
use crate::volume::DenseVolume;
use proptest::prelude::*;

const BOTH: Kinds = Kinds { labels: true, colours: true };

/// A painted solid whose values tell where nodes are.
fn painted(solid: Spans, seed: u32) -> Painted {
    Painted::with(solid, BOTH, &Run::default(), |_, [x, y, z]| {
        let label = seed ^ (x | y << 8 | z << 16);
        Value { label, colour: [x as u8, y as u8, z as u8, seed as u8] }
    })
    .unwrap()
}

/// Values by place, looked up in a list.
fn dense(painted: &Painted) -> Vec<([u32; 3], Value)> {
    let nodes = painted.network().nodes();
    nodes.iter().map(|n| n.at()).zip(painted.payload().values().iter().copied()).collect()
}

fn of(values: &[([u32; 3], Value)], at: [u32; 3]) -> Option<Value> {
    values.iter().find(|v| v.0 == at).map(|v| v.1)
}

/// The value of the first of the nodes that are nearest to a place.
fn nearest(values: &[([u32; 3], Value)], at: [f64; 3], sides: [f64; 3]) -> Value {
    let far =
        |to: [u32; 3]| (0..3).map(|a| ((f64::from(to[a]) - at[a]) * sides[a]).powi(2)).sum::<f64>();
    let least = values.iter().map(|v| far(v.0)).fold(f64::INFINITY, f64::min);
    values.iter().find(|v| far(v.0) == least).map_or(Value::PLAIN, |v| v.1)
}

proptest! {
    #![proptest_config(crate::sweep::cases(40))]

    #[test]
    fn set_operations_take_values_as_defined(
        dims in (1usize..9, 1usize..9, 1usize..9),
        seeds in (any::<u64>(), any::<u64>()),
        coarse in 1usize..4,
        dense_by in 20u64..95,
    ) {
        let dims = [dims.0, dims.1, dims.2];
        let a = painted(noise(dims, seeds.0, coarse, dense_by), 1);
        let b = painted(noise(dims, seeds.1, coarse, dense_by), 2);
        let values = [dense(&a), dense(&b)];
        for operation in [
            Operation::Union,
            Operation::Intersection,
            Operation::Difference,
            Operation::SymmetricDifference,
        ] {
            let run = Run::default();
            let both = combine_painted(operation, &[a.clone(), b.clone()], &run).unwrap().unwrap();
            for (at, value) in dense(&both) {
                let own = of(&values[0], at).or_else(|| of(&values[1], at));
                let is_in = |at| operation.keeps(a.solid().contains(at), b.solid().contains(at));
                let behind = (0..6).filter_map(|d| step(at, d)).filter(|&to| !is_in(to));
                let mut behind =
                    behind.filter_map(|to| of(&values[0], to).or_else(|| of(&values[1], to)));
                prop_assert_eq!(Some(value), own.or_else(|| behind.next()), "{:?}", operation);
            }
        }
    }

    #[test]
    fn motions_and_balls_take_the_nearest(
        dims in (1usize..8, 1usize..8, 1usize..8),
        seed in any::<u64>(),
        coarse in 1usize..4,
        turn in 0usize..8,
        shift in (-3i32..4, -3i32..4, -3i32..4),
        radius in 0u32..3,
    ) {
        let mut solid = noise([dims.0, dims.1, dims.2], seed, coarse, 50);
        let sides = [1.0, 1.5, 0.5];
        solid.placement = Placement::spacing(sides);
        let a = painted(solid, 7);
        let values = dense(&a);
        let run = Run::default();
        for ball in [Ball::Dilate(f64::from(radius)), Ball::Erode(f64::from(radius) / 2.0)] {
            let changed = balled_painted(&a, ball, &run).unwrap();
            let wider = [0, 1, 2].map(|i| (changed.dims()[i] - a.dims()[i]) as f64 / 2.0);
            for (at, value) in dense(&changed) {
                let from = [0, 1, 2].map(|i| f64::from(at[i]) - wider[i]);
                prop_assert_eq!(value, nearest(&values, from, sides));
            }
        }
        // Half turns about all axes, mirrors, and shifts by whole voxels are exact.
        let sign = |axis: usize| if turn >> axis & 1 == 1 { -1.0 } else { 1.0 };
        let motion = Motion {
            linear: [[sign(0), 0.0, 0.0], [0.0, sign(1), 0.0], [0.0, 0.0, sign(2)]],
            about: None,
            shift: [
                f64::from(shift.0) * sides[0],
                f64::from(shift.1) * sides[1],
                f64::from(shift.2) * sides[2],
            ],
        };
        let there = transformed_painted(&a, &motion, &run).unwrap();
        let mut expected: Vec<Value> = a.payload().values().to_vec();
        let mut found = there.payload().values().to_vec();
        expected.sort_unstable();
        found.sort_unstable();
        prop_assert_eq!(expected, found);
        let back = Motion { shift: motion.shift.map(|s| -s), ..motion };
        if turn == 0 && a.solid().count() > 0 {
            let again = transformed_painted(&there, &back, &run).unwrap();
            prop_assert_eq!(again.payload(), a.payload());
        }
        let cut = cut_painted(&a, [1, -1, 0], [5, 6, 4], &run).unwrap();
        for (at, value) in dense(&cut) {
            let from = [at[0] as f64 + 1.0, at[1] as f64 - 1.0, at[2] as f64];
            prop_assert_eq!(value, nearest(&values, from, sides));
        }
    }

    #[test]
    fn boundaries_have_the_faces_of_their_nodes(
        dims in (1usize..8, 1usize..8, 1usize..8),
        seed in any::<u64>(),
        coarse in 1usize..4,
    ) {
        let solid = noise([dims.0, dims.1, dims.2], seed, coarse, 50);
        let a = Painted::with(solid, BOTH, &Run::default(), |_, [x, y, z]| {
            let label = (x / 2 + y / 3 + z / 2) % 3;
            Value { label, colour: [label as u8; 4] }
        });
        let a = a.unwrap();
        let mesh = a.boundary(&Run::default()).unwrap();
        prop_assert!(mesh.check().is_ok());
        let mut areas = [0.0; 3];
        for (t, label) in mesh.attributes.face_labels.as_ref().unwrap().iter().enumerate() {
            let [p, q, r] = mesh.corners(t).map(DVec3::from);
            let normal = (q - p).cross(r - p);
            areas[*label as usize] += normal.length() / 2.0;
            // The voxel behind the middle of the triangle has its label.
            let inside = (p + q + r) / 3.0 - 0.25 * normal.normalize();
            let at = inside.to_array().map(|v| v.round() as u32);
            prop_assert_eq!(a.values().at(at).unwrap().label, *label);
        }
        for label in 0..3 {
            let nodes = a.network().nodes();
            let own = nodes.iter().zip(a.payload().values()).filter(|n| n.1.label == label);
            let faces: u32 = own.map(|n| n.0.mask.count_ones()).sum();
            prop_assert!((areas[label as usize] - f64::from(faces)).abs() < 1e-6);
        }
    }
}

#[test]
fn meshes_and_volumes_tell_labels_and_colours() {
    let mut mesh = crate::samples::Sample::Cube.mesh(4, &Run::default()).unwrap().triangulate();
    let faces = mesh.triangles.len();
    mesh.attributes.face_materials = Some((0..faces).map(|f| (f % 2) as u32).collect());
    mesh.attributes.materials = [[255, 0, 0, 255], [0, 0, 255, 255]]
        .map(|colour| Material { colour, ..Material::default() })
        .to_vec();
    let run = Run::default();
    let options = crate::voxelize::VoxelizeOptions {
        size: crate::voxelize::Size::Resolution(12),
        fill: crate::voxelize::Fill::Solid,
    };
    let solid = crate::voxelize::voxelize(&mesh, &options, &run).unwrap();
    let painted = paint_mesh(solid, &mesh, &[], BOTH, &run).unwrap();
    assert_eq!(painted.payload().kinds(), BOTH);
    for value in painted.payload().values() {
        let expected = if value.label == 1 { [255, 0, 0, 255] } else { [0, 0, 255, 255] };
        assert_eq!(value.colour, expected);
    }
    // As samples, and back from samples.
    let labelled = Labelled::by_label(&painted);
    let region = Region::all(labelled.dims());
    let block = labelled.read(region).unwrap();
    let samples: Vec<u32> = (0..block.len()).map(|i| block.value(i) as u32).collect();
    let mut volume = DenseVolume::new(labelled.dims(), samples, painted.placement()).unwrap();
    volume.labels = labelled.labels().to_vec();
    assert_eq!(paint_volume(&volume, BOTH, &run).unwrap(), painted);
    let few = Labelled::by_colour(&painted, 1);
    assert_eq!(few.labels().len(), 1);
    assert_eq!(Labelled::by_colour(&painted, 255).labels().len(), 2);
    let mut mesh = painted.boundary(&run).unwrap();
    painted.dress(&mut mesh, &run).unwrap();
    assert_eq!(mesh.attributes.point_colours.map(|c| c.len()), Some(mesh.points.len()));
}

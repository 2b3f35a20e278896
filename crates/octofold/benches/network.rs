//! Set operations and motions of shapes of the unit cube at 512^3.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DMat3, DQuat, DVec3};
use octofold::network::Network;
use octofold::network::combine::{Operation, combine};
use octofold::network::motion::{Preimage, moved};
use octofold::samples::Sample;
use octofold::{Run, Volume, par, spans::Spans};
use std::hint::black_box;

const RESOLUTION: usize = 512;
const SHAPES: [Sample; 3] = [Sample::Sphere, Sample::Bracket, Sample::Csg3];

/// The shape, and the same shifted.
fn solids(sample: Sample, run: &Run) -> Option<[Spans; 2]> {
    let solid = sample.voxels(RESOLUTION)?.spans(run).ok()?;
    let by = RESOLUTION as i64 / 8;
    let mut shifted = solid.framed([-by; 3], solid.dims());
    shifted.placement = solid.placement;
    Some([solid, shifted])
}

fn networks(c: &mut Criterion) {
    let run = Run::default();
    let mut group = c.benchmark_group("network");
    group.sample_size(20);
    for sample in SHAPES {
        let Some([a, b]) = solids(sample, &run) else { continue };
        for operation in [Operation::Union, Operation::Intersection, Operation::Difference] {
            group.bench_function(format!("{}, {operation:?}", sample.name()), |bench| {
                bench.iter(|| {
                    par::with_threads(1, || combine(operation, black_box(&[&a, &b]), &run))
                });
            });
        }
        let Ok(network) = Network::new(&a, &run) else { continue };
        let turn =
            DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7));
        let middle = DVec3::splat((RESOLUTION as f64 - 1.0) / 2.0);
        let Ok(preimage) = Preimage::new(turn, middle - turn * middle) else { continue };
        group.bench_function(format!("{}, turned", sample.name()), |bench| {
            bench.iter(|| {
                par::with_threads(1, || {
                    moved(black_box(&network), &preimage, a.dims(), a.placement, &run)
                })
            });
        });
    }
    group.finish();
}

criterion_group!(benches, networks);
criterion_main!(benches);

//! Levels of detail of a generated mesh of a million triangles.

#[path = "../tests/shapes/torus.rs"]
mod torus;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use octofold::Run;
use octofold::lod::{self, BuildOptions, Cut, Eye, Mode, Patchwork, build};
use octofold::par;
use std::hint::black_box;
use torus::torus;

fn levels_of_detail(c: &mut Criterion) {
    let mesh = torus(1000, 500);
    let options = BuildOptions { level: 9, ..BuildOptions::default() };
    let run = Run::default();
    let mut group = c.benchmark_group("lod");
    group.sample_size(10);
    group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
    group.bench_function("build, level 9, one thread", |b| {
        b.iter(|| par::with_threads(1, || build(black_box(&mesh), &options, &run)));
    });
    let Ok(lod) = build(&mesh, &options, &run) else { return };
    let eye = Eye { position: [0.0, -2.5, 1.5], fov: 0.8, height: 1080.0, pixels: 0.35 };
    let criterion = lod::Criterion::Pixels(eye);
    let (mut cut, mut patchwork) = (Cut::default(), Patchwork::default());
    cut.reselect(&lod, &criterion);
    let patches = patchwork.make(&lod, &cut, Mode::Any).len();
    group.throughput(Throughput::Elements(patches as u64));
    group.bench_function("select", |b| b.iter(|| cut.reselect(&lod, black_box(&criterion))));
    group.bench_function("patches", |b| {
        b.iter(|| patchwork.make(&lod, black_box(&cut), Mode::Any).len());
    });
    group.finish();
}

criterion_group!(benches, levels_of_detail);
criterion_main!(benches);

//! Measures of a generated mesh of 100 000 triangles.

#[path = "../tests/shapes/torus.rs"]
mod torus;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use octofold::Run;
use octofold::measure::{Nearest, Topology, Winding, self_intersections, weld_points, within};
use std::hint::black_box;
use torus::torus;

fn measures(c: &mut Criterion) {
    let mesh = torus(500, 100);
    let run = Run::default();
    let mut group = c.benchmark_group("measure");
    group.sample_size(20);
    group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
    group.bench_function("weld", |b| b.iter(|| weld_points(black_box(&mesh.points), &run)));
    group.bench_function("topology", |b| {
        b.iter(|| Topology::of(mesh.points.len(), black_box(&mesh.triangles), &run))
    });
    group.bench_function("self-intersections", |b| {
        b.iter(|| self_intersections(black_box(&mesh), &run))
    });
    group.bench_function("nearest, build", |b| b.iter(|| Nearest::new(black_box(&mesh))));
    group.bench_function("winding, build", |b| b.iter(|| Winding::new(black_box(&mesh))));

    let coarse = torus(50, 20);
    group.bench_function("within, beside 2000 triangles", |b| {
        b.iter(|| within(black_box(&mesh), &coarse, 0.05, &run))
    });

    let queries: Vec<_> = mesh.points.iter().map(|p| p.map(|x| x * 1.001)).collect();
    let (nearest, winding) = (Nearest::new(&mesh), Winding::new(&mesh));
    group.throughput(Throughput::Elements(queries.len() as u64));
    group.bench_function("nearest, near queries", |b| {
        b.iter(|| nearest.nearest_all(black_box(&queries), &run))
    });
    let queries = &queries[..1000];
    group.throughput(Throughput::Elements(queries.len() as u64));
    group.bench_function("winding, near queries", |b| {
        b.iter(|| queries.iter().map(|&q| winding.at(black_box(q))).sum::<f64>())
    });
    group.finish();
}

criterion_group!(benches, measures);
criterion_main!(benches);

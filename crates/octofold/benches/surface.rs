//! Marching cubes and voxelization of generated shapes.

use criterion::{Criterion, criterion_group, criterion_main};
use octofold::lattice::Lattice;
use octofold::octree::Octree;
use octofold::samples::Sample;
use octofold::surface::{CubesOptions, Inside, marching_cubes};
use octofold::volume::{DenseVolume, Region};
use octofold::voxelize::{Fill, Size, VoxelizeOptions, voxelize};
use octofold::{Mesh, Placement, Run, Volume};
use std::hint::black_box;

fn gyroid(n: usize) -> Option<DenseVolume<f32>> {
    let field = Sample::Gyroid.volume(n - 1)?;
    let block = field.read(Region::all(field.dims())).ok()?;
    let samples = (0..block.len()).map(|i| block.value(i) as f32).collect();
    DenseVolume::new(field.dims(), samples, Placement::default())
}

fn torus() -> Option<Mesh> {
    Some(Sample::Torus.polygons(256)?.triangulate())
}

fn cubes(c: &mut Criterion) {
    let options = CubesOptions { iso: 0.0, inside: Inside::Below, open: false };
    let volume = gyroid(256);
    c.bench_function("cubes, gyroid 256", |b| {
        b.iter(|| volume.as_ref().map(|v| marching_cubes(black_box(v), &options, &Run::default())));
    });
}

fn voxels(c: &mut Criterion) {
    let mesh = torus();
    for fill in [Fill::Solid, Fill::Surface, Fill::ThinSurface26, Fill::ThinSurface6] {
        let options = VoxelizeOptions { size: Size::Resolution(512), fill };
        c.bench_function(&format!("voxelize, torus 512, {fill:?}"), |b| {
            b.iter(|| mesh.as_ref().map(|m| voxelize(black_box(m), &options, &Run::default())));
        });
    }
    c.bench_function("octree, torus 512", |b| {
        b.iter(|| {
            let mesh = mesh.as_ref()?;
            let lattice = Lattice::fit(mesh.bounds()?, 512).ok()?;
            Octree::from_mesh(black_box(mesh), &lattice, &Run::default()).ok()
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = cubes, voxels
}
criterion_main!(benches);

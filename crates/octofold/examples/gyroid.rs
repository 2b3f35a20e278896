use octofold::surface::{CubesOptions, Inside, marching_cubes};
use octofold::volume::DenseVolume;
use octofold::{Placement, Run, par};
use std::time::Instant;
fn main() {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let bytes = std::fs::read("/work/env/gyroid.raw").unwrap();
    let s: Vec<f32> = bytemuck::cast_slice(&bytes).to_vec();
    let v = DenseVolume::new([n; 3], s, Placement::default()).unwrap();
    for threads in [1, 2, 1, 2] {
        for open in [true, false] {
            let t = Instant::now();
            let m = par::with_threads(threads, || {
                marching_cubes(
                    &v,
                    &CubesOptions { iso: 0.0, inside: Inside::Above, open },
                    &Run::default(),
                )
                .unwrap()
            });
            println!(
                "{threads} open {open} {:.3}s {} {}",
                t.elapsed().as_secs_f64(),
                m.triangles.len(),
                m.points.len()
            );
        }
    }
}

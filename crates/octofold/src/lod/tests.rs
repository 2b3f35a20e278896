//! Cuts of closed surfaces have no cracks, whatever their levels; coarse patches are collapsed fine
//! ones.

use super::*;
use crate::measure::Topology;
use crate::mesh::Mesh;
use crate::run::Run;
use crate::samples::Sample;
use crate::sweep::cases;
use crate::par;
use proptest::prelude::*;
use rustc_hash::FxHashMap;

fn model(sample: Sample, detail: usize, level: u32) -> Lod {
    let mesh = sample.polygons(detail).unwrap().triangulate();
    build(&mesh, &BuildOptions { level, ..BuildOptions::default() }, &Run::default()).unwrap()
}

/// A cut that stops at a quarter of its octants from level `least` on.
fn random_cut(lod: &Lod, seed: u64, least: u32) -> Cut {
    Cut::by(lod, |o| {
        let mixed = (u64::from(o.node) ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        o.level >= least && (mixed >> 33).is_multiple_of(4)
    })
}

/// Times each directed edge of the patches is passed, less those the other way; and times it is
/// passed at all.
fn passes(patches: &[Patch]) -> FxHashMap<[u32; 2], (i32, u32)> {
    let mut passes = FxHashMap::default();
    for patch in patches {
        let corners: Vec<u32> = patch.corners().collect();
        assert!(corners.len() >= 3);
        for (i, &p) in corners.iter().enumerate() {
            let q = corners[(i + 1) % corners.len()];
            let entry = passes.entry([p.min(q), p.max(q)]).or_insert((0, 0));
            entry.0 += if p < q { 1 } else { -1 };
            entry.1 += 1;
        }
    }
    passes
}

proptest! {
    #![proptest_config(cases(12))]

    #[test]
    fn closed_surfaces_stay_closed_in_any_cut(
        which in 0usize..4,
        seed: u64,
        least in 2u32..5,
    ) {
        let samples = [Sample::Torus, Sample::Gear, Sample::Kettle, Sample::Cone];
        let lod = model(samples[which], 40, 7);
        let cut = random_cut(&lod, seed, least);
        let found = patches(&lod, &cut, Mode::Parity, &Run::default()).unwrap();
        prop_assert!(!found.is_empty());
        for (edge, (net, times)) in passes(&found) {
            prop_assert!(net == 0 && times % 2 == 0, "{edge:?}: {times} times, net {net}");
        }
    }
}

#[test]
fn bunny() {
    let Ok(folder) = std::env::var("OCTOFOLD_TRY") else { return };
    let text = std::fs::read_to_string(folder).unwrap();
    let mut mesh = Mesh::default();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first() {
            Some(&"v") => mesh.points.push([1, 2, 3].map(|i| words[i].parse().unwrap())),
            Some(&"f") => mesh.triangles.push([1, 2, 3].map(|i| words[i].split('/').next().unwrap().parse::<u32>().unwrap() - 1)),
            _ => {}
        }
    }
    let start = std::time::Instant::now();
    let lod = par::with_threads(1, || build(&mesh, &BuildOptions { level: 8, ..Default::default() }, &Run::default()).unwrap());
    println!("build {:?} nodes {}", start.elapsed(), lod.nodes().len());
    for l in 0..=8 {
        let start = std::time::Instant::now();
        let cut = Cut::select(&lod, &Criterion::Level(l), &Run::default()).unwrap();
        let a = start.elapsed();
        let start = std::time::Instant::now();
        let p = par::with_threads(1, || patches(&lod, &cut, Mode::Any, &Run::default()).unwrap());
        let b = start.elapsed();
        let q = patches(&lod, &cut, Mode::Parity, &Run::default()).unwrap();
        let odd = passes(&q).values().filter(|(_, t)| t % 2 == 1).count();
        let d = drawn(&lod, &cut, &p);
        let topo = Topology::of(d.mesh.points.len(), &d.mesh.triangles, &Run::default()).unwrap();
        let errors: Vec<f64> = lod.level(l).map(|n| lod.error(n)).collect();
        println!("level {l}: cut {} in {a:?}, patches {} in {b:?}, odd edges {odd}, mean bound {:.3} max {:.3} {:?}", cut.len(), p.len(), errors.iter().sum::<f64>() / errors.len() as f64, errors.iter().fold(0.0f64, |a, &b| a.max(b)), topo.boundary_edges.count);
    }
}

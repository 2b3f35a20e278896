//! Random cuts of real closed models have no cracks: 1000 of each in a sweep, a few in every run.

// A failed `unwrap` is a failed test.
#![allow(clippy::unwrap_used)]

use octofold::lod::{BuildOptions, Cut, Diagonal, Lod, Mode, Patch, build, drawn, patches};
use octofold::measure::{Topology, weld};
use octofold::{Mesh, Run, par};
use octofold_io::{Source, read_mesh};
use std::path::PathBuf;

/// Closed; the parts of some cut through each other.
const MODELS: [&str; 10] = [
    "scans/armadillo.obj",
    "scans/spot.obj",
    "scans/torus.STL",
    "scans/1002_tray_bottom.STL",
    "scans/quadknot.obj",
    "broken/cracks_many.obj",
    "broken/self_intersectA.obj",
    "broken/busted.STL",
    "broken/wallhole.obj",
    "craft/kndC.obj",
];

/// The deepest level: cuts have levels 2 to 8 side by side.
const LEVEL: u32 = 8;

fn model(path: &str) -> Option<Mesh> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("OCTOFOLD_DATA").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: no data folder at {}", folder.display());
        return None;
    }
    let source = Source::open(&folder.join(path)).unwrap();
    Some(read_mesh(&source, None, &Run::default()).unwrap().triangulate())
}

/// A cut that stops at one of four octants from level 2 on.
fn random_cut(lod: &Lod, seed: u64) -> Cut {
    Cut::by(lod, |o| {
        let mixed = (u64::from(o.node) ^ seed << 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        o.level >= 2 && (mixed >> 33).is_multiple_of(4)
    })
}

/// Edges that are passed an odd number of times, or more often one way than the other.
fn faults(patches: &[Patch]) -> (usize, usize) {
    let mut passes = Vec::with_capacity(4 * patches.len());
    for patch in patches {
        let ring = patch.ring;
        for k in 0..4 {
            let (p, q) = (ring[k], ring[(k + 1) % 4]);
            if p != q {
                let way = u64::from(p < q);
                passes.push((u64::from(p.min(q)) << 32 | u64::from(p.max(q)), way));
            }
        }
    }
    passes.sort_unstable();
    let (mut odd, mut unbalanced) = (0, 0);
    for group in passes.chunk_by(|a, b| a.0 == b.0) {
        let with: usize = group.iter().map(|&(_, way)| way as usize).sum();
        odd += group.len() % 2;
        unbalanced += usize::from(2 * with != group.len());
    }
    (odd, unbalanced)
}

#[test]
fn random_cuts_of_real_models_have_no_cracks() {
    let full = std::env::var_os("OCTOFOLD_SWEEP").is_some_and(|v| v == "full");
    let cuts: Vec<u64> = (0..if full { 1000 } else { 2 }).collect();
    let options = BuildOptions { level: LEVEL, ..BuildOptions::default() };
    let run = Run::default();
    for path in MODELS {
        let Some(mesh) = model(path) else { return };
        let mesh = weld(&mesh, &run).unwrap();
        let topology = Topology::of(mesh.points.len(), &mesh.triangles, &run).unwrap();
        assert!(topology.is_balanced(), "{path} is not closed");
        let lod = build(&mesh, &options, &run).unwrap();
        let counts = par::map(&cuts, |&seed| {
            let cut = random_cut(&lod, seed);
            let found = patches(&lod, &cut, Mode::Parity, &Run::default()).unwrap();
            assert_eq!(faults(&found), (0, 0), "{path}, cut {seed}");
            let out = drawn(&lod, &cut, &found, Mode::Manifold, Diagonal::Fixed, &Run::default());
            let mesh = out.unwrap().mesh;
            let topology =
                Topology::of(mesh.points.len(), &mesh.triangles, &Run::default()).unwrap();
            assert_eq!(topology.boundary_edges.count, 0, "{path}, cut {seed}");
            assert_eq!(topology.misoriented_edges.count, 0, "{path}, cut {seed}");
            assert_eq!(topology.nonmanifold_edges.count, 0, "{path}, cut {seed}");
            assert_eq!(topology.nonmanifold_points.count, 0, "{path}, cut {seed}");
            found.len()
        });
        let patches = counts.iter().sum::<usize>() / counts.len();
        println!("{path}: {} cuts of {patches} patches in the mean, no crack", counts.len());
    }
}

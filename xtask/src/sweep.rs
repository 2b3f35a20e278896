//! Large sweeps: tests that take a sample of their domain in every run, and all of it here.
//!
//! Such a test reads the environment variable `OCTOFOLD_SWEEP` and takes all of its domain where
//! that is `full`; those with numbered cases take some hundredths of it where that is a range.

use crate::{cargo, must};
use anyhow::{Context, Result};

/// Name, package and filters of each sweep.
const SWEEPS: [(&str, &str, &[&str]); 12] = [
    ("formats", "octofold-io", &[]),
    ("certified", "octofold", &["surface::certified"]),
    ("cubes", "octofold", &["surface::cell", "surface::cubes"]),
    ("labels", "octofold", &["surface::labels"]),
    ("lod", "octofold-io", &["random_cuts", "oflod"]),
    ("lod-cuts", "octofold", &["lod::"]),
    ("lod-views", "octofold", &["within_the_bound", "before_and_after_a_switch"]),
    ("network", "octofold", &["network"]),
    ("published", "octofold", &["surface::adaptive", "surface::tel"]),
    ("repair", "octofold", &["repair"]),
    ("simplify", "octofold", &["simplify"]),
    ("voxels", "octofold", &["voxelize", "scan", "spans", "octree", "lattice", "radix"]),
];

/// Runs the sweep `name`, `part` of it.
pub fn run(name: &str, part: &str) -> Result<()> {
    let (_, package, filters) =
        SWEEPS.into_iter().find(|(n, ..)| *n == name).with_context(|| {
            let names = SWEEPS.map(|(n, ..)| n).join(", ");
            format!("no sweep `{name}`; sweeps are {names}")
        })?;
    let words = ["test", "--release", "--package", package, "--", "--nocapture"];
    must(cargo(&words).args(filters).env("OCTOFOLD_SWEEP", part))
}

//! The demo, run as a person would, and a look at what it wrote.

use crate::{cargo, must, octofold, target};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Meshes of the demo that must be closed and manifold.
const SOLIDS: [&str; 3] = ["scan-closed.ply", "kettle.stl", "gyroid.glb"];

/// Where the demo writes when it is tested.
pub fn folder() -> PathBuf {
    target().join("demo")
}

/// Runs the demo and checks its page and its solids.
pub fn run() -> Result<()> {
    let folder = folder();
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    must(cargo(&["run", "--quiet", "--release", "--", "demo"]).arg(&folder))?;
    let named = files_of_page(&folder)?;
    ensure!(named.len() > 2 * SOLIDS.len(), "the page shows only {} files", named.len());
    for file in named {
        let length = std::fs::metadata(&file).with_context(|| file.display().to_string())?.len();
        ensure!(length > 0, "{}: empty", file.display());
    }
    for solid in SOLIDS {
        let mut check = Command::new(octofold());
        check.arg("check").arg(folder.join(solid)).args(["--closed", "--manifold", "--oriented"]);
        must(&mut check)?;
    }
    Ok(())
}

/// Every file that the page shows or links to.
fn files_of_page(folder: &Path) -> Result<Vec<PathBuf>> {
    let index = folder.join("index.html");
    let page = std::fs::read_to_string(&index).with_context(|| index.display().to_string())?;
    let values = |attribute: &str| {
        let parts = page.split(attribute).skip(1).map(|rest| rest.split('"').next());
        parts.flatten().map(|name| folder.join(name)).collect::<Vec<_>>()
    };
    Ok([values("src=\""), values("href=\"")].concat())
}

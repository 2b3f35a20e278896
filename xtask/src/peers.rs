//! Independent programs as witnesses and rivals: pinned Python packages in throwaway environments
//! look at what the demo wrote, and are measured beside the release build.

use crate::{cargo, demo, must, octofold, root, target};
use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::Command;

/// Sets the environment up where it is not yet, and runs the check.
pub fn run() -> Result<()> {
    let python = environment("peers")?;
    let check = root().join("xtask/peers/check.py");
    must(Command::new(python).arg(check).arg(octofold()).arg(demo::folder()))
}

/// Measures octofold beside its peers; `name` is one of the parts of the scripts.
pub fn bench(name: &str) -> Result<()> {
    must(&mut cargo(&["build", "--release", "--package", "octofold-cli"]))?;
    let python = environment("rivals")?;
    let data = std::env::var_os("OCTOFOLD_DATA")
        .map_or_else(|| root().join("../shared/data"), PathBuf::from);
    let script = match name {
        "certified" | "lod" | "network" | "repair" | "sheets" | "simplify" | "tiles" => {
            format!("{name}.py")
        }
        "certified-peers" => "certified.py".into(),
        "damaged" => "repair.py".into(),
        _ => "bench.py".into(),
    };
    let script = root().join("xtask/peers").join(script);
    must(Command::new(python).arg(script).arg(octofold()).arg(name).arg(data))
}

/// The Python of an environment that holds exactly the packages pinned in `xtask/{name}.txt`.
fn environment(name: &str) -> Result<PathBuf> {
    let folder = target().join(name);
    let pins = root().join("xtask").join(name).with_extension("txt");
    let wanted = std::fs::read(&pins)?;
    let installed = folder.join("installed.txt");
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if std::fs::read(&installed).is_ok_and(|known| known == wanted) {
        return Ok(python);
    }
    let system = if cfg!(windows) { "python" } else { "python3" };
    must(Command::new(system).args(["-m", "venv", "--clear"]).arg(&folder))
        .context("the peers need Python 3 with its venv module (Debian: python3 python3-venv)")?;
    must(
        Command::new(&python)
            .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
            .arg(&pins),
    )
    .context("the peers could not be installed: is a Python package registry in reach?")?;
    std::fs::write(installed, wanted)?;
    Ok(python)
}

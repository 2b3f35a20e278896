//! Independent programs as witnesses: pinned Python packages in a throwaway environment look at
//! what the demo wrote.

use crate::{demo, must, octofold, root, target};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sets the environment up where it is not yet, and runs the check.
pub fn run() -> Result<()> {
    let python = environment(&target().join("peers"))?;
    let check = root().join("xtask/peers/check.py");
    must(Command::new(python).arg(check).arg(octofold()).arg(demo::folder()))
}

/// The Python of an environment that holds exactly the pinned packages.
fn environment(folder: &Path) -> Result<PathBuf> {
    let pins = root().join("xtask/peers.txt");
    let wanted = std::fs::read(&pins)?;
    let installed = folder.join("installed.txt");
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if std::fs::read(&installed).is_ok_and(|known| known == wanted) {
        return Ok(python);
    }
    let system = if cfg!(windows) { "python" } else { "python3" };
    must(Command::new(system).args(["-m", "venv", "--clear"]).arg(folder))
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

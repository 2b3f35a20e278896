//! Chores of the repository: the test command, conventions, sweeps and benches beside peers.

mod demo;
mod imports;
mod peers;
mod stages;
mod sweep;
mod tidy;

use anyhow::{Result, bail};
use std::path::PathBuf;
use std::process::{Command, ExitCode};

const USAGE: &str = "\
cargo xtask test          everything that CI checks
cargo xtask tidy          the conventions of the repository
cargo xtask sweep NAME    the whole of a large sweep: formats, certified, cubes, labels, lod,
                          lod-cuts, lod-views, network, published, repair, simplify or voxels;
                          `cargo xtask sweep NAME 30..60` takes these hundredths of numbered cases
cargo xtask bench NAME    beside its peers, on real models: cubes, cells, solid,
                          models, labels, certified, certified-peers, lod, tiles,
                          network, repair, damaged, sheets or simplify";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["test"] => stages::run(),
        ["tidy"] => tidy::run(),
        ["sweep", name] => sweep::run(name, "full"),
        ["sweep", name, part] => sweep::run(name, part),
        ["bench", name] => peers::bench(name),
        _ => Err(anyhow::anyhow!("usage:\n{USAGE}")),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The root of the repository that cargo runs this in, which need not be where it was built when
/// several clones share a target folder.
fn root() -> PathBuf {
    let here = std::env::var_os("CARGO_MANIFEST_DIR");
    let mut root = here.map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    root.pop();
    root
}

/// The same cargo that runs this, in the root of the repository.
fn cargo(words: &[&str]) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(words).current_dir(root());
    command
}

/// Runs a command; it must succeed.
fn must(command: &mut Command) -> Result<()> {
    let status = command.status()?;
    if !status.success() {
        bail!("{command:?}: {status}");
    }
    Ok(())
}

/// The folder that cargo builds into.
fn target() -> PathBuf {
    match std::env::var_os("CARGO_TARGET_DIR") {
        Some(folder) => root().join(folder),
        None => root().join("target"),
    }
}

/// The command that the release build makes.
fn octofold() -> PathBuf {
    target().join("release").join(format!("octofold{}", std::env::consts::EXE_SUFFIX))
}

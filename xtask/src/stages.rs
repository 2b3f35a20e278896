//! The one test command: every stage of it, timed, up to the first that fails.

use crate::{cargo, demo, must, peers, tidy};
use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Tests that passed.
static PASSED: AtomicU64 = AtomicU64::new(0);

type Stage = (&'static str, fn() -> Result<()>);

const STAGES: [Stage; 9] = [
    ("format", || must(&mut cargo(&["fmt", "--all", "--check"]))),
    ("tidy", tidy::run),
    ("clippy", clippy),
    ("tests", tests),
    ("doc tests", || counted(&mut cargo(&["test", "--workspace", "--doc"]))),
    ("docs", docs),
    ("fuzz targets", || {
        must(&mut cargo(&["check", "--locked", "--manifest-path", "fuzz/Cargo.toml"]))
    }),
    ("demo", demo::run),
    ("peers", peers::run),
];

/// Runs all stages.
pub fn run() -> Result<()> {
    let mut times = Vec::new();
    let mut failed = None;
    for (name, stage) in STAGES {
        eprintln!("== {name}");
        let begin = Instant::now();
        let result = stage().with_context(|| format!("stage `{name}` failed"));
        times.push((name, begin.elapsed().as_secs_f64()));
        if let Err(error) = result {
            failed = Some(error);
            break;
        }
    }
    for (name, seconds) in times {
        println!("{seconds:>8.1} s  {name}");
    }
    let passed = PASSED.load(Ordering::Relaxed);
    match failed {
        None => println!("{passed} passed, 0 failed"),
        Some(error) => {
            println!("{passed} passed, 1 failed");
            bail!(error);
        }
    }
    Ok(())
}

fn clippy() -> Result<()> {
    must(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))
}

fn docs() -> Result<()> {
    must(cargo(&["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// All tests but those in docs, which nextest does not run.
fn tests() -> Result<()> {
    let nextest = cargo(&["nextest", "--version"]).output().is_ok_and(|o| o.status.success());
    counted(&mut if nextest {
        cargo(&["nextest", "run", "--workspace", "--cargo-quiet", "--status-level", "fail"])
    } else {
        cargo(&["test", "--workspace", "--lib", "--bins", "--tests"])
    })
}

/// Runs a command that tells how many tests passed, and adds them up.
fn counted(command: &mut Command) -> Result<()> {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let (out, err) = (child.stdout.take(), child.stderr.take());
    std::thread::scope(|scope| {
        scope.spawn(|| out.map(pass_on));
        scope.spawn(|| err.map(pass_on));
    });
    let status = child.wait()?;
    if !status.success() {
        bail!("{command:?}: {status}");
    }
    Ok(())
}

/// Shows what a command says and counts the tests that it says have passed.
fn pass_on(said: impl Read) {
    for line in BufReader::new(said).lines().map_while(Result::ok) {
        PASSED.fetch_add(passed(&line), Ordering::Relaxed);
        eprintln!("{line}");
    }
}

/// The number before `passed` in the last line of a test run.
fn passed(line: &str) -> u64 {
    let line = line.trim_start();
    if !line.starts_with("test result:") && !line.starts_with("Summary") {
        return 0;
    }
    let before = line.split(" passed").next().unwrap_or_default();
    before.rsplit(' ').next().and_then(|n| n.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::passed;

    #[test]
    fn passed_tests_are_counted() {
        assert_eq!(passed("test result: ok. 12 passed; 0 failed; 1 ignored"), 12);
        assert_eq!(passed("     Summary [   0.4s] 7 tests run: 7 passed, 0 skipped"), 7);
        assert_eq!(passed("test three_passed ... 3 passed"), 0);
    }
}

//! The conventions of the repository, as a test.
//!
//! Every source file begins with its module docs, is named for what is in it, is short and leaves
//! nothing for later; the modules of the geometry crate import each other as in the table of
//! [`crate::imports`].

use crate::{imports, root};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// Most lines of code in a file, tests, comments and blank lines aside.
const LONGEST: usize = 600;

/// Names that say nothing about what is inside.
const EMPTY_NAMES: [&str; 5] = ["mod", "utils", "helpers", "common", "types"];

/// Words that put work off. Taken apart, so that this file may name them.
const LATER: [&str; 2] = [concat!("TO", "DO"), concat!("FIX", "ME")];

/// Checks everything and lists what is wrong.
pub fn run() -> Result<()> {
    let root = root();
    let mut wrong = Vec::new();
    for file in sources(&root)? {
        let text = std::fs::read_to_string(&file)?;
        let name = file.strip_prefix(&root).unwrap_or(&file).display().to_string();
        wrong.extend(faults(&file, &text).into_iter().map(|fault| format!("{name}: {fault}")));
    }
    wrong.extend(imports::faults(&root.join("crates/octofold/src"))?);
    if !wrong.is_empty() {
        bail!("{}", wrong.join("\n"));
    }
    Ok(())
}

/// Every Rust file of ours, in order.
pub fn sources(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
        for entry in entries {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                if !name.starts_with('.') && name != "target" && name != "node_modules" {
                    folders.push(path);
                }
            } else if name.ends_with(".rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

fn faults(file: &Path, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    if EMPTY_NAMES.contains(&stem.as_ref()) {
        faults.push(format!("`{stem}` says nothing about what is inside"));
    }
    if !text.starts_with("//!") {
        faults.push("no module docs (`//!`) on the first line".into());
    }
    let lines = lines_of_code(file, text);
    if lines > LONGEST {
        faults.push(format!("{lines} lines of code, {LONGEST} at most"));
    }
    for (number, line) in (1..).zip(text.lines()) {
        if let Some(word) = LATER.iter().find(|word| line.contains(**word)) {
            faults.push(format!("line {number}: {word}"));
        }
    }
    faults
}

/// Lines that are neither blank nor comment nor test.
fn lines_of_code(file: &Path, text: &str) -> usize {
    let is_test = file.components().any(|c| c.as_os_str() == "tests")
        || file.file_stem().is_some_and(|stem| stem == "tests");
    if is_test {
        return 0;
    }
    let code = without_tests(text).lines().map(str::trim);
    code.filter(|line| !line.is_empty() && !line.starts_with("//")).count()
}

/// The part of a file before its tests, which stand last.
pub fn without_tests(text: &str) -> &str {
    text.split("\n#[cfg(test)]").next().unwrap_or(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_repository_is_tidy() {
        run().unwrap();
    }

    #[test]
    fn faults_are_found() {
        let text = format!("fn f() {{}}\n// {}\n", LATER[0]);
        assert_eq!(faults(Path::new("src/utils.rs"), &text).len(), 3);
        let long = format!("//! Long.\n{}", "f();\n".repeat(LONGEST + 1));
        assert_eq!(faults(Path::new("src/long.rs"), &long).len(), 1);
        assert_eq!(faults(Path::new("tests/long.rs"), &long).len(), 0);
        let tested = format!("//! Short.\n#[cfg(test)]\n{long}");
        assert_eq!(faults(Path::new("src/short.rs"), &tested).len(), 0);
    }
}

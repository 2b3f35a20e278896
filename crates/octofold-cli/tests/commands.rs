//! Commands as people type them: what they say, and their exit codes.
//!
//! `TRYCMD=overwrite cargo test --test commands` writes down what they say now.

use std::path::Path;

#[test]
fn commands_say_what_is_written_down() {
    trycmd::TestCases::new().case("tests/cmd/*.trycmd");
}

/// The README's commands run in an empty folder, one after the other.
#[test]
fn the_readme_is_true() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme");
    let work = folder.join("README.in");
    if work.exists() {
        std::fs::remove_dir_all(&work).unwrap();
    }
    std::fs::create_dir_all(&work).unwrap();
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../README.md");
    let copy = folder.join("README.md");
    std::fs::copy(readme, &copy).unwrap();
    trycmd::TestCases::new().case(copy);
}

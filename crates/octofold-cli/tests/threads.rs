//! The same bytes for any number of threads, on every path that the command has.

use std::path::Path;
use std::process::Command;

fn octofold(folder: &Path, threads: &str, words: &[&str]) -> Vec<u8> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_octofold"));
    let done = command.current_dir(folder).args(words).args(["--threads", threads]).output();
    let done = done.expect("the command starts");
    assert!(done.status.success(), "{words:?}: {}", String::from_utf8_lossy(&done.stderr));
    done.stdout
}

#[test]
fn files_and_answers_do_not_depend_on_threads() {
    const STEPS: [&[&str]; 17] = [
        &["sample", "kettle", "kettle.ply", "--resolution", "48"],
        &["sample", "scan", "scan.ply", "--resolution", "48"],
        &["sample", "gyroid", "gyroid.npy", "--resolution", "70"],
        &["voxelize", "kettle.ply", "solid.nrrd", "--resolution", "90"],
        &["voxelize", "kettle.ply", "shell.npy", "--resolution", "90", "--fill", "surface"],
        &["voxelize", "kettle.ply", "thin26.binvox", "--resolution", "60", "--fill", "thin26"],
        &["voxelize", "kettle.ply", "thin6.vox", "--resolution", "60", "--fill", "thin6"],
        &["voxelize", "scan.ply", "scan.nii.gz", "--resolution", "40"],
        &["surface", "solid.nrrd", "solid.glb"],
        &["surface", "solid.nrrd", "solid-mc.glb", "--method", "mc"],
        &["surface", "gyroid.npy", "gyroid.stl", "--iso", "0", "--below"],
        &["surface", "thin6.vox", "labels.glb", "--labels"],
        &["repair", "scan.ply", "repaired.stl", "--resolution", "60"],
        &["repair", "scan.ply", "sheets.stl", "--resolution", "60", "--sheet"],
        &["convert", "kettle.ply", "kettle.3mf"],
        &["info", "scan.ply", "--picture", "scan.png"],
        &["compare", "solid.glb", "kettle.ply", "--samples", "20000"],
    ];
    let root = tempfile::tempdir().unwrap();
    let mut runs = Vec::new();
    for threads in ["1", "2", "3", "8"] {
        let folder = root.path().join(threads);
        std::fs::create_dir(&folder).unwrap();
        let answers: Vec<_> = STEPS.map(|words| octofold(&folder, threads, words)).to_vec();
        let mut names: Vec<_> =
            std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        let files = names.into_iter().map(|name| {
            let bytes = std::fs::read(folder.join(&name)).unwrap();
            (name, bytes)
        });
        runs.push((answers, files.collect::<Vec<_>>()));
    }
    assert_eq!(runs[0].1.len(), 16);
    for run in &runs[1..] {
        for (a, b) in runs[0].1.iter().zip(&run.1) {
            assert_eq!(a.0, b.0);
            assert!(a.1 == b.1, "{:?} differs", a.0);
        }
        assert_eq!(runs[0].0, run.0);
    }
}

//! Every model of the data folder is read or refused with one line, whole and cut anywhere.

use crate::{Ears, read_with};
use octofold::{Run, Soup};
use octofold_io::{Format, Kind, Source, read_mesh};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The folder with models, where it is there.
fn data() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("OCTOFOLD_DATA").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: there is no folder {}", folder.display());
    None
}

/// All files with a mesh ending, sorted.
fn models() -> Vec<PathBuf> {
    let mut open: Vec<_> = data().into_iter().collect();
    let mut found = BTreeSet::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let format = Format::of_name(&path.to_string_lossy());
            if path.is_dir() {
                open.push(path);
            } else if format.is_some_and(|f| f.kind() == Kind::Mesh) {
                found.insert(path);
            }
        }
    }
    found.into_iter().collect()
}

/// Number of different positions that faces name.
fn places(soup: &Soup) -> usize {
    let bits = |&p: &u32| soup.points()[p as usize].map(|x| (x + 0.0).to_bits());
    soup.corners().iter().map(bits).collect::<BTreeSet<_>>().len()
}

#[test]
fn every_model_is_read_or_refused_with_one_line() {
    for path in models() {
        let ears = Ears::default();
        let source = Source::open(&path).unwrap();
        let result = read_mesh(&source, None, &Run::with_watch(ears.clone()));
        let findings = ears.0.lock().unwrap().clone();
        match result {
            Ok(soup) => println!(
                "{}\t{} places\t{} triangles\t{} faces\t{} points\t{findings:?}",
                path.display(),
                places(&soup),
                soup.triangle_count(),
                soup.faces(),
                soup.points().len(),
            ),
            Err(error) => {
                let line = error.to_string();
                assert!(line.starts_with(&path.display().to_string()), "{line}");
                assert!(!line.contains('\n'), "{line}");
                println!("{line}");
            }
        }
    }
}

#[test]
fn no_model_panics_wherever_it_is_cut() {
    for path in models() {
        let bytes = std::fs::read(&path).unwrap();
        let format = Format::of_name(&path.to_string_lossy()).unwrap();
        let cuts = match std::env::var_os("OCTOFOLD_SWEEP") {
            Some(sweep) if sweep == "full" => 4000,
            _ => 200,
        };
        let step = if bytes.len() < 2000 { 1 } else { bytes.len().div_ceil(cuts) };
        for end in (0..bytes.len()).step_by(step) {
            if let Ok((soup, _)) = read_with(format, &bytes[..end], &[]) {
                soup.triangle_count();
            }
        }
    }
}

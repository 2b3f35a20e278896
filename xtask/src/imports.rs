//! Who may import whom inside the geometry crate: the way of the data, as a table.

use crate::tidy::{sources, without_tests};
use anyhow::{Context, Result};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What everything may import: context, columns and arithmetic.
const FREE: [&str; 14] = [
    "attributes",
    "exact",
    "image",
    "light",
    "par",
    "payload",
    "quadric",
    "radix",
    "random",
    "range",
    "run",
    "scan",
    "sets",
    "sweep",
];

/// What each module may import beside [`FREE`]; ARCHITECTURE.md explains the table.
const TABLE: [(&str, &[&str]); 26] = [
    ("bits", &["volume"]),
    ("craft", &["measure", "mesh", "pipeline", "repair", "simplify", "unfold", "voxelize"]),
    ("histogram", &["volume"]),
    ("lattice", &["volume"]),
    ("lib", ALL),
    ("lod", &["lattice", "measure", "mesh", "octree", "surface", "tint", "volume", "voxelize"]),
    ("measure", &["mesh"]),
    ("mesh", &["soup"]),
    ("network", &["measure", "mesh", "rows", "spans", "tint", "volume"]),
    ("octree", &["bits", "lattice", "mesh", "volume", "voxelize"]),
    ("picture", &["measure", "mesh", "volume"]),
    ("pipeline", ALL),
    ("polygon", &[]),
    ("repair", &["bits", "lattice", "measure", "mesh", "solid", "surface", "voxelize"]),
    (
        "report",
        &[
            "craft",
            "histogram",
            "lod",
            "measure",
            "mesh",
            "network",
            "pipeline",
            "repair",
            "simplify",
            "surface",
            "unfold",
            "volume",
        ],
    ),
    ("rows", &[]),
    ("samples", &["mesh", "soup", "spans", "surface", "volume"]),
    ("simplify", &["measure", "mesh", "octree"]),
    ("solid", &["measure", "mesh", "soup"]),
    ("soup", &["mesh", "polygon"]),
    ("spans", &["rows", "volume"]),
    ("surface", &["bits", "histogram", "measure", "mesh", "octree", "spans", "volume"]),
    ("tint", &["mesh"]),
    ("unfold", &["measure", "mesh"]),
    ("volume", &[]),
    ("voxelize", &["lattice", "measure", "mesh", "octree", "spans", "volume"]),
];

/// Stands for every module.
const ALL: &[&str] = &["*"];

/// Every import in `folder` that the table does not allow.
pub fn faults(folder: &Path) -> Result<Vec<String>> {
    let mut texts: BTreeMap<String, String> = BTreeMap::new();
    for file in sources(folder)? {
        let inside = file.strip_prefix(folder)?.with_extension("");
        let module = inside.components().next().context("a file has a name")?;
        let module = module.as_os_str().to_string_lossy().into_owned();
        if inside.file_stem().is_some_and(|stem| stem == "tests") {
            continue;
        }
        let text = std::fs::read_to_string(&file)?;
        texts.entry(module).or_default().push_str(without_tests(&text));
    }
    let homes = homes(texts.get("lib").map(String::as_str).unwrap_or_default());
    let modules: BTreeSet<&str> = texts.keys().map(String::as_str).collect();
    let mut faults = Vec::new();
    for (module, text) in &texts {
        let allowed = match TABLE.iter().find(|(name, _)| name == module) {
            Some((_, allowed)) => *allowed,
            None if FREE.contains(&module.as_str()) => &[],
            None => {
                faults.push(format!("module {module}: not in the import table"));
                continue;
            }
        };
        let names = names_after(text, "crate::");
        let imported = names.iter().filter_map(|name| {
            let home = homes.get(name).map(String::as_str).unwrap_or(name);
            modules.get(home).copied()
        });
        for other in imported.collect::<BTreeSet<_>>() {
            let fine = other == module || FREE.contains(&other) || allowed == ALL;
            if !fine && !allowed.contains(&other) {
                faults.push(format!("module {module} must not import {other}"));
            }
        }
    }
    Ok(faults)
}

/// Where the names that the crate's root hands on come from.
fn homes(lib: &str) -> BTreeMap<String, String> {
    let mut homes = BTreeMap::new();
    for line in lib.split("pub use ").skip(1) {
        let Some((module, names)) = line.split_once("::") else { continue };
        let names = names.split(';').next().unwrap_or_default();
        for name in names.trim_matches(['{', '}']).split(',') {
            homes.insert(name.trim().to_string(), module.to_string());
        }
    }
    homes
}

/// The first name of every path after `prefix`, groups in braces included.
fn names_after(text: &str, prefix: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let code: String = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect::<Vec<_>>()
        .join("\n");
    for rest in code.split(prefix).skip(1) {
        match rest.strip_prefix('{') {
            None => {
                names.insert(first_name(rest));
            }
            Some(group) => {
                let mut depth = 0;
                let mut start = 0;
                for (i, c) in group.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth > 0 => depth -= 1,
                        ',' | '}' if depth == 0 => {
                            names.insert(first_name(group[start..i].trim_start()));
                            start = i + 1;
                            if c == '}' {
                                break;
                            }
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    names
}

fn first_name(path: &str) -> String {
    path.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_any_form() {
        let text = "use crate::{a::B, c::{D, e},\n f};\ncrate::g::h();\n// crate::not\n";
        let names: Vec<_> = names_after(text, "crate::").into_iter().collect();
        assert_eq!(names, ["a", "c", "f", "g"]);
    }

    #[test]
    fn names_of_the_root_have_a_home() {
        let homes = homes("pub mod mesh;\npub use mesh::Mesh;\npub use run::{Cancel,\n Run};\n");
        assert_eq!(homes["Mesh"], "mesh");
        assert_eq!(homes["Run"], "run");
    }
}

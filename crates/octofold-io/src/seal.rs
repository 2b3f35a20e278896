//! Seals of pages: a first line tells that a file is ours, and by a checksum of the rest whether
//! anybody has changed it since. Pages that an earlier run left over are told apart by it from all
//! other files.

use octofold::{Finding, Run};
use std::path::{Path, PathBuf};

/// What a seal begins with, behind whatever makes it a comment.
const MARK: &str = "octofold sheet ";

/// What is known of a file by its seal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// We wrote it.
    Ours,
    /// We wrote it, and somebody has changed it.
    Changed,
    /// Somebody else wrote it.
    Foreign,
}

/// A text under a seal, which `before` and `after` make a comment of its format.
pub(crate) fn sealed(before: &str, after: &str, text: &str) -> String {
    format!("{before}{MARK}{:016x}{after}\n{text}", checksum(text.as_bytes()))
}

/// Who wrote these bytes.
pub(crate) fn origin(bytes: &[u8]) -> Origin {
    let head = &bytes[..bytes.len().min(64)];
    let Some(at) = head.windows(MARK.len()).position(|w| w == MARK.as_bytes()) else {
        return Origin::Foreign;
    };
    let sum = bytes.get(at + MARK.len()..at + MARK.len() + 16);
    let sum = sum.and_then(|hex| u64::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
    let rest = bytes[at..].iter().position(|&b| b == b'\n').map(|end| &bytes[at + end + 1..]);
    match (sum, rest) {
        (Some(sum), Some(rest)) if sum == checksum(rest) => Origin::Ours,
        _ => Origin::Changed,
    }
}

/// FNV-1a.
fn checksum(bytes: &[u8]) -> u64 {
    let step = |sum: u64, &byte: &u8| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, step)
}

/// Takes away the pages of an earlier run beside `path` that are not among `written`. A page that
/// was changed since stays, and is told of; files that we did not write stay in any case.
pub(crate) fn clear(path: &Path, written: &[PathBuf], run: &Run) {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut left: Vec<PathBuf> = entries
        .filter_map(|entry| Some(folder.join(entry.ok()?.file_name())))
        .filter(|other| is_page_of(path, other) && !written.iter().any(|w| same_name(w, other)))
        .filter(|other| std::fs::symlink_metadata(other).is_ok_and(|m| m.is_file()))
        .collect();
    left.sort();
    for page in left {
        let origin = std::fs::read(&page).map_or(Origin::Foreign, |bytes| origin(&bytes));
        let stays = match origin {
            Origin::Ours => std::fs::remove_file(&page).is_err(),
            Origin::Changed => true,
            Origin::Foreign => false,
        };
        if stays {
            let text =
                format!("{} is a page of an earlier run and no part of this one", page.display());
            run.finding(Finding::warning("old-page", text));
        }
    }
}

fn same_name(a: &Path, b: &Path) -> bool {
    a.file_name() == b.file_name()
}

/// True where a name is that of the only page of `path`, or of a numbered one.
fn is_page_of(path: &Path, other: &Path) -> bool {
    let stem = |p: &Path| p.file_stem().map(|s| s.to_string_lossy().into_owned());
    let (Some(own), Some(others)) = (stem(path), stem(other)) else { return false };
    let numbered = || {
        let number = others.strip_prefix(&own).and_then(|rest| rest.strip_prefix('-'));
        number.is_some_and(|n| n.parse::<u32>().is_ok_and(|k| k > 0 && k.to_string() == n))
    };
    path.extension() == other.extension() && (own == others || numbered())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seal_tells_who_wrote_a_file() {
        let page = sealed("<!-- ", " -->", "<svg>\n</svg>\n");
        assert_eq!(origin(page.as_bytes()), Origin::Ours);
        assert_eq!(origin(page.replace("</svg>", "<g/></svg>").as_bytes()), Origin::Changed);
        for foreign in ["", "<svg></svg>", "octofold"] {
            assert_eq!(origin(foreign.as_bytes()), Origin::Foreign);
        }
        assert_ne!(origin(b"# octofold sheet "), Origin::Ours);
    }

    #[test]
    fn pages_are_told_by_their_names() {
        let is = |other: &str| is_page_of(Path::new("a/house.svg"), Path::new(other));
        assert!(["house.svg", "a/house-1.svg", "house-12.svg"].into_iter().all(is));
        let others = [
            "house-0.svg",
            "house-01.svg",
            "house-a.svg",
            "house-1.obj",
            "house1.svg",
            "houses.svg",
        ];
        assert!(!others.into_iter().any(is));
    }
}

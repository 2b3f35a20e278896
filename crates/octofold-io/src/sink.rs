//! Whole files or none: writes go to temporaries that are renamed at the end.

use crate::WriteError;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Where a writer writes: one main file, and files beside it (`.mtl`, images).
pub struct Sink<'a> {
    /// The main file.
    pub out: &'a mut dyn Write,
    /// File name of the target without its ending, for the names of files beside it.
    pub stem: String,
    beside: Vec<(String, Vec<u8>)>,
}

impl<'a> Sink<'a> {
    /// A sink into any writer.
    pub fn new(out: &'a mut dyn Write, stem: impl Into<String>) -> Self {
        Self { out, stem: stem.into(), beside: Vec::new() }
    }

    /// Adds a file beside the main one.
    pub fn beside(&mut self, name: impl Into<String>, bytes: Vec<u8>) {
        self.beside.push((name.into(), bytes));
    }

    /// The files added beside the main one.
    pub fn into_beside(self) -> Vec<(String, Vec<u8>)> {
        self.beside
    }
}

/// Writes `path` (or standard output for `-`) through `write`, and renames all temporaries into
/// place only once everything is written.
pub fn save(
    path: &Path,
    write: impl FnOnce(&mut Sink<'_>) -> Result<(), WriteError>,
) -> Result<(), WriteError> {
    let io = |path: &Path| {
        let path = PathBuf::from(path);
        move |source| WriteError::Io { path, source }
    };
    if path.as_os_str() == "-" {
        let mut out = std::io::BufWriter::new(std::io::stdout().lock());
        write(&mut Sink::new(&mut out, "octofold"))?;
        return out.flush().map_err(io(path));
    }
    // A link stays a link: what it leads to is replaced.
    let linked = std::fs::canonicalize(path).ok();
    let path = linked.as_deref().unwrap_or(path);
    let old = std::fs::metadata(path).ok();
    if old.as_ref().is_some_and(|m| !m.is_file() && !m.is_dir()) {
        return through(path, write);
    }
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let temporary = || {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".octofold-");
        // Temporaries are private by default; a finished file is as readable as any other.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder);
        // The temporary's own name would only confuse.
        file.map_err(|e| std::io::Error::from(e.kind()))
    };
    let mut main = temporary().map_err(io(path))?;
    let beside = {
        let mut out = std::io::BufWriter::with_capacity(1 << 20, main.as_file_mut());
        let mut sink = Sink::new(&mut out, stem);
        write(&mut sink)?;
        let beside = sink.into_beside();
        out.flush().map_err(io(path))?;
        beside
    };
    let mut finished = Vec::new();
    for (name, bytes) in beside {
        let target = folder.join(name);
        let mut file = temporary().map_err(io(&target))?;
        file.write_all(&bytes).map_err(io(&target))?;
        finished.push((file, target));
    }
    finished.push((main, path.to_path_buf()));
    if let (Some(old), Some((file, _))) = (old, finished.last()) {
        file.as_file().set_permissions(old.permissions()).map_err(io(path))?;
    }
    for (file, target) in finished {
        file.persist(&target).map_err(|e| io(&target)(e.error))?;
    }
    Ok(())
}

/// Writes into a device or a pipe, which cannot be replaced by a whole file.
fn through(
    path: &Path,
    write: impl FnOnce(&mut Sink<'_>) -> Result<(), WriteError>,
) -> Result<(), WriteError> {
    let io = |source| WriteError::Io { path: path.into(), source };
    let file = std::fs::OpenOptions::new().write(true).open(path).map_err(io)?;
    let mut out = std::io::BufWriter::new(file);
    let mut sink = Sink::new(&mut out, "octofold");
    write(&mut sink)?;
    out.flush().map_err(io)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn put(path: &Path, text: &str) -> Result<(), WriteError> {
        save(path, |sink| {
            let io = |source| WriteError::Io { path: path.into(), source };
            sink.out.write_all(text.as_bytes()).map_err(io)
        })
    }

    #[test]
    fn links_lead_to_what_is_replaced_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file.obj", "link.obj"].map(|name| folder.path().join(name));
        put(&file, "one").unwrap();
        std::fs::set_permissions(&file, PermissionsExt::from_mode(0o600)).unwrap();
        std::os::unix::fs::symlink("file.obj", &link).unwrap();
        put(&link, "two").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "two");
        assert_eq!(std::fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file.obj");
        put(&file, "old").unwrap();
        let failed = save(&file, |sink| {
            let _ = sink.out.write_all(b"half");
            Err(WriteError::Unfit { format: "obj", fact: "test".into() })
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn devices_are_written_through() {
        // This device refuses every write; a file beside it would not.
        let full = Path::new("/dev/full");
        if !full.exists() {
            return println!("skipped: this system has no /dev/full");
        }
        let name = |source| WriteError::Io { path: full.into(), source };
        let through = through(full, |sink| sink.out.write_all(b"text").map_err(name));
        assert!(through.is_err());
    }
}

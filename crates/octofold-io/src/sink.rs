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
        builder.tempfile_in(folder)
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
    for (file, target) in finished {
        file.persist(&target).map_err(|e| io(&target)(e.error))?;
    }
    Ok(())
}

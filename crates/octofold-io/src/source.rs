//! Bytes of a file, and the files beside it.

use crate::ReadError;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes that are cheap to clone: owned, or mapped from a file.
#[derive(Clone)]
pub struct Bytes(Arc<Held>);

enum Held {
    Owned(Vec<u8>),
    Mapped(memmap2::Mmap),
}

impl std::ops::Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match &*self.0 {
            Held::Owned(bytes) => bytes,
            Held::Mapped(map) => map,
        }
    }
}

impl From<Vec<u8>> for Bytes {
    fn from(bytes: Vec<u8>) -> Self {
        Self(Arc::new(Held::Owned(bytes)))
    }
}

impl Bytes {
    /// Maps a file, or reads it where it cannot be mapped (pipes, empty files).
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let io = |source| ReadError::Io { path: path.into(), source };
        let mut file = std::fs::File::open(path).map_err(io)?;
        let meta = file.metadata().map_err(io)?;
        if meta.is_dir() {
            return Err(io(std::io::ErrorKind::IsADirectory.into()));
        }
        if meta.is_file() && meta.len() > 0 {
            // SAFETY: the map is read-only. Another process that truncates the file while it is
            // read can fault this one, as with every reader that maps files.
            #[allow(unsafe_code)]
            if let Ok(map) = unsafe { memmap2::Mmap::map(&file) } {
                return Ok(Self(Arc::new(Held::Mapped(map))));
            }
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io)?;
        Ok(bytes.into())
    }

    /// Lets the pages of a mapped file go: they no longer count as this process's memory, and come
    /// back from the file when they are read again.
    pub fn release(&self) {
        #[cfg(unix)]
        if let Held::Mapped(map) = &*self.0 {
            // SAFETY: the map is shared and read-only, so that every page is the file's own and
            // reads the same when it comes back.
            #[allow(unsafe_code)]
            // Advice that is not taken costs memory only.
            let _ = unsafe { map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) };
        }
    }
}

/// Finds the files that a file names: materials, buffers, images, detached data.
pub trait Files {
    /// Bytes of a neighbour named by a relative path. Absolute paths and paths that climb out of
    /// the folder are refused.
    fn open(&self, name: &str) -> Result<Bytes, ReadError>;
}

/// No neighbours: for bytes from a pipe, and for tests.
pub struct NoFiles;

impl Files for NoFiles {
    fn open(&self, name: &str) -> Result<Bytes, ReadError> {
        let source = std::io::Error::new(std::io::ErrorKind::NotFound, "no folder to look in");
        Err(ReadError::Io { path: name.into(), source })
    }
}

/// The folder that a file lies in.
struct Folder(PathBuf);

impl Files for Folder {
    fn open(&self, name: &str) -> Result<Bytes, ReadError> {
        let relative = Path::new(name);
        let inside = relative
            .components()
            .all(|c| matches!(c, std::path::Component::Normal(_) | std::path::Component::CurDir));
        if !inside {
            let source = std::io::Error::new(
                std::io::ErrorKind::PermissionDenied,
                "only files in or below the folder of the file that names them are opened",
            );
            return Err(ReadError::Io { path: name.into(), source });
        }
        let path = self.0.join(relative);
        if std::fs::metadata(&path).is_ok_and(|m| !m.is_file()) {
            let source = std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a file");
            return Err(ReadError::Io { path, source });
        }
        Bytes::open(&path)
    }
}

/// What a reader reads: a name for messages and file-type hints, bytes and neighbours.
pub struct Source {
    /// Path or name, `-` for a pipe.
    pub path: PathBuf,
    /// All bytes.
    pub bytes: Bytes,
    /// The files beside it.
    pub files: Box<dyn Files>,
}

impl Source {
    /// Opens a file; `-` reads standard input.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        if path.as_os_str() == "-" {
            let mut bytes = Vec::new();
            std::io::stdin()
                .read_to_end(&mut bytes)
                .map_err(|source| ReadError::Io { path: path.into(), source })?;
            return Ok(Self { path: path.into(), bytes: bytes.into(), files: Box::new(NoFiles) });
        }
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok(Self { path: path.into(), bytes: Bytes::open(path)?, files: Box::new(Folder(folder)) })
    }

    /// Bytes without a file, for tests and pipes.
    pub fn from_bytes(name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        Self { path: name.into(), bytes: bytes.into().into(), files: Box::new(NoFiles) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn pages_come_back() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let expected: Vec<u8> = (0..100_000u32).map(|i| (i * 7 % 251) as u8).collect();
        file.write_all(&expected).unwrap();
        let bytes = Bytes::open(file.path()).unwrap();
        for _ in 0..2 {
            assert!(*bytes == *expected);
            bytes.release();
        }
        let owned = Bytes::from(expected.clone());
        owned.release();
        assert!(*owned == *expected);
    }
}

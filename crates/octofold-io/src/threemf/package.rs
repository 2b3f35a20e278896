//! The package around 3MF models: a ZIP archive with relationships, after the Open Packaging
//! Conventions.

use super::FORMAT;
use super::model::Model;
use crate::{At, ReadError};
use octofold::Run;
use quick_xml::events::Event;
use std::collections::BTreeMap;
use std::io::{BufReader, Cursor, Read};
use zip::ZipArchive;

/// A package that is open, and how many bytes may still be unpacked from it.
pub(super) struct Package<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    /// The archive's own names of parts, by key.
    names: BTreeMap<String, String>,
    left: u64,
    limit: u64,
}

impl<'a> Package<'a> {
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, ReadError> {
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            ReadError::malformed(FORMAT, At::File, format!("it is no sound ZIP archive: {error}"))
        })?;
        // Honest models shrink to a tenth at best; bombs to a thousandth and less.
        let limit = (64 << 20) + 200 * bytes.len() as u64;
        let names = archive.file_names().flatten().map(|name| (key(&name), name.into_owned()));
        let names = names.collect();
        Ok(Self { archive, names, left: limit, limit })
    }

    /// Name of the part that holds the build.
    pub(super) fn root(&mut self) -> Result<String, ReadError> {
        if let Some(name) = self.find("_rels/.rels")
            && let Some(target) = self.target(&name)?
        {
            return Ok(target);
        }
        let model = self.names.iter().find(|(key, _)| key.ends_with(".model"));
        model.map(|(_, name)| name.clone()).ok_or_else(|| {
            ReadError::malformed(FORMAT, At::File, "the package holds no model; is it a 3MF file?")
        })
    }

    /// Parses a model part.
    pub(super) fn model(&mut self, part: &str, run: &Run) -> Result<Model, ReadError> {
        let Some(name) = self.find(part) else {
            let fact = format!("the part {part} is named, but it is not in the package");
            return Err(ReadError::malformed(FORMAT, At::File, fact));
        };
        let (limit, left) = (self.limit, &mut self.left);
        let file = self.archive.by_name(&name).map_err(|e| damaged(&name, &e.to_string()))?;
        let bounded = Bounded { input: file, left, limit };
        Model::read(BufReader::with_capacity(1 << 16, bounded), &name, run)
    }

    /// Where the relationships of the package say that the model is.
    fn target(&mut self, name: &str) -> Result<Option<String>, ReadError> {
        let (limit, left) = (self.limit, &mut self.left);
        let file = self.archive.by_name(name).map_err(|e| damaged(name, &e.to_string()))?;
        let bounded = Bounded { input: file, left, limit };
        let mut reader = quick_xml::Reader::from_reader(BufReader::new(bounded));
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            let event = reader.read_event_into(&mut buffer);
            match event.map_err(|e| damaged(name, &e.to_string()))? {
                Event::Start(element) | Event::Empty(element) => {
                    let value = |key: &str| {
                        let found = element.try_get_attribute(key).ok().flatten();
                        found.map(|a| a.value.into_owned())
                    };
                    if value("Type").is_some_and(|kind| kind.ends_with("/3dmodel")) {
                        return Ok(value("Target"));
                    }
                }
                Event::Eof => return Ok(None),
                _ => {}
            }
        }
    }

    fn find(&self, part: &str) -> Option<String> {
        self.names.get(&key(part)).cloned()
    }
}

/// What names of one part have in common: they may begin with a slash, and know no case.
pub(super) fn key(part: &str) -> String {
    part.trim_start_matches('/').to_ascii_lowercase()
}

fn damaged(part: &str, error: &str) -> ReadError {
    ReadError::malformed(FORMAT, At::File, format!("the part {part} cannot be read: {error}"))
}

/// Unpacks until the package has used up what it may.
struct Bounded<'a, R> {
    input: R,
    left: &'a mut u64,
    limit: u64,
}

impl<R: Read> Read for Bounded<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.input.read(buffer)?;
        match self.left.checked_sub(count as u64) {
            Some(left) => *self.left = left,
            None => {
                return Err(std::io::Error::other(format!(
                    "the package unpacks to more than {} bytes, which no honest one of its size does",
                    self.limit
                )));
            }
        }
        Ok(count)
    }
}

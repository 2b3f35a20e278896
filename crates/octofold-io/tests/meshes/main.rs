//! Readers and writers of meshes: every feature by a tiny file, hostile bytes, round trips, and
//! the models of the data folder.

// A failed `unwrap` is a failed test.
#![allow(clippy::unwrap_used)]

mod damage;
mod gltf;
mod obj;
mod off;
mod on_disk;
mod ply;
mod round_trip;
mod stl;
mod threemf;

use octofold::{Finding, Run, Soup, Watch};
use octofold_io::{Bytes, Files, Format, NoFiles, ReadError, Sink, Source, WriteError};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Keeps the codes of all findings.
#[derive(Clone, Default)]
struct Ears(Arc<Mutex<Vec<&'static str>>>);

impl Watch for Ears {
    fn finding(&self, finding: Finding) {
        self.0.lock().unwrap().push(finding.code);
    }
}

/// Files beside a source.
struct Shelf(BTreeMap<String, Vec<u8>>);

impl Files for Shelf {
    fn open(&self, name: &str) -> Result<Bytes, ReadError> {
        match self.0.get(name) {
            Some(bytes) => Ok(bytes.clone().into()),
            None => NoFiles.open(name),
        }
    }
}

/// A reader or writer under test.
fn reader(format: Format) -> fn(&Source, &Run) -> Result<Soup, ReadError> {
    match format {
        Format::Obj => octofold_io::obj::read,
        Format::Ply => octofold_io::ply::read,
        Format::Stl => octofold_io::stl::read,
        Format::Off => octofold_io::off::read,
        Format::Gltf | Format::Glb => octofold_io::gltf::read,
        Format::ThreeMf => octofold_io::threemf::read,
        _ => unreachable!("not a mesh format"),
    }
}

type Writer = fn(&Soup, &mut Sink<'_>, &Run) -> Result<(), WriteError>;

fn writer(format: Format) -> Writer {
    match format {
        Format::Obj => octofold_io::obj::write,
        Format::Ply => octofold_io::ply::write,
        Format::Stl => octofold_io::stl::write,
        Format::Off => octofold_io::off::write,
        Format::Gltf => octofold_io::gltf::write_gltf,
        Format::Glb => octofold_io::gltf::write_glb,
        Format::ThreeMf => octofold_io::threemf::write,
        _ => unreachable!("not a mesh format"),
    }
}

/// Every mesh format.
const MESHES: [Format; 7] = [
    Format::Obj,
    Format::Ply,
    Format::Stl,
    Format::Off,
    Format::Gltf,
    Format::Glb,
    Format::ThreeMf,
];

/// What a file reads as, and the codes of what was found odd.
fn read_with(
    format: Format,
    bytes: impl Into<Vec<u8>>,
    beside: &[(&str, &[u8])],
) -> Result<(Soup, Vec<&'static str>), ReadError> {
    let ears = Ears::default();
    let mut source = Source::from_bytes("test", bytes);
    let shelf = beside.iter().map(|(name, bytes)| (name.to_string(), bytes.to_vec()));
    source.files = Box::new(Shelf(shelf.collect()));
    let soup = reader(format)(&source, &Run::with_watch(ears.clone()))?;
    let codes = ears.0.lock().unwrap().clone();
    Ok((soup, codes))
}

fn read(format: Format, bytes: impl Into<Vec<u8>>) -> Soup {
    read_with(format, bytes, &[]).unwrap().0
}

/// The one line that a file is refused with.
fn refused(format: Format, bytes: impl Into<Vec<u8>>) -> String {
    let error = read_with(format, bytes, &[]).unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

/// Files beside the main one.
type Beside = Vec<(String, Vec<u8>)>;

/// The bytes that a shape is written as, the files beside, and the codes of what was found odd.
fn write(format: Format, soup: &Soup) -> (Vec<u8>, Beside, Vec<&'static str>) {
    let ears = Ears::default();
    let mut bytes = Vec::new();
    let mut sink = Sink::new(&mut bytes, "shape");
    writer(format)(soup, &mut sink, &Run::with_watch(ears.clone())).unwrap();
    let beside = sink.into_beside();
    let codes = ears.0.lock().unwrap().clone();
    (bytes, beside, codes)
}

/// What comes back of a shape that is written and read.
fn there_and_back(format: Format, soup: &Soup) -> Soup {
    let (bytes, beside, _) = write(format, soup);
    let beside: Vec<_> = beside.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
    read_with(format, bytes, &beside).unwrap().0
}

/// Positions of the corners of each face.
fn faces(soup: &Soup) -> Vec<Vec<[f64; 3]>> {
    let at = |&p: &u32| soup.points()[p as usize];
    (0..soup.faces()).map(|f| soup.face(f).iter().map(at).collect()).collect()
}

/// Corner numbers of each face.
fn corners(soup: &Soup) -> Vec<Vec<u32>> {
    (0..soup.faces()).map(|f| soup.face(f).to_vec()).collect()
}

/// A PNG of one pixel.
fn pixel() -> Vec<u8> {
    octofold_io::png::encode(1, 1, &[1, 2, 3, 255]).unwrap()
}

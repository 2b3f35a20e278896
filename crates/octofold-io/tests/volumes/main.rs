//! Volumes through the front door: round trips, features of each format, damage, real files.

// The lint knows test functions, but not what they share.
#![allow(clippy::unwrap_used)]

mod damage;
mod nifti;
mod nrrd;
mod real;
mod round_trip;
mod vox;

use octofold::volume::{Block, Region, Scalar};
use octofold::{Finding, Run, Volume, Watch};
use octofold_io::{Bytes, Files, Format, RawLayout, ReadError, Source, read_volume, write_volume};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Keeps the codes of findings.
#[derive(Clone, Default)]
struct Codes(Arc<Mutex<Vec<&'static str>>>);

impl Watch for Codes {
    fn finding(&self, finding: Finding) {
        self.0.lock().unwrap().push(finding.code);
    }
}

/// A folder in memory.
struct Folder(BTreeMap<String, Vec<u8>>);

impl Files for Folder {
    fn open(&self, name: &str) -> Result<Bytes, ReadError> {
        self.0.get(name).cloned().map(Bytes::from).ok_or_else(|| ReadError::Io {
            path: name.into(),
            source: std::io::ErrorKind::NotFound.into(),
        })
    }
}

/// A file among the others of a folder.
fn beside(name: &str, files: &[(&str, &[u8])]) -> Source {
    let folder: BTreeMap<_, _> =
        files.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.to_vec())).collect();
    let bytes = folder[name].clone().into();
    Source { path: name.into(), bytes, files: Box::new(Folder(folder)) }
}

fn read(name: &str, bytes: impl Into<Vec<u8>>) -> Result<Box<dyn Volume>, ReadError> {
    read_volume(&Source::from_bytes(name, bytes), None, None, &Run::default())
}

/// The volume, and the codes of what was found on the way.
fn read_with_findings(source: &Source) -> (Box<dyn Volume>, Vec<&'static str>) {
    let codes = Codes::default();
    let volume = read_volume(source, None, None, &Run::with_watch(codes.clone())).unwrap();
    let codes = codes.0.lock().unwrap().clone();
    (volume, codes)
}

fn samples(volume: &dyn Volume) -> Block<'static> {
    let block = volume.read(Region::all(volume.dims())).unwrap();
    octofold::with_samples!(block, s => Scalar::block(s.into_owned().into()))
}

/// The bytes of a file that the front door wrote.
fn written(volume: &dyn Volume, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write_volume(volume, &path, None, &Run::default()).unwrap();
    std::fs::read(path).unwrap()
}

/// Says how a volume could not be read.
fn refusal(source: &Source) -> String {
    read_volume(source, None, None, &Run::default()).err().unwrap().to_string()
}

#[test]
fn the_front_door_names_the_file_and_what_to_do() {
    let raw = Source::from_bytes("x.raw", [0; 8]);
    assert!(refusal(&raw).contains("x.raw: raw: a raw file does not say"));
    let mesh = Source::from_bytes("x.obj", "v 0 0 0");
    assert!(refusal(&mesh).contains("x.obj: obj: it holds a mesh"));
    assert!(refusal(&Source::from_bytes("x.what", [0; 8])).contains("--from FORMAT"));
    let volume = octofold::volume::DenseVolume::new([1; 3], vec![0u8], Default::default());
    let write = |name: &str| {
        let error = write_volume(&volume.clone().unwrap(), name.as_ref(), None, &Run::default());
        error.unwrap_err().to_string()
    };
    assert!(write("x.stl").contains("it holds meshes"));
    assert!(write("x.hdr").contains("write .nii"));
    assert!(write("x.binvox").contains("voxelize first"));
    assert!(write("x.what").contains("no known format"));
    assert_eq!(Format::of_name("a.IMG.GZ"), Some(Format::Nifti));
}

#[test]
fn what_is_left_over_is_told() {
    let raw = Source::from_bytes("x.raw", [1, 2, 3, 4, 5]);
    let scalar = octofold::volume::ScalarType::U8;
    let layout = RawLayout { dims: [2, 2, 1], scalar, offset: 0, big_endian: false };
    let codes = Codes::default();
    read_volume(&raw, None, Some(layout), &Run::with_watch(codes.clone())).unwrap();
    assert_eq!(*codes.0.lock().unwrap(), ["trailing-data"]);

    let header = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 1, 1, 2), }";
    let head = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..]].concat();
    let npy = [&head[..], header.as_bytes(), &[1, 2, 3, 4]].concat();
    let (volume, codes) = read_with_findings(&Source::from_bytes("x.npy", npy));
    assert_eq!(samples(&*volume), Block::U8(vec![1, 2].into()));
    assert_eq!(codes, ["first-of-4d"]);

    let nrrd = "NRRD0004\ntype: int8\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\nab";
    let (_, codes) = read_with_findings(&Source::from_bytes("x.nrrd", nrrd));
    assert_eq!(codes, ["trailing-data"]);
}

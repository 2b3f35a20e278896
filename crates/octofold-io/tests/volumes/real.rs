//! Real files of other programs, where the data folder is at hand.

use octofold::volume::Region;
use octofold::{Run, Volume};
use octofold_io::{Source, read_volume};
use std::path::PathBuf;

/// The data folder, or `None` with the reason printed.
fn data() -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("OCTOFOLD_DATA").map_or_else(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no data folder at {}", folder.display());
    None
}

const FILES: [(&str, [usize; 3], &str); 9] = [
    ("volumes/CTChest4.nrrd", [128, 128, 34], "i32"),
    ("volumes/D99_atlas_v2.0_right.nii.gz", [275, 347, 245], "f32"),
    ("volumes/Segmentation.seg.nrrd", [128, 128, 34], "u8"),
    ("volumes/SegmentationOverlapping.seg.nrrd", [128, 128, 34], "u8"),
    ("volumes/aal.nii.gz", [181, 217, 181], "u8"),
    ("volumes/brodmann.nii.gz", [181, 217, 181], "u8"),
    ("volumes/ch2.nii.gz", [181, 217, 181], "u8"),
    ("volumes/ch2bet.nii.gz", [181, 217, 181], "u8"),
    ("volumes/mr-bet.nii.gz", [142, 178, 142], "u8"),
];

fn open(path: &str) -> Option<Box<dyn Volume>> {
    let source = Source::open(&data()?.join(path)).unwrap();
    Some(read_volume(&source, None, None, &Run::default()).unwrap())
}

#[test]
fn real_volumes_have_the_right_shape() {
    for (path, dims, scalar) in FILES {
        let Some(volume) = open(path) else { return };
        let block = volume.read(Region::all(volume.dims())).unwrap();
        let sum: f64 = (0..block.len()).map(|i| block.value(i)).sum();
        println!("{path}: {:?} {sum} {:?}", volume.dims(), volume.placement());
        assert_eq!((volume.dims(), volume.scalar_type().name()), (dims, scalar), "{path}");
    }
}

#[test]
fn real_segments_have_names_and_colours() {
    let Some(volume) = open("volumes/Segmentation.seg.nrrd") else { return };
    assert_eq!(volume.labels().len(), 7);
    assert_eq!(volume.labels()[5].name, "left lung");
    assert_eq!(volume.labels()[5].colour, [197, 25, 99, 255]);
    // The overlapping sphere lies in the second layer, which is not read.
    let Some(volume) = open("volumes/SegmentationOverlapping.seg.nrrd") else { return };
    assert_eq!(volume.labels().len(), 7);
}

#[test]
fn a_real_binvox_is_read() {
    let Some(volume) = open("formats/chair_model.binvox") else { return };
    assert!(volume.is_binary());
    assert_eq!(volume.dims(), [32, 32, 32]);
    let block = volume.read(Region::all([32; 3])).unwrap();
    let full = (0..block.len()).filter(|&i| block.value(i) == 1.0).count();
    println!("chair_model.binvox: {full} full voxels, {:?}", volume.placement());
}

#[test]
fn prefixes_of_real_files_do_not_panic() {
    let Some(folder) = data() else { return };
    for path in FILES.map(|(path, ..)| path).into_iter().chain(["formats/chair_model.binvox"]) {
        let bytes = std::fs::read(folder.join(path)).unwrap();
        for i in 0..24 {
            let end = if i < 12 { i * 100 } else { bytes.len() * (i - 12) / 12 };
            let source = Source::from_bytes(path, &bytes[..end.min(bytes.len() - 1)]);
            let read = read_volume(&source, None, None, &Run::default());
            assert!(read.is_err(), "{path} cut off at {end}");
        }
    }
}

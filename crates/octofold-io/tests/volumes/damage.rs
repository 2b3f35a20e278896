//! Damaged files: every prefix, flipped bytes, and the fuzz corpus. Nothing may panic.

use super::nifti::Header;
use super::{vox, written};
use octofold::volume::{DenseVolume, Label, Region};
use octofold::{Placement, Run};
use octofold_io::{Source, read_volume};

/// One small valid file of every format and encoding.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let placement = Placement::spacing([0.5; 3]);
    let mut binary = DenseVolume::new([5, 4, 3], vec![1u8; 60], placement).unwrap();
    binary.binary = true;
    let mut labelled = binary.clone();
    labelled.binary = false;
    labelled.labels = vec![Label { value: 1, name: "one".into(), colour: [1, 2, 3, 255] }];
    let ramp: Vec<f32> = (0..60u8).map(f32::from).collect();
    let real = DenseVolume::new([5, 4, 3], ramp, placement).unwrap();
    let mut pair = Header::new(true, &[2, 2, 2, 2], 4);
    pair.i16(252, 1);
    let text = "NRRD0005\ntype: int64\ndimension: 3\nsizes: 2 2 1\nspacings: 1 2 3\n\
                encoding: ascii\n\n1 -2 3 400000000000";
    let hex = "NRRD0005\ntype: uint16\nendian: big\ndimension: 3\nsizes: 2 1 1\nspace: LPS\n\
               space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,2,3)\nline skip: 1\n\
               encoding: hex\n\nskipped\n00 01 02 03";
    vec![
        ("v.nii", written(&real, "v.nii")),
        ("v.nii.gz", written(&real, "v.nii.gz")),
        ("four.nii", pair.with(&[3; 16])),
        ("v.nrrd", written(&real, "v.nrrd")),
        ("binary.nrrd", written(&binary, "v.nrrd")),
        ("labels.nrrd", written(&labelled, "v.nrrd")),
        ("text.nrrd", text.into()),
        ("hex.nrrd", hex.into()),
        ("v.npy", written(&real, "v.npy")),
        ("v.binvox", written(&binary, "v.binvox")),
        ("v.vox", written(&labelled, "v.vox")),
        ("scene.vox", vox::scene()),
        ("v.ofn", written(&binary, "v.ofn")),
    ]
}

/// Reads, and where that works looks at every sample.
fn exercise(name: &str, bytes: &[u8]) -> bool {
    let source = Source::from_bytes(name, bytes);
    let Ok(volume) = read_volume(&source, None, None, &Run::default()) else { return false };
    let dims = volume.dims();
    assert!(!dims.contains(&0));
    for z in [0, dims[2] - 1] {
        let slice = Region { start: [0, 0, z], end: [dims[0].min(9), dims[1].min(9), z + 1] };
        assert_eq!(volume.read(slice).unwrap().len(), slice.len());
    }
    true
}

#[test]
fn every_prefix_is_an_error_or_a_sound_volume() {
    for (name, bytes) in files() {
        assert!(exercise(name, &bytes), "{name} itself");
        for end in 0..bytes.len() {
            exercise(name, &bytes[..end]);
        }
    }
}

#[test]
fn flipped_bytes_are_an_error_or_a_sound_volume() {
    let mut state = 0x2545_f491_4f6c_dd1du64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as usize
    };
    for (name, bytes) in files() {
        for _ in 0..3000 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random() % 4 {
                let at = random() % damaged.len().min(700);
                damaged[at] = if random() % 2 == 0 {
                    random() as u8
                } else {
                    damaged[at] ^ (1 << (random() % 8))
                };
            }
            exercise(name, &damaged);
        }
    }
}

#[test]
fn the_fuzz_corpus_is_read_without_panic() {
    let corpus = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut count = 0;
    for target in ["nifti", "nrrd", "npy", "binvox", "vox", "ofn"] {
        let ending = if target == "nifti" { "nii" } else { target };
        for file in std::fs::read_dir(corpus.join(target)).unwrap() {
            let bytes = std::fs::read(file.unwrap().path()).unwrap();
            exercise(&format!("x.{ending}"), &bytes);
            count += 1;
        }
    }
    assert!(count >= 5, "{count} files");
}

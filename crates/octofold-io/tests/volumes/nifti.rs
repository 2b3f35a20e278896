//! Features of NIfTI, on headers made by hand.

use super::{beside, read, read_with_findings, refusal, samples};
use flate2::{Compression, write::GzEncoder};
use octofold::LengthUnit;
use octofold::volume::Block;
use octofold_io::Source;
use std::io::Write;

/// A NIfTI-1 header of either byte order, written field by field.
pub(crate) struct Header {
    pub(crate) bytes: Vec<u8>,
    big_endian: bool,
}

impl Header {
    pub(crate) fn new(big_endian: bool, dims: &[i16], code: i16) -> Self {
        let mut header = Self { bytes: vec![0; 352], big_endian };
        header.i32(0, 348);
        header.i16(40, dims.len() as i16);
        for (i, &dim) in dims.iter().enumerate() {
            header.i16(42 + 2 * i, dim);
            header.f32(80 + 4 * i, 1.0);
        }
        header.i16(70, code);
        header.f32(108, 352.0);
        header.bytes[344..348].copy_from_slice(b"n+1\0");
        header
    }

    fn put<const N: usize>(&mut self, at: usize, mut little: [u8; N]) {
        if self.big_endian {
            little.reverse();
        }
        self.bytes[at..at + N].copy_from_slice(&little);
    }

    pub(crate) fn i16(&mut self, at: usize, value: i16) {
        self.put(at, value.to_le_bytes());
    }

    pub(crate) fn i32(&mut self, at: usize, value: i32) {
        self.put(at, value.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, at: usize, value: f32) {
        self.put(at, value.to_le_bytes());
    }

    /// The header and samples of type i16.
    pub(crate) fn with(&self, samples: &[i16]) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        for sample in samples {
            bytes.extend(if self.big_endian { sample.to_be_bytes() } else { sample.to_le_bytes() });
        }
        bytes
    }
}

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn both_byte_orders_scale_and_place() {
    for big_endian in [false, true] {
        let mut header = Header::new(big_endian, &[2, 1, 2], 4);
        header.f32(112, 0.5);
        header.f32(116, -3.0);
        header.i16(254, 2);
        for (i, v) in
            [2.0, 0.0, 0.0, -10.0, 0.0, 3.0, 0.0, 5.0, 0.0, 0.5, 4.0, 7.0].into_iter().enumerate()
        {
            header.f32(280 + 4 * i, v);
        }
        header.bytes[123] = 3;
        let volume = read("x.nii", header.with(&[-4, 0, 6, 32767])).unwrap();
        assert_eq!(samples(&*volume), Block::F32(vec![-5.0, -3.0, 0.0, 16380.5].into()));
        assert_eq!(volume.placement().place([1.0, 1.0, 1.0]), [-8.0, 8.0, 11.5]);
        assert_eq!(volume.placement().unit, Some(LengthUnit::Micrometre));
        let packed = gzip(&header.with(&[-4, 0, 6, 32767]));
        let volume = read("oddly.named", packed).unwrap();
        assert_eq!(volume.placement().place([1.0, 1.0, 1.0]), [-8.0, 8.0, 11.5]);
    }
}

#[test]
fn a_slope_of_nothing_keeps_the_integers() {
    for (slope, intercept) in [(0.0, 5.0), (1.0, 0.0), (f32::NAN, 0.0)] {
        let mut header = Header::new(false, &[1, 1, 1], 4);
        header.f32(112, slope);
        header.f32(116, intercept);
        let volume = read("x.nii", header.with(&[7])).unwrap();
        assert_eq!(samples(&*volume), Block::I16(vec![7].into()));
    }
}

#[test]
fn the_qform_turns_and_flips() {
    let mut header = Header::new(false, &[1, 1, 1], 4);
    header.i16(252, 1);
    // A quarter turn about z, sizes 2, 3, 4, z flipped.
    header.f32(264, std::f32::consts::FRAC_1_SQRT_2);
    for (i, v) in [-1.0, 2.0, 3.0, 4.0].into_iter().enumerate() {
        header.f32(76 + 4 * i, v);
    }
    for (i, v) in [10.0, 20.0, 30.0].into_iter().enumerate() {
        header.f32(268 + 4 * i, v);
    }
    let placement = read("x.nii", header.with(&[0])).unwrap().placement();
    let corner = placement.place([1.0, 1.0, 1.0]);
    for (found, expected) in corner.into_iter().zip([7.0, 22.0, 26.0]) {
        assert!((found - expected).abs() < 1e-5, "{corner:?}");
    }
    assert!(placement.determinant() < 0.0);
}

#[test]
fn without_forms_the_voxel_sizes_count() {
    let mut header = Header::new(false, &[1, 1], 4);
    header.f32(80, -2.0);
    header.f32(84, 0.0);
    let volume = read("x.nii", header.with(&[0])).unwrap();
    assert_eq!(volume.dims(), [1, 1, 1]);
    assert_eq!(volume.placement().place([1.0; 3]), [2.0, 1.0, 1.0]);
}

#[test]
fn of_four_dimensions_the_first_volume_is_read() {
    let header = Header::new(false, &[1, 2, 1, 3], 4);
    let source = Source::from_bytes("x.nii", header.with(&[1, 2, 3, 4, 5, 6]));
    let (volume, codes) = read_with_findings(&source);
    assert_eq!(samples(&*volume), Block::I16(vec![1, 2].into()));
    assert_eq!(codes, ["first-of-4d"]);
}

#[test]
fn either_file_of_a_pair_leads_to_the_other() {
    let mut header = Header::new(true, &[2, 1, 1], 4);
    header.bytes[345] = b'i';
    header.f32(108, 0.0);
    let image = [0u8, 5, 0, 6];
    let head = &header.bytes[..348];
    let packed = gzip(&image);
    for files in [
        [("a.hdr", head), ("a.img", &image[..])],
        [("A.HDR", head), ("A.IMG", &image[..])],
        [("a.hdr", head), ("a.img.gz", &packed[..])],
        [("a.hdr.gz", &gzip(head)[..]), ("a.img.gz", &packed[..])],
    ] {
        for (name, _) in files {
            let (volume, _) = read_with_findings(&beside(name, &files));
            assert_eq!(samples(&*volume), Block::I16(vec![5, 6].into()), "{name}");
        }
    }
    assert!(refusal(&beside("a.hdr", &[("a.hdr", head)])).contains("no a.img beside"));
    assert!(refusal(&beside("a.img", &[("a.img", &image)])).contains("no a.hdr beside"));
}

#[test]
fn other_samples_are_converted_or_refused() {
    let labelled = Header::new(false, &[2, 1, 1], 1024);
    let mut bytes = labelled.bytes;
    bytes.extend([3i64, -1].map(i64::to_le_bytes).concat());
    assert_eq!(samples(&*read("x.nii", bytes).unwrap()), Block::I32(vec![3, -1].into()));
    let mut colours = Header::new(false, &[2, 1, 1], 128).bytes;
    colours.extend([255, 255, 255, 255, 0, 0]);
    let (volume, codes) = read_with_findings(&Source::from_bytes("x.nii", colours));
    assert_eq!(samples(&*volume), Block::U8(vec![255, 54].into()));
    assert_eq!(codes, ["colour-to-luminance"]);
    for (code, says) in [(32, "complex"), (1, "single bits"), (1536, "128-bit"), (99, "code 99")] {
        let source = Source::from_bytes("x.nii", Header::new(false, &[1, 1, 1], code).bytes);
        assert!(refusal(&source).contains(says), "{code}");
    }
}

#[test]
fn damaged_headers_are_refused_in_words() {
    type Damage = fn(&mut Header);
    let damages: [(Damage, &str); 6] = [
        (|h| h.i16(40, 9), "9 dimensions"),
        (|h| h.i16(42, -1), "dimension 1 is -1"),
        (|h| h.i16(44, 0), "dimension 2 is 0"),
        (|h| h.f32(108, f32::NAN), "begin at byte NaN"),
        (|h| h.f32(108, 100.0), "begin at byte 100"),
        (|h| h.i16(42, 30_000), "end at byte"),
    ];
    for (damage, says) in damages {
        let mut header = Header::new(false, &[1, 1, 1], 4);
        damage(&mut header);
        let said = refusal(&Source::from_bytes("x.nii", header.with(&[1])));
        assert!(said.contains(says), "{said}");
    }
    let mut analyze = Header::new(false, &[1, 1, 1], 4).bytes;
    analyze[344..348].fill(0);
    assert!(refusal(&Source::from_bytes("x.hdr", analyze.clone())).contains("ANALYZE"));
    assert!(refusal(&Source::from_bytes("x.nii", &analyze[..200])).contains("cut off"));
    let mut flat = Header::new(false, &[1, 1, 1], 4);
    flat.i16(254, 1);
    flat.f32(280, f32::INFINITY);
    let (volume, codes) = read_with_findings(&Source::from_bytes("x.nii", flat.with(&[1])));
    assert_eq!(volume.placement().origin, [0.0; 3]);
    assert!(codes.is_empty() || codes == ["placement-ignored"]);
}

//! What is written is read again, for every type of samples.

use super::{read, samples, written};
use octofold::volume::{Block, DenseVolume, Label, Scalar, ScalarType};
use octofold::{LengthUnit, Placement, Run, Volume};
use octofold_io::{RawLayout, Source, read_volume};
use proptest::prelude::*;

/// Any samples of one type, from random bytes; NaN is left out, so that equal means equal.
fn volume<T: Scalar>(dims: [usize; 3], bytes: &[u8], placement: Placement) -> DenseVolume<T> {
    let count: usize = dims.iter().product();
    let bytes: Vec<u8> = bytes.iter().copied().cycle().take(count * size_of::<T>()).collect();
    let mut samples: Vec<T> = bytemuck::pod_collect_to_vec(&bytes);
    for sample in &mut samples {
        if sample.to_f64().is_nan() {
            *sample = T::default();
        }
    }
    DenseVolume::new(dims, samples, placement).unwrap()
}

fn any_volume(
    scalar: ScalarType,
    dims: [usize; 3],
    bytes: &[u8],
    placement: Placement,
) -> Box<dyn Volume> {
    match scalar {
        ScalarType::U8 => Box::new(volume::<u8>(dims, bytes, placement)),
        ScalarType::I8 => Box::new(volume::<i8>(dims, bytes, placement)),
        ScalarType::U16 => Box::new(volume::<u16>(dims, bytes, placement)),
        ScalarType::I16 => Box::new(volume::<i16>(dims, bytes, placement)),
        ScalarType::U32 => Box::new(volume::<u32>(dims, bytes, placement)),
        ScalarType::I32 => Box::new(volume::<i32>(dims, bytes, placement)),
        ScalarType::F32 => Box::new(volume::<f32>(dims, bytes, placement)),
        ScalarType::F64 => Box::new(volume::<f64>(dims, bytes, placement)),
    }
}

/// Steps and origins that single precision holds.
fn placements() -> impl Strategy<Value = Placement> {
    let number = || (-4000i32..4000).prop_map(|n| f64::from(n) / 64.0);
    (
        proptest::array::uniform3(proptest::array::uniform3(number())),
        proptest::array::uniform3(number()),
        proptest::sample::select(vec![
            None,
            Some(LengthUnit::Millimetre),
            Some(LengthUnit::Metre),
            Some(LengthUnit::Micrometre),
        ]),
    )
        .prop_map(|(axes, origin, unit)| Placement { axes, origin, unit })
        .prop_filter("flat", |p| p.determinant().abs() > 1e-3)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn samples_and_placement_survive(
        scalar in proptest::sample::select(ScalarType::ALL.to_vec()),
        dims in proptest::array::uniform3(1usize..7),
        bytes in proptest::collection::vec(any::<u8>(), 1..900),
        placement in placements(),
    ) {
        let volume = any_volume(scalar, dims, &bytes, placement);
        for name in ["v.nii", "v.nii.gz", "v.nrrd"] {
            let back = read(name, written(&*volume, name)).unwrap();
            prop_assert_eq!(back.dims(), dims);
            prop_assert_eq!(samples(&*back), samples(&*volume), "{}", name);
            prop_assert_eq!(back.placement(), placement, "{}", name);
        }
        let back = read("v.npy", written(&*volume, "v.npy")).unwrap();
        prop_assert_eq!(back.dims(), dims);
        prop_assert_eq!(samples(&*back), samples(&*volume));
        let source = Source::from_bytes("v.raw", written(&*volume, "v.raw"));
        let layout = RawLayout { dims, scalar, offset: 0, big_endian: false };
        let back = read_volume(&source, None, Some(layout), &Run::default()).unwrap();
        prop_assert_eq!(samples(&*back), samples(&*volume));
    }

    #[test]
    fn binary_volumes_survive(
        dims in proptest::array::uniform3(1usize..20),
        bits in proptest::collection::vec(any::<u8>(), 1..400),
    ) {
        let mut volume: DenseVolume<u8> = volume(dims, &bits, Placement::default());
        let samples_01 = volume.samples().iter().map(|v| v % 2).collect();
        volume = DenseVolume::new(dims, samples_01, placed([0.5; 3], 2.0)).unwrap();
        volume.binary = true;
        for name in ["v.binvox", "v.nrrd", "v.npy", "v.nii", "v.ofn"] {
            let back = read(name, written(&volume, name)).unwrap();
            prop_assert_eq!(samples(&*back), samples(&volume), "{}", name);
            prop_assert_eq!(back.is_binary(), name != "v.nii", "{}", name);
            if name != "v.npy" {
                prop_assert_eq!(back.placement(), volume.placement, "{}", name);
            }
        }
    }

    #[test]
    fn labels_survive(
        dims in proptest::array::uniform3(1usize..9),
        bytes in proptest::collection::vec(any::<u8>(), 1..400),
        origin in proptest::array::uniform3(-50i32..50),
    ) {
        let placement = placed(origin.map(|v| f64::from(v) + 0.5), 1.0);
        let mut volume: DenseVolume<u8> = volume(dims, &bytes, placement);
        volume.labels = (1..4)
            .map(|value| Label {
                value,
                name: format!("part {value}: a\\b\nc"),
                colour: [value as u8, 200, 0, 255],
            })
            .collect();
        let back = read("v.nrrd", written(&volume, "v.nrrd")).unwrap();
        prop_assert_eq!(back.labels(), &volume.labels[..]);
        let back = read("v.vox", written(&volume, "v.vox")).unwrap();
        prop_assert_eq!(back.placement(), placement);
        prop_assert_eq!(samples(&*back), samples(&volume));
        let named = back.labels().iter().find(|label| label.value == 2);
        prop_assert!(named.is_none_or(|label| label.colour == [2, 200, 0, 255]));
    }
}

fn placed(origin: [f64; 3], step: f64) -> Placement {
    Placement { origin, ..Placement::spacing([step; 3]) }
}

#[test]
fn long_axes_make_nifti_two() {
    let long: DenseVolume<u8> = volume([40_000, 1, 1], &[1, 2, 3], placed([0.1, 0.2, 0.3], 0.7));
    let bytes = written(&long, "v.nii");
    assert_eq!(&bytes[4..8], b"n+2\0");
    let back = read("v.nii", bytes).unwrap();
    assert_eq!(back.placement(), long.placement);
    assert_eq!(samples(&*back), samples(&long));
}

#[test]
fn units_that_a_format_lacks_are_converted() {
    let mut inches: DenseVolume<u8> = volume([2, 2, 2], &[0], placed([1.0; 3], 2.0));
    inches.placement.unit = Some(LengthUnit::Inch);
    let back = read("v.nii", written(&inches, "v.nii")).unwrap().placement();
    assert_eq!(back.unit, Some(LengthUnit::Millimetre));
    assert!((back.axes[0][0] - 50.8).abs() < 1e-5 && (back.origin[1] - 25.4).abs() < 1e-5);
}

#[test]
fn what_a_format_cannot_hold_is_refused() {
    let run = Run::default();
    let folder = tempfile::tempdir().unwrap();
    let refused = |volume: &dyn Volume| {
        let path = folder.path().join("v.vox");
        let error = octofold_io::write_volume(volume, &path, None, &run).unwrap_err();
        assert!(!path.exists(), "a refused volume must leave no file");
        error.to_string()
    };
    let floats = DenseVolume::new([1; 3], vec![1f32], Placement::default()).unwrap();
    assert!(refused(&floats).contains("labels from 0 to 255"));
    let large = DenseVolume::new([1; 3], vec![300i16], Placement::default()).unwrap();
    assert!(refused(&large).contains("a sample is 300"));
    let path = folder.path().join("v.ofn");
    let error = octofold_io::write_volume(&floats, &path, None, &run).unwrap_err().to_string();
    assert!(error.contains("net encode") && !path.exists(), "{error}");
    let Block::F32(_) = samples(&floats) else { panic!() };
}

#[test]
fn interrupted_writes_stop() {
    let run = Run::default();
    run.cancel.cancel();
    let any = DenseVolume::new([4; 3], vec![0u8; 64], Placement::default()).unwrap();
    for name in ["v.nii", "v.nii.gz", "v.nrrd", "v.npy", "v.raw", "v.vox"] {
        let folder = tempfile::tempdir().unwrap();
        let error = octofold_io::write_volume(&any, &folder.path().join(name), None, &run);
        assert!(matches!(error, Err(octofold_io::WriteError::Cancelled(_))), "{name}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

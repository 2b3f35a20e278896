//! Every model comes back from its stream, and streams that are damaged do no harm.

use super::super::{BuildOptions, LodError, build};
use super::*;
use crate::samples::Sample;
use proptest::prelude::*;
use std::sync::LazyLock;

fn of(sample: Sample) -> Lod {
    let mesh = sample.polygons(20).unwrap().triangulate();
    let options = BuildOptions { level: 5, ..BuildOptions::default() };
    build(&mesh, &options, &Run::default()).unwrap()
}

static TORUS: LazyLock<Lod> = LazyLock::new(|| of(Sample::Torus));

fn decoded(lod: &Lod, stream: &[u8]) -> Result<Lod, LodError> {
    let parts = lod.parts();
    let octants = parts.nodes.len() as u64;
    let coloured = parts.colours.is_some();
    Lod::decoded(stream, parts.levels, parts.frame, octants, coloured, &Run::default())
}

#[test]
fn streams_are_much_shorter_than_columns() {
    let lod = &*TORUS;
    let stream = lod.encoded(&Run::default()).unwrap();
    assert!(stream.len() < 5 * lod.nodes().len(), "{} {}", stream.len(), lod.nodes().len());
    assert_eq!(&decoded(lod, &stream).unwrap(), lod);
}

proptest! {
    #![proptest_config(crate::sweep::cases(16))]

    #[test]
    fn any_columns_come_back(seed in any::<u64>(), coloured: bool) {
        let mut state = seed;
        let mut byte = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 56) as u8
        };
        let kept = TORUS.parts();
        let count = kept.nodes.len();
        let mut column = || (0..count).map(|_| byte()).collect::<Vec<u8>>();
        let [x, y, z, u, v] = [(); 5].map(|()| column());
        let parts = Parts {
            errors: column().into(),
            shapes: column().into(),
            traits: column().iter().map(|t| t & 1).collect::<Vec<_>>().into(),
            vertices: (0..count).map(|i| [x[i], y[i], z[i]]).collect::<Vec<_>>().into(),
            normals: (0..count).map(|i| [u[i], v[i]]).collect::<Vec<_>>().into(),
            colours: coloured.then(|| (0..count).map(|i| [z[i], y[i], x[i], u[i]]).collect::<Vec<_>>().into()),
            ..kept.clone()
        };
        let lod = Lod::from_parts(parts).unwrap();
        let stream = lod.encoded(&Run::default()).unwrap();
        prop_assert_eq!(decoded(&lod, &stream).unwrap(), lod);
    }

    #[test]
    fn damage_is_an_error_or_another_model(at in any::<prop::sample::Index>(), bits in 1u8.., cut: bool) {
        let mut stream = TORUS.encoded(&Run::default()).unwrap();
        let at = at.index(stream.len());
        if cut {
            stream.truncate(at);
        } else {
            stream[at] ^= bits;
        }
        if let Ok(lod) = decoded(&TORUS, &stream) {
            prop_assert_eq!(lod.nodes().len(), TORUS.nodes().len());
        }
    }
}

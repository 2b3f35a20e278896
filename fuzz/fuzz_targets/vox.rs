//! Reads any bytes as MagicaVoxel: an error or a sound volume, never a panic, a hang or a flood of memory.

#![no_main]

use libfuzzer_sys::fuzz_target;
use octofold::{Run, volume::Region};
use octofold_io::{Source, vox};

fuzz_target!(|bytes: &[u8]| {
    let source = Source::from_bytes("fuzz.vox", bytes);
    if let Ok(volume) = vox::read(&source, &Run::default()) {
        let [x, y, _] = volume.dims();
        let slice = Region::all([x, y, 1]);
        assert_eq!(volume.read(slice).expect("samples are at hand").len(), slice.len());
    }
});

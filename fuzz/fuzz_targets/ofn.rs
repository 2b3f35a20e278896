//! Reads any bytes as .ofn: an error or a sound solid, never a panic, a hang or a flood of memory.
//!
//! Streams and indices are also read without their sums, so that what lies behind them is reached.

#![no_main]

use libfuzzer_sys::fuzz_target;
use octofold::Run;
use octofold::network::code::bricks::Bricks;
use octofold::network::code::{CodeError, Mode, Reader};
use octofold::volume::Region;
use octofold_io::{Source, ofn};

fuzz_target!(|bytes: &[u8]| {
    let run = Run::default();
    if let Ok(volume) = ofn::read(&Source::from_bytes("fuzz.ofn", bytes), &run) {
        let [x, y, _] = octofold::Volume::dims(&*volume);
        let slice = Region::all([x.min(99), y.min(99), 1]);
        assert_eq!(volume.read(slice).expect("samples are at hand").len(), slice.len());
    }
    for mode in [Mode::Fast, Mode::Archive] {
        let _ = Reader::new([90, 30], mode, bytes, 10_000).pull(20, &run);
    }
    let dims = [500, 300, 200];
    let _ = Bricks::from_first_bytes(dims, bytes, 1 << 20);
    if let Ok(bricks) = Bricks::from_bytes(dims, bytes, 1 << 20) {
        let _ = bricks.is_filled([3, 4, 5], |_| Ok::<_, CodeError>(bytes));
    }
});

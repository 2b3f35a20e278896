//! Reads any bytes as a level-of-detail model: an error, or a model of which any cut is a sound mesh.

#![no_main]

use libfuzzer_sys::fuzz_target;
use octofold::Run;
use octofold::lod::{Criterion, Cut, Diagonal, Mode, drawn, patches};
use octofold_io::{Source, oflod};

fuzz_target!(|bytes: &[u8]| {
    let run = Run::default();
    let Ok(lod) = oflod::read(&Source::from_bytes("fuzz.oflod", bytes), &run) else { return };
    for mode in Mode::ALL {
        let cut = Cut::select(&lod, &Criterion::Level(6), &run).expect("nobody interrupts");
        let found = patches(&lod, &cut, mode, &run).expect("nobody interrupts");
        let drawn = drawn(&lod, &cut, &found, mode, Diagonal::Flatter, &run);
        assert!(drawn.expect("nobody interrupts").mesh.check().is_ok());
    }
});

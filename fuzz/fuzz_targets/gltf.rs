//! Any bytes as glTF and GLB: no panic, no hang, and whatever is read is a sound shape.
#![no_main]

use libfuzzer_sys::fuzz_target;
use octofold::Run;
use octofold_io::{Source, gltf};

fuzz_target!(|bytes: &[u8]| {
    if let Ok(soup) = gltf::read(&Source::from_bytes("fuzz", bytes), &Run::default()) {
        assert!(soup.triangulate().check().is_ok());
    }
});

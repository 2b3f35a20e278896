//! sRGB and linear light.

use glam::Vec3;
use std::sync::LazyLock;

/// Linear light of each sRGB value.
static DECODED: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let s = i as f64 / 255.0;
        (if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }) as f32
    })
});

/// sRGB value of each 1/4096 of linear light, by the middle of the step.
static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..4096)
        .map(|i| {
            let light = (f64::from(i) + 0.5) / 4096.0;
            let s = if light <= 0.003_130_8 {
                light * 12.92
            } else {
                1.055 * light.powf(1.0 / 2.4) - 0.055
            };
            (s * 255.0).round() as u8
        })
        .collect()
});

/// Linear light of an sRGB colour.
pub fn linear([r, g, b]: [u8; 3]) -> Vec3 {
    Vec3::new(DECODED[r as usize], DECODED[g as usize], DECODED[b as usize])
}

/// The sRGB colour of linear light, clamped.
pub fn srgb(light: Vec3) -> [u8; 3] {
    light.to_array().map(|x| ENCODED[((x * 4096.0) as usize).min(4095)])
}

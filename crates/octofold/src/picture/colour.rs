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
pub(super) fn linear([r, g, b]: [u8; 3]) -> Vec3 {
    Vec3::new(DECODED[r as usize], DECODED[g as usize], DECODED[b as usize])
}

/// The sRGB colour of linear light, clamped.
pub(super) fn srgb(light: Vec3) -> [u8; 3] {
    light.to_array().map(|x| ENCODED[((x * 4096.0) as usize).min(4095)])
}

/// A colour for a label, far from those of the labels near to it.
pub(super) fn of_label(label: u32) -> [u8; 3] {
    if label == 0 {
        return [176, 180, 186];
    }
    // Hues a golden section apart never come close to each other soon.
    let hue = f64::from(label) * 0.618_033_988_749_895 % 1.0 * 6.0;
    let [saturation, value] = [[0.55, 0.88], [0.72, 0.74], [0.42, 0.95]][label as usize % 3];
    [5.0, 3.0, 1.0].map(|offset| {
        let k: f64 = (offset + hue) % 6.0;
        let c = value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0);
        (c * 255.0).round() as u8
    })
}

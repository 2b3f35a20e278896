//! Colours of pictures.

pub(super) use crate::light::{linear, srgb};

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

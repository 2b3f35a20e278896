//! Colours of mesh files, and the images that come with them.

use octofold::attributes::Texture;

/// A byte from a fraction of one; NaN is none of it.
pub(crate) fn byte(fraction: f64) -> u8 {
    (255.0 * fraction).round().clamp(0.0, 255.0) as u8
}

/// sRGB byte of a fraction in linear light.
pub(crate) fn srgb(linear: f32) -> u8 {
    let encoded =
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    byte(f64::from(encoded))
}

/// Fraction in linear light of an sRGB byte.
pub(crate) fn linear(srgb: u8) -> f32 {
    let encoded = f32::from(srgb) / 255.0;
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// sRGB bytes with alpha of a colour in linear light.
pub(crate) fn srgb_of_linear([r, g, b, a]: [f32; 4]) -> [u8; 4] {
    [srgb(r), srgb(g), srgb(b), byte(f64::from(a))]
}

/// An encoded image, if it is of a kind that can ride along.
pub(crate) fn texture(bytes: &[u8]) -> Option<Texture> {
    let media_type = match bytes {
        [0x89, b'P', b'N', b'G', ..] => "image/png",
        [0xff, 0xd8, 0xff, ..] => "image/jpeg",
        _ => return None,
    };
    Some(Texture { media_type: media_type.into(), bytes: bytes.into() })
}

/// File-name ending of an image.
pub(crate) fn ending(texture: &Texture) -> &'static str {
    if texture.media_type == "image/jpeg" { "jpg" } else { "png" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_linear_light() {
        for b in 0..=255u8 {
            assert_eq!(srgb(linear(b)), b);
            let word = (linear(b) * 65535.0).round() / 65535.0;
            assert_eq!(srgb(word), b);
        }
        assert_eq!((byte(f64::NAN), byte(7.0), byte(-1.0)), (0, 255, 0));
    }
}

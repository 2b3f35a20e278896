//! Pictures out.

/// Encodes an RGBA picture, rows from the top.
pub fn encode(width: u32, height: u32, rgba: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    encoded(width, height, png::ColorType::Rgba, rgba)
}

/// Encodes an RGB picture, rows from the top.
pub(crate) fn encode_rgb(
    width: u32,
    height: u32,
    rgb: &[u8],
) -> Result<Vec<u8>, png::EncodingError> {
    encoded(width, height, png::ColorType::Rgb, rgb)
}

fn encoded(
    width: u32,
    height: u32,
    colour: png::ColorType,
    bytes: &[u8],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(bytes)?;
    Ok(out)
}

//! Images of materials, unpacked: PNG and JPEG.

use octofold::attributes::{Attributes, Texture};
use octofold::image::{Image, Pyramid};
use octofold::{Finding, Run};
use std::sync::Arc;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Images that unpack to more bytes are left out.
const MOST_BYTES: usize = 1 << 28;

/// The images of all materials in all sizes, one for each material. What cannot be unpacked is told of
/// and left out.
pub fn images(attributes: &Attributes, run: &Run) -> Vec<Option<Arc<Pyramid>>> {
    let mut known: Vec<(&Texture, Option<Arc<Pyramid>>)> = Vec::new();
    let mut all = Vec::new();
    let mut lost = 0;
    for material in &attributes.materials {
        let image = material.texture.as_ref().and_then(|texture| {
            if let Some((_, image)) = known.iter().find(|(other, _)| *other == texture) {
                return image.clone();
            }
            let image = decode(texture).map(|image| Arc::new(Pyramid::new(image)));
            lost += u64::from(image.is_none());
            known.push((texture, image.clone()));
            image
        });
        all.push(image);
    }
    if lost > 0 {
        let text = format!("{lost} images could not be unpacked; their materials are plain");
        run.finding(Finding::warning("unknown-image", text).of(lost));
    }
    all
}

/// Unpacks an image of a kind that is read.
pub(crate) fn decode(texture: &Texture) -> Option<Image> {
    match texture.media_type.as_str() {
        "image/jpeg" => jpeg(&texture.bytes),
        _ => png(&texture.bytes),
    }
}

fn png(bytes: &[u8]) -> Option<Image> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info().ok()?;
    let size = reader.output_buffer_size().filter(|&n| n <= MOST_BYTES)?;
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes).ok()?;
    unpacked([info.width as usize, info.height as usize], info.color_type.samples(), &bytes)
}

fn jpeg(bytes: &[u8]) -> Option<Image> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().ok()?;
    let (width, height) = decoder.dimensions()?;
    decoder.output_buffer_size().filter(|&n| n <= MOST_BYTES)?;
    unpacked([width, height], 3, &decoder.decode().ok()?)
}

fn unpacked([width, height]: [usize; 2], channels: usize, bytes: &[u8]) -> Option<Image> {
    let spread = |c: &[u8]| match *c {
        [l] => [l, l, l, 255],
        [l, a] => [l, l, l, a],
        [r, g, b] => [r, g, b, 255],
        [r, g, b, a] => [r, g, b, a],
        _ => [255; 4],
    };
    let texels = bytes.get(..width.checked_mul(height)?.checked_mul(channels)?)?;
    Image::new(width, height, texels.chunks_exact(channels).map(spread).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;

    /// 16 by 8 texels, red on the left and blue on the right.
    const JPEG: &str = "\
        /9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAA0JCgsKCA0LCgsODg0PEyAVExISEyccHhcgLikxMC4pLSwzOko+MzZGNywtQFdBRkxO\
        UlNSMj5aYVpQYEpRUk//2wBDAQ4ODhMREyYVFSZPNS01T09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09P\
        T09PT09PT09PT0//wAARCAAIABADAREAAhEBAxEB/8QAFQABAQAAAAAAAAAAAAAAAAAABQb/xAAUEAEAAAAAAAAAAAAAAAAAAAAA\
        /8QAFQEBAQAAAAAAAAAAAAAAAAAABwX/xAAUEQEAAAAAAAAAAAAAAAAAAAAA/9oADAMBAAIRAxEAPwCfRiSCMQqf/9k=";

    fn jpeg_bytes() -> Vec<u8> {
        base64::engine::general_purpose::STANDARD.decode(JPEG).unwrap()
    }

    #[test]
    fn both_kinds_are_unpacked() {
        let rgba: Vec<u8> = (0..6).flat_map(|i| [40 * i, 7, 9, 255 - i]).collect();
        let png = crate::png::encode(3, 2, &rgba).unwrap();
        let image = decode(&crate::colour::texture(&png).unwrap()).unwrap();
        assert_eq!((image.size(), image.texel([0.9, 0.1])), ([3, 2], [200, 7, 9, 250]));
        let image = decode(&crate::colour::texture(&jpeg_bytes()).unwrap()).unwrap();
        assert_eq!(image.size(), [16, 8]);
        let near =
            |texel: [u8; 4], colour: [u8; 4]| (0..4).all(|k| texel[k].abs_diff(colour[k]) < 9);
        assert!(near(image.texel([0.2, 0.5]), [255, 0, 0, 255]));
        assert!(near(image.texel([0.8, 0.5]), [0, 0, 255, 255]));
    }

    #[test]
    fn cut_off_images_are_told_of_or_come_back_in_part() {
        let bytes = jpeg_bytes();
        for end in 3..bytes.len() {
            if let Some(image) = crate::colour::texture(&bytes[..end]).and_then(|t| decode(&t)) {
                assert_eq!(image.size(), [16, 8]);
            }
        }
        let material = |bytes: &[u8]| octofold::Material {
            texture: crate::colour::texture(bytes),
            ..octofold::Material::default()
        };
        let materials = vec![material(&bytes), material(&bytes[..20]), material(&bytes)];
        let attributes = Attributes { materials, ..Attributes::default() };
        let all = images(&attributes, &Run::default());
        let [Some(first), None, Some(third)] = all.as_slice() else { panic!("{all:?}") };
        assert!(Arc::ptr_eq(first, third));
    }
}

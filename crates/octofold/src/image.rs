//! Unpacked images of materials, and their pyramids: colours of any place, averaged in linear light over
//! as much of the image as is asked for.
//!
//! Images repeat. Texture coordinates begin at the lower left, rows of texels at the top. Source:
//! Williams, "Pyramidal parametrics", 1983.

use crate::light::{linear, srgb};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// Four bytes a texel: sRGB with straight alpha, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    width: usize,
    height: usize,
    rgba: Vec<[u8; 4]>,
}

impl Image {
    /// An image of these texels; `None` where they are not `width` times `height`, or none.
    pub fn new(width: usize, height: usize, rgba: Vec<[u8; 4]>) -> Option<Self> {
        let fits = width.checked_mul(height).is_some_and(|count| count > 0 && count == rgba.len());
        fits.then_some(Self { width, height, rgba })
    }

    /// Texels in a row, and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The texel at texture coordinates.
    pub fn texel(&self, [u, v]: [f64; 2]) -> [u8; 4] {
        let place = |share: f64, count: usize| {
            ((share.rem_euclid(1.0) * count as f64) as usize).min(count - 1)
        };
        self.rgba[(self.height - 1 - place(v, self.height)) * self.width + place(u, self.width)]
    }

    /// The image with half the texels in a row, and half the rows.
    fn half(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut rgba = Vec::with_capacity(width * height);
        for y in 0..height {
            let rows = [2 * y, (2 * y + 1).min(self.height - 1)];
            for x in 0..width {
                let columns = [2 * x, (2 * x + 1).min(self.width - 1)];
                let all = rows.map(|y| columns.map(|x| self.light(x, y)));
                rgba.push(packed(all.as_flattened().iter().sum::<Vec4>() / 4.0));
            }
        }
        Self { width, height, rgba }
    }

    /// Linear light times alpha, and alpha, of a texel.
    fn light(&self, x: usize, y: usize) -> Vec4 {
        let [r, g, b, a] = self.rgba[y * self.width + x];
        let alpha = f32::from(a) / 255.0;
        (linear([r, g, b]) * alpha).extend(alpha)
    }

    /// The same between the four texels round a place.
    fn between(&self, [u, v]: [f64; 2]) -> Vec4 {
        let split = |share: f64, count: usize| {
            let share = if share.is_finite() { share } else { 0.0 };
            let at = share.rem_euclid(1.0) * count as f64 - 0.5;
            let low = at.floor();
            let first = (low as i64).rem_euclid(count as i64) as usize;
            (first, (first + 1) % count, (at - low) as f32)
        };
        let (left, right, x) = split(u, self.width);
        let (upper, lower, y) = split(1.0 - v, self.height);
        let row = |y: usize| self.light(left, y).lerp(self.light(right, y), x);
        row(upper).lerp(row(lower), y)
    }
}

/// A colour of linear light times alpha.
fn packed(light: Vec4) -> [u8; 4] {
    let [r, g, b] = srgb(straight(light).xyz());
    [r, g, b, (light.w * 255.0).round() as u8]
}

fn straight(light: Vec4) -> Vec4 {
    let colour = if light.w > 0.0 { light.xyz() / light.w } else { Vec3::ZERO };
    colour.extend(light.w)
}

/// An image in all sizes, each half of the one before.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pyramid {
    levels: Vec<Image>,
}

impl Pyramid {
    /// All sizes of an image.
    pub fn new(image: Image) -> Self {
        let mut levels = vec![image];
        while let Some(last) = levels.last().filter(|i| i.width > 1 || i.height > 1) {
            levels.push(last.half());
        }
        Self { levels }
    }

    /// The image itself.
    pub fn image(&self) -> &Image {
        &self.levels[0]
    }

    /// The mean colour round a place in linear light with straight alpha, over a square with sides of so
    /// many texels.
    pub fn light(&self, place: [f64; 2], texels: f64) -> Vec4 {
        let last = self.levels.len() - 1;
        let level = texels.max(1.0).log2().min(last as f64);
        let (low, share) = (level as usize, level.fract() as f32);
        let of = |level: usize| self.levels[level.min(last)].between(place);
        straight(if share > 0.0 { of(low).lerp(of(low + 1), share) } else { of(low) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(width: usize, height: usize) -> Image {
        let texel = |i: usize| {
            let bright = if (i % width + i / width).is_multiple_of(2) { 255 } else { 0 };
            [bright, bright, bright, 255]
        };
        Image::new(width, height, (0..width * height).map(texel).collect()).unwrap()
    }

    #[test]
    fn rows_begin_at_the_top_and_coordinates_at_the_bottom() {
        let image = Image::new(1, 2, vec![[9, 0, 0, 255], [0, 9, 0, 255]]).unwrap();
        assert_eq!(image.texel([0.5, 0.25]), [0, 9, 0, 255]);
        assert_eq!(image.texel([7.5, -0.25]), [9, 0, 0, 255]);
        let pyramid = Pyramid::new(image);
        assert!(pyramid.light([0.5, 0.25], 1.0).y > 0.0);
        assert_eq!(pyramid.light([0.5, 0.75], 1.0).y, 0.0);
    }

    #[test]
    fn a_chequered_board_is_half_as_bright_from_afar() {
        for size in [2, 8, 64] {
            let pyramid = Pyramid::new(board(size, size));
            for texels in [2.0, 3.7, 1e9] {
                let light = pyramid.light([0.3, 0.9], texels);
                assert!((light.x - 0.5).abs() < 0.01 && light.w == 1.0, "{size} {texels} {light}");
            }
        }
    }

    #[test]
    fn what_is_clear_has_no_colour() {
        let rgba = vec![[255, 0, 0, 255], [0, 255, 0, 0]];
        let pyramid = Pyramid::new(Image::new(2, 1, rgba).unwrap());
        let light = pyramid.light([0.1, 0.5], 2.0);
        assert!((light.x - 1.0).abs() < 0.01 && light.y == 0.0 && (light.w - 0.5).abs() < 0.01);
    }

    #[test]
    fn images_without_texels_are_none() {
        assert!(Image::new(0, 3, vec![]).is_none());
        assert!(Image::new(2, 2, vec![[0; 4]; 3]).is_none());
        assert!(Image::new(usize::MAX, 2, vec![]).is_none());
        let odd = Pyramid::new(board(5, 3));
        assert!(odd.light([f64::NAN, 2.0], f64::NAN).w > 0.0);
    }
}

//! The cover of a document: the model, the same with a colour for each piece, and which piece has
//! which, in the order that they are put together.

use crate::drawing::{Drawing, Layer, Paint};
use crate::prints::{DOTS, Print};
use octofold::picture::Picture;
use octofold::unfold::Pattern;

/// What a cover shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Cover {
    /// Pictures of [`Cover::picture_size`], the model and its pieces.
    pub pictures: [Picture; 2],
    /// The colour of each piece.
    pub colours: Vec<[u8; 3]>,
}

/// Share of the page's height that a picture takes.
const SHARE: f64 = 0.38;

/// Side of a swatch, and from one to the next, in millimetres.
const SWATCH: f64 = 5.0;
const STEP: [f64; 2] = [15.0, 8.0];

impl Cover {
    /// Pixels across and down of its pictures on pages of a size in millimetres.
    pub fn picture_size(page: [f64; 2]) -> [u32; 2] {
        let across = page[0] - 2.0 * margin(page);
        [across, SHARE * page[1]].map(|x| (x * DOTS) as u32)
    }

    /// A colour for each of `count` pieces, neighbours in the list well apart.
    pub fn palette(count: usize) -> Vec<[u8; 3]> {
        let colour = |i: usize| {
            // Steps of the golden section never come near a hue that was there shortly before.
            let hue = 6.0 * (0.08 + 0.618_034 * i as f64).fract();
            let wave = |shift: f64| {
                let x = (hue + shift).rem_euclid(6.0);
                (2.0 - (x - 3.0).abs()).clamp(0.0, 1.0)
            };
            let light = if i.is_multiple_of(2) { 225.0 } else { 185.0 };
            [0.0, 4.0, 2.0].map(|shift| (light * (0.35 + 0.65 * wave(shift + 3.0))) as u8)
        };
        (0..count).map(colour).collect()
    }

    /// The page.
    pub(crate) fn drawing(&self, pattern: &Pattern) -> Drawing {
        let mut print = Print::blank(pattern.page);
        let left = margin(pattern.page);
        let mut top = left;
        for picture in &self.pictures {
            print.put(picture, [left, top].map(|x| (x * DOTS) as usize));
            top += SHARE * pattern.page[1] + 4.0;
        }
        let mut drawing = Drawing { print: Some(print), ..Drawing::default() };
        let columns = (((pattern.page[0] - 2.0 * left) / STEP[0]) as usize).max(1);
        for (i, &colour) in self.colours.iter().enumerate() {
            let [x, y] = [
                left + (i % columns) as f64 * STEP[0],
                pattern.page[1] - top - (i / columns + 1) as f64 * STEP[1],
            ];
            if y < left {
                break;
            }
            let [right, up] = [x + SWATCH, y + SWATCH];
            let points = vec![[x, y], [right, y], [right, up], [x, up]];
            drawing.fills.push(Paint { colour, points });
            drawing.lettered(&(i + 1).to_string(), [right + 1.5, y + 1.0], 3.0, Layer::Page);
        }
        drawing
    }
}

fn margin(page: [f64; 2]) -> f64 {
    10.0f64.min(page[0] / 20.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_in_the_palette_differ() {
        let palette = Cover::palette(40);
        for pair in palette.windows(2) {
            let apart: u32 = (0..3).map(|c| u32::from(pair[0][c].abs_diff(pair[1][c]))).sum();
            assert!(apart > 60, "{pair:?}");
        }
    }
}

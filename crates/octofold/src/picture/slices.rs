//! The three middle slices of a volume, side by side.

use super::Picture;
use super::colour::{linear, of_label, srgb};
use crate::par;
use crate::run::Run;
use crate::volume::{Block, Region, Volume, VolumeError};
use glam::{DVec3, Vec3};

/// How samples become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SlicePaint {
    /// By what the volume says of itself: labels where it names some, a mask in one colour, else
    /// gray.
    #[default]
    Auto,
    /// From black at the darkest hundredth of the samples to white at the brightest.
    Gray,
    /// A colour for every value.
    Labels,
}

/// What the slices look like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceStyle {
    /// Rows of the picture.
    pub height: u32,
    /// How samples become colours.
    pub paint: SlicePaint,
    /// Draws the line where values cross this one.
    pub iso: Option<f64>,
    /// Around the slices, sRGB.
    pub background: [u8; 3],
}

impl Default for SliceStyle {
    fn default() -> Self {
        Self { height: 400, paint: SlicePaint::Auto, iso: None, background: [236, 239, 243] }
    }
}

/// Samples along the side of a pixel.
const SAMPLES: usize = 3;
/// Free pixels around each slice.
const GAP: usize = 10;
/// Widest slice, in multiples of the height.
const WIDEST: f64 = 4.0;
/// Colours of masks, of the iso line and of label 0, sRGB.
const INSIDE: [u8; 3] = [72, 134, 168];
const OUTSIDE: [u8; 3] = [252, 252, 253];
const LINE: [u8; 3] = [236, 88, 40];

/// One slice in memory: two axes of the volume, the first to the right and the second up.
struct Slice<'a> {
    block: Block<'a>,
    dims: [usize; 2],
    /// Size in the world.
    extent: [f64; 2],
}

/// Draws the slices through the middle, with x, y and z across: y-z, x-z and x-y planes, with the
/// higher axis pointing up.
pub fn slices(volume: &dyn Volume, style: &SliceStyle, run: &Run) -> Result<Picture, VolumeError> {
    run.stage("picture");
    let mut shown = Vec::new();
    for axis in 0..3 {
        run.check()?;
        shown.extend(middle(volume, axis)?);
    }
    let tallest = shown.iter().map(|s| s.extent[1]).fold(0.0, f64::max);
    let inner = (style.height as usize).saturating_sub(2 * GAP).max(1);
    let sizes: Vec<[usize; 2]> = shown
        .iter()
        .map(|s| {
            let scale = inner as f64 / tallest;
            let width = (s.extent[0] * scale).min(WIDEST * inner as f64);
            [width, s.extent[1] * scale].map(|x| (x.round() as usize).max(1))
        })
        .collect();
    let width = sizes.iter().map(|s| s[0] + GAP).sum::<usize>() + GAP;
    let [r, g, b] = style.background;
    let mut rgba = [r, g, b, 255].repeat(width * style.height as usize);
    let mut left = GAP;
    let paint = Painter::new(volume, &shown, style);
    for (slice, [across, up]) in shown.iter().zip(sizes) {
        let top = GAP + (inner - up.min(inner)) / 2;
        let rows = par::blocks(run, up, 8, |rows| {
            rows.map(|row| paint.row(slice, [across, up], row)).collect::<Vec<_>>()
        })?;
        for (row, pixels) in rows.into_iter().flatten().enumerate() {
            let at = ((top + row) * width + left) * 4;
            if at + 4 * across <= rgba.len() {
                rgba[at..at + 4 * across].copy_from_slice(pixels.as_flattened());
            }
        }
        left += across + GAP;
    }
    Ok(Picture { width: width as u32, height: style.height, rgba })
}

/// The middle slice across `axis`; `None` for an empty volume.
fn middle(volume: &dyn Volume, axis: usize) -> Result<Option<Slice<'_>>, VolumeError> {
    let dims = volume.dims();
    let mut region = Region::all(dims);
    if region.is_empty() {
        return Ok(None);
    }
    region.start[axis] = dims[axis] / 2;
    region.end[axis] = dims[axis] / 2 + 1;
    let [u, v] = [[1, 2], [0, 2], [0, 1]][axis];
    let axes = volume.placement().axes;
    let extent = [u, v].map(|a| {
        let length = DVec3::from(axes[a]).length();
        dims[a] as f64 * if length > 0.0 && length.is_finite() { length } else { 1.0 }
    });
    Ok(Some(Slice { block: volume.read(region)?, dims: [dims[u], dims[v]], extent }))
}

impl Slice<'_> {
    fn value(&self, x: usize, y: usize) -> f64 {
        self.block.value(y * self.dims[0] + x)
    }

    /// Value of the sample nearest to a position in samples.
    fn nearest(&self, [x, y]: [f64; 2]) -> f64 {
        let at = |p: f64, n: usize| ((p + 0.5) as usize).min(n - 1);
        self.value(at(x, self.dims[0]), at(y, self.dims[1]))
    }

    /// Value between the four samples around a position.
    fn between(&self, [x, y]: [f64; 2]) -> f64 {
        let split = |p: f64, n: usize| {
            let low = (p.max(0.0) as usize).min(n - 1);
            (low, (low + 1).min(n - 1), (p - low as f64).clamp(0.0, 1.0))
        };
        let ((x0, x1, s), (y0, y1, t)) = (split(x, self.dims[0]), split(y, self.dims[1]));
        let row = |y| self.value(x0, y) * (1.0 - s) + self.value(x1, y) * s;
        row(y0) * (1.0 - t) + row(y1) * t
    }
}

/// Colours of values.
enum Ramp {
    Gray { black: f64, white: f64 },
    Mask,
    Labels,
}

struct Painter<'a> {
    volume: &'a dyn Volume,
    ramp: Ramp,
    iso: Option<f64>,
}

impl<'a> Painter<'a> {
    fn new(volume: &'a dyn Volume, shown: &[Slice<'_>], style: &SliceStyle) -> Self {
        let ramp = match style.paint {
            SlicePaint::Labels => Ramp::Labels,
            SlicePaint::Auto if volume.is_binary() => Ramp::Mask,
            SlicePaint::Auto if !volume.labels().is_empty() => Ramp::Labels,
            SlicePaint::Auto | SlicePaint::Gray => gray(shown),
        };
        Self { volume, ramp, iso: style.iso }
    }

    /// Pixels of one row of a slice, from the top.
    fn row(&self, slice: &Slice<'_>, size: [usize; 2], row: usize) -> Vec<[u8; 4]> {
        let at = |pixel: usize, sub: usize, pixels: usize, samples: usize| {
            let share = (pixel as f64 + (sub as f64 + 0.5) / SAMPLES as f64) / pixels as f64;
            share * samples as f64 - 0.5
        };
        // Pixels count down, the slice's second axis up.
        let up = size[1] - 1 - row;
        // Half of a line of 1.6 pixels, in samples.
        let half = 0.8 * slice.dims[0] as f64 / size[0] as f64;
        (0..size[0])
            .map(|x| {
                let light: Vec3 = (0..SAMPLES * SAMPLES)
                    .map(|i| {
                        let p = [
                            at(x, i % SAMPLES, size[0], slice.dims[0]),
                            at(up, i / SAMPLES, size[1], slice.dims[1]),
                        ];
                        let on_line = self.iso.is_some_and(|iso| crosses(slice, p, iso, half));
                        if on_line { linear(LINE) } else { self.light(slice, p) }
                    })
                    .sum();
                let [r, g, b] = srgb(light / (SAMPLES * SAMPLES) as f32);
                [r, g, b, 255]
            })
            .collect()
    }

    fn light(&self, slice: &Slice<'_>, p: [f64; 2]) -> Vec3 {
        match self.ramp {
            Ramp::Gray { black, white } => {
                let share = (slice.between(p) - black) / (white - black);
                let gray = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
                linear([(gray * 255.0).round() as u8; 3])
            }
            Ramp::Mask => linear(if slice.nearest(p) != 0.0 { INSIDE } else { OUTSIDE }),
            Ramp::Labels => {
                let value = slice.nearest(p);
                if value == 0.0 {
                    return linear(OUTSIDE);
                }
                let label = value.abs() as u32;
                let known = self.volume.labels().iter().find(|l| l.value == label);
                known.map_or_else(
                    || linear(of_label(label)),
                    |l| linear([l.colour[0], l.colour[1], l.colour[2]]),
                )
            }
        }
    }
}

/// True where values cross `iso` within `half` samples of a position.
fn crosses(slice: &Slice<'_>, [x, y]: [f64; 2], iso: f64, half: f64) -> bool {
    let around = [[x - half, y], [x + half, y], [x, y - half], [x, y + half]];
    let above = around.map(|p| slice.between(p) >= iso);
    above.contains(&true) && above.contains(&false)
}

/// The ramp that leaves out the darkest and the brightest hundredth.
fn gray(shown: &[Slice<'_>]) -> Ramp {
    let mut values: Vec<f64> = Vec::new();
    for slice in shown {
        let step = slice.block.len().div_ceil(1 << 14).max(1);
        values.extend((0..slice.block.len()).step_by(step).map(|i| slice.block.value(i)));
    }
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let rank = |share: f64| values.get((share * values.len() as f64) as usize).copied();
    let (black, white) = (rank(0.01).unwrap_or(0.0), rank(0.99).unwrap_or(1.0));
    // A slice of one value, or nearly so, still shows what little differs.
    let (low, high) = (values.first().copied(), values.last().copied());
    if white > black {
        Ramp::Gray { black, white }
    } else {
        let (black, white) = (low.unwrap_or(0.0), high.unwrap_or(1.0));
        Ramp::Gray { black, white: if white > black { white } else { black + 1.0 } }
    }
}

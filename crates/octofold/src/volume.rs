//! Volumes, read by the block.
//!
//! A volume is a box of samples, x fastest, with an affine placement that maps sample indices
//! (of sample centres) to world coordinates. Whatever it is made of (an array, bits, runs, a
//! mapped file, a function), a method asks it for one [`Region`] at a time and gets a
//! [`Block`] in the volume's own scalar type, borrowed where the samples lie in memory already.

use crate::attributes::LengthUnit;
use crate::payload::Payload;
use crate::run::Cancelled;
use std::borrow::Cow;

/// Maps sample indices to world coordinates: `world = linear * index + origin`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Placement {
    /// Columns of the linear part: the world steps of one sample along x, y and z.
    pub axes: [[f64; 3]; 3],
    /// World position of sample (0, 0, 0).
    pub origin: [f64; 3],
    /// Unit of the world coordinates, where known.
    pub unit: Option<LengthUnit>,
}

impl Default for Placement {
    fn default() -> Self {
        Self::spacing([1.0; 3])
    }
}

impl Placement {
    /// Axis-aligned samples `spacing` apart, the first at the world's origin.
    pub fn spacing([x, y, z]: [f64; 3]) -> Self {
        Self { axes: [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]], origin: [0.0; 3], unit: None }
    }

    /// World position of a (fractional) sample index.
    pub fn place(&self, index: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|r| {
            self.axes[0][r] * index[0]
                + self.axes[1][r] * index[1]
                + self.axes[2][r] * index[2]
                + self.origin[r]
        })
    }

    /// Maps world coordinates to sample indices; `None` where the samples lie in one plane.
    pub fn inverse(&self) -> Option<Self> {
        let linear = glam::DMat3::from_cols_array_2d(&self.axes);
        let inverse = linear.inverse();
        let origin = inverse * -glam::DVec3::from(self.origin);
        let usable = linear.determinant() != 0.0 && inverse.is_finite() && origin.is_finite();
        usable.then(|| Self {
            axes: inverse.to_cols_array_2d(),
            origin: origin.to_array(),
            unit: None,
        })
    }

    /// Determinant of the linear part; negative where the placement mirrors.
    pub fn determinant(&self) -> f64 {
        glam::DMat3::from_cols_array_2d(&self.axes).determinant()
    }
}

/// A box of samples: `start` inclusive, `end` exclusive, in sample indices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First sample along x, y, z.
    pub start: [usize; 3],
    /// One past the last sample.
    pub end: [usize; 3],
}

impl Region {
    /// The whole of a volume of `dims` samples.
    pub fn all(dims: [usize; 3]) -> Self {
        Self { start: [0; 3], end: dims }
    }

    /// Samples along each axis.
    pub fn dims(&self) -> [usize; 3] {
        std::array::from_fn(|a| self.end[a] - self.start[a])
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.dims().iter().product()
    }

    /// True where there is no sample inside.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Samples of one region, x fastest, without gaps, in the volume's own type.
#[derive(Debug, Clone, PartialEq)]
pub enum Block<'a> {
    /// Unsigned bytes; bit grids and masks are read as 0 and 1.
    U8(Cow<'a, [u8]>),
    /// Signed bytes.
    I8(Cow<'a, [i8]>),
    /// 16-bit unsigned.
    U16(Cow<'a, [u16]>),
    /// 16-bit signed.
    I16(Cow<'a, [i16]>),
    /// 32-bit unsigned.
    U32(Cow<'a, [u32]>),
    /// 32-bit signed.
    I32(Cow<'a, [i32]>),
    /// Single precision.
    F32(Cow<'a, [f32]>),
    /// Double precision.
    F64(Cow<'a, [f64]>),
}

/// Runs `$body` with `$slice` bound to the typed samples of a [`Block`].
#[macro_export]
macro_rules! with_samples {
    ($block:expr, $slice:ident => $body:expr) => {
        match $block {
            $crate::volume::Block::U8($slice) => $body,
            $crate::volume::Block::I8($slice) => $body,
            $crate::volume::Block::U16($slice) => $body,
            $crate::volume::Block::I16($slice) => $body,
            $crate::volume::Block::U32($slice) => $body,
            $crate::volume::Block::I32($slice) => $body,
            $crate::volume::Block::F32($slice) => $body,
            $crate::volume::Block::F64($slice) => $body,
        }
    };
}

/// Scalar types of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum ScalarType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

impl ScalarType {
    /// Every type.
    pub const ALL: [Self; 8] =
        [Self::U8, Self::I8, Self::U16, Self::I16, Self::U32, Self::I32, Self::F32, Self::F64];

    /// Bytes of one sample.
    pub fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Lower-case name, as on the command line: `u8`, `i16`, `f32`.
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// True for whole numbers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// One sample's type, as methods see it.
pub trait Scalar: Copy + PartialOrd + PartialEq + Send + Sync + Default + bytemuck::Pod {
    /// The type's tag.
    const TYPE: ScalarType;
    /// The value; every scalar type fits an f64 exactly.
    fn to_f64(self) -> f64;
    /// The value rounded towards zero and clamped to the type's range; 0 for what is no number,
    /// where the type is whole.
    fn from_f64(value: f64) -> Self;
    /// The value as a label: a whole number from 0 on, and 0 for any other.
    fn to_label(self) -> u32 {
        let value = self.to_f64();
        let whole = value as u32;
        if f64::from(whole) == value { whole } else { 0 }
    }
    /// Wraps samples of this type.
    fn block(samples: Cow<'_, [Self]>) -> Block<'_>;
}

macro_rules! scalars {
    ($($t:ident $tag:ident),*) => {$(
        impl Scalar for $t {
            const TYPE: ScalarType = ScalarType::$tag;
            fn to_f64(self) -> f64 {
                self as f64
            }
            fn from_f64(value: f64) -> Self {
                value as $t
            }
            fn block(samples: Cow<'_, [Self]>) -> Block<'_> {
                Block::$tag(samples)
            }
        }
    )*};
}
scalars!(u8 U8, i8 I8, u16 U16, i16 I16, u32 U32, i32 I32, f32 F32, f64 F64);

impl Block<'_> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        with_samples!(self, s => s.len())
    }

    /// True where there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value of sample `i`.
    pub fn value(&self, i: usize) -> f64 {
        with_samples!(self, s => s[i].to_f64())
    }
}

/// Why a block could not be read.
#[derive(Debug, thiserror::Error)]
pub enum VolumeError {
    /// The file behind the volume could not be read.
    #[error("the volume could not be read: {0}")]
    Read(#[from] std::io::Error),
    /// An axis is longer than integer names of its cells reach.
    #[error(
        "the volume has {samples} samples along an axis; {most} are the most: cut it into parts"
    )]
    TooLong {
        /// Samples along the axis.
        samples: usize,
        /// The most that can be named.
        most: usize,
    },
    /// A surface needs more points than 32-bit indices can name.
    #[error("the surface has more than 4 294 967 295 points; take a part or a coarser volume")]
    TooManyPoints,
    /// The work was interrupted.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A box of samples that is read by the block.
pub trait Volume: Send + Sync {
    /// Samples along x, y, z.
    fn dims(&self) -> [usize; 3];

    /// Where the samples lie in the world.
    fn placement(&self) -> Placement;

    /// Type of the samples.
    fn scalar_type(&self) -> ScalarType;

    /// Samples of `region`, which must lie inside. Borrowed where no copy is needed.
    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError>;

    /// Lower and upper bound of all values in `region`, where that is known without reading it.
    fn bounds(&self, _region: Region) -> Option<[f64; 2]> {
        None
    }

    /// How many samples are not 0, where that is known without reading them.
    fn nonzero(&self) -> Option<u64> {
        None
    }

    /// The samples of a row that are 1, as runs `[start, end)` along x, where a binary volume is kept
    /// so.
    fn runs(&self, _y: usize, _z: usize) -> Option<&[[u32; 2]]> {
        None
    }

    /// True where samples are only 0 and 1: surfaces then run midway between samples.
    fn is_binary(&self) -> bool {
        false
    }

    /// Names and colours of labels, where the source has them.
    fn labels(&self) -> &[Label] {
        &[]
    }

    /// What the surface voxels of a binary volume carry, where they do.
    fn payload(&self) -> Option<&Payload> {
        None
    }
}

/// One entry of a lookup table beside a label volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The sample value.
    pub value: u32,
    /// Its name, may be empty.
    pub name: String,
    /// sRGB with straight alpha.
    pub colour: [u8; 4],
}

impl Label {
    /// A colour for a label without one: hues a golden angle apart.
    pub fn plain_colour(label: u32) -> [u8; 4] {
        let turn = f64::from(label) * 0.381_966_011_250_105;
        let hue = 6.0 * (turn - turn.floor());
        let channel = |shift: f64| {
            let h = (hue + shift) % 6.0;
            let ramp = (h.min(4.0 - h)).clamp(0.0, 1.0);
            (80.0 + 160.0 * ramp) as u8
        };
        [channel(2.0), channel(0.0), channel(4.0), 255]
    }
}

/// A volume whose samples all lie in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct DenseVolume<T> {
    dims: [usize; 3],
    samples: Vec<T>,
    /// Where the samples lie in the world.
    pub placement: Placement,
    /// Samples are only 0 and 1.
    pub binary: bool,
    /// Names and colours of labels.
    pub labels: Vec<Label>,
}

impl<T: Scalar> DenseVolume<T> {
    /// Wraps `samples`, x fastest. `None` where their number is not the product of `dims`.
    pub fn new(dims: [usize; 3], samples: Vec<T>, placement: Placement) -> Option<Self> {
        let count = dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d))?;
        (count == samples.len()).then_some(Self {
            dims,
            samples,
            placement,
            binary: false,
            labels: Vec::new(),
        })
    }

    /// The samples, x fastest.
    pub fn samples(&self) -> &[T] {
        &self.samples
    }

    /// Samples along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }
}

impl<T: Scalar> Volume for DenseVolume<T> {
    fn dims(&self) -> [usize; 3] {
        self.dims
    }

    fn placement(&self) -> Placement {
        self.placement
    }

    fn scalar_type(&self) -> ScalarType {
        T::TYPE
    }

    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError> {
        Ok(T::block(cut(&self.samples, self.dims, region)))
    }

    fn is_binary(&self) -> bool {
        self.binary
    }

    fn labels(&self) -> &[Label] {
        &self.labels
    }
}

/// The samples of `region` out of a full array: borrowed where they lie in one piece.
pub fn cut<T: Copy>(samples: &[T], dims: [usize; 3], region: Region) -> Cow<'_, [T]> {
    let [nx, ny, _] = dims;
    let [w, h, _] = region.dims();
    let at = |x: usize, y: usize, z: usize| (z * ny + y) * nx + x;
    let [x0, y0, z0] = region.start;
    if region.is_empty() {
        return Cow::Borrowed(&[]);
    }
    if w == nx && (h == ny || region.dims()[2] == 1) {
        let first = at(0, y0, z0);
        return Cow::Borrowed(&samples[first..first + region.len()]);
    }
    let mut out = Vec::with_capacity(region.len());
    for z in z0..region.end[2] {
        for y in y0..region.end[1] {
            let first = at(x0, y, z);
            out.extend_from_slice(&samples[first..first + w]);
        }
    }
    Cow::Owned(out)
}

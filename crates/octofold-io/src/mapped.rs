//! Volumes whose samples stay where they lie: in a mapped file or in decompressed memory.
//!
//! [`MappedVolume`] reads a region straight out of [`Bytes`]. Samples that are aligned, of this
//! machine's byte order and in one piece are borrowed; otherwise only the region that was asked
//! for is copied. So a file of any size is streamed by the block with almost no memory: pages of a
//! large file are let go of again and again.

use crate::{At, Bytes, ReadError};
use bytemuck::Pod;
use octofold::volume::{Block, Label, Region, Scalar, ScalarType, VolumeError, cut};
use octofold::{Finding, Placement, Run, Volume, with_samples};
use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes that are read from a file larger than this, before its pages are let go of.
const RESIDENT: usize = 256 << 20;

/// How one sample lies in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// As one of the scalar types of volumes.
    Scalar(ScalarType),
    /// A byte that means 0 where it is 0, else 1: the volume is binary.
    Bool,
    /// 64-bit signed, read as the smallest type that holds all values.
    I64,
    /// 64-bit unsigned, read as the smallest type that holds all values.
    U64,
    /// Half precision, read as single.
    F16,
    /// Three bytes of colour, read as their luminance.
    Rgb,
    /// Three bytes of colour and one of opacity, read as the luminance of the colour.
    Rgba,
}

impl Stored {
    /// Bytes of one sample.
    pub fn size(self) -> usize {
        match self {
            Self::Scalar(scalar) => scalar.size(),
            Self::Bool => 1,
            Self::F16 => 2,
            Self::Rgb => 3,
            Self::Rgba => 4,
            Self::I64 | Self::U64 => 8,
        }
    }

    /// The scalar type that samples are read as; the 64-bit integers need a look at the values.
    fn read_as(self) -> ScalarType {
        match self {
            Self::Scalar(scalar) => scalar,
            Self::Bool | Self::Rgb | Self::Rgba => ScalarType::U8,
            Self::F16 => ScalarType::F32,
            Self::I64 | Self::U64 => ScalarType::F64,
        }
    }
}

/// Where the samples of a volume lie among bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// How one sample lies.
    pub stored: Stored,
    /// Samples are big-endian.
    pub big_endian: bool,
    /// Byte of sample (0, 0, 0).
    pub offset: usize,
    /// Samples along x, y, z.
    pub dims: [usize; 3],
    /// Bytes from one sample to the next along x, y, z.
    pub strides: [usize; 3],
}

impl Layout {
    /// Samples without gaps, x fastest. `None` where their size overflows.
    pub fn packed(
        stored: Stored,
        big_endian: bool,
        offset: usize,
        dims: [usize; 3],
    ) -> Option<Self> {
        let row = stored.size().checked_mul(dims[0])?;
        let slice = row.checked_mul(dims[1])?;
        slice.checked_mul(dims[2])?.checked_add(offset)?;
        Some(Self { stored, big_endian, offset, dims, strides: [stored.size(), row, slice] })
    }

    /// One past the last byte that a sample uses. `None` where there is no sample, or where the
    /// number overflows.
    pub fn end(&self) -> Option<usize> {
        self.dims
            .iter()
            .zip(&self.strides)
            .try_fold(self.offset.checked_add(self.stored.size())?, |end, (&dim, &stride)| {
                end.checked_add(dim.checked_sub(1)?.checked_mul(stride)?)
            })
    }

    /// Samples have no gaps and x is fastest.
    fn is_packed(&self) -> bool {
        Self::packed(self.stored, self.big_endian, self.offset, self.dims)
            .is_some_and(|packed| packed.strides == self.strides)
    }
}

/// A volume over bytes.
pub struct MappedVolume {
    bytes: Bytes,
    /// How many were read since pages were let go of; counted where there are many.
    read: AtomicUsize,
    layout: Layout,
    /// What samples are read as, before scaling.
    base: ScalarType,
    scaling: Option<Scaling>,
    /// Where the samples lie in the world.
    pub placement: Placement,
    /// Names and colours of labels.
    pub labels: Vec<Label>,
}

/// A value is `slope * sample + intercept`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// Factor.
    pub slope: f64,
    /// Value of a sample of 0.
    pub intercept: f64,
}

impl MappedVolume {
    /// A volume over `bytes`, which must hold all samples of `layout`. 64-bit integers are looked
    /// through once, to find the type that holds them all.
    pub fn new(
        format: &'static str,
        bytes: Bytes,
        layout: Layout,
        run: &Run,
    ) -> Result<Self, ReadError> {
        let [x, y, z] = layout.dims;
        let end = layout.end().ok_or_else(|| {
            let fact = if layout.dims.contains(&0) {
                format!("a volume of {x} x {y} x {z} samples holds nothing")
            } else {
                format!("{x} x {y} x {z} samples are more than this machine can address")
            };
            ReadError::malformed(format, At::File, fact)
        })?;
        if bytes.len() < end {
            let fact = format!(
                "{x} x {y} x {z} samples of {} bytes end at byte {end}, but there are {} bytes: \
                 the data is cut off, or the dimensions are wrong",
                layout.stored.size(),
                bytes.len()
            );
            return Err(ReadError::malformed(format, At::Byte(bytes.len() as u64), fact));
        }
        let mut volume = Self {
            bytes,
            read: AtomicUsize::new(0),
            layout,
            base: layout.stored.read_as(),
            scaling: None,
            placement: Placement::default(),
            labels: Vec::new(),
        };
        match layout.stored {
            Stored::I64 => volume.base = volume.fit(run, |v: i64| v.into())?,
            Stored::U64 => volume.base = volume.fit(run, |v: u64| v.into())?,
            Stored::Rgb | Stored::Rgba => {
                let text = "colours were read as their luminance, 0 to 255";
                run.finding(Finding::warning("colour-to-luminance", text));
            }
            _ => {}
        }
        Ok(volume)
    }

    /// The same samples with every value scaled. Values become single precision where that holds
    /// the stored samples exactly, else double.
    #[must_use]
    pub fn scaled(mut self, scaling: Scaling) -> Self {
        self.scaling = Some(scaling);
        self
    }

    /// The smallest of i32, u32 and f64 that holds all 64-bit integers.
    fn fit<T: Pod>(&self, run: &Run, wide: impl Fn(T) -> i128) -> Result<ScalarType, ReadError> {
        const EXACT: i128 = 1 << 53;
        let [nx, ny, nz] = self.layout.dims;
        let (mut low, mut high, mut inexact) = (i128::MAX, i128::MIN, 0u64);
        for z in 0..nz {
            run.check()?;
            run.progress(z as u64, nz as u64);
            for y in 0..ny {
                for &sample in
                    &*self.samples::<T>(Region { start: [0, y, z], end: [nx, y + 1, z + 1] })
                {
                    let value = wide(sample);
                    low = low.min(value);
                    high = high.max(value);
                    inexact += u64::from(value.abs() > EXACT && (value as f64) as i128 != value);
                }
            }
        }
        if inexact > 0 {
            let text = "64-bit samples beyond 2^53 were rounded to double precision";
            run.finding(Finding::warning("rounded-samples", text).of(inexact));
        }
        Ok(if low >= i32::MIN.into() && high <= i32::MAX.into() {
            ScalarType::I32
        } else if low >= 0 && high <= u32::MAX.into() {
            ScalarType::U32
        } else {
            ScalarType::F64
        })
    }

    /// The samples of a region as they are stored, in this machine's byte order.
    fn samples<T: Pod>(&self, region: Region) -> Cow<'_, [T]> {
        let Layout { dims, strides, offset, big_endian, .. } = self.layout;
        let size = size_of::<T>();
        self.let_go(region.len().saturating_mul(size));
        let swap = big_endian != cfg!(target_endian = "big") && align_of::<T>() > 1;
        if !swap && self.layout.is_packed() {
            let all = &self.bytes[offset..offset + strides[2] * dims[2]];
            if let Ok(all) = bytemuck::try_cast_slice(all) {
                return cut(all, dims, region);
            }
        }
        let [width, ..] = region.dims();
        let mut samples = vec![T::zeroed(); region.len()];
        let mut rows = samples.chunks_exact_mut(width.max(1));
        for z in region.start[2]..region.end[2] {
            for y in region.start[1]..region.end[1] {
                let Some(row) = rows.next() else { break };
                let start = offset + region.start[0] * strides[0] + y * strides[1] + z * strides[2];
                if strides[0] == size {
                    bytemuck::cast_slice_mut(row)
                        .copy_from_slice(&self.bytes[start..start + width * size]);
                } else {
                    for (i, sample) in row.iter_mut().enumerate() {
                        let at = start + i * strides[0];
                        bytemuck::bytes_of_mut(sample).copy_from_slice(&self.bytes[at..at + size]);
                    }
                }
            }
        }
        if swap {
            for sample in &mut samples {
                bytemuck::bytes_of_mut(sample).reverse();
            }
        }
        Cow::Owned(samples)
    }

    /// Lets the pages of a large file go from time to time, `more` bytes of which are to be read.
    /// Those that are still in use come back.
    fn let_go(&self, more: usize) {
        if self.bytes.len() <= RESIDENT {
            return;
        }
        if self.read.fetch_add(more, Ordering::Relaxed).saturating_add(more) > RESIDENT {
            self.read.store(more, Ordering::Relaxed);
            self.bytes.release();
        }
    }

    fn scalars<T: Scalar>(&self, region: Region) -> Block<'_> {
        T::block(self.samples(region))
    }

    fn converted<S: Pod, T: Scalar>(
        &self,
        region: Region,
        convert: impl Fn(S) -> T,
    ) -> Block<'static> {
        T::block(self.samples(region).iter().map(|&sample| convert(sample)).collect())
    }

    fn unscaled(&self, region: Region) -> Block<'_> {
        use ScalarType as T;
        match self.layout.stored {
            Stored::Scalar(T::U8) => self.scalars::<u8>(region),
            Stored::Scalar(T::I8) => self.scalars::<i8>(region),
            Stored::Scalar(T::U16) => self.scalars::<u16>(region),
            Stored::Scalar(T::I16) => self.scalars::<i16>(region),
            Stored::Scalar(T::U32) => self.scalars::<u32>(region),
            Stored::Scalar(T::I32) => self.scalars::<i32>(region),
            Stored::Scalar(T::F32) => self.scalars::<f32>(region),
            Stored::Scalar(T::F64) => self.scalars::<f64>(region),
            Stored::Bool => self.converted(region, |b: u8| u8::from(b != 0)),
            Stored::F16 => self.converted(region, single),
            Stored::Rgb => self.converted(region, |[r, g, b]: [u8; 3]| luminance(r, g, b)),
            Stored::Rgba => self.converted(region, |[r, g, b, _]: [u8; 4]| luminance(r, g, b)),
            Stored::I64 => match self.base {
                T::I32 => self.converted(region, |v: i64| v as i32),
                T::U32 => self.converted(region, |v: i64| v as u32),
                _ => self.converted(region, |v: i64| v as f64),
            },
            Stored::U64 => match self.base {
                T::I32 => self.converted(region, |v: u64| v as i32),
                T::U32 => self.converted(region, |v: u64| v as u32),
                _ => self.converted(region, |v: u64| v as f64),
            },
        }
    }
}

impl Volume for MappedVolume {
    fn dims(&self) -> [usize; 3] {
        self.layout.dims
    }

    fn placement(&self) -> Placement {
        self.placement
    }

    fn scalar_type(&self) -> ScalarType {
        match (self.scaling, self.base) {
            (None, base) => base,
            (Some(_), ScalarType::I32 | ScalarType::U32 | ScalarType::F64) => ScalarType::F64,
            (Some(_), _) => ScalarType::F32,
        }
    }

    fn read(&self, region: Region) -> Result<Block<'_>, VolumeError> {
        let block = self.unscaled(region);
        let Some(Scaling { slope, intercept }) = self.scaling else { return Ok(block) };
        Ok(with_samples!(block, samples => {
            let values = samples.iter().map(|&sample| sample.to_f64() * slope + intercept);
            match self.scalar_type() {
                ScalarType::F64 => Block::F64(values.collect()),
                _ => Block::F32(values.map(|value| value as f32).collect()),
            }
        }))
    }

    fn is_binary(&self) -> bool {
        self.layout.stored == Stored::Bool && self.scaling.is_none()
    }

    fn labels(&self) -> &[Label] {
        &self.labels
    }
}

/// Luminance of a colour by the weights of Rec. 709.
fn luminance(r: u8, g: u8, b: u8) -> u8 {
    ((u32::from(r) * 2126 + u32::from(g) * 7152 + u32::from(b) * 722 + 5000) / 10_000) as u8
}

/// The value of the bits of an IEEE half, which every single holds exactly.
fn single(bits: u16) -> f32 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let fraction = f32::from(bits & 0x3ff);
    match (bits >> 10) & 0x1f {
        0 => sign * fraction * 2f32.powi(-24),
        31 if bits & 0x3ff == 0 => sign * f32::INFINITY,
        31 => f32::NAN,
        exponent => sign * (1.0 + fraction / 1024.0) * 2f32.powi(i32::from(exponent) - 15),
    }
}

/// `placement` where it is finite and spans space, else the default and a finding.
pub(crate) fn sound_placement(placement: Placement, run: &Run) -> Placement {
    let finite = placement.axes.iter().flatten().chain(&placement.origin).all(|v| v.is_finite());
    if finite && placement.determinant() != 0.0 && placement.determinant().is_finite() {
        return placement;
    }
    let text = "the placement in the file is not finite or flattens space: samples were placed 1 \
                apart, from the origin";
    run.finding(Finding::warning("placement-ignored", text));
    Placement { unit: placement.unit, ..Placement::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(bytes: Vec<u8>, layout: Layout) -> MappedVolume {
        MappedVolume::new("test", bytes.into(), layout, &Run::default()).unwrap()
    }

    fn all(volume: &MappedVolume) -> Block<'_> {
        volume.read(Region::all(volume.dims())).unwrap()
    }

    #[test]
    fn both_byte_orders_and_any_alignment_read_alike() {
        let values: Vec<f64> = (0..24).map(|i| f64::from(i) * 1.5 - 7.0).collect();
        for shift in 0..3 {
            for big_endian in [false, true] {
                let mut bytes = vec![0; shift];
                for v in &values {
                    bytes.extend(if big_endian { v.to_be_bytes() } else { v.to_le_bytes() });
                }
                let stored = Stored::Scalar(ScalarType::F64);
                let layout = Layout::packed(stored, big_endian, shift, [4, 3, 2]).unwrap();
                let volume = volume(bytes, layout);
                assert_eq!(all(&volume), Block::F64(Cow::Borrowed(&values)));
                let region = Region { start: [1, 1, 0], end: [3, 2, 2] };
                let part = [values[5], values[6], values[17], values[18]];
                assert_eq!(volume.read(region).unwrap(), Block::F64(Cow::Borrowed(&part)));
            }
        }
    }

    #[test]
    fn samples_that_lie_ready_are_borrowed() {
        let layout = Layout::packed(Stored::Scalar(ScalarType::U8), false, 3, [4, 4, 4]).unwrap();
        let volume = volume((0..67).collect(), layout);
        assert!(matches!(all(&volume), Block::U8(Cow::Borrowed(_))));
        let slab = Region { start: [0, 0, 1], end: [4, 4, 3] };
        assert!(matches!(volume.read(slab).unwrap(), Block::U8(Cow::Borrowed(_))));
    }

    #[test]
    fn strides_pick_one_of_interleaved_volumes() {
        let layout = Layout {
            stored: Stored::Scalar(ScalarType::U8),
            big_endian: false,
            offset: 1,
            dims: [2, 2, 2],
            strides: [2, 4, 8],
        };
        let volume = volume((0..16).collect(), layout);
        assert_eq!(all(&volume), Block::U8(vec![1, 3, 5, 7, 9, 11, 13, 15].into()));
    }

    #[test]
    fn wide_integers_take_the_smallest_type_that_holds_them() {
        let read = |values: [i64; 2]| {
            let bytes = bytemuck::cast_slice(&values).to_vec();
            let big = cfg!(target_endian = "big");
            let volume = volume(bytes, Layout::packed(Stored::I64, big, 0, [2, 1, 1]).unwrap());
            with_samples!(all(&volume), s => Scalar::block(Cow::Owned(s.into_owned())))
        };
        assert_eq!(read([-5, 7]), Block::I32(vec![-5, 7].into()));
        assert_eq!(read([0, 4_000_000_000]), Block::U32(vec![0, 4_000_000_000].into()));
        assert_eq!(read([-1, 1 << 40]), Block::F64(vec![-1.0, (1u64 << 40) as f64].into()));
    }

    #[test]
    fn halves_are_exact() {
        let halves = [0u16, 0x8000, 0x3c00, 0xc000, 0x7bff, 0x0001, 0x03ff, 0x0400, 0x7c00, 0x3555];
        let singles = [
            0.0,
            -0.0,
            1.0,
            -2.0,
            65504.0,
            5.960_464_5e-8,
            6.097_555e-5,
            6.103_515_6e-5,
            f32::INFINITY,
            0.333_251_95,
        ];
        for (half, value) in halves.into_iter().zip(singles) {
            assert_eq!(single(half).to_bits(), value.to_bits(), "{half:#x}");
        }
        assert!(single(0x7e00).is_nan());
    }

    #[test]
    fn too_few_bytes_are_refused() {
        let layout = Layout::packed(Stored::Scalar(ScalarType::U16), false, 4, [4, 4, 4]).unwrap();
        let short = MappedVolume::new("test", vec![0; 131].into(), layout, &Run::default());
        assert!(short.err().unwrap().to_string().contains("end at byte 132"));
        assert_eq!(Layout::packed(Stored::I64, false, 0, [usize::MAX, 2, 2]), None);
    }
}

//! The fixed-size header, both versions, both byte orders.

use super::{FORMAT, HEADER_MAX, code, orientation, stored};
use crate::mapped::{Scaling, Stored};
use crate::{At, ReadError};
use octofold::{LengthUnit, Placement, Volume};

/// The version of a header: where its fields lie, and how wide they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    One,
    Two,
}

/// What a header says of the first volume.
pub(super) struct Header {
    pub(super) big_endian: bool,
    /// Samples follow in the same file, not in an `.img` beside it.
    pub(super) single_file: bool,
    pub(super) stored: Stored,
    pub(super) dims: [usize; 3],
    /// Byte of the field of dimensions, for messages.
    pub(super) dims_at: u64,
    /// Volumes along the fourth and further dimensions.
    pub(super) volumes: usize,
    /// Byte of the first sample.
    pub(super) offset: usize,
    pub(super) scaling: Option<Scaling>,
    pub(super) placement: Placement,
}

impl Header {
    /// Version and byte order (true: big-endian), told from size and magic.
    pub(super) fn magic(bytes: &[u8]) -> Option<(Version, bool)> {
        let size: [u8; 4] = bytes.get(..4)?.try_into().ok()?;
        let big_endian = match (u32::from_le_bytes(size), u32::from_be_bytes(size)) {
            (348 | 540, _) => false,
            (_, 348 | 540) => true,
            _ => return None,
        };
        match (bytes.get(4..8)?, bytes.get(344..348)?) {
            (b"n+2\0" | b"ni2\0", _) => Some((Version::Two, big_endian)),
            (_, b"n+1\0" | b"ni1\0") => Some((Version::One, big_endian)),
            _ => None,
        }
    }

    /// Reads the header at the start of `bytes`.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, ReadError> {
        let Some((version, big_endian)) = Self::magic(bytes) else {
            return Err(not_nifti(bytes));
        };
        let size = match version {
            Version::One => 348,
            Version::Two => 540,
        };
        if bytes.len() < size {
            let fact = format!("the header has {} of {size} bytes: it is cut off", bytes.len());
            return Err(ReadError::malformed(FORMAT, At::Byte(bytes.len() as u64), fact));
        }
        let fields = Fields { bytes, big_endian, version };
        let single_file = match version {
            Version::One => bytes[345] == b'+',
            Version::Two => bytes[5] == b'+',
        };
        let dims_at = fields.at(40, 16);
        let (dims, volumes) = fields.dims(dims_at)?;
        let code = fields.u16(fields.at(70, 12));
        let stored = stored(code).map_err(|name| {
            let fact = format!("samples of type {name} (code {code}) are not read");
            ReadError::unsupported(FORMAT, fact)
        })?;
        let offset = fields.offset(single_file, size)?;
        let scaling = fields.scaling();
        let placement = fields.placement();
        let dims_at = dims_at as u64;
        Ok(Self {
            big_endian,
            single_file,
            stored,
            dims,
            dims_at,
            volumes,
            offset,
            scaling,
            placement,
        })
    }
}

/// What bytes without the marks of NIfTI are, as far as one can tell.
fn not_nifti(bytes: &[u8]) -> ReadError {
    let is_analyze = bytes.len() >= 344
        && (bytes.starts_with(&348u32.to_le_bytes()) || bytes.starts_with(&348u32.to_be_bytes()));
    if is_analyze {
        let fact = "the header is of ANALYZE 7.5, which knows no placement: convert it to NIfTI";
        return ReadError::unsupported(FORMAT, fact);
    }
    let fact = "the header is cut off, or this is not NIfTI: size and magic are missing";
    ReadError::malformed(FORMAT, At::Byte(0), fact)
}

/// Fields by their offsets. The length of `bytes` was checked.
struct Fields<'a> {
    bytes: &'a [u8],
    big_endian: bool,
    version: Version,
}

impl Fields<'_> {
    /// The offset in this version.
    fn at(&self, one: usize, two: usize) -> usize {
        match self.version {
            Version::One => one,
            Version::Two => two,
        }
    }

    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut array = [0; N];
        array.copy_from_slice(&self.bytes[at..at + N]);
        if self.big_endian {
            array.reverse();
        }
        array
    }

    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.array(at))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.array(at))
    }

    fn i64(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.array(at))
    }

    /// Element `i` of the field of real numbers that begins at `one` or `two`.
    fn real(&self, one: usize, two: usize, i: usize) -> f64 {
        match self.version {
            Version::One => f32::from_le_bytes(self.array(one + 4 * i)).into(),
            Version::Two => f64::from_le_bytes(self.array(two + 8 * i)),
        }
    }

    /// A code that is 16 bits wide in version 1 and 32 in version 2.
    fn code(&self, one: usize, two: usize) -> i32 {
        match self.version {
            Version::One => i32::from(self.u16(one) as i16),
            Version::Two => self.i32(two),
        }
    }

    fn dims(&self, at: usize) -> Result<([usize; 3], usize), ReadError> {
        let dim = |i: usize| match self.version {
            Version::One => i64::from(self.u16(at + 2 * i) as i16),
            Version::Two => self.i64(at + 8 * i),
        };
        let rank = dim(0);
        let malformed = |fact| ReadError::malformed(FORMAT, At::Byte(at as u64), fact);
        if !(1..=7).contains(&rank) {
            return Err(malformed(format!("the file says it has {rank} dimensions, not 1 to 7")));
        }
        let mut dims = [1; 3];
        for (axis, slot) in dims.iter_mut().enumerate().take(rank as usize) {
            *slot = usize::try_from(dim(axis + 1))
                .ok()
                .filter(|&n| n > 0)
                .ok_or_else(|| malformed(format!("dimension {} is {}", axis + 1, dim(axis + 1))))?;
        }
        let volumes = (4..=rank as usize)
            .map(|i| usize::try_from(dim(i)).unwrap_or(1).max(1))
            .fold(1, usize::saturating_mul);
        Ok((dims, volumes))
    }

    fn offset(&self, single_file: bool, header: usize) -> Result<usize, ReadError> {
        let field = self.at(108, 168);
        let offset = match self.version {
            Version::One => f64::from(f32::from_le_bytes(self.array(field))),
            Version::Two => self.i64(field) as f64,
        };
        // Zero in a single file means that its writer left the field out.
        if single_file && offset == 0.0 {
            return Ok(header + 4);
        }
        let least = if single_file { header as f64 } else { 0.0 };
        if !(least..=(1u64 << 53) as f64).contains(&offset) {
            let fact = format!("samples are said to begin at byte {offset}");
            return Err(ReadError::malformed(FORMAT, At::Byte(field as u64), fact));
        }
        Ok(offset as usize)
    }

    /// A slope of 0 says that there is none.
    fn scaling(&self) -> Option<Scaling> {
        let slope = self.real(112, 176, 0);
        let intercept = self.real(116, 184, 0);
        let useful = slope.is_finite() && slope != 0.0 && intercept.is_finite();
        (useful && (slope, intercept) != (1.0, 0.0)).then_some(Scaling { slope, intercept })
    }

    fn placement(&self) -> Placement {
        let unit = match self.code_byte() & 7 {
            1 => Some(LengthUnit::Metre),
            2 => Some(LengthUnit::Millimetre),
            3 => Some(LengthUnit::Micrometre),
            _ => None,
        };
        if self.code(254, 348) > 0 {
            let row = |r: usize, i: usize| self.real(280 + 16 * r, 400 + 32 * r, i);
            let column = |i| [row(0, i), row(1, i), row(2, i)];
            let sform =
                Placement { axes: [column(0), column(1), column(2)], origin: column(3), unit };
            if sform.determinant().abs() > 0.0 {
                return sform;
            }
        }
        let size = |axis: usize| match self.real(76, 104, axis + 1).abs() {
            size if size > 0.0 => size,
            _ => 1.0,
        };
        if self.code(252, 344) > 0 {
            let qfac = if self.real(76, 104, 0) < 0.0 { -1.0 } else { 1.0 };
            let mut axes = orientation::rotation(std::array::from_fn(|i| self.real(256, 352, i)));
            for (axis, scale) in axes.iter_mut().zip([size(0), size(1), size(2) * qfac]) {
                *axis = axis.map(|v| v * scale);
            }
            return Placement {
                axes,
                origin: std::array::from_fn(|i| self.real(268, 376, i)),
                unit,
            };
        }
        Placement { unit, ..Placement::spacing([size(0), size(1), size(2)]) }
    }

    /// `xyzt_units`: one byte in version 1, four in version 2.
    fn code_byte(&self) -> i32 {
        match self.version {
            Version::One => self.bytes[123].into(),
            Version::Two => self.i32(500),
        }
    }
}

/// The header of a single file, little-endian, with the four bytes that end it.
pub(super) fn encode(volume: &dyn Volume) -> Vec<u8> {
    let dims = volume.dims();
    let version =
        if dims.iter().all(|&n| n <= i16::MAX as usize) { Version::One } else { Version::Two };
    let (placement, unit_code) = in_known_unit(volume.placement());
    let mut header = Encoder { bytes: vec![0; HEADER_MAX], version };
    let scalar = volume.scalar_type();
    let bits = 8 * scalar.size() as u16;
    match version {
        Version::One => {
            header.bytes.truncate(352);
            header.put(0, &348u32.to_le_bytes());
            header.put(344, b"n+1\0");
            header.put(108, &352f32.to_le_bytes());
            header.put(70, &code(scalar).to_le_bytes());
            header.put(72, &bits.to_le_bytes());
            header.put(123, &[unit_code]);
            for (i, n) in [3, dims[0], dims[1], dims[2], 1, 1, 1, 1].into_iter().enumerate() {
                header.put(40 + 2 * i, &(n as i16).to_le_bytes());
            }
        }
        Version::Two => {
            header.put(0, &540u32.to_le_bytes());
            header.put(4, b"n+2\0\r\n\x1a\n");
            header.put(168, &544i64.to_le_bytes());
            header.put(12, &code(scalar).to_le_bytes());
            header.put(14, &bits.to_le_bytes());
            header.put(500, &i32::from(unit_code).to_le_bytes());
            for (i, n) in [3, dims[0], dims[1], dims[2], 1, 1, 1, 1].into_iter().enumerate() {
                header.put(16 + 8 * i, &(n as i64).to_le_bytes());
            }
        }
    }
    header.real(112, 176, 0, 1.0);
    header.code(254, 348, 1);
    for r in 0..3 {
        for c in 0..3 {
            header.real(280 + 16 * r, 400 + 32 * r, c, placement.axes[c][r]);
        }
        header.real(280 + 16 * r, 400 + 32 * r, 3, placement.origin[r]);
    }
    let lengths = placement.axes.map(|axis| glam::DVec3::from(axis).length());
    for (i, length) in lengths.into_iter().enumerate() {
        header.real(76, 104, i + 1, length);
    }
    // Readers that know no sform are served by the qform, where it says the same.
    if let Some(rigid) = orientation::rigid(&placement) {
        header.code(252, 344, 1);
        header.real(76, 104, 0, rigid.qfac);
        for i in 0..3 {
            header.real(256, 352, i, rigid.quaternion[i]);
            header.real(268, 376, i, placement.origin[i]);
        }
    } else {
        header.real(76, 104, 0, 1.0);
    }
    header.bytes
}

/// The placement in a unit that NIfTI has a code for, and the code.
fn in_known_unit(placement: Placement) -> (Placement, u8) {
    let (unit, code) = match placement.unit {
        None => return (placement, 0),
        Some(LengthUnit::Metre) => (LengthUnit::Metre, 1),
        Some(LengthUnit::Micrometre) => (LengthUnit::Micrometre, 3),
        Some(_) => (LengthUnit::Millimetre, 2),
    };
    (in_unit(placement, unit), code)
}

/// The same placement in another unit, where it has one.
fn in_unit(mut placement: Placement, unit: LengthUnit) -> Placement {
    if let Some(old) = placement.unit
        && old != unit
    {
        let scale = old.metres() / unit.metres();
        placement.axes = placement.axes.map(|axis| axis.map(|v| v * scale));
        placement.origin = placement.origin.map(|v| v * scale);
        placement.unit = Some(unit);
    }
    placement
}

struct Encoder {
    bytes: Vec<u8>,
    version: Version,
}

impl Encoder {
    fn put(&mut self, at: usize, field: &[u8]) {
        self.bytes[at..at + field.len()].copy_from_slice(field);
    }

    fn real(&mut self, one: usize, two: usize, i: usize, value: f64) {
        match self.version {
            Version::One => self.put(one + 4 * i, &(value as f32).to_le_bytes()),
            Version::Two => self.put(two + 8 * i, &value.to_le_bytes()),
        }
    }

    fn code(&mut self, one: usize, two: usize, code: i16) {
        match self.version {
            Version::One => self.put(one, &code.to_le_bytes()),
            Version::Two => self.put(two, &i32::from(code).to_le_bytes()),
        }
    }
}

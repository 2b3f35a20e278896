//! The text before the samples.

use super::FORMAT;
use crate::mapped::Stored;
use crate::{At, ReadError};
use octofold::volume::ScalarType;
use octofold::{LengthUnit, Placement};

/// More axes than this are refused, as by the format's own library.
const MAX_RANK: usize = 16;

/// More data files than this are refused.
const MAX_FILES: i64 = 1 << 16;

/// How samples are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Raw,
    Gzip,
    Ascii,
    Hex,
}

impl Encoding {
    /// Numbers are spelled out, so that they come in this machine's byte order.
    pub(super) fn is_text(self) -> bool {
        self == Self::Ascii
    }
}

/// Where the samples lie.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Data {
    /// Behind the header, from this byte on.
    Attached(usize),
    /// In these files, one after the other.
    Files(Vec<String>),
}

/// How to find the first byte of the samples after the skipped lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteSkip {
    /// Skip so many bytes.
    Bytes(usize),
    /// The samples are the last bytes of the file.
    ToEnd,
}

/// What the header says.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) stored: Stored,
    pub(super) big_endian: bool,
    pub(super) encoding: Encoding,
    pub(super) sizes: Vec<usize>,
    pub(super) sizes_line: u64,
    pub(super) data: Data,
    pub(super) line_skip: usize,
    pub(super) byte_skip: ByteSkip,
    pub(super) pairs: Vec<(String, String)>,
    kinds: Vec<String>,
    space: Option<String>,
    directions: Vec<Option<Vec<f64>>>,
    origin: Vec<f64>,
    spacings: Vec<f64>,
    mins: Vec<f64>,
    maxs: Vec<f64>,
    centers: Vec<String>,
    unit: Unit,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Unit {
    /// The header has no field for it.
    Unsaid,
    /// The field says this, or something unknown.
    Said(Option<LengthUnit>),
}

/// The lines of a header, taken apart.
struct Lines {
    /// Name (lower case, without spaces), description and line of each field.
    fields: Vec<(String, String, u64)>,
    pairs: Vec<(String, String)>,
    /// First byte behind the empty line.
    end: Option<usize>,
    /// Lines after `data file: LIST`.
    listed: Vec<String>,
    count: u64,
}

impl Lines {
    fn split(bytes: &[u8]) -> Result<Self, ReadError> {
        if !bytes.starts_with(b"NRRD0") {
            let fact = "the file does not begin with NRRD000 and a version";
            return Err(ReadError::malformed(FORMAT, At::Byte(0), fact));
        }
        let mut lines =
            Self { fields: Vec::new(), pairs: Vec::new(), end: None, listed: Vec::new(), count: 0 };
        let mut start = 0;
        let mut is_list = false;
        while start < bytes.len() {
            let rest = &bytes[start..];
            let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            let line = String::from_utf8_lossy(&rest[..length]);
            let line = line.trim_end_matches('\r');
            start += length + 1;
            lines.count += 1;
            if is_list {
                lines.listed.extend((!line.is_empty()).then(|| line.to_owned()));
            } else if line.is_empty() {
                lines.end = Some(start.min(bytes.len()));
                break;
            } else if lines.count > 1 && !line.starts_with('#') {
                is_list = lines.line(line)?;
            }
        }
        Ok(lines)
    }

    /// Takes one line; true where file names follow.
    fn line(&mut self, line: &str) -> Result<bool, ReadError> {
        let Some((name, value)) = line.split_once(':') else {
            let fact = format!("neither a field nor a key: {:?}", shortened(line));
            return Err(ReadError::malformed(FORMAT, At::Line(self.count), fact));
        };
        if let Some(value) = value.strip_prefix('=') {
            let value = value.replace("\\n", "\n").replace("\\\\", "\\");
            self.pairs.push((name.to_owned(), value));
            return Ok(false);
        }
        let name: String = name.chars().filter(|c| !c.is_whitespace()).collect();
        let name = name.to_ascii_lowercase();
        let value = value.trim();
        let is_list = name == "datafile" && value.split_whitespace().next() == Some("LIST");
        self.fields.push((name, value.to_owned(), self.count));
        Ok(is_list)
    }

    fn get(&self, names: &[&str]) -> Option<(&str, At)> {
        let field = self.fields.iter().find(|(name, ..)| names.contains(&name.as_str()))?;
        Some((&field.1, At::Line(field.2)))
    }

    fn require(&self, name: &str) -> Result<(&str, At), ReadError> {
        self.get(&[name]).ok_or_else(|| {
            let fact = format!("the header has no field {name:?}: it is cut off or damaged");
            ReadError::malformed(FORMAT, At::Line(self.count), fact)
        })
    }

    /// The numbers of a field, none where it is missing.
    fn numbers(&self, names: &[&str]) -> Result<Vec<f64>, ReadError> {
        let Some((text, at)) = self.get(names) else { return Ok(Vec::new()) };
        text.split_whitespace().map(|part| number(part, at)).collect()
    }

    fn words(&self, names: &[&str]) -> Vec<String> {
        let words = self.get(names).map_or("", |(text, _)| text).split_whitespace();
        words.map(str::to_ascii_lowercase).collect()
    }
}

impl Header {
    /// Reads the header at the start of `bytes`.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, ReadError> {
        let lines = Lines::split(bytes)?;
        let (sizes, sizes_line) = sizes(&lines)?;
        let (text, at) = lines.require("type")?;
        let stored = stored(text, at)?;
        let (text, at) = lines.require("encoding")?;
        let encoding = encoding(text, at)?;
        let big_endian = match lines.get(&["endian"]) {
            None => false,
            Some((text, at)) => match text.to_ascii_lowercase().as_str() {
                "big" => true,
                "little" => false,
                _ => {
                    let fact = format!("endian is {text:?}, not big or little");
                    return Err(ReadError::malformed(FORMAT, at, fact));
                }
            },
        };
        if lines.get(&["endian"]).is_none() && stored.size() > 1 && encoding != Encoding::Ascii {
            lines.require("endian")?;
        }
        let unit = match lines.get(&["spaceunits"]) {
            None => Unit::Unsaid,
            Some((text, _)) => Unit::Said(unit(text)),
        };
        let (line_skip, byte_skip) = skips(&lines)?;
        let directions = match lines.get(&["spacedirections"]) {
            None => Vec::new(),
            Some((text, at)) => vectors(text, at)?,
        };
        let origin = match lines.get(&["spaceorigin"]) {
            None => Vec::new(),
            Some((text, at)) => vectors(text, at)?.into_iter().flatten().next().unwrap_or_default(),
        };
        Ok(Self {
            stored,
            big_endian,
            encoding,
            sizes,
            sizes_line,
            data: data(&lines)?,
            line_skip,
            byte_skip,
            kinds: lines.words(&["kinds"]),
            space: lines.get(&["space"]).map(|(text, _)| text.to_ascii_lowercase()),
            directions,
            origin,
            spacings: lines.numbers(&["spacings"])?,
            mins: lines.numbers(&["axismins"])?,
            maxs: lines.numbers(&["axismaxs"])?,
            centers: lines.words(&["centers", "centerings"]),
            unit,
            pairs: lines.pairs,
        })
    }

    /// The axes of space, at most three, in the order of the file.
    pub(super) fn axes(&self) -> Vec<usize> {
        let is_spatial = |axis: &usize| {
            let by_kind = self.kinds.get(*axis).is_none_or(|kind| {
                matches!(kind.as_str(), "domain" | "space" | "none" | "???" | "stub")
            });
            let by_direction = self.directions.get(*axis).is_none_or(Option::is_some);
            by_kind && by_direction
        };
        let spatial: Vec<usize> = (0..self.sizes.len()).filter(is_spatial).take(3).collect();
        if spatial.is_empty() { (0..self.sizes.len().min(3)).collect() } else { spatial }
    }

    /// How colours lie, where the fastest axis is their parts.
    pub(super) fn colour_axis(&self, axes: &[usize]) -> Option<Stored> {
        let kind = self.kinds.first()?;
        let colours = match (kind.as_str(), self.sizes.first()?) {
            ("rgb-color", 3) => Stored::Rgb,
            ("rgba-color", 4) => Stored::Rgba,
            _ => return None,
        };
        let all_used = axes.len() + 1 == self.sizes.len();
        (all_used && !axes.contains(&0)).then_some(colours)
    }

    /// Where the samples along the spatial `axes` lie in the world.
    pub(super) fn placement(&self, axes: &[usize]) -> Placement {
        let space = self.space.as_deref().unwrap_or("").replace("-time", "");
        let (is_patient, signs) = match space.as_str() {
            "right-anterior-superior" | "ras" | "rast" => (true, [1.0, 1.0, 1.0]),
            "left-anterior-superior" | "las" | "last" => (true, [-1.0, 1.0, 1.0]),
            "left-posterior-superior" | "lps" | "lpst" => (true, [-1.0, -1.0, 1.0]),
            _ => (false, [1.0; 3]),
        };
        let unit = match self.unit {
            Unit::Said(unit) => unit,
            Unit::Unsaid => is_patient.then_some(LengthUnit::Millimetre),
        };
        let signed = |vector: &[f64]| -> [f64; 3] {
            std::array::from_fn(|i| match vector.get(i) {
                Some(&v) if v != 0.0 => v * signs[i],
                _ => 0.0,
            })
        };
        let mut placement = Placement { unit, ..Placement::default() };
        let directions: Vec<_> =
            axes.iter().filter_map(|&axis| self.directions.get(axis)?.as_deref()).collect();
        if !directions.is_empty() && directions.len() == axes.len() {
            for (slot, direction) in directions.iter().enumerate() {
                placement.axes[slot] = signed(direction);
            }
            placement.origin = signed(&self.origin);
            complete(&mut placement.axes, directions.len());
            return placement;
        }
        for (slot, &axis) in axes.iter().enumerate() {
            let (step, first) = self.along(axis);
            placement.axes[slot][slot] = step * signs[slot];
            placement.origin[slot] = first * signs[slot];
        }
        placement
    }

    /// Step between samples of an axis without direction, and the position of the first.
    fn along(&self, axis: usize) -> (f64, f64) {
        let finite = |list: &[f64]| list.get(axis).copied().filter(|v| v.is_finite());
        let is_cell = self.centers.get(axis).is_some_and(|center| center == "cell");
        let (min, max) = (finite(&self.mins), finite(&self.maxs));
        let gaps = if is_cell { self.sizes[axis] } else { self.sizes[axis].max(2) - 1 };
        let step = match (finite(&self.spacings), min, max) {
            (Some(step), ..) if step != 0.0 => step,
            (_, Some(min), Some(max)) if max != min => (max - min) / gaps as f64,
            _ => 1.0,
        };
        (step, min.map_or(0.0, |min| if is_cell { min + step / 2.0 } else { min }))
    }
}

/// Gives the missing axes of a slice or a line a direction of length 1 across the others.
fn complete(axes: &mut [[f64; 3]; 3], known: usize) {
    let [x, y, _] = axes.map(glam::DVec3::from);
    if known == 1 {
        axes[1] = x.normalize_or_zero().any_orthogonal_vector().normalize_or_zero().into();
    }
    if known <= 2 {
        let y = if known == 1 { axes[1].into() } else { y };
        axes[2] = x.cross(y).normalize_or_zero().into();
    }
}

fn sizes(lines: &Lines) -> Result<(Vec<usize>, u64), ReadError> {
    let (text, at) = lines.require("dimension")?;
    let rank = text.parse().ok().filter(|rank| (1..=MAX_RANK).contains(rank)).ok_or_else(|| {
        let fact = format!("dimension is {:?}, not 1 to {MAX_RANK}", shortened(text));
        ReadError::malformed(FORMAT, at, fact)
    })?;
    let (text, at) = lines.require("sizes")?;
    let sizes: Vec<usize> = text
        .split_whitespace()
        .map(|part| part.parse().ok().filter(|&size| size > 0))
        .collect::<Option<_>>()
        .filter(|sizes: &Vec<usize>| sizes.len() == rank)
        .ok_or_else(|| {
            let fact = format!("sizes are {:?}, not {rank} counts", shortened(text));
            ReadError::malformed(FORMAT, at, fact)
        })?;
    let line = if let At::Line(line) = at { line } else { 0 };
    Ok((sizes, line))
}

fn skips(lines: &Lines) -> Result<(usize, ByteSkip), ReadError> {
    let count = |name: &'static str| {
        let Some((text, at)) = lines.get(&[name]) else { return Ok(0) };
        text.parse::<i64>().ok().filter(|&n| n >= -1).ok_or_else(|| {
            let fact = format!("{:?} is no number of things to skip", shortened(text));
            ReadError::malformed(FORMAT, at, fact)
        })
    };
    let line_skip = usize::try_from(count("lineskip")?).unwrap_or(0);
    let byte_skip = usize::try_from(count("byteskip")?).map_or(ByteSkip::ToEnd, ByteSkip::Bytes);
    Ok((line_skip, byte_skip))
}

fn data(lines: &Lines) -> Result<Data, ReadError> {
    let Some((text, at)) = lines.get(&["datafile"]) else {
        return lines.end.map(Data::Attached).ok_or_else(|| {
            let fact = "the header is cut off: no empty line ends it";
            ReadError::malformed(FORMAT, At::Line(lines.count), fact)
        });
    };
    let words: Vec<&str> = text.split_whitespace().collect();
    match *words {
        ["LIST", ..] => Ok(Data::Files(lines.listed.clone())),
        [pattern, first, last, step, ..] if pattern.contains('%') => {
            numbered(pattern, [first, last, step], at).map(Data::Files)
        }
        [] => Err(ReadError::malformed(FORMAT, at, "the data file has no name")),
        _ => Ok(Data::Files(vec![text.to_owned()])),
    }
}

/// The names of `pattern` (with `%d`, `%03d`) for the numbers from first to last.
fn numbered(pattern: &str, range: [&str; 3], at: At) -> Result<Vec<String>, ReadError> {
    let malformed = |fact: &str| ReadError::malformed(FORMAT, at, fact);
    let mut ends = [0i64; 3];
    for (end, text) in ends.iter_mut().zip(range) {
        *end = text.parse().map_err(|_| malformed("the numbers of the data files are damaged"))?;
    }
    let [first, last, step] = ends;
    let count = last.checked_sub(first).and_then(|span| span.checked_div(step));
    let count = count
        .filter(|count| (0..MAX_FILES).contains(count))
        .ok_or_else(|| malformed("the numbers of the data files do not go from first to last"))?;
    let damaged = || malformed("the pattern of the data files has no %d");
    let (before, rest) = pattern.split_once('%').ok_or_else(damaged)?;
    let (width, after) = rest.split_once('d').ok_or_else(damaged)?;
    let zeros = width.starts_with('0');
    let width: usize = if width.is_empty() { 0 } else { width.parse().map_err(|_| damaged())? };
    if width > 20 {
        return Err(damaged());
    }
    Ok((0..=count)
        .map(|i| {
            let n = first + i * step;
            if zeros {
                format!("{before}{n:0width$}{after}")
            } else {
                format!("{before}{n:width$}{after}")
            }
        })
        .collect())
}

fn stored(text: &str, at: At) -> Result<Stored, ReadError> {
    use ScalarType as T;
    let name = text.to_ascii_lowercase();
    let plain = name.strip_suffix("_t").unwrap_or(&name);
    let plain = plain.strip_suffix(" int").unwrap_or(plain);
    Ok(match plain {
        "signed char" | "int8" => Stored::Scalar(T::I8),
        "uchar" | "unsigned char" | "uint8" => Stored::Scalar(T::U8),
        "short" | "signed short" | "int16" => Stored::Scalar(T::I16),
        "ushort" | "unsigned short" | "uint16" => Stored::Scalar(T::U16),
        "int" | "signed" | "int32" => Stored::Scalar(T::I32),
        "uint" | "unsigned" | "uint32" => Stored::Scalar(T::U32),
        "longlong" | "long long" | "signed long long" | "int64" => Stored::I64,
        "ulonglong" | "unsigned long long" | "uint64" => Stored::U64,
        "float" => Stored::Scalar(T::F32),
        "double" => Stored::Scalar(T::F64),
        "block" => {
            return Err(ReadError::unsupported(FORMAT, "samples of type block are no numbers"));
        }
        _ => {
            let fact = format!("type {:?} is not known", shortened(text));
            return Err(ReadError::malformed(FORMAT, at, fact));
        }
    })
}

fn encoding(text: &str, at: At) -> Result<Encoding, ReadError> {
    match text.to_ascii_lowercase().as_str() {
        "raw" => Ok(Encoding::Raw),
        "gz" | "gzip" => Ok(Encoding::Gzip),
        "txt" | "text" | "ascii" => Ok(Encoding::Ascii),
        "hex" => Ok(Encoding::Hex),
        "bz2" | "bzip2" => {
            let fact = "bzip2 is not read: save the file with encoding gzip or raw";
            Err(ReadError::unsupported(FORMAT, fact))
        }
        _ => {
            let fact = format!("encoding {:?} is not known", shortened(text));
            Err(ReadError::malformed(FORMAT, at, fact))
        }
    }
}

/// The unit of the first axis of `space units`, a list of quoted names.
fn unit(text: &str) -> Option<LengthUnit> {
    let first = text.split('"').nth(1).or_else(|| text.split_whitespace().next())?;
    match first.trim().to_ascii_lowercase().as_str() {
        "um" | "µm" | "micron" | "microns" | "micrometer" | "micrometre" => {
            Some(LengthUnit::Micrometre)
        }
        "mm" | "millimeter" | "millimetre" => Some(LengthUnit::Millimetre),
        "cm" | "centimeter" | "centimetre" => Some(LengthUnit::Centimetre),
        "m" | "meter" | "metre" => Some(LengthUnit::Metre),
        "in" | "inch" => Some(LengthUnit::Inch),
        "ft" | "foot" => Some(LengthUnit::Foot),
        _ => None,
    }
}

/// A list of vectors `(1,0,0)`, or `none`.
fn vectors(text: &str, at: At) -> Result<Vec<Option<Vec<f64>>>, ReadError> {
    let mut vectors = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            vectors.push(None);
            rest = after.trim_start();
        } else if let Some((inside, after)) =
            rest.strip_prefix('(').and_then(|rest| rest.split_once(')'))
        {
            let parts = inside.split(',').map(|part| number(part.trim(), at));
            vectors.push(Some(parts.collect::<Result<_, _>>()?));
            rest = after.trim_start();
        } else {
            let fact = format!("{:?} is no vector like (1,0,0)", shortened(rest));
            return Err(ReadError::malformed(FORMAT, at, fact));
        }
    }
    Ok(vectors)
}

fn number(text: &str, at: At) -> Result<f64, ReadError> {
    text.parse().map_err(|_| {
        ReadError::malformed(FORMAT, at, format!("{:?} is no number", shortened(text)))
    })
}

/// At most 40 characters, for messages.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

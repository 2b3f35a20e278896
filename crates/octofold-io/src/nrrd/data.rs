//! The samples behind or beside the header, unpacked.

use super::FORMAT;
use super::header::{ByteSkip, Data, Encoding, Header};
use crate::inflate::Gunzip;
use crate::mapped::Stored;
use crate::{At, Bytes, ReadError, Source};
use octofold::volume::ScalarType;
use octofold::{Finding, Run};

/// Samples, and where among the bytes they start.
pub(super) struct Samples {
    pub(super) bytes: Bytes,
    pub(super) offset: usize,
}

/// Finds and unpacks the first `needed` of `total` bytes of samples.
pub(super) fn load(
    header: &Header,
    source: &Source,
    needed: usize,
    total: usize,
    run: &Run,
) -> Result<Samples, ReadError> {
    let names = match &header.data {
        Data::Attached(start) => {
            return unpack(header, &source.bytes, *start, needed, total, run);
        }
        Data::Files(names) => names,
    };
    if let [name] = names.as_slice() {
        let bytes = source.files.open(name)?;
        return unpack(header, &bytes, 0, needed, total, run).map_err(|e| inside(name, e));
    }
    if names.is_empty() || !total.is_multiple_of(names.len()) {
        let fact = format!("{total} bytes do not go evenly into {} data files", names.len());
        return Err(ReadError::malformed(FORMAT, At::File, fact));
    }
    let share = total / names.len();
    let mut all = Vec::new();
    for name in names {
        if all.len() >= needed {
            break;
        }
        run.check()?;
        let bytes = source.files.open(name)?;
        let part = unpack(header, &bytes, 0, share, share, run).map_err(|e| inside(name, e))?;
        let samples = part.bytes.get(part.offset..part.offset + share).ok_or_else(|| {
            let fact = format!("{share} bytes of samples were to be in it");
            inside(name, ReadError::malformed(FORMAT, At::File, fact))
        })?;
        all.extend_from_slice(samples);
    }
    Ok(Samples { bytes: all.into(), offset: 0 })
}

/// The same error, told of a data file.
fn inside(name: &str, error: ReadError) -> ReadError {
    match error {
        ReadError::Cancelled(_) => error,
        _ => ReadError::In { path: name.into(), source: Box::new(error) },
    }
}

fn unpack(
    header: &Header,
    bytes: &Bytes,
    start: usize,
    needed: usize,
    total: usize,
    run: &Run,
) -> Result<Samples, ReadError> {
    let start = start + skip_lines(&bytes[start..], header.line_skip)?;
    let rest = &bytes[start..];
    let cut_off = |fact: String| ReadError::malformed(FORMAT, At::Byte(bytes.len() as u64), fact);
    let skip = match header.byte_skip {
        ByteSkip::Bytes(skip) => skip,
        ByteSkip::ToEnd if header.encoding == Encoding::Raw => {
            rest.len().checked_sub(total).ok_or_else(|| {
                cut_off(format!("the last {total} bytes are wanted of {}", rest.len()))
            })?
        }
        ByteSkip::ToEnd => {
            let fact = "a byte skip of -1 goes with encoding raw only";
            return Err(ReadError::unsupported(FORMAT, fact));
        }
    };
    match header.encoding {
        Encoding::Raw => {
            let offset = start.checked_add(skip).filter(|&at| at <= bytes.len());
            let offset =
                offset.ok_or_else(|| cut_off(format!("{skip} bytes are to be skipped")))?;
            if bytes.len() - offset > total {
                tell_of_more(total, run);
            }
            Ok(Samples { bytes: bytes.clone(), offset })
        }
        Encoding::Gzip => {
            let end = skip.checked_add(needed).ok_or_else(|| {
                cut_off(format!("{skip} bytes are to be skipped before {needed}"))
            })?;
            let out = Gunzip::new(FORMAT, rest).finish(end, needed == total, run)?;
            Ok(Samples { bytes: out.into(), offset: skip })
        }
        Encoding::Ascii => {
            let text = rest.get(skip..).unwrap_or_default();
            let at = bytes.len() - text.len();
            let out = numbers(text, at, header.stored, needed, run)?;
            Ok(Samples { bytes: out.into(), offset: 0 })
        }
        Encoding::Hex => {
            let text = rest.get(skip..).unwrap_or_default();
            let at = bytes.len() - text.len();
            Ok(Samples { bytes: hex(text, at, needed)?.into(), offset: 0 })
        }
    }
}

fn tell_of_more(total: usize, run: &Run) {
    let text = format!("there is more data than the {total} bytes of the header");
    run.finding(Finding::note("trailing-data", text));
}

/// Bytes of the first `count` lines.
fn skip_lines(bytes: &[u8], count: usize) -> Result<usize, ReadError> {
    let mut at = 0;
    for skipped in 0..count {
        let Some(length) = bytes[at..].iter().position(|&b| b == b'\n') else {
            let fact = format!("{count} lines are to be skipped, but there are {skipped}");
            return Err(ReadError::malformed(FORMAT, At::File, fact));
        };
        at += length + 1;
    }
    Ok(at)
}

/// Spelled-out numbers as `needed` bytes of samples in this machine's byte order.
fn numbers(
    text: &[u8],
    at: usize,
    stored: Stored,
    needed: usize,
    run: &Run,
) -> Result<Vec<u8>, ReadError> {
    let size = stored.size();
    let count = needed / size;
    // Every number has a digit, and a gap before the next.
    let most = text.len().div_ceil(2);
    if count > most {
        let fact = format!("{count} numbers are wanted, but the text is at most {most} long");
        return Err(ReadError::malformed(FORMAT, At::Byte((at + text.len()) as u64), fact));
    }
    let mut out = Vec::with_capacity(needed);
    let is_gap = |b: &u8| b.is_ascii_whitespace() || *b == b',';
    let mut position = 0;
    for i in 0..count {
        if i % (1 << 16) == 0 {
            run.check()?;
            run.progress(i as u64, count as u64);
        }
        position += text[position..].iter().take_while(|b| is_gap(b)).count();
        let rest = &text[position..];
        let length = rest.iter().position(is_gap).unwrap_or(rest.len());
        let word = &rest[..length];
        if !std::str::from_utf8(word).is_ok_and(|word| append(word, stored, &mut out)) {
            let at = At::Byte((at + position) as u64);
            let word: String = String::from_utf8_lossy(word).chars().take(40).collect();
            let fact = if word.is_empty() {
                format!("the text ends after {i} of {count} numbers")
            } else {
                format!("number {i} is {word:?}, which its type does not hold")
            };
            return Err(ReadError::malformed(FORMAT, at, fact));
        }
        position += length;
    }
    Ok(out)
}

/// Appends the bytes of one number; false where the word is none of its type.
fn append(word: &str, stored: Stored, out: &mut Vec<u8>) -> bool {
    macro_rules! number {
        ($t:ty) => {
            word.parse::<$t>().map(|value| out.extend(value.to_ne_bytes())).is_ok()
        };
    }
    match stored {
        Stored::Scalar(ScalarType::U8) | Stored::Bool => number!(u8),
        Stored::Scalar(ScalarType::I8) => number!(i8),
        Stored::Scalar(ScalarType::U16) => number!(u16),
        Stored::Scalar(ScalarType::I16) => number!(i16),
        Stored::Scalar(ScalarType::U32) => number!(u32),
        Stored::Scalar(ScalarType::I32) => number!(i32),
        Stored::Scalar(ScalarType::F32) => number!(f32),
        Stored::Scalar(ScalarType::F64) => number!(f64),
        Stored::I64 => number!(i64),
        Stored::U64 => number!(u64),
        Stored::F16 | Stored::Rgb | Stored::Rgba => false,
    }
}

/// Pairs of hexadecimal digits as `needed` bytes.
fn hex(text: &[u8], at: usize, needed: usize) -> Result<Vec<u8>, ReadError> {
    if needed > text.len() / 2 {
        let fact = format!("{needed} bytes are wanted, but there are {} digits", text.len());
        return Err(ReadError::malformed(FORMAT, At::Byte((at + text.len()) as u64), fact));
    }
    let mut out = Vec::with_capacity(needed);
    let mut half = None;
    for (i, &b) in text.iter().enumerate() {
        if out.len() == needed {
            break;
        }
        if b.is_ascii_whitespace() {
            continue;
        }
        let Some(digit) = char::from(b).to_digit(16) else {
            let fact = format!("{:?} is no hexadecimal digit", char::from(b));
            return Err(ReadError::malformed(FORMAT, At::Byte((at + i) as u64), fact));
        };
        match half.take() {
            None => half = Some(digit),
            Some(high) => out.push((high * 16 + digit) as u8),
        }
    }
    if out.len() < needed {
        let fact = format!("the text ends after {} of {needed} bytes", out.len());
        return Err(ReadError::malformed(FORMAT, At::Byte((at + text.len()) as u64), fact));
    }
    Ok(out)
}

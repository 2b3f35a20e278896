//! Object File Format in ASCII, with its prefixes ST, C and N, comments and face colours.
//!
//! After the Geomview manual. The four-dimensional and n-dimensional variants and binary OFF are
//! refused.

use crate::columns::{Column, NO_COLOUR, finish, put, sink_error, tell_dropped};
use crate::text::{Shortest, Words, decoded, leading_number, name, number};
use crate::{At, ReadError, Sink, Source, WriteError, colour};
use octofold::{Finding, Run, Soup, SoupBuilder};

const FORMAT: &str = "off";

/// Points and faces between two looks at the cancel flag.
const BLOCK: u64 = 1 << 16;

/// Reads polygons.
pub fn read(source: &Source, run: &Run) -> Result<Soup, ReadError> {
    let text = decoded(&source.bytes);
    let mut words = Words::new(&text, Some(b'#'));
    let (kind, glued) = header(&mut words)?;
    if words.clone().next_on_line().is_some_and(|w| w.eq_ignore_ascii_case(b"BINARY")) {
        let fact = "binary OFF is not read; save it as ASCII OFF or as binary PLY";
        return Err(ReadError::unsupported(FORMAT, fact));
    }
    let points = glued.map_or_else(|| count(&mut words, "vertices"), Ok)?;
    let faces = count(&mut words, "faces")?;
    // The number of edges is often wrong or missing, and nobody needs it.
    words.next_on_line();
    let mut reader = Reader { kind, builder: SoupBuilder::default(), uvs: None, skipped: 0 };
    for i in 0..points {
        if i.is_multiple_of(BLOCK) {
            run.check()?;
        }
        reader.point(i, points, &mut words)?;
    }
    for i in 0..faces {
        if i.is_multiple_of(BLOCK) {
            run.check()?;
        }
        reader.face(i, faces, &mut words)?;
    }
    reader.finish(&words, run)
}

/// What stands beside the coordinates of a point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Prefixes {
    uvs: bool,
    colours: bool,
    normals: bool,
}

/// The keyword, and the number of vertices where it is glued to it.
fn header(words: &mut Words<'_>) -> Result<(Prefixes, Option<u64>), ReadError> {
    let wrong = |line, word: &[u8]| {
        let fact = format!("'{}' stands where OFF, COFF or NOFF should", name(word));
        ReadError::malformed(FORMAT, At::Line(line), fact)
    };
    let word = words.next().ok_or_else(|| wrong(1, b""))?;
    let end = word.windows(3).position(|w| w == b"OFF").ok_or_else(|| wrong(words.line, word))?;
    let (mut rest, glued) = (&word[..end], &word[end + 3..]);
    let mut kind = Prefixes::default();
    let mut take = |prefix: &[u8]| match rest.strip_prefix(prefix) {
        Some(after) => {
            rest = after;
            true
        }
        None => false,
    };
    kind.uvs = take(b"ST");
    kind.colours = take(b"C");
    kind.normals = take(b"N");
    // Some writers have the last two the other way round.
    kind.colours |= take(b"C");
    if matches!(rest, b"4" | b"n" | b"4n") {
        let fact = "OFF of other than three dimensions is not read; project it to three first";
        return Err(ReadError::unsupported(FORMAT, fact));
    }
    let glued = match glued {
        b"" => None,
        digits => {
            let value = std::str::from_utf8(digits).ok().and_then(|d| d.parse().ok());
            Some(value.ok_or_else(|| wrong(words.line, word))?)
        }
    };
    if rest.is_empty() { Ok((kind, glued)) } else { Err(wrong(words.line, word)) }
}

fn count(words: &mut Words<'_>, what: &str) -> Result<u64, ReadError> {
    let word = words.next().unwrap_or_default();
    std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
        let fact = format!("'{}' is no number of {what}", name(word));
        ReadError::malformed(FORMAT, At::Line(words.line), fact)
    })
}

struct Reader {
    kind: Prefixes,
    builder: SoupBuilder,
    uvs: Option<Vec<[f32; 2]>>,
    skipped: u64,
}

impl Reader {
    fn point(&mut self, i: u64, of: u64, words: &mut Words<'_>) -> Result<(), ReadError> {
        let what = || format!("vertex {} of {of}", i + 1);
        let line = words.line;
        let point = numbers::<3>(words, what)?;
        if !point.iter().all(|x| x.is_finite()) {
            let fact = format!("{} has a coordinate that is not a finite number", what());
            return Err(ReadError::malformed(FORMAT, At::Line(words.line), fact));
        }
        let at = self.builder.points.len();
        let a = &mut self.builder.attributes;
        self.builder.points.push(point);
        if self.kind.normals {
            let normal = numbers::<3>(words, what)?.map(|x| x as f32);
            put(&mut a.point_normals, at, [0.0; 3], normal);
        }
        let left = left_on_line(words);
        let behind = if self.kind.uvs { 2 } else { 0 };
        // Plain files with colours behind the coordinates exist, too, one point a line.
        let coloured = self.kind.colours || words.line > line;
        if coloured && matches!(left.saturating_sub(behind), 3 | 4) {
            let colour = take_colour(words, left - behind);
            put(&mut a.point_colours, at, NO_COLOUR, colour);
        } else if self.kind.colours {
            let fact = format!("{} has no colour of three or four parts", what());
            return Err(ReadError::malformed(FORMAT, At::Line(words.line), fact));
        }
        if self.kind.uvs {
            let uv = numbers::<2>(words, what)?.map(|x| x as f32);
            put(&mut self.uvs, at, [0.0; 2], uv);
        }
        Ok(())
    }

    fn face(&mut self, i: u64, of: u64, words: &mut Words<'_>) -> Result<(), ReadError> {
        let what = || format!("face {} of {of}", i + 1);
        let line = words.line;
        let corners = index(words, what)?;
        if corners > words.left() as u64 {
            let fact = format!("{} has {corners} corners, more than the file can hold", what());
            return Err(ReadError::malformed(FORMAT, At::Line(words.line), fact));
        }
        let points = self.builder.points.len();
        let mut face = Vec::with_capacity(corners as usize);
        for _ in 0..corners {
            let point = index(words, what)?;
            if point >= points as u64 {
                let fact = format!("face {} names vertex {point}, but there are {points}", i + 1);
                return Err(ReadError::malformed(FORMAT, At::Line(words.line), fact));
            }
            face.push(point as u32);
        }
        // What stands behind several faces on one line is the next face, no colour.
        let left = if words.line > line { left_on_line(words) } else { 0 };
        let colour = matches!(left, 3 | 4).then(|| take_colour(words, left));
        if left == 1 {
            // One number is a place in a colour map that only its author has.
            words.next_on_line();
        }
        if face.len() < 3 {
            self.skipped += 1;
            return Ok(());
        }
        let at = self.builder.faces();
        let a = &mut self.builder.attributes;
        if let Some(colour) = colour {
            put(&mut a.face_colours, at, NO_COLOUR, colour);
        }
        if let Some(uvs) = &self.uvs {
            let column = a.corner_uvs.get_or_insert_default();
            column.extend(face.iter().map(|&p| uvs[p as usize]));
        }
        self.builder.face(&face);
        Ok(())
    }

    fn finish(self, words: &Words<'_>, run: &Run) -> Result<Soup, ReadError> {
        if self.skipped > 0 {
            let text = format!("{} faces of fewer than three corners are skipped", self.skipped);
            run.finding(Finding::warning("short-faces", text).of(self.skipped));
        }
        if words.clone().next().is_some() {
            let text = "text behind the last face is skipped";
            run.finding(Finding::note("trailing-bytes", text));
        }
        finish(self.builder, FORMAT)
    }
}

fn left_on_line(words: &Words<'_>) -> usize {
    let mut ahead = words.clone();
    // More than six are no colour, whatever they are.
    (0..7).take_while(|_| ahead.next_on_line().is_some()).count()
}

/// A colour in whole bytes, or in fractions of one where any part has a point.
fn take_colour(words: &mut Words<'_>, count: usize) -> [u8; 4] {
    let mut parts = [b"255".as_slice(); 4];
    for part in &mut parts[..count] {
        *part = words.next_on_line().unwrap_or_default();
    }
    let fractions = parts[..count].iter().any(|w| !w.iter().all(u8::is_ascii_digit));
    let scale = if fractions { 1.0 } else { 255.0 };
    let value = |word| leading_number(word).unwrap_or(f64::NAN) / scale;
    let mut bytes = parts.map(|word| colour::byte(value(word)));
    bytes[count..].fill(255);
    bytes
}

fn numbers<const N: usize>(
    words: &mut Words<'_>,
    what: impl Fn() -> String,
) -> Result<[f64; N], ReadError> {
    let mut values = [0.0; N];
    for value in &mut values {
        let word = words.next().ok_or_else(|| ends(words.line, &what()))?;
        *value = number(word).or_else(|| leading_number(word)).ok_or_else(|| {
            let fact = format!("'{}' in {} is not a number", name(word), what());
            ReadError::malformed(FORMAT, At::Line(words.line), fact)
        })?;
    }
    Ok(values)
}

fn index(words: &mut Words<'_>, what: impl Fn() -> String) -> Result<u64, ReadError> {
    let word = words.next().ok_or_else(|| ends(words.line, &what()))?;
    std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
        let fact = format!("'{}' in {} is no whole number", name(word), what());
        ReadError::malformed(FORMAT, At::Line(words.line), fact)
    })
}

fn ends(line: u64, what: &str) -> ReadError {
    ReadError::malformed(FORMAT, At::Line(line), format!("the file ends in {what}"))
}

/// Writes polygons; point colours and normals become COFF, NOFF or CNOFF.
pub fn write(soup: &Soup, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    use Column::{CornerNormals, CornerUvs, FaceLabels};
    tell_dropped(soup, FORMAT, &[CornerUvs, CornerNormals, FaceLabels], run);
    let a = soup.attributes();
    let paint = crate::parts::palette(a);
    let prefix = |there: bool, name: &'static str| if there { name } else { "" };
    let colours = prefix(a.point_colours.is_some(), "C");
    let normals = prefix(a.point_normals.is_some(), "N");
    let mut text = format!("{colours}{normals}OFF\n{} {} 0\n", soup.points().len(), soup.faces());
    for (i, point) in soup.points().iter().enumerate() {
        let [x, y, z] = point.map(Shortest);
        text += &format!("{x} {y} {z}");
        if let Some(normals) = &a.point_normals {
            let [x, y, z] = normals[i];
            text += &format!(" {x} {y} {z}");
        }
        if let Some(colours) = &a.point_colours {
            let [r, g, b, a] = colours[i];
            text += &format!(" {r} {g} {b} {a}");
        }
        end_line(&mut text, i, sink, run)?;
    }
    for f in 0..soup.faces() {
        let face = soup.face(f);
        text += &face.len().to_string();
        face.iter().for_each(|p| text += &format!(" {p}"));
        let material = paint.as_ref().and_then(|(all, of_face)| all.get(of_face[f] as usize));
        if let Some(material) = material {
            let [r, g, b, a] = material.colour;
            text += &format!(" {r} {g} {b} {a}");
        }
        end_line(&mut text, f, sink, run)?;
    }
    sink.out.write_all(text.as_bytes()).map_err(sink_error)
}

/// Ends line `i`, and now and then hands the text on.
fn end_line(text: &mut String, i: usize, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    text.push('\n');
    if i as u64 % BLOCK == BLOCK - 1 {
        run.check()?;
        sink.out.write_all(text.as_bytes()).map_err(sink_error)?;
        text.clear();
    }
    Ok(())
}

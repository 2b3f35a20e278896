//! Wavefront OBJ, with the colours of its material files.
//!
//! Faces keep their corners, order and duplicates; `o` and `g` become labels, `usemtl` materials,
//! `vt` and `vn` corner columns, and colours behind the coordinates of `v` point colours. Points,
//! lines and free-form geometry are skipped with a finding. After the Wavefront specification
//! (Advanced Visualizer, appendix B1) and what exporters make of it.

mod materials;
mod write;

pub use write::write;

use crate::columns::{NO_COLOUR, finish, put};
use crate::parts::Labels;
use crate::text::{Statements, decoded, leading_number, name, number, split_word, words};
use crate::{At, ReadError, Source, colour};
use materials::Library;
use octofold::{Attributes, Finding, Run, Soup, SoupBuilder};
use rustc_hash::FxHashMap;

const FORMAT: &str = "obj";

/// Statements between two looks at the cancel flag.
const BLOCK: u64 = 1 << 16;

/// Reads polygons.
pub fn read(source: &Source, run: &Run) -> Result<Soup, ReadError> {
    let text = decoded(&source.bytes);
    let mut statements = Statements::new(&text);
    let mut reader = Reader::default();
    let mut count = 0u64;
    while let Some((line, text)) = statements.next() {
        count += 1;
        if count.is_multiple_of(BLOCK) {
            run.check()?;
        }
        reader.statement(line, text)?;
    }
    reader.finish(source, run)
}

/// What the statements so far have said.
#[derive(Default)]
struct Reader {
    builder: SoupBuilder,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// Colours as they stand in the file, per point.
    colours: Option<Vec<[f32; 4]>>,
    /// Part that the next face belongs to.
    part: Option<Vec<u8>>,
    label: Option<u32>,
    labels: Labels,
    /// Place in `used` of the material that the next face is made of.
    material: Option<u32>,
    used: Vec<Vec<u8>>,
    places: FxHashMap<Vec<u8>, u32>,
    libraries: Vec<Vec<u8>>,
    /// The highest point that a face has named before it came, and by which face where.
    ahead: Option<(usize, usize, u64)>,
    corners: Vec<u32>,
    skipped: Skipped,
}

/// Counts of what was passed over.
#[derive(Default)]
struct Skipped {
    points_and_lines: u64,
    unknown: u64,
    short_faces: u64,
    odd_numbers: u64,
    dangling: u64,
}

impl Reader {
    fn statement(&mut self, line: u64, text: &[u8]) -> Result<(), ReadError> {
        let (keyword, rest) = split_word(text);
        match keyword {
            b"v" => self.point(line, rest)?,
            b"vt" => {
                let [u, v] = self.numbers(line, rest, 1)?;
                self.uvs.push([u as f32, v as f32]);
            }
            b"vn" => {
                let n: [f64; 3] = self.numbers(line, rest, 3)?;
                self.normals.push(n.map(|x| x as f32));
            }
            b"f" | b"fo" => self.face(line, rest)?,
            b"o" | b"g" => {
                self.part = Some(rest.trim_ascii().to_vec());
                self.label = None;
            }
            b"usemtl" => {
                let name = rest.trim_ascii();
                let next = self.used.len() as u32;
                let place = *self.places.entry(name.to_vec()).or_insert(next);
                if place == next {
                    self.used.push(name.to_vec());
                }
                self.material = Some(place);
            }
            b"mtllib" => self.libraries.push(rest.trim_ascii().to_vec()),
            b"p" | b"l" => self.skipped.points_and_lines += 1,
            b"" | b"s" | b"vp" => {}
            _ if keyword.starts_with(b"#") => {}
            _ => self.skipped.unknown += 1,
        }
        Ok(())
    }

    fn point(&mut self, line: u64, rest: &[u8]) -> Result<(), ReadError> {
        let mut values = [0.0; 7];
        let mut count = 0;
        for word in words(rest).take_while(|w| !w.starts_with(b"#")).take(7) {
            values[count] = self.number(line, word)?;
            count += 1;
        }
        let at = self.builder.points.len();
        let [x, y, z, r, g, b, a] = values;
        if count < 3 {
            let fact = format!("vertex {} has {count} of 3 coordinates", at + 1);
            return Err(ReadError::malformed(FORMAT, At::Line(line), fact));
        }
        if ![x, y, z].iter().all(|x| x.is_finite()) {
            let fact = format!("vertex {} has a coordinate that is not a finite number", at + 1);
            return Err(ReadError::malformed(FORMAT, At::Line(line), fact));
        }
        self.builder.points.push([x, y, z]);
        // A fourth value alone is the weight of a rational curve's control point.
        if count >= 6 {
            let alpha = if count == 7 { a } else { f64::NAN };
            let colour = [r, g, b, alpha].map(|c| c as f32);
            put(&mut self.colours, at, [f32::NAN; 4], colour);
        }
        Ok(())
    }

    /// At least `least` numbers, the rest zero.
    fn numbers<const N: usize>(
        &mut self,
        line: u64,
        rest: &[u8],
        least: usize,
    ) -> Result<[f64; N], ReadError> {
        let mut values = [0.0; N];
        let mut count = 0;
        for word in words(rest).take(N) {
            values[count] = self.number(line, word)?;
            count += 1;
        }
        if count < least {
            let fact = format!("{count} numbers stand where {least} are needed");
            return Err(ReadError::malformed(FORMAT, At::Line(line), fact));
        }
        Ok(values)
    }

    fn number(&mut self, line: u64, word: &[u8]) -> Result<f64, ReadError> {
        if let Some(x) = number(word) {
            return Ok(x);
        }
        self.skipped.odd_numbers += 1;
        leading_number(word).ok_or_else(|| {
            let fact = format!("'{}' is not a number", name(word));
            ReadError::malformed(FORMAT, At::Line(line), fact)
        })
    }

    fn face(&mut self, line: u64, rest: &[u8]) -> Result<(), ReadError> {
        let first = self.builder.corners.len();
        self.corners.clear();
        let mut uvs = self.builder.attributes.corner_uvs.take();
        let mut normals = self.builder.attributes.corner_normals.take();
        for word in words(rest).take_while(|w| !w.starts_with(b"#")) {
            let at = first + self.corners.len();
            let [point, uv, normal] = self.corner(line, word)?;
            if let Some(uv) = self.own(uv, self.uvs.len()) {
                put(&mut uvs, at, [0.0; 2], self.uvs[uv]);
            }
            if let Some(normal) = self.own(normal, self.normals.len()) {
                put(&mut normals, at, [0.0; 3], self.normals[normal]);
            }
            let Some(point) = point else {
                let fact = format!("'{}' names no vertex", name(word));
                return Err(ReadError::malformed(FORMAT, At::Line(line), fact));
            };
            let point = self.named_point(line, point)?;
            self.corners.push(point);
        }
        let short = self.corners.len() < 3;
        if short {
            self.skipped.short_faces += 1;
            uvs.iter_mut().for_each(|c| c.truncate(first));
            normals.iter_mut().for_each(|c| c.truncate(first));
        }
        self.builder.attributes.corner_uvs = uvs;
        self.builder.attributes.corner_normals = normals;
        if short {
            return Ok(());
        }
        let face = self.builder.faces();
        if self.label.is_none() {
            self.label = self.part.as_deref().map(|part| self.labels.of(&name(part)));
        }
        let a = &mut self.builder.attributes;
        if let Some(label) = self.label {
            put(&mut a.face_labels, face, 0, label);
        }
        if let Some(material) = self.material {
            put(&mut a.face_materials, face, Attributes::NO_MATERIAL, material);
        }
        self.builder.face(&self.corners);
        Ok(())
    }

    /// The three numbers of a corner: `1`, `1/2`, `1//3`, `1/2/3`, and any of them left empty.
    fn corner(&self, line: u64, word: &[u8]) -> Result<[Option<i64>; 3], ReadError> {
        let mut named = [None; 3];
        for (place, part) in word.split(|&b| b == b'/').enumerate() {
            let index = integer(part);
            if place > 2 || (index.is_none() && !part.is_empty()) {
                let fact = format!("'{}' is not a corner of a face", name(word));
                return Err(ReadError::malformed(FORMAT, At::Line(line), fact));
            }
            named[place] = index;
        }
        Ok(named)
    }

    /// Place of a texture coordinate or normal; one that is not there is counted and left out.
    fn own(&mut self, index: Option<i64>, len: usize) -> Option<usize> {
        let place = resolve(index?, len).filter(|&place| place < len);
        self.skipped.dangling += u64::from(place.is_none());
        place
    }

    fn named_point(&mut self, line: u64, index: i64) -> Result<u32, ReadError> {
        let points = self.builder.points.len();
        let face = self.builder.faces();
        match resolve(index, points).filter(|&place| place < u32::MAX as usize) {
            Some(place) => {
                if place >= points && self.ahead.is_none_or(|(highest, ..)| place > highest) {
                    self.ahead = Some((place, face, line));
                }
                Ok(place as u32)
            }
            None => Err(names_missing(line, face, index, points)),
        }
    }

    fn finish(mut self, source: &Source, run: &Run) -> Result<Soup, ReadError> {
        let points = self.builder.points.len();
        if let Some((place, face, line)) = self.ahead.filter(|&(place, ..)| place >= points) {
            return Err(names_missing(line, face, place as i64 + 1, points));
        }
        if points == 0 && self.skipped.unknown > 0 {
            let fact = "it holds no vertex, and lines that are no OBJ statements";
            return Err(ReadError::malformed(FORMAT, At::File, fact));
        }
        self.skipped.tell(run);
        if let Some(colours) = self.colours.take() {
            self.builder.attributes.point_colours = Some(bytes(&colours, points));
        }
        let library = Library::load(&self.libraries, &*source.files, run);
        let attributes = &mut self.builder.attributes;
        attributes.materials = self.used.iter().map(|name| library.material(name)).collect();
        attributes.label_names = self.labels.into_names();
        finish(self.builder, FORMAT)
    }
}

impl Skipped {
    fn tell(&self, run: &Run) {
        let tell = |count: u64, code, what: &str| {
            if count > 0 {
                run.finding(Finding::warning(code, format!("{count} {what}")).of(count));
            }
        };
        tell(self.points_and_lines, "skipped-points-lines", "point or line elements are skipped");
        tell(self.unknown, "skipped-lines", "lines with unknown statements are skipped");
        tell(self.short_faces, "short-faces", "faces of fewer than three corners are skipped");
        tell(self.odd_numbers, "odd-numbers", "numbers are read as far as they go");
        tell(
            self.dangling,
            "dangling-index",
            "corners name a texture coordinate or normal that is not there",
        );
    }
}

fn names_missing(line: u64, face: usize, index: i64, points: usize) -> ReadError {
    let fact = format!("face {} names vertex {index}, but there are {points}", face + 1);
    ReadError::malformed(FORMAT, At::Line(line), fact)
}

/// Place of an index that counts from 1, or back from the end where it is negative.
fn resolve(index: i64, len: usize) -> Option<usize> {
    let place = if index > 0 { index - 1 } else { (len as i64).checked_add(index)? };
    if index == 0 { None } else { usize::try_from(place).ok() }
}

fn integer(digits: &[u8]) -> Option<i64> {
    let (negative, digits) = match digits {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, digits),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0;
    for b in digits {
        if !b.is_ascii_digit() {
            return None;
        }
        value = 10 * value + i64::from(b - b'0');
    }
    Some(if negative { -value } else { value })
}

/// Bytes of point colours: fractions of one, or of 255 where the file has values well above one.
fn bytes(colours: &[[f32; 4]], points: usize) -> Vec<[u8; 4]> {
    let scale = if colours.iter().flatten().any(|&c| c > 2.0) { 255.0 } else { 1.0 };
    let part = |c: f32| colour::byte(f64::from(c) / scale);
    let mut bytes: Vec<_> = colours
        .iter()
        .map(|&[r, g, b, a]| {
            let alpha = if a.is_nan() { 255 } else { part(a) };
            [part(r), part(g), part(b), alpha]
        })
        .collect();
    bytes.resize(points, NO_COLOUR);
    bytes
}

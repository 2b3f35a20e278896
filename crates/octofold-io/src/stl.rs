//! Stereolithography STL, ASCII and binary, told apart by content.
//!
//! STL repeats the position of a point in every triangle; points at the same position (bit for
//! bit, zero without its sign) become one. Binary files may carry 15-bit colours after VisCAM or
//! after Materialise Magics.

use crate::columns::{Column, finish, put, single, sink_error, tell_dropped};
use crate::parts::{Labels, palette};
use crate::text::{Words, decoded, leading_number, name, number};
use crate::{At, ReadError, Sink, Source, WriteError};
use octofold::{Finding, Run, Soup, SoupBuilder};
use rustc_hash::FxHashMap;

const FORMAT: &str = "stl";

/// Bytes before the first triangle of a binary file: a free header and the number of triangles.
const HEAD: usize = 84;

/// Bytes of a binary triangle: normal, three points, and two bytes of anything.
const TRIANGLE: usize = 50;

/// Triangles between two looks at the cancel flag.
const BLOCK: usize = 1 << 16;

/// Reads polygons.
pub fn read(source: &Source, run: &Run) -> Result<Soup, ReadError> {
    let bytes = &source.bytes;
    let promised = bytes.get(80..HEAD).map(|b| u32_at(b, 0) as usize);
    let fits = promised
        .and_then(|n| n.checked_mul(TRIANGLE))
        .is_some_and(|size| size.checked_add(HEAD) == Some(bytes.len()));
    if fits || !is_text(bytes) { read_binary(bytes, run) } else { read_ascii(bytes, run) }
}

/// True for text that begins like an ASCII STL. Binary headers may begin with `solid` too, but
/// then hold zero bytes somewhere in the count and the first coordinates.
fn is_text(bytes: &[u8]) -> bool {
    let text = decoded(&bytes[..bytes.len().min(1024)]).into_owned();
    let start = text.trim_ascii_start();
    let keyword =
        |word: &[u8]| start.len() >= word.len() && start[..word.len()].eq_ignore_ascii_case(word);
    (keyword(b"solid") || keyword(b"facet")) && !text.contains(&0)
}

/// Points by position.
#[derive(Default)]
struct Weld {
    points: Vec<[f64; 3]>,
    places: FxHashMap<[u64; 3], u32>,
}

impl Weld {
    fn place(&mut self, point: [f64; 3]) -> u32 {
        // Adding zero takes the sign off a negative zero.
        *self.places.entry(point.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            self.points.push(point);
            self.points.len() as u32 - 1
        })
    }
}

fn read_binary(bytes: &[u8], run: &Run) -> Result<Soup, ReadError> {
    let Some((head, body)) = bytes.split_at_checked(HEAD) else {
        let fact = format!(
            "{} bytes are neither the head of a binary file nor text that begins with 'solid'",
            bytes.len()
        );
        return Err(ReadError::malformed(FORMAT, At::File, fact));
    };
    let promised = u32_at(head, 80) as usize;
    let (whole, rest) = (body.len() / TRIANGLE, body.len() % TRIANGLE);
    let count = if rest == 0 { whole } else { promised };
    if count > whole {
        let fact = format!(
            "the file ends in triangle {} of {promised}; it is cut off or no STL",
            whole + 1
        );
        return Err(ReadError::malformed(FORMAT, At::Byte(bytes.len() as u64), fact));
    }
    if count != promised {
        let text = format!("the header promises {promised} triangles, but there are {count}");
        run.finding(Finding::warning("wrong-count", text));
    } else if count < whole || rest > 0 {
        let extra = body.len() - count * TRIANGLE;
        let text = format!("{extra} bytes behind the last triangle are skipped");
        run.finding(Finding::note("trailing-bytes", text).of(extra as u64));
    }
    let triangles = &body[..count * TRIANGLE];
    let mut weld = Weld::default();
    let mut builder = SoupBuilder::default();
    for (t, record) in triangles.chunks_exact(TRIANGLE).enumerate() {
        if t.is_multiple_of(BLOCK) {
            run.check()?;
        }
        let corners: [[f64; 3]; 3] = std::array::from_fn(|corner| {
            std::array::from_fn(|axis| f64::from(f32_at(record, 12 + 12 * corner + 4 * axis)))
        });
        if !corners.iter().flatten().all(|x| x.is_finite()) {
            let fact = format!("triangle {} has a coordinate that is not a finite number", t + 1);
            let at = At::Byte((HEAD + t * TRIANGLE) as u64);
            return Err(ReadError::malformed(FORMAT, at, fact));
        }
        builder.face(&corners.map(|p| weld.place(p)));
    }
    builder.points = weld.points;
    builder.attributes.face_colours = colours(&head[..80], triangles);
    finish(builder, FORMAT)
}

/// Colours of the triangles, where the two spare bytes hold them beyond doubt.
///
/// Magics says `COLOR=` in the header and sets the highest bit where the object's colour holds;
/// VisCAM sets it where the triangle's own does. Without that word, any other value in the spare
/// bytes means that they hold something else.
fn colours(head: &[u8], triangles: &[u8]) -> Option<Vec<[u8; 4]>> {
    const OWN: u16 = 0x8000;
    let spare = triangles.chunks_exact(TRIANGLE).map(|r| u16::from_le_bytes([r[48], r[49]]));
    // Five bits to eight, so that all ones stay all ones.
    let part = |value: u16, shift: u32| {
        let five = (value >> shift & 31) as u8;
        five << 3 | five >> 2
    };
    let magics = head.windows(6).position(|w| w == b"COLOR=").map(|at| &head[at + 6..]);
    if let Some([r, g, b, a, ..]) = magics {
        let own = |v| [part(v, 0), part(v, 5), part(v, 10), 255];
        return Some(spare.map(|v| if v & OWN != 0 { [*r, *g, *b, *a] } else { own(v) }).collect());
    }
    let coloured = spare.clone().any(|v| v != 0) && spare.clone().all(|v| v == 0 || v & OWN != 0);
    let own = |v| [part(v, 10), part(v, 5), part(v, 0), 255];
    let plain = octofold::Material::default().colour;
    coloured.then(|| spare.map(|v| if v & OWN != 0 { own(v) } else { plain }).collect())
}

fn read_ascii(bytes: &[u8], run: &Run) -> Result<Soup, ReadError> {
    let text = decoded(bytes);
    let mut words = Words::new(&text, None);
    let mut reader = Ascii::default();
    while let Some(word) = words.next() {
        reader.word(word, &mut words, run)?;
    }
    if reader.open {
        let text = "the last solid has no end; the file may be cut off";
        run.finding(Finding::warning("no-end", text));
    }
    if !reader.corners.is_empty() {
        let fact = format!("the file ends in facet {}", reader.builder.faces() + 1);
        return Err(ReadError::malformed(FORMAT, At::Line(words.line), fact));
    }
    if reader.solids > 1 {
        reader.builder.attributes.label_names = reader.labels.into_names();
    } else {
        reader.builder.attributes.face_labels = None;
    }
    reader.builder.points = reader.weld.points;
    finish(reader.builder, FORMAT)
}

/// State of an ASCII file.
#[derive(Default)]
struct Ascii {
    builder: SoupBuilder,
    weld: Weld,
    corners: Vec<u32>,
    labels: Labels,
    label: u32,
    solids: u32,
    open: bool,
}

impl Ascii {
    fn word(&mut self, word: &[u8], words: &mut Words<'_>, run: &Run) -> Result<(), ReadError> {
        match word.to_ascii_lowercase().as_slice() {
            b"vertex" => {
                let point = self.point(words)?;
                self.corners.push(self.weld.place(point));
            }
            b"endloop" | b"endfacet" => self.close_face(words.line, run)?,
            b"solid" => {
                let name = name(words.rest_of_line());
                self.solids += 1;
                let known = if name.is_empty() { format!("solid {}", self.solids) } else { name };
                self.label = self.labels.of(&known);
                self.open = true;
            }
            b"endsolid" => {
                words.rest_of_line();
                self.open = false;
            }
            // The normal follows from the corners; colours are somebody's extension.
            b"facet" | b"color" => {
                words.rest_of_line();
            }
            b"outer" | b"loop" => {}
            _ => {
                let fact = format!("'{}' is no word of an ASCII STL", name(word));
                return Err(ReadError::malformed(FORMAT, At::Line(words.line), fact));
            }
        }
        Ok(())
    }

    fn point(&self, words: &mut Words<'_>) -> Result<[f64; 3], ReadError> {
        let mut point = [0.0; 3];
        for x in &mut point {
            let value = words.next().and_then(|w| number(w).or_else(|| leading_number(w)));
            *x = value.filter(|x| x.is_finite()).ok_or_else(|| {
                let face = self.builder.faces() + 1;
                let fact = format!("a vertex of facet {face} lacks a finite coordinate");
                ReadError::malformed(FORMAT, At::Line(words.line), fact)
            })?;
        }
        Ok(point)
    }

    fn close_face(&mut self, line: u64, run: &Run) -> Result<(), ReadError> {
        if self.corners.is_empty() {
            return Ok(());
        }
        let face = self.builder.faces();
        if self.corners.len() < 3 {
            let fact = format!("facet {} has {} of 3 vertices", face + 1, self.corners.len());
            return Err(ReadError::malformed(FORMAT, At::Line(line), fact));
        }
        if face.is_multiple_of(BLOCK) {
            run.check()?;
        }
        put(&mut self.builder.attributes.face_labels, face, 0, self.label);
        self.builder.face(&self.corners);
        self.corners.clear();
        Ok(())
    }
}

/// Writes triangles, binary. Face colours go into the spare bytes after Magics, five bits a
/// channel.
pub fn write(soup: &Soup, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    use Column::{CornerNormals, CornerUvs, FaceLabels, PointColours, PointNormals};
    let dropped = [PointColours, PointNormals, CornerUvs, CornerNormals, FaceLabels];
    tell_dropped(soup, FORMAT, &dropped, run);
    let mesh = soup.triangulate();
    let points = single(&mesh.points, FORMAT, run)?;
    let plain = octofold::Material::default().colour;
    let paint = palette(&mesh.attributes).map(|(materials, of_face)| {
        let colour = |m: u32| materials.get(m as usize).map_or(plain, |m| m.colour);
        of_face.into_iter().map(colour).collect::<Vec<_>>()
    });
    let mut head = [b' '; HEAD];
    let title = b"binary STL, written by Octofold";
    head[..title.len()].copy_from_slice(title);
    if paint.is_some() {
        head[40..46].copy_from_slice(b"COLOR=");
        head[46..50].copy_from_slice(&plain);
    }
    let count = u32::try_from(mesh.triangles.len()).map_err(|_| WriteError::Unfit {
        format: FORMAT,
        fact: "more triangles than its 32-bit count can tell".into(),
    })?;
    head[80..].copy_from_slice(&count.to_le_bytes());
    sink.out.write_all(&head).map_err(sink_error)?;
    let mut record = [0; TRIANGLE];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        if t.is_multiple_of(BLOCK) {
            run.check()?;
        }
        let corners = triangle.map(|p| points[p as usize]);
        let floats = std::iter::once(normal(corners)).chain(corners).flatten();
        for (place, x) in record.chunks_exact_mut(4).zip(floats) {
            place.copy_from_slice(&x.to_le_bytes());
        }
        let spare = paint.as_ref().map_or(0, |paint| spare_of(paint[t]));
        record[48..].copy_from_slice(&spare.to_le_bytes());
        sink.out.write_all(&record).map_err(sink_error)?;
    }
    Ok(())
}

/// The 15 bits of a colour after Magics.
fn spare_of([r, g, b, _]: [u8; 4]) -> u16 {
    let five = |c: u8| (u16::from(c) * 31 + 127) / 255;
    five(r) | five(g) << 5 | five(b) << 10
}

/// Unit normal of a triangle; zero where it has none.
fn normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| glam::DVec3::from(p.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().to_array().map(|x| x as f32)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_bits_survive() {
        for v in 0..0x8000u16 {
            let part = |shift: u32| {
                let five = (v >> shift & 31) as u8;
                five << 3 | five >> 2
            };
            assert_eq!(spare_of([part(0), part(5), part(10), 255]), v);
        }
    }
}

//! Polygon File Format PLY: ASCII and both binary encodings.
//!
//! Read are polygons and triangle strips, normals, colours (also of faces), texture coordinates of
//! points and of corners, and face labels. Other properties and elements are skipped with a
//! finding. After Greg Turk's description and what MeshLab, Blender and scanners write.

mod header;
mod values;
mod write;

pub use write::write;

use crate::columns::{NO_COLOUR, finish, put};
use crate::{At, ReadError, Source, colour};
use header::{Element, Header, Property, Scalar};
use octofold::{Attributes, Finding, Material, Run, Soup, SoupBuilder};
use values::Values;

const FORMAT: &str = "ply";

/// Records between two looks at the cancel flag.
const BLOCK: u64 = 1 << 16;

/// Reads polygons.
pub fn read(source: &Source, run: &Run) -> Result<Soup, ReadError> {
    let header = Header::read(&source.bytes)?;
    let mut values = Values::new(&source.bytes, &header);
    let mut reader = Reader::default();
    for element in &header.elements {
        let least = element.least(header.encoding);
        // The last value of an ASCII file needs no space behind it.
        if element.count.checked_mul(least).is_none_or(|size| size > values.left() + 1) {
            let fact = format!(
                "{} records of '{}' are promised, but only {} bytes are left",
                element.count,
                element.name,
                values.left()
            );
            return Err(ReadError::malformed(FORMAT, values.place(), fact));
        }
        let fields: Vec<_> = element.properties.iter().map(|p| Field::of(element, p)).collect();
        reader.tell_skipped(element, &fields, run);
        // Without properties, records are nothing however many there are.
        let records = if fields.is_empty() { 0 } else { element.count };
        for i in 0..records {
            if i.is_multiple_of(BLOCK) {
                run.check()?;
            }
            reader.record(i, element, &fields, &mut values)?;
        }
    }
    reader.finish(&header, source, run)
}

/// What a property is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Field {
    /// Coordinate of a point.
    Position(usize),
    /// Part of a point's normal.
    Normal(usize),
    /// Channel of a point's or face's colour.
    Colour(usize),
    /// Texture coordinate of a point.
    Uv(usize),
    /// Points of a polygon.
    Corners,
    /// Texture coordinates of a polygon's corners.
    CornerUvs,
    /// Number of a face's image.
    Image,
    /// Label of a face.
    Label,
    /// Points of triangle strips, with -1 between them.
    Strips,
    /// Nothing.
    Skipped,
}

impl Field {
    fn of(element: &Element, property: &Property) -> Self {
        let name = property.name.as_str();
        let colour = || {
            Some(match name {
                "red" | "r" | "diffuse_red" => Self::Colour(0),
                "green" | "g" | "diffuse_green" => Self::Colour(1),
                "blue" | "b" | "diffuse_blue" => Self::Colour(2),
                "alpha" | "a" | "diffuse_alpha" => Self::Colour(3),
                _ => return None,
            })
        };
        let field = match (element.name.as_str(), property.list.is_some()) {
            ("vertex", false) => match name {
                "x" => Some(Self::Position(0)),
                "y" => Some(Self::Position(1)),
                "z" => Some(Self::Position(2)),
                "nx" => Some(Self::Normal(0)),
                "ny" => Some(Self::Normal(1)),
                "nz" => Some(Self::Normal(2)),
                "s" | "u" | "texture_u" | "texture_s" => Some(Self::Uv(0)),
                "t" | "v" | "texture_v" | "texture_t" => Some(Self::Uv(1)),
                _ => colour(),
            },
            ("face", true) => match name {
                "vertex_indices" | "vertex_index" => Some(Self::Corners),
                "texcoord" => Some(Self::CornerUvs),
                _ => None,
            },
            ("face", false) => match name {
                "texnumber" => Some(Self::Image),
                "label" => Some(Self::Label),
                _ => colour(),
            },
            ("tristrips", true) => {
                matches!(name, "vertex_indices" | "vertex_index").then_some(Self::Strips)
            }
            _ => None,
        };
        field.unwrap_or(Self::Skipped)
    }
}

/// One record of points or faces.
#[derive(Debug, Clone, Default)]
struct Record {
    position: [f64; 3],
    normal: Option<[f32; 3]>,
    colour: Option<[u8; 4]>,
    uv: Option<[f32; 2]>,
    corners: Vec<u32>,
    corner_uvs: Vec<f32>,
    image: Option<f64>,
    label: Option<f64>,
}

impl Record {
    fn clear(&mut self) {
        let (mut corners, mut corner_uvs) =
            (std::mem::take(&mut self.corners), std::mem::take(&mut self.corner_uvs));
        corners.clear();
        corner_uvs.clear();
        *self = Self { corners, corner_uvs, ..Self::default() };
    }
}

#[derive(Default)]
struct Reader {
    builder: SoupBuilder,
    /// Texture coordinates per point, until they go to the corners.
    uvs: Option<Vec<[f32; 2]>>,
    record: Record,
    short_faces: u64,
}

impl Reader {
    fn tell_skipped(&self, element: &Element, fields: &[Field], run: &Run) {
        if fields.iter().all(|f| *f == Field::Skipped) {
            if element.count > 0 {
                let text = format!("the element '{}' is skipped", element.name);
                run.finding(Finding::note("skipped-element", text).of(element.count));
            }
            return;
        }
        let skipped = element.properties.iter().zip(fields);
        let names: Vec<_> = skipped
            .filter(|(_, field)| **field == Field::Skipped)
            .map(|(property, _)| property.name.as_str())
            .collect();
        if !names.is_empty() {
            let text =
                format!("properties of '{}' are skipped: {}", element.name, names.join(", "));
            run.finding(Finding::note("skipped-properties", text).of(names.len() as u64));
        }
    }

    fn record(
        &mut self,
        i: u64,
        element: &Element,
        fields: &[Field],
        values: &mut Values<'_>,
    ) -> Result<(), ReadError> {
        self.record.clear();
        for (property, &field) in element.properties.iter().zip(fields) {
            match property.list {
                Some(count) => self.list(i, count, property.scalar, field, values)?,
                None => self.value(property.scalar, field, values)?,
            }
        }
        match element.name.as_str() {
            "vertex" => self.point(i, values),
            "face" => self.face(values),
            _ => Ok(()),
        }
    }

    fn value(
        &mut self,
        scalar: Scalar,
        field: Field,
        values: &mut Values<'_>,
    ) -> Result<(), ReadError> {
        let value = values.next(scalar)?;
        let record = &mut self.record;
        match field {
            Field::Position(axis) => record.position[axis] = value,
            Field::Normal(axis) => record.normal.get_or_insert_default()[axis] = value as f32,
            Field::Uv(axis) => record.uv.get_or_insert_default()[axis] = value as f32,
            Field::Colour(channel) => {
                record.colour.get_or_insert([0, 0, 0, 255])[channel] =
                    colour::byte(value / scalar.full());
            }
            Field::Image => record.image = Some(value),
            Field::Label => record.label = Some(value),
            _ => {}
        }
        Ok(())
    }

    fn list(
        &mut self,
        i: u64,
        count: Scalar,
        scalar: Scalar,
        field: Field,
        values: &mut Values<'_>,
    ) -> Result<(), ReadError> {
        let length = values.list(count, scalar)?;
        match field {
            Field::Corners => {
                for _ in 0..length {
                    let value = values.next(scalar)?;
                    let point = self.named(value, || format!("face {}", i + 1), values)?;
                    self.record.corners.push(point);
                }
            }
            Field::CornerUvs => {
                for _ in 0..length {
                    self.record.corner_uvs.push(values.next(scalar)? as f32);
                }
            }
            Field::Strips => self.strips(i, length, scalar, values)?,
            _ => values.skip(length, scalar)?,
        }
        Ok(())
    }

    /// A point that a face names. Where the points come behind the faces, the last check is made
    /// when all is read.
    fn named(
        &self,
        value: f64,
        who: impl Fn() -> String,
        values: &Values<'_>,
    ) -> Result<u32, ReadError> {
        let points = self.builder.points.len();
        let known = if points == 0 { f64::from(u32::MAX) } else { points as f64 };
        if value >= 0.0 && value < known && value.fract() == 0.0 {
            return Ok(value as u32);
        }
        let fact = format!("{} names vertex {value}, but there are {points}", who());
        Err(ReadError::malformed(FORMAT, values.place(), fact))
    }

    /// Triangles of strips: every point from the third on makes one with the two before it, every
    /// other one turned round. Those that name a point twice only lead the strip elsewhere.
    fn strips(
        &mut self,
        i: u64,
        length: usize,
        scalar: Scalar,
        values: &mut Values<'_>,
    ) -> Result<(), ReadError> {
        let mut strip: Vec<u32> = Vec::new();
        for _ in 0..length {
            let value = values.next(scalar)?;
            if value == -1.0 {
                strip.clear();
                continue;
            }
            strip.push(self.named(value, || format!("strip {}", i + 1), values)?);
            if let [.., a, b, c] = strip[..]
                && a != b
                && b != c
                && c != a
            {
                let odd = strip.len().is_multiple_of(2);
                self.builder.face(&if odd { [b, a, c] } else { [a, b, c] });
            }
        }
        Ok(())
    }

    fn point(&mut self, i: u64, values: &Values<'_>) -> Result<(), ReadError> {
        let Record { position, normal, colour, uv, .. } = self.record;
        if !position.iter().all(|x| x.is_finite()) {
            let fact = format!("vertex {i} has a coordinate that is not a finite number");
            return Err(ReadError::malformed(FORMAT, values.place(), fact));
        }
        let at = self.builder.points.len();
        let a = &mut self.builder.attributes;
        self.builder.points.push(position);
        if let Some(normal) = normal {
            put(&mut a.point_normals, at, [0.0; 3], normal);
        }
        if let Some(colour) = colour {
            put(&mut a.point_colours, at, NO_COLOUR, colour);
        }
        if let Some(uv) = uv {
            put(&mut self.uvs, at, [0.0; 2], uv);
        }
        Ok(())
    }

    fn face(&mut self, values: &Values<'_>) -> Result<(), ReadError> {
        let record = &self.record;
        if record.corners.len() < 3 {
            self.short_faces += 1;
            return Ok(());
        }
        let (face, corner) = (self.builder.faces(), self.builder.corners.len());
        let a = &mut self.builder.attributes;
        if let Some(colour) = record.colour {
            put(&mut a.face_colours, face, NO_COLOUR, colour);
        }
        // Other lengths, zero above all, mean a face without texture.
        if record.corner_uvs.len() == 2 * record.corners.len() {
            for (i, uv) in record.corner_uvs.chunks_exact(2).enumerate() {
                put(&mut a.corner_uvs, corner + i, [0.0; 2], [uv[0], uv[1]]);
            }
        }
        if let Some(image) = record.image {
            let none = Attributes::NO_MATERIAL;
            let image = if image >= 0.0 { image as u32 } else { none };
            put(&mut a.face_materials, face, none, image);
        }
        if let Some(label) = record.label {
            if label.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&label) {
                let fact = format!("{label} is no label of a face; labels count from 0");
                return Err(ReadError::malformed(FORMAT, values.place(), fact));
            }
            put(&mut a.face_labels, face, 0, label as u32);
        }
        self.builder.face(&record.corners);
        Ok(())
    }

    fn finish(mut self, header: &Header, source: &Source, run: &Run) -> Result<Soup, ReadError> {
        if self.short_faces > 0 {
            let text =
                format!("{} faces of fewer than three corners are skipped", self.short_faces);
            run.finding(Finding::warning("short-faces", text).of(self.short_faces));
        }
        let (points, faces) = (self.builder.points.len(), self.builder.faces());
        let corners = &self.builder.corners;
        let a = &mut self.builder.attributes;
        if let (Some(uvs), None) = (&self.uvs, &a.corner_uvs) {
            let uv = |&p: &u32| uvs.get(p as usize).copied().unwrap_or_default();
            a.corner_uvs = Some(corners.iter().map(uv).collect());
        }
        a.materials = header.images.iter().map(|image| material(image, source, run)).collect();
        let count = a.materials.len() as u32;
        match &mut a.face_materials {
            Some(of_face) => of_face
                .iter_mut()
                .filter(|m| **m >= count)
                .for_each(|m| *m = Attributes::NO_MATERIAL),
            None if count == 1 => a.face_materials = Some(vec![0; faces]),
            None => {}
        }
        if let Some(&point) = self.builder.corners.iter().find(|&&p| p as usize >= points) {
            let fact = format!("a face names vertex {point}, but there are {points}");
            return Err(ReadError::malformed(FORMAT, At::File, fact));
        }
        finish(self.builder, FORMAT)
    }
}

/// A white material with the image of that name, where it is there.
fn material(image: &str, source: &Source, run: &Run) -> Material {
    let found = source.files.open(image);
    let texture = found.as_ref().ok().and_then(|bytes| colour::texture(bytes));
    if texture.is_none() {
        let fact = found
            .err()
            .map_or_else(|| format!("{image} is neither PNG nor JPEG"), |error| error.to_string());
        let text = format!("the shape is left without its image: {fact}");
        run.finding(Finding::warning("missing-image", text));
    }
    Material { name: image.into(), colour: [255; 4], texture }
}

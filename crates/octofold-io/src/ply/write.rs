//! Writing PLY, binary and little-endian.

use super::FORMAT;
use crate::columns::{Column, sink_error, tell_dropped};
use crate::text::plain;
use crate::{Sink, WriteError, colour};
use octofold::{Attributes, Run, Soup};

/// Records between two looks at the cancel flag.
const BLOCK: usize = 1 << 16;

/// Writes polygons. Coordinates are `float` where that holds all of them exactly, else `double`.
pub fn write(soup: &Soup, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    tell_dropped(soup, FORMAT, &[Column::CornerNormals], run);
    let a = soup.attributes();
    let exact = |p: &[f64; 3]| p.iter().all(|&x| f64::from(x as f32) == x);
    let columns = Columns {
        double: !soup.points().iter().all(exact),
        wide: (0..soup.faces()).any(|f| soup.face(f).len() > 255 / 2),
        // A coloured material without an image is a face colour here.
        face_colours: a.face_colours.clone().or_else(|| {
            let plain = octofold::Material::default().colour;
            let of = |&m: &u32| a.materials.get(m as usize).map_or(plain, |m| m.colour);
            a.face_materials.as_ref().map(|m| m.iter().map(of).collect())
        }),
        images: a.materials.iter().any(|m| m.texture.is_some()) && a.face_materials.is_some(),
    };
    let header = columns.header(soup, sink);
    sink.out.write_all(header.as_bytes()).map_err(sink_error)?;
    let mut record = Vec::new();
    for i in 0..soup.points().len() {
        if i.is_multiple_of(BLOCK) {
            run.check()?;
        }
        record.clear();
        columns.point(soup, i, &mut record);
        sink.out.write_all(&record).map_err(sink_error)?;
    }
    for f in 0..soup.faces() {
        if f.is_multiple_of(BLOCK) {
            run.check()?;
        }
        record.clear();
        columns.face(soup, f, &mut record);
        sink.out.write_all(&record).map_err(sink_error)?;
    }
    Ok(())
}

/// What goes into the file beside positions and polygons.
struct Columns {
    double: bool,
    /// Lists are counted in 32 bits.
    wide: bool,
    face_colours: Option<Vec<[u8; 4]>>,
    images: bool,
}

impl Columns {
    /// The head of the file; images go beside it.
    fn header(&self, soup: &Soup, sink: &mut Sink<'_>) -> String {
        let a = soup.attributes();
        let mut lines = vec!["ply".to_owned(), "format binary_little_endian 1.0".into()];
        if self.images {
            let stem = plain(&sink.stem);
            for (i, material) in a.materials.iter().enumerate() {
                // A material without an image still takes its number.
                let ending = material.texture.as_ref().map_or("png", colour::ending);
                let name = format!("{stem}-{}.{ending}", i + 1);
                lines.push(format!("comment TextureFile {name}"));
                if let Some(texture) = &material.texture {
                    sink.beside(name, texture.bytes.to_vec());
                }
            }
        }
        let real = if self.double { "double" } else { "float" };
        let count = if self.wide { "uint" } else { "uchar" };
        let colour = ["red", "green", "blue", "alpha"];
        let properties = |there: bool, kind: &str, names: &[&str]| {
            let names = if there { names } else { &[] };
            names.iter().map(|name| format!("property {kind} {name}")).collect::<Vec<_>>()
        };
        lines.push(format!("element vertex {}", soup.points().len()));
        lines.extend(properties(true, real, &["x", "y", "z"]));
        lines.extend(properties(a.point_normals.is_some(), "float", &["nx", "ny", "nz"]));
        lines.extend(properties(a.point_colours.is_some(), "uchar", &colour));
        for column in &a.point_columns {
            let name = column.name.to_ascii_lowercase();
            let numbered = (0..column.width).map(|i| format!("property float {name}_{i}"));
            lines.extend(numbered);
        }
        lines.push(format!("element face {}", soup.faces()));
        let index = if i32::try_from(soup.points().len()).is_ok() { "int" } else { "uint" };
        lines.push(format!("property list {count} {index} vertex_indices"));
        lines.extend(properties(self.face_colours.is_some(), "uchar", &colour));
        let uvs = format!("list {count} float");
        lines.extend(properties(a.corner_uvs.is_some(), &uvs, &["texcoord"]));
        lines.extend(properties(self.images, "int", &["texnumber"]));
        lines.extend(properties(a.face_labels.is_some(), "uint", &["label"]));
        lines.push("end_header\n".into());
        lines.join("\n")
    }

    fn point(&self, soup: &Soup, i: usize, record: &mut Vec<u8>) {
        let a = soup.attributes();
        for x in soup.points()[i] {
            if self.double {
                record.extend(x.to_le_bytes());
            } else {
                record.extend((x as f32).to_le_bytes());
            }
        }
        if let Some(normals) = &a.point_normals {
            record.extend(normals[i].iter().flat_map(|x| x.to_le_bytes()));
        }
        if let Some(colours) = &a.point_colours {
            record.extend(colours[i]);
        }
        for column in &a.point_columns {
            let values = &column.values[i * column.width..][..column.width];
            record.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        }
    }

    fn face(&self, soup: &Soup, f: usize, record: &mut Vec<u8>) {
        let a = soup.attributes();
        let (face, first) = (soup.face(f), soup.first_corner(f));
        self.count(face.len(), record);
        record.extend(face.iter().flat_map(|p| p.to_le_bytes()));
        if let Some(colours) = &self.face_colours {
            record.extend(colours[f]);
        }
        if let Some(uvs) = &a.corner_uvs {
            self.count(2 * face.len(), record);
            let uvs = uvs[first..first + face.len()].iter().flatten();
            record.extend(uvs.flat_map(|x| x.to_le_bytes()));
        }
        if self.images {
            let material = a.face_materials.as_ref().map_or(Attributes::NO_MATERIAL, |m| m[f]);
            // No material is -1 in the signed type of the file.
            record.extend(material.to_le_bytes());
        }
        if let Some(labels) = &a.face_labels {
            record.extend(labels[f].to_le_bytes());
        }
    }

    fn count(&self, count: usize, record: &mut Vec<u8>) {
        if self.wide {
            record.extend((count as u32).to_le_bytes());
        } else {
            record.push(count as u8);
        }
    }
}

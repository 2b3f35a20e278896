//! Writing 3MF: one object per label.

use super::FORMAT;
use crate::columns::{Column, sink_error, tell_dropped};
use crate::parts::{Part, parts};
use crate::text::{Shortest, plain};
use crate::{Sink, WriteError};
use octofold::{Attributes, Finding, LengthUnit, Mesh, Run, Soup};
use quick_xml::escape::escape;
use rustc_hash::FxHashMap;
use std::io::{Cursor, Write};
use zip::write::{SimpleFileOptions, ZipWriter};

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;

const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;

/// Resource of all colours; objects count on from it.
const PAINTS: usize = 1;

/// Lines between two looks at the cancel flag.
const BLOCK: usize = 1 << 16;

/// Writes triangles. Coordinates without a unit are taken for millimetres, as the format does.
pub fn write(soup: &Soup, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    use Column::{CornerNormals, CornerUvs, PointColours, PointNormals};
    tell_dropped(soup, FORMAT, &[PointColours, PointNormals, CornerUvs, CornerNormals], run);
    let mesh = soup.triangulate();
    let bytes = package(&mesh, run).map_err(|error| match error {
        Stop::Cancelled(cancelled) => WriteError::Cancelled(cancelled),
        Stop::Io(error) => sink_error(error),
    })?;
    sink.out.write_all(&bytes).map_err(sink_error)
}

/// Why packing stopped.
enum Stop {
    Cancelled(octofold::Cancelled),
    Io(std::io::Error),
}

impl From<octofold::Cancelled> for Stop {
    fn from(cancelled: octofold::Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

impl From<std::io::Error> for Stop {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<zip::result::ZipError> for Stop {
    fn from(error: zip::result::ZipError) -> Self {
        Self::Io(error.into())
    }
}

fn package(mesh: &Mesh, run: &Run) -> Result<Vec<u8>, Stop> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    // The time of writing is left out, so that equal shapes make equal files. The usual
    // effort would make the file a sixth smaller, and take several times as long.
    let options = SimpleFileOptions::default()
        .compression_level(Some(2))
        .large_file(mesh.triangles.len() > 1 << 25);
    for (name, text) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        zip.start_file(name, options)?;
        zip.write_all(text.as_bytes())?;
    }
    zip.start_file("3D/3dmodel.model", options)?;
    let mut out = std::io::BufWriter::with_capacity(1 << 16, &mut zip);
    model(mesh, &mut out, run)?;
    out.flush()?;
    drop(out);
    Ok(zip.finish()?.into_inner())
}

fn model(mesh: &Mesh, out: &mut impl Write, run: &Run) -> Result<(), Stop> {
    let unit = match mesh.unit.unwrap_or(LengthUnit::Millimetre) {
        LengthUnit::Micrometre => "micron",
        LengthUnit::Millimetre => "millimeter",
        LengthUnit::Centimetre => "centimeter",
        LengthUnit::Inch => "inch",
        LengthUnit::Foot => "foot",
        LengthUnit::Metre => "meter",
    };
    let core = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
    let material = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02";
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(out, r#"<model unit="{unit}" xml:lang="en-US" xmlns="{core}" xmlns:m="{material}">"#)?;
    writeln!(out, "<resources>")?;
    let paints = Paints::of(&mesh.attributes);
    paints.write(out)?;
    let parts = parts(&mesh.attributes, mesh.triangles.len());
    let mut places = vec![u32::MAX; mesh.points.len()];
    let mut degenerate = 0;
    let mut items = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        let id = PAINTS + 1 + i;
        let (written, flat) = object(mesh, part, id, &paints, &mut places, out, run)?;
        degenerate += flat;
        items.extend(written.then_some(id));
    }
    if degenerate > 0 {
        let text = format!("{degenerate} triangles on fewer than three points are left out");
        run.finding(Finding::warning("dropped-degenerate", text).of(degenerate));
    }
    writeln!(out, "</resources>\n<build>")?;
    for id in items {
        writeln!(out, r#"<item objectid="{id}"/>"#)?;
    }
    writeln!(out, "</build>\n</model>")?;
    Ok(())
}

/// Writes the faces of a part and the points that they use. Returns whether there were any, and
/// the number of triangles left out because the format forbids them.
fn object(
    mesh: &Mesh,
    part: &Part,
    id: usize,
    paints: &Paints,
    places: &mut [u32],
    out: &mut impl Write,
    run: &Run,
) -> Result<(bool, u64), Stop> {
    let whole = |&&f: &&u32| {
        let [a, b, c] = mesh.triangles[f as usize];
        a != b && b != c && c != a
    };
    let faces: Vec<_> = part.faces.iter().filter(whole).copied().collect();
    let flat = (part.faces.len() - faces.len()) as u64;
    if faces.is_empty() {
        return Ok((false, flat));
    }
    let name = part.name.as_deref().map(plain).unwrap_or_default();
    let name =
        if name.is_empty() { String::new() } else { format!(r#" name="{}""#, escape(&name)) };
    let paint = paints.first(&faces);
    let paint = paint.map(|p| format!(r#" pid="{PAINTS}" pindex="{p}""#)).unwrap_or_default();
    writeln!(out, r#"<object id="{id}" type="model"{name}{paint}><mesh><vertices>"#)?;
    let mut used = Vec::new();
    for &point in faces.iter().flat_map(|&f| &mesh.triangles[f as usize]) {
        if places[point as usize] == u32::MAX {
            places[point as usize] = used.len() as u32;
            used.push(point);
        }
    }
    for (i, &point) in used.iter().enumerate() {
        if i.is_multiple_of(BLOCK) {
            run.check()?;
        }
        let [x, y, z] = mesh.points[point as usize].map(Shortest);
        writeln!(out, r#"<vertex x="{x}" y="{y}" z="{z}"/>"#)?;
    }
    writeln!(out, "</vertices><triangles>")?;
    for (i, &face) in faces.iter().enumerate() {
        if i.is_multiple_of(BLOCK) {
            run.check()?;
        }
        let [a, b, c] = mesh.triangles[face as usize].map(|p| places[p as usize]);
        write!(out, r#"<triangle v1="{a}" v2="{b}" v3="{c}""#)?;
        match paints.of_face(face) {
            Some(p) => writeln!(out, r#" pid="{PAINTS}" p1="{p}"/>"#)?,
            None => writeln!(out, "/>")?,
        }
    }
    writeln!(out, "</triangles></mesh></object>")?;
    used.iter().for_each(|&p| places[p as usize] = u32::MAX);
    Ok((true, flat))
}

/// The one colour resource of the file.
enum Paints {
    None,
    /// Distinct face colours, and each face's place in them.
    Colours(Vec<[u8; 4]>, Vec<u32>),
    /// Names and colours of materials, and each face's place in them.
    Materials(Vec<(String, [u8; 4])>, Vec<u32>),
}

impl Paints {
    fn of(a: &Attributes) -> Self {
        if let Some(colours) = &a.face_colours {
            let mut distinct = Vec::new();
            let mut known = FxHashMap::default();
            let place = |&colour: &[u8; 4]| {
                *known.entry(colour).or_insert_with(|| {
                    distinct.push(colour);
                    distinct.len() as u32 - 1
                })
            };
            let of_face = colours.iter().map(place).collect();
            return Self::Colours(distinct, of_face);
        }
        match &a.face_materials {
            Some(of_face) if !a.materials.is_empty() => {
                let materials = a.materials.iter().map(|m| (m.name.clone(), m.colour)).collect();
                Self::Materials(materials, of_face.clone())
            }
            _ => Self::None,
        }
    }

    fn of_face(&self, face: u32) -> Option<u32> {
        match self {
            Self::None => None,
            Self::Colours(_, of_face) => Some(of_face[face as usize]),
            Self::Materials(materials, of_face) => {
                let place = of_face[face as usize];
                ((place as usize) < materials.len()).then_some(place)
            }
        }
    }

    /// An object's own paint, which it must have where its triangles have; none where one of
    /// them must stay without.
    fn first(&self, faces: &[u32]) -> Option<u32> {
        let mut paints = faces.iter().map(|&f| self.of_face(f));
        let first = paints.next()??;
        paints.all(|p| p.is_some()).then_some(first)
    }

    fn write(&self, out: &mut impl Write) -> std::io::Result<()> {
        match self {
            Self::None => Ok(()),
            Self::Colours(colours, _) => {
                writeln!(out, r#"<m:colorgroup id="{PAINTS}">"#)?;
                for [r, g, b, a] in colours {
                    writeln!(out, r##"<m:color color="#{r:02X}{g:02X}{b:02X}{a:02X}"/>"##)?;
                }
                writeln!(out, "</m:colorgroup>")
            }
            Self::Materials(materials, _) => {
                writeln!(out, r#"<basematerials id="{PAINTS}">"#)?;
                for (i, (name, [r, g, b, a])) in materials.iter().enumerate() {
                    let name = plain(name);
                    let name = if name.is_empty() { format!("material {}", i + 1) } else { name };
                    let name = escape(&name);
                    writeln!(
                        out,
                        r##"<base name="{name}" displaycolor="#{r:02X}{g:02X}{b:02X}{a:02X}"/>"##
                    )?;
                }
                writeln!(out, "</basematerials>")
            }
        }
    }
}

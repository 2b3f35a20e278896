//! One model part of a 3MF package: its objects, colours and build items.

use super::FORMAT;
use crate::text::number;
use crate::{At, ReadError};
use glam::DMat4;
use octofold::{LengthUnit, Material, Run};
use quick_xml::events::{BytesStart, Event};
use rustc_hash::FxHashMap;
use std::borrow::Cow;
use std::io::BufRead;

/// XML events between two looks at the cancel flag.
const BLOCK: u64 = 1 << 16;

/// A colour resource and a place in it.
pub(super) type Paint = (u32, u32);

/// What a build item or component shows, and where.
pub(super) struct Reference {
    /// Part that holds the object, where it is not this one.
    pub(super) path: Option<String>,
    pub(super) object: u32,
    pub(super) transform: DMat4,
}

/// A mesh, or other objects put together.
#[derive(Default)]
pub(super) struct Object {
    pub(super) name: String,
    pub(super) paint: Option<Paint>,
    pub(super) points: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Paint of each triangle that has its own.
    pub(super) paints: FxHashMap<u32, Paint>,
    pub(super) components: Vec<Reference>,
}

/// What a paint's resource holds.
pub(super) enum Group {
    Materials(Vec<Material>),
    Colours(Vec<[u8; 4]>),
}

/// Everything in a part.
#[derive(Default)]
pub(super) struct Model {
    pub(super) unit: Option<LengthUnit>,
    pub(super) objects: FxHashMap<u32, Object>,
    pub(super) groups: FxHashMap<u32, Group>,
    pub(super) items: Vec<Reference>,
    /// Kinds of elements that hold geometry or paint of other sorts, and were passed over.
    pub(super) skipped: Vec<&'static str>,
    object: Option<(u32, Object)>,
    group: Option<(u32, Group)>,
}

/// Extensions that are known, and not read.
const SKIPPED: [&str; 6] = [
    "beamlattice",
    "slicestack",
    "texture2dgroup",
    "compositematerials",
    "multiproperties",
    "booleanshape",
];

impl Model {
    /// Parses the part that is called `part`.
    pub(super) fn read(input: impl BufRead, part: &str, run: &Run) -> Result<Self, ReadError> {
        let mut reader = quick_xml::Reader::from_reader(input);
        let mut buffer = Vec::new();
        let mut model = Self::default();
        let mut count = 0u64;
        loop {
            count += 1;
            if count.is_multiple_of(BLOCK) {
                run.check()?;
            }
            buffer.clear();
            let at = reader.buffer_position();
            let wrong = |fact: String| {
                ReadError::malformed(FORMAT, At::Byte(at), format!("of {part}: {fact}"))
            };
            match reader.read_event_into(&mut buffer).map_err(|e| wrong(e.to_string()))? {
                Event::Start(element) => model.open(&element).map_err(wrong)?,
                Event::Empty(element) => {
                    model.open(&element).map_err(wrong)?;
                    model.close(element.local_name().into_inner());
                }
                Event::End(element) => model.close(element.local_name().into_inner()),
                Event::Eof => break,
                _ => {}
            }
        }
        if model.object.is_some() {
            let at = At::Byte(reader.buffer_position());
            return Err(ReadError::malformed(FORMAT, at, format!("{part} ends in an object")));
        }
        Ok(model)
    }

    fn open(&mut self, element: &BytesStart<'_>) -> Result<(), String> {
        match element.local_name().into_inner() {
            "vertex" => {
                let point = Attributes::of(element).numbers(["x", "y", "z"])?;
                if !point.iter().all(|x| x.is_finite()) {
                    return Err("a vertex has a coordinate that is not a finite number".into());
                }
                if let Some((_, object)) = &mut self.object {
                    object.points.push(point);
                }
            }
            "triangle" => self.triangle(&Attributes::of(element))?,
            "model" => {
                self.unit = match Attributes::of(element).get("unit").as_deref() {
                    Some("micron") => Some(LengthUnit::Micrometre),
                    Some("centimeter") => Some(LengthUnit::Centimetre),
                    Some("inch") => Some(LengthUnit::Inch),
                    Some("foot") => Some(LengthUnit::Foot),
                    Some("meter") => Some(LengthUnit::Metre),
                    None | Some("millimeter") => Some(LengthUnit::Millimetre),
                    Some(other) => return Err(format!("'{other}' is no unit of length")),
                };
            }
            "object" => {
                let attributes = Attributes::of(element);
                let name = attributes.get("name").unwrap_or_default().into_owned();
                let pindex = attributes.index("pindex")?.unwrap_or(0);
                let paint = attributes.index("pid")?.map(|pid| (pid, pindex));
                let id = attributes.index("id")?.ok_or("an object has no id")?;
                self.object = Some((id, Object { name, paint, ..Object::default() }));
            }
            "component" => {
                let reference = reference(&Attributes::of(element))?;
                if let Some((_, object)) = &mut self.object {
                    object.components.push(reference);
                }
            }
            "item" => self.items.push(reference(&Attributes::of(element))?),
            "basematerials" => self.open_group(element, Group::Materials(Vec::new()))?,
            "colorgroup" => self.open_group(element, Group::Colours(Vec::new()))?,
            "base" => {
                if let Some((_, Group::Materials(materials))) = &mut self.group {
                    let attributes = Attributes::of(element);
                    let name = attributes.get("name").unwrap_or_default().into_owned();
                    let colour = colour(attributes.get("displaycolor").as_deref())?;
                    materials.push(Material { name, colour, texture: None });
                }
            }
            "color" => {
                if let Some((_, Group::Colours(colours))) = &mut self.group {
                    colours.push(colour(Attributes::of(element).get("color").as_deref())?);
                }
            }
            name => {
                let known = SKIPPED.into_iter().find(|&skipped| skipped == name);
                if let Some(known) = known.filter(|k| !self.skipped.contains(k)) {
                    self.skipped.push(known);
                }
            }
        }
        Ok(())
    }

    fn open_group(&mut self, element: &BytesStart<'_>, group: Group) -> Result<(), String> {
        let id = Attributes::of(element).index("id")?.ok_or("a group of colours has no id")?;
        self.group = Some((id, group));
        Ok(())
    }

    fn close(&mut self, name: &str) {
        match name {
            "object" => self.objects.extend(self.object.take()),
            "basematerials" | "colorgroup" => self.groups.extend(self.group.take()),
            _ => {}
        }
    }

    fn triangle(&mut self, attributes: &Attributes<'_>) -> Result<(), String> {
        let Some((_, object)) = &mut self.object else { return Ok(()) };
        let face = object.triangles.len();
        let mut corners = [0; 3];
        for (corner, name) in corners.iter_mut().zip(["v1", "v2", "v3"]) {
            *corner =
                attributes.index(name)?.ok_or_else(|| format!("triangle {face} has no {name}"))?;
            let points = object.points.len();
            if *corner as usize >= points {
                return Err(format!(
                    "triangle {face} names vertex {corner}, but there are {points}"
                ));
            }
        }
        object.triangles.push(corners);
        if let Some(index) = attributes.index("p1")? {
            let group = attributes.index("pid")?.or(object.paint.map(|(group, _)| group));
            object.paints.extend(group.map(|group| (face as u32, (group, index))));
        }
        Ok(())
    }
}

/// The attributes of an element by local name; prefixes are dropped, since no two attributes that
/// matter share a local name.
struct Attributes<'a>(Vec<(&'a str, Cow<'a, str>)>);

impl<'a> Attributes<'a> {
    fn of(element: &'a BytesStart<'_>) -> Self {
        let mut attributes = element.attributes();
        let pairs = attributes.with_checks(false).flatten();
        Self(pairs.map(|a| (a.key.local_name().into_inner(), a.value)).collect())
    }

    fn raw(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(key, _)| *key == name).map(|(_, value)| value.as_ref())
    }

    /// A value with its escapes resolved, where they can be.
    fn get(&self, name: &str) -> Option<Cow<'_, str>> {
        self.raw(name).map(|raw| quick_xml::escape::unescape(raw).unwrap_or(Cow::Borrowed(raw)))
    }

    fn index(&self, name: &str) -> Result<Option<u32>, String> {
        let Some(text) = self.raw(name) else { return Ok(None) };
        let value = text.trim().parse().map_err(|_| format!("{name}='{text}' is no index"))?;
        Ok(Some(value))
    }

    fn numbers<const N: usize>(&self, names: [&str; N]) -> Result<[f64; N], String> {
        let mut values = [0.0; N];
        for (value, name) in values.iter_mut().zip(names) {
            let text = self.raw(name).unwrap_or_default();
            *value = number(text.trim().as_bytes())
                .ok_or_else(|| format!("{name}='{text}' is not a number"))?;
        }
        Ok(values)
    }
}

fn reference(attributes: &Attributes<'_>) -> Result<Reference, String> {
    let object = attributes.index("objectid")?.ok_or("a component or item names no object")?;
    let path = attributes.get("path").map(Cow::into_owned);
    let transform = attributes.raw("transform").map_or(Ok(DMat4::IDENTITY), transform)?;
    Ok(Reference { path, object, transform })
}

/// Twelve numbers: the rows of a matrix that row vectors are multiplied by, without its last column.
fn transform(text: &str) -> Result<DMat4, String> {
    let mut values = [0.0; 12];
    let mut count = 0;
    for word in text.split_ascii_whitespace() {
        let value = number(word.as_bytes()).filter(|x| x.is_finite());
        let (Some(place), Some(value)) = (values.get_mut(count), value) else {
            return Err(format!("'{text}' is no transform"));
        };
        *place = value;
        count += 1;
    }
    if count != 12 {
        return Err(format!("'{text}' is no transform"));
    }
    let column = |i: usize, last: f64| {
        glam::DVec4::new(values[3 * i], values[3 * i + 1], values[3 * i + 2], last)
    };
    Ok(DMat4::from_cols(column(0, 0.0), column(1, 0.0), column(2, 0.0), column(3, 1.0)))
}

/// A colour `#RRGGBB` or `#RRGGBBAA`. No alpha at all is a slip of some exporters, since nothing
/// that is printed is invisible.
fn colour(text: Option<&str>) -> Result<[u8; 4], String> {
    let text = text.unwrap_or_default().trim();
    let digits = text.strip_prefix('#').filter(|d| matches!(d.len(), 6 | 8));
    let value = digits.and_then(|d| {
        let value = u32::from_str_radix(d, 16).ok()?;
        Some(if d.len() == 6 { value << 8 | 255 } else { value })
    });
    let [r, g, b, a] = value.ok_or_else(|| format!("'{text}' is no colour"))?.to_be_bytes();
    Ok([r, g, b, if a == 0 { 255 } else { a }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_are_for_row_vectors() {
        let matrix =
            transform("0 1 0 -1 0 0 0 0 1 10 20 30").map(|m| m.transform_point3(glam::DVec3::X));
        assert_eq!(matrix, Ok(glam::DVec3::new(10.0, 21.0, 30.0)));
        assert!(transform("1 0 0").is_err());
        assert!(transform("1 0 0 0 1 0 0 0 1 0 0 0 0").is_err());
    }

    #[test]
    fn colours_are_six_or_eight_digits() {
        assert_eq!(colour(Some("#010203")), Ok([1, 2, 3, 255]));
        assert_eq!(colour(Some("#01020380")), Ok([1, 2, 3, 128]));
        assert!(colour(Some("#0102")).is_err());
        assert!(colour(None).is_err());
    }
}

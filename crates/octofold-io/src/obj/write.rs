//! Writing OBJ, with its materials and their images beside it.

use super::FORMAT;
use crate::columns::{Column, sink_error, tell_dropped};
use crate::parts::{LabelNames, palette};
use crate::text::{Shortest, plain};
use crate::{Sink, WriteError, colour};
use octofold::{Finding, Material, Run, Soup};
use rustc_hash::FxHashMap;
use std::fmt::Write;
use std::hash::Hash;

/// Faces between two looks at the cancel flag.
const BLOCK: usize = 1 << 16;

/// Writes polygons. Labels become groups, and face colours and materials an `.mtl` file beside.
pub fn write(soup: &Soup, sink: &mut Sink<'_>, run: &Run) -> Result<(), WriteError> {
    let a = soup.attributes();
    if a.corner_normals.is_some() {
        tell_dropped(soup, FORMAT, &[Column::PointNormals], run);
    }
    let paint = palette(a).map(|(materials, of_face)| (named(&materials), materials, of_face));
    let mut text = String::new();
    lines(soup, sink, paint.as_ref(), &mut text, run)?;
    sink.out.write_all(text.as_bytes()).map_err(sink_error)?;
    if let Some((names, materials, _)) = &paint {
        write_materials(sink, names, materials);
    }
    Ok(())
}

type Paint = (Vec<String>, Vec<Material>, Vec<u32>);

/// All statements into `text`, which is emptied into the sink whenever it has grown long.
fn lines(
    soup: &Soup,
    sink: &mut Sink<'_>,
    paint: Option<&Paint>,
    text: &mut String,
    run: &Run,
) -> Result<(), WriteError> {
    let a = soup.attributes();
    if paint.is_some() {
        line(text, format_args!("mtllib {}.mtl", plain(&sink.stem)));
    }
    if a.point_colours.iter().flatten().any(|c| c[3] != 255) {
        let text = "obj has no transparent point colours; they become opaque";
        run.finding(Finding::warning("dropped-alpha", text));
    }
    for (i, [x, y, z]) in soup.points().iter().map(|p| p.map(Shortest)).enumerate() {
        match &a.point_colours {
            Some(colours) => {
                let [r, g, b, _] = colours[i].map(|c| f64::from(c) / 255.0);
                line(text, format_args!("v {x} {y} {z} {r:.4} {g:.4} {b:.4}"));
            }
            None => line(text, format_args!("v {x} {y} {z}")),
        }
        drain(text, sink)?;
    }
    let uvs = a.corner_uvs.as_deref().map(|c| distinct(c, |uv| uv.map(f32::to_bits)));
    for [u, v] in uvs.iter().flat_map(|(values, _)| values) {
        line(text, format_args!("vt {u} {v}"));
        drain(text, sink)?;
    }
    let normals = match (&a.corner_normals, &a.point_normals) {
        (Some(corners), _) => Some(distinct(corners, |n| n.map(f32::to_bits))),
        (None, Some(points)) => Some((points.clone(), soup.corners().to_vec())),
        (None, None) => None,
    };
    for [x, y, z] in normals.iter().flat_map(|(values, _)| values) {
        line(text, format_args!("vn {x} {y} {z}"));
        drain(text, sink)?;
    }
    let labels = LabelNames::new(a);
    let (mut label, mut material) = (None, None);
    for f in 0..soup.faces() {
        if f.is_multiple_of(BLOCK) {
            run.check()?;
        }
        let own = a.face_labels.as_ref().map(|labels| labels[f]);
        if own != label {
            let name = own.map(|l| labels.of(l)).unwrap_or_default();
            line(text, format_args!("g {}", plain(&name)));
            label = own;
        }
        let own = paint.map(|(_, _, of_face)| of_face[f]);
        if own != material {
            let named = paint.zip(own).and_then(|((names, ..), m)| names.get(m as usize));
            line(text, format_args!("usemtl {}", named.map_or(UNPAINTED, String::as_str)));
            material = own;
        }
        text.push('f');
        for (i, point) in soup.face(f).iter().enumerate() {
            let corner = soup.first_corner(f) + i;
            let uv = uvs.as_ref().map(|(_, places)| places[corner] + 1);
            let normal = normals.as_ref().map(|(_, places)| places[corner] + 1);
            // Writing to a string cannot fail.
            let _ = match (uv, normal) {
                (None, None) => write!(text, " {}", point + 1),
                (Some(uv), None) => write!(text, " {}/{uv}", point + 1),
                (None, Some(normal)) => write!(text, " {}//{normal}", point + 1),
                (Some(uv), Some(normal)) => write!(text, " {}/{uv}/{normal}", point + 1),
            };
        }
        text.push('\n');
        drain(text, sink)?;
    }
    Ok(())
}

/// Material name of faces that have none, where others have one.
const UNPAINTED: &str = "unpainted";

fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = text.write_fmt(arguments);
    text.push('\n');
}

fn drain(text: &mut String, sink: &mut Sink<'_>) -> Result<(), WriteError> {
    if text.len() >= 1 << 20 {
        sink.out.write_all(text.as_bytes()).map_err(sink_error)?;
        text.clear();
    }
    Ok(())
}

/// The distinct values of a column in order of first use, and the place of each entry in them.
fn distinct<T: Copy, K: Hash + Eq>(column: &[T], key: impl Fn(T) -> K) -> (Vec<T>, Vec<u32>) {
    let mut values = Vec::new();
    let mut known = FxHashMap::default();
    let places = column
        .iter()
        .map(|&value| {
            *known.entry(key(value)).or_insert_with(|| {
                values.push(value);
                values.len() as u32 - 1
            })
        })
        .collect();
    (values, places)
}

/// One name per material, each different.
fn named(materials: &[Material]) -> Vec<String> {
    let mut taken = rustc_hash::FxHashSet::default();
    taken.insert(UNPAINTED.to_owned());
    materials
        .iter()
        .enumerate()
        .map(|(i, m)| {
            let base = plain(&m.name);
            let mut name = if base.is_empty() { format!("material {}", i + 1) } else { base };
            while !taken.insert(name.clone()) {
                name = format!("{name} ({})", i + 1);
            }
            name
        })
        .collect()
}

fn write_materials(sink: &mut Sink<'_>, names: &[String], materials: &[Material]) {
    let stem = plain(&sink.stem);
    let mut text = String::new();
    let mut images: Vec<&octofold::attributes::Texture> = Vec::new();
    let plain_one = Material::default();
    let unpainted = (UNPAINTED, &plain_one);
    let all = names.iter().map(String::as_str).zip(materials).chain([unpainted]);
    for (name, material) in all {
        let [r, g, b, a] = material.colour.map(|c| f64::from(c) / 255.0);
        line(&mut text, format_args!("newmtl {name}\nKd {r:.4} {g:.4} {b:.4}"));
        if material.colour[3] != 255 {
            line(&mut text, format_args!("d {a:.4}"));
        }
        if let Some(texture) = &material.texture {
            let known = images.iter().position(|&image| image == texture);
            let place = known.unwrap_or_else(|| {
                images.push(texture);
                images.len() - 1
            });
            let image = image_name(&stem, place, texture);
            line(&mut text, format_args!("map_Kd {image}"));
        }
    }
    let images: Vec<_> = images
        .iter()
        .enumerate()
        .map(|(i, image)| (image_name(&stem, i, image), image.bytes.to_vec()))
        .collect();
    sink.beside(format!("{stem}.mtl"), text.into_bytes());
    images.into_iter().for_each(|(name, bytes)| sink.beside(name, bytes));
}

fn image_name(stem: &str, place: usize, texture: &octofold::attributes::Texture) -> String {
    format!("{stem}-{}.{}", place + 1, colour::ending(texture))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_different() {
        let of = |name: &str| Material { name: name.into(), ..Material::default() };
        let names = named(&[of("a"), of("a"), of(""), of(UNPAINTED)]);
        assert_eq!(names, ["a", "a (2)", "material 3", "unpainted (4)"]);
        assert_eq!(distinct(&[3, 9, 3], |x| x), (vec![3, 9], vec![0, 1, 0]));
    }
}

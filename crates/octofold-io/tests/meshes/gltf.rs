//! glTF and GLB, feature by feature.

use crate::{corners, faces, pixel, read, read_with, refused, there_and_back, write};
use base64::Engine;
use octofold::{LengthUnit, Material, SoupBuilder};
use octofold_io::Format::{Glb, Gltf};
use serde_json::{Value, json};

/// A file with one node that shows one triangle of `POSITION` alone.
fn triangle() -> Value {
    let positions: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = positions.iter().flat_map(|x| x.to_le_bytes()).collect();
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3,
            "min": [0, 0, 0], "max": [1, 1, 0],
        }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": uri(&bytes) }],
    })
}

fn uri(bytes: &[u8]) -> String {
    let text = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!("data:application/octet-stream;base64,{text}")
}

/// Adds an accessor with a buffer of its own, and returns its number.
fn add(file: &mut Value, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
    let push = |file: &mut Value, table: &str, value: Value| {
        let table = file[table].as_array_mut().unwrap();
        table.push(value);
        table.len() - 1
    };
    let buffer = json!({ "byteLength": bytes.len(), "uri": uri(bytes) });
    let buffer = push(file, "buffers", buffer);
    let view = json!({ "buffer": buffer, "byteLength": bytes.len() });
    let view = push(file, "bufferViews", view);
    let accessor =
        json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
    push(file, "accessors", accessor)
}

fn f32s(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn primitive(file: &mut Value) -> &mut Value {
    &mut file["meshes"][0]["primitives"][0]
}

const T: [[f64; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn the_least_file() {
    let soup = read(Gltf, triangle().to_string());
    assert_eq!(faces(&soup), [T]);
    assert_eq!(soup.unit, Some(LengthUnit::Metre));
    let mut other = triangle();
    other["scenes"] = json!([{ "nodes": [0] }, {}]);
    assert_eq!(read(Gltf, other.to_string()), soup);
    let marked = format!("\u{feff}{}", triangle());
    assert_eq!(read(Gltf, marked), soup);
}

#[test]
fn indices_of_every_size_and_modes_of_triangles() {
    let sizes: [(u32, Vec<u8>); 3] = [
        (5121, vec![2, 1, 0]),
        (5123, vec![2, 0, 1, 0, 0, 0]),
        (5125, vec![2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
    ];
    for (component, bytes) in sizes {
        let mut file = triangle();
        let indices = add(&mut file, &bytes, component, "SCALAR", 3);
        primitive(&mut file)["indices"] = json!(indices);
        assert_eq!(corners(&read(Gltf, file.to_string())), [[2, 1, 0]]);
    }
    for (mode, expected) in [(5, vec![[0, 1, 2], [2, 1, 0]]), (6, vec![[0, 1, 2], [0, 2, 0]])] {
        let mut file = triangle();
        let indices = add(&mut file, &[0, 1, 2, 0], 5121, "SCALAR", 4);
        primitive(&mut file)["indices"] = json!(indices);
        primitive(&mut file)["mode"] = json!(mode);
        assert_eq!(corners(&read(Gltf, file.to_string())), expected, "mode {mode}");
    }
    let mut file = triangle();
    primitive(&mut file)["mode"] = json!(1);
    let (soup, findings) = read_with(Gltf, file.to_string(), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (0, vec!["skipped-points-lines"]));
}

#[test]
fn nodes_move_turn_and_mirror() {
    let mut file = triangle();
    file["nodes"] = json!([
        { "children": [1, 2], "translation": [10, 0, 0], "scale": [0.001, 0.001, 0.001] },
        { "mesh": 0, "name": "turned", "rotation": [0, 0, 1, 0] },
        { "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1] },
    ]);
    let soup = read(Gltf, file.to_string());
    let faces = faces(&soup);
    assert_eq!(faces[0][1], [9.999, 0.0, 0.0]);
    // Mirrored: the last two corners change places.
    assert_eq!(faces[1], [[10.0, 0.0, 0.005], [10.0, 0.001, 0.005], [9.999, 0.0, 0.005]]);
    let a = soup.attributes();
    assert_eq!(a.face_labels, Some(vec![1, 2]));
    assert_eq!(a.label_names, [(1, "turned".into()), (2, "node 2".into())]);
}

#[test]
fn colours_are_linear_light() {
    let kinds: [(u32, &str, Vec<u8>); 3] = [
        (5126, "VEC3", f32s(&[1.0, 0.0, 0.212_230_76].repeat(3))),
        (5121, "VEC4", [255, 0, 54, 255].repeat(3)),
        (5123, "VEC4", [0xff, 0xff, 0, 0, 0x54, 0x36, 0xff, 0xff].repeat(3)),
    ];
    for (component, kind, bytes) in kinds {
        let mut file = triangle();
        let colours = add(&mut file, &bytes, component, kind, 3);
        file["accessors"][colours]["normalized"] = json!(component != 5126);
        primitive(&mut file)["attributes"]["COLOR_0"] = json!(colours);
        let soup = read(Gltf, file.to_string());
        let colours = soup.attributes().point_colours.as_ref().unwrap();
        assert!(colours[2][2].abs_diff(127) < 2, "{colours:?}");
        assert_eq!((colours[2][0], colours[2][1], colours[2][3]), (255, 0, 255));
    }
}

#[test]
fn sparse_accessors_change_some_points() {
    let mut file = triangle();
    let indices = add(&mut file, &[1], 5121, "SCALAR", 1);
    let values = add(&mut file, &f32s(&[7.0, 8.0, 9.0]), 5126, "VEC3", 1);
    let view = |accessor: usize| file["accessors"][accessor]["bufferView"].clone();
    let sparse = json!({
        "count": 1,
        "indices": { "bufferView": view(indices), "componentType": 5121 },
        "values": { "bufferView": view(values) },
    });
    file["accessors"][0]["sparse"] = sparse;
    assert_eq!(read(Gltf, file.to_string()).points()[1], [7.0, 8.0, 9.0]);
    file["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let points = [[0.0; 3], [7.0, 8.0, 9.0], [0.0; 3]];
    assert_eq!(read(Gltf, file.to_string()).points(), points);
    file["accessors"][0]["count"] = json!(1);
    assert!(refused(Gltf, file.to_string()).contains("changes element 1 of 1"));
}

#[test]
fn strides_skip_what_lies_between() {
    let mut file = triangle();
    let rows: Vec<f32> =
        T.iter().flat_map(|p| [9.0, p[0] as f32, p[1] as f32, p[2] as f32]).collect();
    let accessor = add(&mut file, &f32s(&rows), 5126, "VEC3", 3);
    file["accessors"][accessor]["byteOffset"] = json!(4);
    let view = file["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
    file["bufferViews"][view]["byteStride"] = json!(16);
    primitive(&mut file)["attributes"]["POSITION"] = json!(accessor);
    assert_eq!(faces(&read(Gltf, file.to_string())), [T]);
    file["accessors"][accessor]["byteOffset"] = json!(8);
    assert!(refused(Gltf, file.to_string()).contains("ends behind its buffer view"));
}

fn textured(image: Value) -> Value {
    let mut file = triangle();
    let uvs = add(&mut file, &f32s(&[0.0, 0.0, 0.25, 0.0, 0.0, 0.75]), 5126, "VEC2", 3);
    primitive(&mut file)["attributes"]["TEXCOORD_1"] = json!(uvs);
    primitive(&mut file)["material"] = json!(0);
    file["materials"] = json!([{ "name": "m", "pbrMetallicRoughness": {
        "baseColorFactor": [1, 0.212_230_76, 0, 0.5],
        "baseColorTexture": { "index": 0, "texCoord": 1 },
    }}]);
    file["textures"] = json!([{ "source": 0 }]);
    file["images"] = json!([image]);
    file
}

#[test]
fn materials_with_images_embedded_or_beside() {
    let image = pixel();
    let inside = textured(json!({ "uri": uri(&image) }));
    let soup = read(Gltf, inside.to_string());
    let a = soup.attributes();
    assert_eq!(a.materials[0].colour, [255, 127, 0, 128]);
    assert_eq!(a.corner_uvs, Some(vec![[0.0, 1.0], [0.25, 1.0], [0.0, 0.25]]));
    assert_eq!(a.materials[0].texture.as_ref().map(|t| t.bytes.to_vec()), Some(image.clone()));

    let beside = textured(json!({ "uri": "my%20image.png" })).to_string();
    let (found, findings) = read_with(Gltf, beside.clone(), &[("my image.png", &image)]).unwrap();
    assert_eq!((&found, findings.len()), (&soup, 0));
    let (soup, findings) = read_with(Gltf, beside, &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["missing-image"]));

    let mut moved = inside;
    moved["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({ "KHR_texture_transform": { "offset": [1, 0], "scale": [2, 2] } });
    let uvs = read(Gltf, moved.to_string()).attributes().corner_uvs.clone();
    assert_eq!(uvs, Some(vec![[1.0, 1.0], [1.5, 1.0], [1.0, -0.5]]));
}

#[test]
fn buffers_beside_are_found_or_missed() {
    let mut file = triangle();
    let text = file["buffers"][0]["uri"].as_str().unwrap().split_once(',').unwrap().1.to_owned();
    let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
    file["buffers"][0]["uri"] = json!("a.bin");
    assert_eq!(read_with(Gltf, file.to_string(), &[("a.bin", &bytes)]).unwrap().0.faces(), 1);
    assert!(refused(Gltf, file.to_string()).contains("buffer 0: a.bin"));
}

#[test]
fn packed_geometry_is_refused_by_name() {
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression"] {
        let mut file = triangle();
        file["extensionsRequired"] = json!([name]);
        let line = refused(Gltf, file.to_string());
        assert!(line.contains(name) && line.contains("save it again"), "{line}");
    }
    let mut file = triangle();
    file["extensionsRequired"] = json!(["KHR_materials_unlit", "VENDOR_strange"]);
    assert_eq!(read_with(Gltf, file.to_string(), &[]).unwrap().1, ["unknown-extension"]);
}

#[test]
fn every_reference_is_checked() {
    let cases: [(&str, Value, &str); 12] = [
        ("/nodes/0/mesh", json!(9), "mesh that is not there"),
        ("/nodes/0/children", json!([0]), "two places"),
        ("/nodes/0/children", json!([7]), "node 7 is named"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(5), "no positions"),
        ("/meshes/0/primitives/0/indices", json!(5), "accessor 5"),
        ("/meshes/0/primitives/0/indices", json!(0), "holds no indices"),
        ("/meshes/0/primitives/0/mode", json!(17), "unknown mode"),
        ("/accessors/0/bufferView", json!(3), "buffer view 3"),
        ("/accessors/0/count", json!(4_000_000_000u32), "instances make more"),
        ("/accessors/0/count", json!(4), "ends behind its buffer view"),
        ("/bufferViews/0/buffer", json!(3), "buffer 3 of view 0"),
        ("/bufferViews/0/byteLength", json!(u64::MAX), "ends behind its buffer"),
    ];
    for (place, value, fact) in cases {
        let mut file = triangle();
        let (parent, key) = place.rsplit_once('/').unwrap();
        file.pointer_mut(parent).unwrap()[key] = value;
        let line = refused(Gltf, file.to_string());
        assert!(line.contains(fact), "{place}: {line}");
    }
    let mut file = triangle();
    let indices = add(&mut file, &[0, 1, 3], 5121, "SCALAR", 3);
    primitive(&mut file)["indices"] = json!(indices);
    assert!(refused(Gltf, file.to_string()).contains("names vertex 3, but there are 3"));
    assert!(refused(Gltf, "{").contains("JSON"));
}

#[test]
fn many_instances_of_much_are_refused() {
    let mut file = triangle();
    file["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    file["accessors"][0]["count"] = json!(1_000_000);
    file["nodes"] = json!(vec![json!({ "mesh": 0 }); 100]);
    file["scenes"] = json!([{ "nodes": (0..100).collect::<Vec<_>>() }]);
    assert!(refused(Gltf, file.to_string()).contains("instances make more"));
}

#[test]
fn containers_are_checked() {
    let mut builder = SoupBuilder::default();
    builder.points = T.to_vec();
    builder.face(&[0, 1, 2]);
    let (bytes, ..) = write(Glb, &builder.build().unwrap());
    assert_eq!(bytes.len() % 4, 0);
    assert_eq!(bytes[8..12], (bytes.len() as u32).to_le_bytes());
    assert_eq!(read(Glb, bytes.clone()).faces(), 1);
    assert!(refused(Glb, &bytes[..bytes.len() - 4]).contains("ends inside its chunks"));
    let mut old = bytes;
    old[4] = 1;
    assert!(refused(Glb, old).contains("glTF 1 is not read"));
}

/// The JSON of a shape as it is written.
fn written(soup: &octofold::Soup) -> Value {
    serde_json::from_slice(&write(Gltf, soup).0).unwrap()
}

#[test]
fn parts_materials_and_units_are_written() {
    let mut builder = SoupBuilder::default();
    builder.points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [9.0; 3]];
    builder.face(&[0, 1, 2, 3]);
    builder.face(&[0, 1, 2]);
    builder.face(&[0, 2, 3]);
    let a = &mut builder.attributes;
    a.face_labels = Some(vec![5, 5, 2]);
    a.label_names = vec![(5, "top".into())];
    a.materials = vec![Material { name: "red".into(), colour: [255, 0, 0, 255], texture: None }];
    a.face_materials = Some(vec![0, u32::MAX, 0]);
    builder.unit = Some(LengthUnit::Millimetre);
    let soup = builder.build().unwrap();
    let file = written(&soup);
    assert_eq!(file["nodes"][0]["name"], "label 2");
    assert_eq!(file["nodes"][1]["name"], "top");
    assert_eq!(file["nodes"][1]["scale"], json!([0.001, 0.001, 0.001]));
    assert_eq!(file["meshes"][1]["primitives"].as_array().unwrap().len(), 2);
    assert_eq!(file["materials"][0]["name"], "red");
    let back = there_and_back(Glb, &soup);
    assert_eq!(back.faces(), 4);
    assert_eq!(back.points()[1], [0.001, 0.001, 0.0]);
    let a = back.attributes();
    assert_eq!(a.label_names, [(1, "label 2".into()), (2, "top".into())]);
    assert_eq!(a.materials[0].colour, [255, 0, 0, 255]);
}

/// The rules of the Khronos validator that writers trip over.
#[test]
fn written_tables_obey_the_validator() {
    let image: std::sync::Arc<[u8]> = pixel().into();
    let texture = octofold::attributes::Texture { media_type: "image/png".into(), bytes: image };
    let mut builder = SoupBuilder::default();
    builder.points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
    builder.face(&[0, 1, 2]);
    builder.face(&[0, 2, 3]);
    let a = &mut builder.attributes;
    a.corner_uvs = Some((0..6).map(|i| [i as f32, 0.0]).collect());
    a.point_normals = Some(vec![[0.0, 0.0, 2.0], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    a.face_colours = Some(vec![[10, 20, 30, 40], [1, 2, 3, 255]]);
    a.materials = vec![Material { name: "t".into(), colour: [255; 4], texture: Some(texture) }];
    a.face_materials = Some(vec![0, 0]);
    let soup = builder.build().unwrap();
    let (bytes, _, findings) = write(Gltf, &soup);
    assert_eq!(findings, ["rounded-to-f32"]);
    let file: Value = serde_json::from_slice(&bytes).unwrap();
    let length = file["buffers"][0]["byteLength"].as_u64().unwrap();
    let views = file["bufferViews"].as_array().unwrap();
    for view in views {
        let number = |key: &str| view[key].as_u64().unwrap();
        assert_eq!(number("byteOffset") % 4, 0);
        assert!(number("byteLength") > 0);
        assert!(number("byteOffset") + number("byteLength") <= length);
    }
    let primitive = &file["meshes"][0]["primitives"][0];
    let accessor = |key: &Value| &file["accessors"][key.as_u64().unwrap() as usize];
    let target = |a: &Value| views[a["bufferView"].as_u64().unwrap() as usize]["target"].clone();
    let indices = accessor(&primitive["indices"]);
    assert_eq!((target(indices), &indices["componentType"]), (json!(34963), &json!(5123)));
    for (name, kind) in
        [("POSITION", "VEC3"), ("NORMAL", "VEC3"), ("TEXCOORD_0", "VEC2"), ("COLOR_0", "VEC4")]
    {
        let accessor = accessor(&primitive["attributes"][name]);
        assert_eq!((target(accessor), &accessor["type"]), (json!(34962), &json!(kind)));
        assert_eq!(accessor["count"], 6);
    }
    let positions = accessor(&primitive["attributes"]["POSITION"]);
    assert_eq!(positions["min"], json!([0.0, 0.0, 0.0]));
    assert_eq!(positions["max"], json!([1.0, 1.0, f64::from(0.1f32)]));
    assert_eq!(file["images"][0]["mimeType"], "image/png");
    assert_eq!(target(&file["images"][0]), Value::Null);
    assert_eq!(file["materials"][0]["alphaMode"], "BLEND");
    let back = read(Gltf, bytes);
    let normals = back.attributes().point_normals.as_ref().unwrap();
    assert_eq!(normals[..2], [[0.0, 0.0, 1.0]; 2]);
    assert_eq!(back.attributes().point_colours.as_ref().map(|c| c[0]), Some([10, 20, 30, 40]));
    assert_eq!(back.attributes().corner_uvs, soup.attributes().corner_uvs);
}

#[test]
fn nothing_is_written_without_faces() {
    let empty = SoupBuilder::default().build().unwrap();
    let file = written(&empty);
    for table in ["scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "buffers"] {
        assert_eq!(file[table], Value::Null, "{table}");
    }
    for format in [Glb, Gltf] {
        assert_eq!(there_and_back(format, &empty).faces(), 0);
    }
}

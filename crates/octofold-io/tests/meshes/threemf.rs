//! 3MF, feature by feature.

use crate::{Format::ThreeMf, faces, read, read_with, refused, there_and_back, write};
use octofold::{LengthUnit, Material, SoupBuilder};
use std::io::{Cursor, Read, Write};

const RELS: &str = r#"<Relationships><Relationship Target="/3D/main.model" Id="a" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;

/// A package of these parts.
fn package(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in parts {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// A package with one model of these resources and build items.
fn model(resources: &str, build: &str) -> Vec<u8> {
    let text = format!(
        r#"<?xml version="1.0"?><model unit="inch"><resources>{resources}</resources><build>{build}</build></model>"#
    );
    package(&[("_rels/.rels", RELS), ("3D/main.model", &text)])
}

const MESH: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh>"#;

fn object(id: u32, attributes: &str) -> String {
    format!(r#"<object id="{id}" {attributes}>{MESH}</object>"#)
}

#[test]
fn items_put_objects_in_place() {
    let items = r#"<item objectid="1"/><item objectid="1" transform="1 0 0 0 1 0 0 0 -1 5 6 7"/>"#;
    let soup = read(ThreeMf, model(&object(1, r#"name="a &amp; b""#), items));
    assert_eq!(soup.unit, Some(LengthUnit::Inch));
    assert_eq!(faces(&soup)[0], [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    // Mirrored: the last two corners change places.
    assert_eq!(faces(&soup)[1], [[5.0, 6.0, 7.0], [5.0, 7.0, 7.0], [6.0, 6.0, 7.0]]);
    let a = soup.attributes();
    assert_eq!(a.face_labels, Some(vec![1, 2]));
    assert_eq!(a.label_names[1], (2, "a & b".into()));
}

#[test]
fn components_nest() {
    let resources = format!(
        r#"{}<object id="2"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 1 0 0"/><component objectid="1"/></components></object>
        <object id="3"><components><component objectid="2" transform="2 0 0 0 2 0 0 0 2 0 0 0"/></components></object>"#,
        object(1, "")
    );
    let soup = read(ThreeMf, model(&resources, r#"<item objectid="3"/>"#));
    assert_eq!(faces(&soup)[0][1], [4.0, 0.0, 0.0]);
    assert_eq!(faces(&soup)[1][1], [2.0, 0.0, 0.0]);
}

#[test]
fn circles_depth_and_multiplication_are_refused() {
    let link = |id: u32, to: u32, times: usize| {
        let one = format!(r#"<component objectid="{to}"/>"#);
        format!(r#"<object id="{id}"><components>{}</components></object>"#, one.repeat(times))
    };
    let circle = format!("{}{}", link(1, 2, 1), link(2, 1, 1));
    assert!(
        refused(ThreeMf, model(&circle, r#"<item objectid="1"/>"#)).contains("component of itself")
    );
    let chain: String = (1..100).map(|i| link(i, i + 1, 1)).collect();
    let chain = format!("{chain}{}", object(100, ""));
    assert!(refused(ThreeMf, model(&chain, r#"<item objectid="1"/>"#)).contains("deeper than 64"));
    let tree: String = (1..40).map(|i| link(i, i + 1, 2)).collect();
    let tree = format!("{tree}{}", object(40, ""));
    assert!(
        refused(ThreeMf, model(&tree, r#"<item objectid="1"/>"#)).contains("instances make more")
    );
}

#[test]
fn colours_of_groups_and_materials() {
    let resources = format!(
        r##"<basematerials id="7"><base name="red" displaycolor="#FF0000"/><base name="blue" displaycolor="#0000FF80"/></basematerials>
        <m:colorgroup id="8"><m:color color="#010203"/></m:colorgroup>{}{}"##,
        object(1, r#"pid="7" pindex="1""#),
        object(2, "").replace(r#"v3="2""#, r#"v3="2" pid="8" p1="0""#)
    );
    let soup = read(ThreeMf, model(&resources, r#"<item objectid="1"/><item objectid="2"/>"#));
    let a = soup.attributes();
    assert_eq!(a.face_materials, Some(vec![1, u32::MAX]));
    assert_eq!((a.materials[1].name.as_str(), a.materials[1].colour), ("blue", [0, 0, 255, 128]));
    assert_eq!(a.face_colours, Some(vec![[255; 4], [1, 2, 3, 255]]));
}

#[test]
fn parts_of_the_production_extension() {
    let other = format!("<model><resources>{}</resources></model>", object(5, ""));
    let main = r#"<model><resources><object id="1"><components><component p:path="/3D/Other.model" objectid="5"/></components></object></resources><build><item objectid="1"/></build></model>"#;
    let parts =
        [("_rels/.rels", RELS), ("3D/main.model", main), ("3D/other.model", other.as_str())];
    let soup = read(ThreeMf, package(&parts));
    assert_eq!((soup.faces(), soup.unit), (1, Some(LengthUnit::Millimetre)));
    assert!(refused(ThreeMf, package(&parts[..2])).contains("/3D/Other.model"));
}

#[test]
fn odd_packages_are_read() {
    let text = format!("<model><resources>{}</resources></model>", object(1, ""));
    let (soup, findings) = read_with(ThreeMf, package(&[("any.model", &text)]), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["nothing-built"]));
}

#[test]
fn refusals_name_place_and_fact() {
    assert!(refused(ThreeMf, "PK").contains("ZIP"));
    assert!(refused(ThreeMf, package(&[("a.txt", "")])).contains("holds no model"));
    let item = r#"<item objectid="1"/>"#;
    assert!(refused(ThreeMf, model("", item)).contains("object 1 is named"));
    let wrong = |from, to| refused(ThreeMf, model(&object(1, "").replace(from, to), item));
    let far = wrong(r#"v3="2""#, r#"v3="3""#);
    assert!(
        far.contains("byte ") && far.contains("triangle 0 names vertex 3, but there are 3"),
        "{far}"
    );
    assert!(wrong(r#"x="1""#, r#"x="one""#).contains("x='one' is not a number"));
    assert!(wrong(r#"x="1""#, r#"x="inf""#).contains("not a finite number"));
    assert!(wrong(r#" x="1""#, "").contains("x='' is not a number"));
    assert!(wrong("</triangles>", "").contains("main.model"));
    assert!(wrong(r#"id="1""#, "").contains("no id"));
}

#[test]
fn bombs_are_refused() {
    let text = " ".repeat(200 << 20);
    let text = format!("<model>{text}</model>");
    assert!(refused(ThreeMf, package(&[("3D/a.model", &text)])).contains("unpacks to more than"));
}

#[test]
fn parts_colours_and_units_are_written() {
    let mut builder = SoupBuilder::default();
    builder.points = vec![[0.0; 3], [0.1, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1e-7]];
    builder.face(&[0, 1, 2]);
    builder.face(&[0, 1, 2, 3]);
    builder.face(&[0, 0, 2]);
    let a = &mut builder.attributes;
    a.face_labels = Some(vec![2, 1, 1]);
    a.label_names = vec![(1, "<left>".into())];
    a.materials =
        vec![Material { name: "\"red\"".into(), colour: [255, 0, 0, 128], texture: None }];
    a.face_materials = Some(vec![0, u32::MAX, 0]);
    builder.unit = Some(LengthUnit::Inch);
    let soup = builder.build().unwrap();
    let (bytes, _, findings) = write(ThreeMf, &soup);
    assert_eq!(findings, ["dropped-degenerate"]);
    let mut text = String::new();
    let mut archive = zip::ZipArchive::new(Cursor::new(&bytes)).unwrap();
    archive.by_name("3D/3dmodel.model").unwrap().read_to_string(&mut text).unwrap();
    assert!(text.contains(r#"unit="inch""#) && text.contains("&lt;left&gt;"), "{text}");
    let back = read(ThreeMf, bytes);
    let a = back.attributes();
    assert_eq!(a.face_labels, Some(vec![1, 1, 2]));
    assert_eq!(a.face_materials, Some(vec![u32::MAX, u32::MAX, 0]));
    assert_eq!(a.label_names, [(1, "<left>".into()), (2, "label 2".into())]);
    assert_eq!(
        (a.materials[0].name.as_str(), a.materials[0].colour),
        ("\"red\"", [255, 0, 0, 128])
    );
    assert_eq!(back.unit, Some(LengthUnit::Inch));
    assert_eq!(faces(&back)[2], [[0.0; 3], [0.1, 0.0, 0.0], [1.0, 1.0, 0.0]]);
}

#[test]
fn face_colours_come_back() {
    let mut builder = SoupBuilder::default();
    builder.points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
    builder.face(&[0, 1, 2]);
    builder.face(&[0, 2, 1]);
    builder.attributes.face_colours = Some(vec![[1, 2, 3, 255], [4, 5, 6, 7]]);
    builder.unit = Some(LengthUnit::Millimetre);
    let soup = builder.build().unwrap();
    assert_eq!(there_and_back(ThreeMf, &soup), soup);
}

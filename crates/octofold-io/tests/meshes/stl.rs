//! STL, feature by feature.

use crate::{Format::Stl, corners, faces, read, read_with, refused, write};
use octofold::SoupBuilder;

/// Bytes of a binary file with the corners and spare bytes of each triangle.
fn binary(header: &[u8], promised: u32, triangles: &[([[f32; 3]; 3], u16)]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(promised.to_le_bytes());
    for (corners, spare) in triangles {
        bytes.extend([0; 12]);
        bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(spare.to_le_bytes());
    }
    bytes
}

const T: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const U: [[f32; 3]; 3] = [[1.0, 0.0, -0.0], [-0.0, 0.0, 0.0], [0.0, 0.0, 1.0]];

#[test]
fn binary_points_at_one_place_are_one() {
    // A header that begins like text does not make it text.
    let soup = read(Stl, binary(b"solid thing", 2, &[(T, 0), (U, 0)]));
    assert_eq!(corners(&soup), [[0, 1, 2], [1, 0, 3]]);
    assert_eq!(soup.points().len(), 4);
}

#[test]
fn a_wrong_count_is_told() {
    let (soup, findings) = read_with(Stl, binary(b"x", 7, &[(T, 0)]), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["wrong-count"]));
    let (soup, findings) = read_with(Stl, binary(b"x", 0, &[(T, 0), (U, 0)]), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (2, vec!["wrong-count"]));
    let mut long = binary(b"x", 1, &[(T, 0)]);
    long.extend(b"bye");
    let (soup, findings) = read_with(Stl, long, &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["trailing-bytes"]));
}

#[test]
fn colours_after_viscam_and_magics() {
    let colours = |bytes| read(Stl, bytes).attributes().face_colours.clone();
    let viscam = binary(b"x", 2, &[(T, 0x8000 | 31 << 10), (U, 0)]);
    assert_eq!(colours(viscam), Some(vec![[255, 0, 0, 255], [204, 204, 204, 255]]));
    let magics = binary(b"COLOR=\x01\x02\x03\x04", 2, &[(T, 31), (U, 0x8000)]);
    assert_eq!(colours(magics), Some(vec![[255, 0, 0, 255], [1, 2, 3, 4]]));
    // Something else in the spare bytes is no colour.
    assert_eq!(colours(binary(b"x", 2, &[(T, 0x8000), (U, 5)])), None);
    assert_eq!(colours(binary(b"x", 2, &[(T, 0), (U, 0)])), None);
}

const SOLID: &str = "solid a name\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   \
    vertex 0.1 1e0 -0\n  endloop\n endfacet\nendsolid a name\n";

#[test]
fn ascii_with_one_solid_and_several() {
    let soup = read(Stl, SOLID);
    assert_eq!(faces(&soup), [[[0.0; 3], [1.0, 0.0, 0.0], [0.1, 1.0, 0.0]]]);
    assert_eq!(soup.attributes().face_labels, None);
    let shouted = SOLID.to_ascii_uppercase().replace('\n', "\r\n");
    assert_eq!(read(Stl, shouted), soup);
    let several = format!("{SOLID}{}", SOLID.replace("a name", "").replace("solid", "solid  "));
    let several = read(Stl, several.replace("endsolid  ", "endsolid"));
    assert_eq!(several.attributes().face_labels, Some(vec![1, 2]));
    let names = [(1, "a name".to_owned()), (2, "solid 2".to_owned())];
    assert_eq!(several.attributes().label_names, names);
    assert_eq!(several.points().len(), 3);
}

#[test]
fn ascii_without_an_end_is_told() {
    let cut = SOLID.replace("endsolid a name\n", "");
    assert_eq!(read_with(Stl, cut, &[]).unwrap().1, ["no-end"]);
}

#[test]
fn refusals_name_place_and_fact() {
    assert!(
        refused(Stl, binary(b"x", 3, &[(T, 0)])[..100].to_vec())
            .contains("byte 100: the file ends in triangle 1 of 3")
    );
    assert!(refused(Stl, "hello").contains("5 bytes"));
    let mut bad = U;
    bad[1][2] = f32::NAN;
    assert!(refused(Stl, binary(b"x", 2, &[(T, 0), (bad, 0)])).contains("byte 134: triangle 2"));
    assert!(refused(Stl, SOLID.replace("1e0", "one")).contains("line 6: a vertex of facet 1"));
    assert!(refused(Stl, SOLID.replace("   vertex 1 0 0\n", "")).contains("has 2 of 3 vertices"));
    assert!(refused(Stl, SOLID.replace("facet normal", "fact normal")).contains("line 2: 'fact'"));
    let cut = SOLID.split("endloop").next().unwrap();
    assert!(refused(Stl, cut).contains("ends in facet 1"));
    assert!(refused(Stl, SOLID.split("1e0").next().unwrap()).contains("a vertex of facet 1"));
}

#[test]
fn polygons_colours_and_rounding_are_written() {
    let mut builder = SoupBuilder::default();
    builder.points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.1, 0.0]];
    builder.face(&[0, 1, 2, 3]);
    builder.attributes.face_colours = Some(vec![[255, 0, 132, 255]]);
    let (bytes, _, findings) = write(Stl, &builder.build().unwrap());
    assert_eq!((bytes.len(), findings), (84 + 2 * 50, vec!["rounded-to-f32"]));
    assert!(!bytes.starts_with(b"solid"));
    assert_eq!(bytes[84..96], [0.0f32, 0.0, 1.0].map(f32::to_le_bytes).concat());
    let soup = read(Stl, bytes);
    assert_eq!(soup.attributes().face_colours, Some(vec![[255, 0, 132, 255]; 2]));
}

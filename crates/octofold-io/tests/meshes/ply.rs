//! PLY, feature by feature.

use crate::{Format::Ply, corners, pixel, read, read_with, refused, there_and_back, write};
use octofold::{Attributes, SoupBuilder};

fn ascii(elements: &str, values: &str) -> String {
    format!("ply\nformat ascii 1.0\ncomment hello\n{elements}end_header\n{values}")
}

const POINTS: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const FACES: &str = "element face 1\nproperty list uchar int vertex_indices\n";
const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

#[test]
fn polygons_in_ascii() {
    let text = ascii(&format!("{POINTS}{FACES}"), &format!("{SQUARE}4 0 1 2 3"));
    let soup = read(Ply, text.clone());
    assert_eq!(corners(&soup), [[0, 1, 2, 3]]);
    assert_eq!(read(Ply, text.replace('\n', "\r\n")), soup);
    assert_eq!(read(Ply, text.replace('\n', "\r")), soup);
}

#[test]
fn both_byte_orders_of_every_type() {
    let head = |order: &str| {
        format!(
            "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty double x\n\
             property short y\nproperty int64 z\nelement face 1\nproperty char flags\n\
             property list uint ushort vertex_index\nend_header\n"
        )
    };
    let (mut little, mut big) = (head("little").into_bytes(), head("big").into_bytes());
    for (x, y, z) in [(0.1f64, -2i16, 3i64), (1e300, 300, -4), (-0.5, 0, 0)] {
        little.extend(x.to_le_bytes());
        little.extend(y.to_le_bytes());
        little.extend(z.to_le_bytes());
        big.extend(x.to_be_bytes());
        big.extend(y.to_be_bytes());
        big.extend(z.to_be_bytes());
    }
    little.push(7);
    big.push(7);
    little.extend(3u32.to_le_bytes());
    big.extend(3u32.to_be_bytes());
    for i in [2u16, 1, 0] {
        little.extend(i.to_le_bytes());
        big.extend(i.to_be_bytes());
    }
    let (soup, findings) = read_with(Ply, little, &[]).unwrap();
    assert_eq!(soup.points(), [[0.1, -2.0, 3.0], [1e300, 300.0, -4.0], [-0.5, 0.0, 0.0]]);
    assert_eq!(corners(&soup), [[2, 1, 0]]);
    assert_eq!(findings, ["skipped-properties"]);
    assert_eq!(read(Ply, big), soup);
}

#[test]
fn colours_of_points_and_faces() {
    let elements = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float red\nproperty float green\nproperty float blue\n\
        element face 1\nproperty list uchar int vertex_indices\nproperty uchar red\n\
        property ushort green\nproperty uchar blue\nproperty uchar alpha\n";
    let soup = read(
        Ply,
        ascii(elements, "0 0 0 1 0.5 nan\n1 0 0 0 0 0\n0 1 0 0 0 2\n3 0 1 2 1 65535 3 4\n"),
    );
    let a = soup.attributes();
    assert_eq!(a.point_colours, Some(vec![[255, 128, 0, 255], [0, 0, 0, 255], [0, 0, 255, 255]]));
    assert_eq!(a.face_colours, Some(vec![[1, 255, 3, 4]]));
}

#[test]
fn texture_coordinates_of_points_or_corners() {
    let names = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
    for [s, t] in names {
        let elements = format!(
            "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property float {s}\nproperty float {t}\n{FACES}"
        );
        let soup = read(Ply, ascii(&elements, "0 0 0 .1 .2\n1 0 0 .3 .4\n0 1 0 .5 .6\n3 2 1 0\n"));
        let uvs = soup.attributes().corner_uvs.clone();
        assert_eq!(uvs, Some(vec![[0.5, 0.6], [0.3, 0.4], [0.1, 0.2]]));
    }
    let elements = format!(
        "{POINTS}element face 2\nproperty list uchar int vertex_indices\n\
         property list uchar float texcoord\nproperty int texnumber\n"
    );
    let text = ascii(&elements, &format!("{SQUARE}3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 0 -1\n"))
        .replace("comment hello", "comment TextureFile my picture.png");
    let image = pixel();
    let (soup, findings) = read_with(Ply, text, &[("my picture.png", &image)]).unwrap();
    let a = soup.attributes();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(a.corner_uvs.as_ref().map(|c| c[2]), Some([1.0, 1.0]));
    assert_eq!(a.face_materials, Some(vec![0, Attributes::NO_MATERIAL]));
    assert!(a.materials[0].texture.is_some());
}

#[test]
fn strips_restart_and_turn() {
    let elements = format!("{POINTS}element tristrips 1\nproperty list int int vertex_indices\n");
    let soup = read(Ply, ascii(&elements, &format!("{SQUARE}9 0 1 2 3 -1 3 2 1 1\n")));
    assert_eq!(corners(&soup), [[0, 1, 2], [2, 1, 3], [3, 2, 1]]);
}

#[test]
fn odd_elements_and_lists_are_skipped() {
    let elements = "element nothing 99999999999\n\
        element vertex 3\nproperty float x\nproperty list uchar float w\nproperty float y\nproperty float z\n\
        element edge 1\nproperty int a\nproperty int b\n\
        element face 1\nproperty list uchar int vertex_indices\nelement empty 0\nproperty int q\n";
    let text = ascii(elements, "0 2 9 9 0 0\n1 0 0 0\n0 1 9 1 0\n0 1\n3 0 1 2\n");
    let (soup, findings) = read_with(Ply, text, &[]).unwrap();
    assert_eq!(soup.points(), [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(findings, ["skipped-element", "skipped-properties", "skipped-element"]);
}

#[test]
fn faces_may_come_first() {
    let text = ascii(&format!("{FACES}{POINTS}"), &format!("4 0 1 2 3\n{SQUARE}"));
    assert_eq!(corners(&read(Ply, text)), [[0, 1, 2, 3]]);
    let text = ascii(&format!("{FACES}{POINTS}"), &format!("4 0 1 2 7\n{SQUARE}"));
    assert_eq!(refused(Ply, text), "ply: a face names vertex 7, but there are 4");
}

#[test]
fn refusals_name_place_and_fact() {
    let both = format!("{POINTS}{FACES}");
    let far = refused(Ply, ascii(&both, &format!("{SQUARE}3 0 1 4\n")));
    assert_eq!(far, "ply: line 15: face 1 names vertex 4, but there are 4");
    assert!(refused(Ply, ascii(&both, &format!("{SQUARE}3 0 1 -2\n"))).contains("names vertex -2"));
    assert!(refused(Ply, ascii(&both, "0 0 0\n1 0\n")).contains("4 records of 'vertex'"));
    assert!(
        refused(Ply, ascii(&both, &format!("{SQUARE}200 0 1\n"))).contains("list of 200 values")
    );
    assert!(
        refused(Ply, ascii(&both, &format!("{SQUARE}3 0 x 1\n")))
            .contains("line 15: 'x' is not a number")
    );
    assert!(
        refused(Ply, ascii(&both, "0 0 nan\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n"))
            .contains("line 11: vertex 0")
    );
    let many = POINTS.replace("vertex 4", "vertex 18446744073709551615");
    assert!(refused(Ply, ascii(&many, SQUARE)).contains("are promised"));
    assert!(refused(Ply, "ply\nformat ascii 1.0\n").contains("ends in its header"));
    assert!(refused(Ply, "ply\nend_header\n").contains("no line tells its format"));
    assert!(refused(Ply, "ply\nformat ascii 1.0\nproperty int x\nend_header\n").contains("line 3"));
    assert!(refused(Ply, "solid\n").contains("'ply'"));
}

#[test]
fn coordinates_are_written_as_wide_as_they_need() {
    let shape = |x: f64| {
        let mut builder = SoupBuilder::default();
        builder.points = vec![[x, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        builder.face(&[0, 1, 2]);
        builder.build().unwrap()
    };
    let kind = |x| {
        let text = String::from_utf8_lossy(&write(Ply, &shape(x)).0).into_owned();
        (text.contains("property float x"), text.contains("property double x"))
    };
    assert_eq!((kind(0.5), kind(0.1)), ((true, false), (false, true)));
    assert_eq!(there_and_back(Ply, &shape(0.1)), shape(0.1));
}

#[test]
fn wide_polygons_are_written() {
    let mut builder = SoupBuilder::default();
    builder.points = (0..300).map(|i| [f64::from(i), f64::from(i * i), 0.0]).collect();
    builder.face(&(0..300).collect::<Vec<_>>());
    builder.attributes.corner_uvs = Some(vec![[0.5, 0.25]; 300]);
    builder.attributes.face_labels = Some(vec![7]);
    let soup = builder.build().unwrap();
    assert_eq!(there_and_back(Ply, &soup), soup);
}

//! OBJ, feature by feature.

use crate::{Format::Obj, corners, pixel, read, read_with, refused, write};
use octofold::Attributes;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn polygons_stay_whole_with_any_kind_of_index() {
    let soup = read(Obj, format!("{SQUARE}f 1 2 3 4\nf -4 -3 -2\nf 1 2 3 4 # twice\n"));
    assert_eq!(corners(&soup), [vec![0, 1, 2, 3], vec![0, 1, 2], vec![0, 1, 2, 3]]);
    assert_eq!(soup.points()[2], [1.0, 1.0, 0.0]);
    let early = read(Obj, format!("f 1 2 3\n{SQUARE}"));
    assert_eq!(corners(&early), [[0, 1, 2]]);
}

#[test]
fn corners_carry_uvs_and_normals() {
    let text = format!("{SQUARE}vt 0 0\nvt 1 0.5\nvn 0 0 1\nf 1/1/1 2/-1/1 3//1\nf 1 2 3/1\n");
    let soup = read(Obj, text);
    let a = soup.attributes();
    let uvs = [[0.0, 0.0], [1.0, 0.5], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]];
    assert_eq!(a.corner_uvs.as_deref(), Some(&uvs[..]));
    let (up, none) = ([0.0, 0.0, 1.0], [0.0; 3]);
    assert_eq!(a.corner_normals.as_deref(), Some(&[up, up, up, none, none, none][..]));
}

#[test]
fn missing_uvs_do_not_cost_the_face() {
    let (soup, findings) = read_with(Obj, format!("{SQUARE}f 1/7 2/8 3/9\n"), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["dangling-index"]));
    let (soup, findings) =
        read_with(Obj, format!("{SQUARE}f 1// 2//\nf 1// 2// 3//\n"), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["short-faces"]));
}

#[test]
fn point_colours_are_fractions_or_bytes() {
    let fractions = "v 0 0 0 1 0.5 0\nv 1 0 0 nan 1.2 -1\nv 0 1 0\nf 1 2 3\n";
    let colours = read(Obj, fractions).attributes().point_colours.clone();
    assert_eq!(colours, Some(vec![[255, 128, 0, 255], [0, 255, 0, 255], [255; 4]]));
    let bytes = "v 0 0 0 255 128 0\nv 1 0 0 1 2 3 4\nv 0 1 0 0 0 0\nf 1 2 3\n";
    let colours = read(Obj, bytes).attributes().point_colours.clone();
    assert_eq!(colours, Some(vec![[255, 128, 0, 255], [1, 2, 3, 4], [0, 0, 0, 255]]));
    let weight = read(Obj, "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n");
    assert_eq!(weight.attributes().point_colours, None);
}

#[test]
fn groups_become_labels() {
    let text = format!(
        "{SQUARE}f 1 2 3\no empty\ng left half\nf 1 2 3\ng b\nf 1 2 4\ng left half\nf 2 3 4\n"
    );
    let soup = read(Obj, text);
    let a = soup.attributes();
    assert_eq!(a.face_labels.as_deref(), Some(&[0, 1, 2, 1][..]));
    assert_eq!(a.label_names, [(1, "left half".into()), (2, "b".into())]);
}

#[test]
fn materials_come_from_beside() {
    let library = b"newmtl red paint\nKd 1 0 0\nd 0.5\nnewmtl wood\nKd 0 0 0\nTr 0\nmap_Kd -s 1 1 my wood.png\n";
    let text = format!(
        "mtllib my colours.mtl\n{SQUARE}f 1 2 3\nusemtl red paint\nf 1 2 3\nusemtl wood\nf 2 3 4\nusemtl none\nf 1 2 4\n"
    );
    let image = pixel();
    let beside: [(&str, &[u8]); 2] = [("my colours.mtl", library), ("my wood.png", &image)];
    let (soup, findings) = read_with(Obj, text.clone(), &beside).unwrap();
    let a = soup.attributes();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(a.face_materials.as_deref(), Some(&[Attributes::NO_MATERIAL, 0, 1, 2][..]));
    assert_eq!(a.materials[0].colour, [255, 0, 0, 128]);
    assert_eq!(a.materials[1].colour, [255; 4]);
    assert_eq!(a.materials[1].texture.as_ref().map(|t| t.bytes.to_vec()), Some(image.clone()));
    assert_eq!(
        (a.materials[2].name.as_str(), a.materials[2].colour),
        ("none", [204, 204, 204, 255])
    );

    let (_, findings) = read_with(Obj, text.clone(), &beside[..1]).unwrap();
    assert_eq!(findings, ["missing-image"]);
    let (soup, findings) = read_with(Obj, text, &[]).unwrap();
    assert_eq!((soup.faces(), findings), (4, vec!["missing-materials"]));
}

#[test]
fn several_libraries_on_one_line_and_windows_paths() {
    let text = format!("mtllib a.mtl b.mtl\n{SQUARE}usemtl b\nf 1 2 3\n");
    let image = pixel();
    let beside: [(&str, &[u8]); 3] = [
        ("a.mtl", b"newmtl a\nKd 0 0 1\n"),
        ("b.mtl", b"newmtl b\r\nKd 0 1 0\r\nmap_Kd C:\\Users\\me\\p.png\r\n"),
        ("p.png", &image),
    ];
    let (soup, findings) = read_with(Obj, text, &beside).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(soup.attributes().materials[0].colour, [0, 255, 0, 255]);
    assert!(soup.attributes().materials[0].texture.is_some());
}

#[test]
fn any_line_ending_continuation_and_encoding() {
    let text = "v 0 0 0\nv 1 \\\n 0 0\nv 0 1 0\nf 1 2 \\\n3\n";
    let expected = read(Obj, text);
    assert_eq!(expected.faces(), 1);
    assert_eq!(read(Obj, text.replace('\n', "\r\n")), expected);
    assert_eq!(read(Obj, text.replace('\n', "\r")), expected);
    assert_eq!(read(Obj, format!("\u{feff}{text}")), expected);
    let units: Vec<u16> = format!("\u{feff}{text}").encode_utf16().collect();
    let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
    let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
    assert_eq!(read(Obj, little), expected);
    assert_eq!(read(Obj, big), expected);
}

#[test]
fn points_and_lines_are_skipped() {
    let (soup, findings) =
        read_with(Obj, format!("{SQUARE}p 1 2\nl 1 2 3\nf 1 2 3\nbevel on\n"), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["skipped-points-lines", "skipped-lines"]));
}

#[test]
fn refusals_name_line_and_fact() {
    let far = refused(Obj, format!("{SQUARE}f 1 2 3\nf 1 2 41\nv 0 0 0\n"));
    assert_eq!(far, "obj: line 6: face 2 names vertex 41, but there are 5");
    let back = refused(Obj, format!("{SQUARE}f 1 2 -5\n"));
    assert_eq!(back, "obj: line 5: face 1 names vertex -5, but there are 4");
    assert_eq!(
        refused(Obj, format!("{SQUARE}f 0 1 2\n")),
        "obj: line 5: face 1 names vertex 0, but there are 4"
    );
    assert_eq!(refused(Obj, "v 1 2\n"), "obj: line 1: vertex 1 has 2 of 3 coordinates");
    assert_eq!(refused(Obj, "v 1 2 x\n"), "obj: line 1: 'x' is not a number");
    assert!(refused(Obj, "v 1 2 nan\n").contains("line 1: vertex 1"));
    assert!(refused(Obj, format!("{SQUARE}f 1 2 3/x\n")).contains("line 5: '3/x'"));
    assert!(refused(Obj, format!("{SQUARE}f 1 2 99999999999999999999\n")).contains("line 5"));
    assert!(refused(Obj, "<html>\n").contains("no OBJ statements"));
}

#[test]
fn written_files_name_their_materials_beside() {
    let beside: [(&str, &[u8]); 2] =
        [("a.mtl", b"newmtl a\nKd 1 0 0\nmap_Kd a.png\n"), ("a.png", &pixel())];
    let text = format!("mtllib a.mtl\n{SQUARE}f 1 2 3\nusemtl a\ng x\nf 1 2 3 4\n");
    let (soup, _) = read_with(Obj, text, &beside).unwrap();
    let (bytes, beside, _) = write(Obj, &soup);
    let text = String::from_utf8(bytes).unwrap();
    assert_eq!(
        text,
        "mtllib shape.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
         g label 0\nusemtl unpainted\nf 1 2 3\ng x\nusemtl a\nf 1 2 3 4\n"
    );
    let names: Vec<_> = beside.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["shape.mtl", "shape-1.png"]);
    let library = String::from_utf8(beside[0].1.clone()).unwrap();
    assert!(
        library.starts_with("newmtl a\nKd 1.0000 0.0000 0.0000\nmap_Kd shape-1.png\n"),
        "{library}"
    );
}

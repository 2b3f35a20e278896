//! OFF, feature by feature.

use crate::{Format::Off, corners, read, read_with, refused, there_and_back, write};
use octofold::SoupBuilder;

const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

#[test]
fn comments_blank_lines_and_counts_anywhere() {
    let plain = read(Off, format!("OFF\n4 1 0\n{SQUARE}4 0 1 2 3\n"));
    assert_eq!(corners(&plain), [[0, 1, 2, 3]]);
    let odd = format!("\r\n # first\n\tOFF4 1 # counts\n\n{SQUARE}# faces\n4 0 1\n2 3 # end")
        .replace('\n', "\r\n");
    assert_eq!(read(Off, odd), plain);
    assert_eq!(read(Off, format!("OFF 4 1 0 {SQUARE} 4 0 1 2 3").replace('\n', " ")), plain);
}

#[test]
fn colours_of_points_and_faces_in_bytes_or_fractions() {
    let text = "COFF\n3 3 0\n0 0 0 255 0 1 2\n1 0 0 1.0 0.5 0\n0 1 0 0 0 0\n3 0 1 2 1 2 3\n3 0 1 2 0.0 1 0 0.5\n3 0 1 2 7\n";
    let soup = read(Off, text);
    let a = soup.attributes();
    assert_eq!(a.point_colours, Some(vec![[255, 0, 1, 2], [255, 128, 0, 255], [0, 0, 0, 255]]));
    assert_eq!(a.face_colours, Some(vec![[1, 2, 3, 255], [0, 255, 0, 128], [255; 4]]));
}

#[test]
fn normals_and_texture_coordinates() {
    let triangle = "3 0 1 2\n";
    let soup = read(Off, format!("NOFF 3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 1 0\n{triangle}"));
    assert_eq!(soup.attributes().point_normals.as_ref().map(|n| n[2]), Some([0.0, 1.0, 0.0]));
    for header in ["STCNOFF", "STNCOFF"] {
        let text = format!(
            "{header} 3 1 0\n0 0 0 0 0 1 9 8 7 6 .1 .2\n1 0 0 0 0 1 1 2 3 4 .3 .4\n0 1 0 0 1 0 0 0 0 0 .5 .6\n{triangle}"
        );
        let soup = read(Off, text);
        let a = soup.attributes();
        assert_eq!(a.point_colours.as_ref().map(|c| c[0]), Some([9, 8, 7, 6]));
        assert_eq!(a.corner_uvs, Some(vec![[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]));
    }
}

#[test]
fn edges_are_skipped() {
    let (soup, findings) =
        read_with(Off, format!("OFF\n4 2 0\n{SQUARE}2 0 1\n3 0 1 2\n"), &[]).unwrap();
    assert_eq!((soup.faces(), findings), (1, vec!["short-faces"]));
}

#[test]
fn refusals_name_line_and_fact() {
    let far = refused(Off, format!("OFF\n4 1 0\n{SQUARE}3 0 1 4\n"));
    assert_eq!(far, "off: line 7: face 1 names vertex 4, but there are 4");
    assert!(refused(Off, "OFF BINARY\n").contains("binary OFF is not read"));
    assert!(refused(Off, "4OFF\n1 0 0\n").contains("three dimensions"));
    assert!(refused(Off, "nOFF\n3\n1 0 0\n").contains("three dimensions"));
    assert!(refused(Off, "off\n").contains("'off' stands where OFF"));
    assert!(refused(Off, "OFF\n18446744073709551616 0 0\n").contains("no number of vertices"));
    assert!(
        refused(Off, "OFF\n9999999999 1 0\n0 0 0\n").contains("ends in vertex 2 of 9999999999")
    );
    assert!(refused(Off, format!("OFF\n4 1 0\n{SQUARE}4000000000 0 1 2\n")).contains("corners"));
    assert!(refused(Off, "OFF\n1 0 0\n0 inf 0\n").contains("line 3: vertex 1 of 1"));
    assert!(refused(Off, "").contains("OFF"));
}

#[test]
fn written_colours_and_normals_come_back() {
    let mut builder = SoupBuilder::default();
    builder.points = vec![[0.1, 1e-9, 0.0], [1e20, 0.0, 0.0], [0.0, 1.0 / 3.0, 0.0]];
    builder.face(&[0, 1, 2]);
    builder.attributes.point_colours = Some(vec![[1, 2, 3, 4], [5, 6, 7, 8], [255; 4]]);
    builder.attributes.point_normals = Some(vec![[0.0, 0.0, 1.0]; 3]);
    builder.attributes.face_colours = Some(vec![[9, 8, 7, 6]]);
    let soup = builder.build().unwrap();
    assert_eq!(there_and_back(Off, &soup), soup);
    assert!(write(Off, &soup).0.starts_with(b"CNOFF\n3 1 0\n0.1 1e-9 0 0 0 1 1 2 3 4\n"));
}

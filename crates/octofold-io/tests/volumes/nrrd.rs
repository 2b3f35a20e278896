//! Features of NRRD, on headers made by hand.

use super::nifti::gzip;
use super::{beside, read, read_with_findings, refusal, samples};
use octofold::LengthUnit;
use octofold::volume::{Block, Label};
use octofold_io::Source;

/// A file with these header lines and these data.
fn nrrd(lines: &[&str], data: &[u8]) -> Vec<u8> {
    let mut bytes = format!("NRRD0005\n# made by hand\n{}\n\n", lines.join("\n")).into_bytes();
    bytes.extend(data);
    bytes
}

const SMALL: [&str; 4] = ["type: uchar", "dimension: 3", "sizes: 2 1 2", "encoding: raw"];

fn small(more: &[&str]) -> Vec<u8> {
    nrrd(&[&SMALL, more].concat(), &[1, 2, 3, 4])
}

#[test]
fn every_encoding_gives_the_same_samples() {
    let bytes: Vec<u8> = [-2i16, 1, 300, 4].iter().flat_map(|v| v.to_be_bytes()).collect();
    let swapped: Vec<u8> = [-2i16, 1, 300, 4].iter().flat_map(|v| v.to_le_bytes()).collect();
    let cases: [(&str, &str, Vec<u8>); 6] = [
        ("big", "raw", bytes.clone()),
        ("little", "raw", swapped.clone()),
        ("little", "gz", gzip(&swapped)),
        ("big", "gzip", [gzip(&bytes[..3]), gzip(&bytes[3..])].concat()),
        ("big", "ascii", b"-2 1\r\n300,4\n".to_vec()),
        ("little", "hex", b"feff 0100\n2c010400".to_vec()),
    ];
    for (endian, encoding, data) in cases {
        let lines = [
            "type: short".to_owned(),
            "dimension: 3".to_owned(),
            "sizes: 2 1 2".to_owned(),
            format!("endian: {endian}"),
            format!("encoding: {encoding}"),
        ];
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let volume = read("x.nrrd", nrrd(&lines, &data)).unwrap();
        assert_eq!(volume.dims(), [2, 1, 2]);
        assert_eq!(samples(&*volume), Block::I16(vec![-2, 1, 300, 4].into()), "{encoding}");
    }
    let bzip2 = nrrd(&["type: uchar", "dimension: 1", "sizes: 1", "encoding: bz2"], &[0]);
    assert!(refusal(&Source::from_bytes("x.nrrd", bzip2)).contains("bzip2 is not read"));
}

#[test]
fn line_ends_of_any_kind_and_loose_spelling_are_read() {
    let text = "NRRD0001\r\nType:unsigned char\r\ndimension: 3\r\nSIZES:  2 1 2 \r\n\
                encoding: RAW\r\nkey with: colon:=kept\r\n\r\n";
    let bytes = [text.as_bytes(), &[1, 2, 3, 4]].concat();
    let volume = read("x.nrrd", bytes).unwrap();
    assert_eq!(samples(&*volume), Block::U8(vec![1, 2, 3, 4].into()));
}

#[test]
fn spaces_become_right_anterior_superior() {
    let directions = "space directions: (2,0,0) (0,3,0) (0,0.5,4)";
    for (space, signs) in [
        ("right-anterior-superior", [1.0, 1.0, 1.0]),
        ("LPS", [-1.0, -1.0, 1.0]),
        ("left-anterior-superior", [-1.0, 1.0, 1.0]),
    ] {
        let space = format!("space: {space}");
        let volume =
            read("x.nrrd", small(&[&space, directions, "space origin: (10,20,30)"])).unwrap();
        let [x, y, z] = volume.placement().place([1.0, 1.0, 1.0]);
        assert_eq!([x * signs[0], y * signs[1], z * signs[2]], [12.0, 23.5, 34.0], "{space}");
        assert_eq!(volume.placement().unit, Some(LengthUnit::Millimetre));
    }
    let plain = small(&["space: 3D-right-handed", directions, "space units: \"cm\" \"cm\" \"cm\""]);
    let placement = read("x.nrrd", plain).unwrap().placement();
    assert_eq!(placement.place([1.0, 1.0, 1.0]), [2.0, 3.5, 4.0]);
    assert_eq!(placement.unit, Some(LengthUnit::Centimetre));
}

#[test]
fn without_space_spacings_and_minima_count() {
    let nodes = small(&["spacings: 2 NaN 0.5", "axis mins: 1 2 3"]);
    let placement = read("x.nrrd", nodes).unwrap().placement();
    assert_eq!(placement.place([1.0, 1.0, 1.0]), [3.0, 3.0, 3.5]);
    assert_eq!(placement.unit, None);
    let cells = small(&["axis mins: 0 0 0", "axis maxs: 4 3 1", "centers: cell cell node"]);
    let placement = read("x.nrrd", cells).unwrap().placement();
    assert_eq!(placement.place([0.0; 3]), [1.0, 1.5, 0.0]);
    assert_eq!(placement.place([1.0; 3]), [3.0, 4.5, 1.0]);
    let flat = small(&["space directions: (1,0,0) (1,0,0) (0,0,1)", "space dimension: 3"]);
    let (_, codes) = read_with_findings(&Source::from_bytes("x.nrrd", flat));
    assert_eq!(codes, ["placement-ignored"]);
}

#[test]
fn data_lie_beside_the_header() {
    let head = |data: &str| {
        format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 2\nencoding: raw\n{data}")
            .into_bytes()
    };
    let all: &[u8] = &[1, 2, 3, 4];
    let (low, high) = all.split_at(2);
    let text: &[u8] = b"two\nlines\n\x01\x02\x03\x04";
    let late: &[u8] = &[9, 9, 9, 1, 2, 3, 4];
    type Files<'a> = Vec<(&'a str, &'a [u8])>;
    let cases: [(Vec<u8>, Files<'_>); 6] = [
        (head("data file: d.raw\n"), vec![("d.raw", all)]),
        (head("datafile: d.raw\nlineskip: 2\n\n"), vec![("d.raw", text)]),
        (head("data file: d.raw\nbyte skip: 3"), vec![("d.raw", late)]),
        (head("data file: d.raw\nbyte skip: -1"), vec![("d.raw", late)]),
        (head("data file: LIST\na.raw\nb.raw\n"), vec![("a.raw", low), ("b.raw", high)]),
        (head("data file: p%03d.raw 7 9 2\n"), vec![("p007.raw", low), ("p009.raw", high)]),
    ];
    for (header, mut files) in cases {
        files.push(("h.nhdr", &header));
        let (volume, codes) = read_with_findings(&beside("h.nhdr", &files));
        assert_eq!(samples(&*volume), Block::U8(all.into()));
        assert!(codes.is_empty(), "{codes:?}");
    }
    let missing = head("data file: d.raw\n");
    let said = refusal(&beside("h.nhdr", &[("h.nhdr", &missing)]));
    assert!(said.contains("h.nhdr") && said.contains("d.raw"), "{said}");
    let short = head("data file: LIST\na.raw\nb.raw\n");
    let said = refusal(&beside("h.nhdr", &[("h.nhdr", &short), ("a.raw", low), ("b.raw", &[1])]));
    assert!(said.contains("b.raw"), "{said}");
}

#[test]
fn axes_that_are_not_of_space_make_several_volumes() {
    let list = nrrd(
        &[
            "type: uchar",
            "dimension: 4",
            "sizes: 2 2 1 2",
            "kinds: list domain domain domain",
            "space dimension: 3",
            "space directions: none (1,0,0) (0,2,0) (0,0,3)",
            "encoding: raw",
        ],
        &[1, 9, 2, 9, 3, 9, 4, 9],
    );
    let (volume, codes) = read_with_findings(&Source::from_bytes("x.nrrd", list));
    assert_eq!(samples(&*volume), Block::U8(vec![1, 2, 3, 4].into()));
    assert_eq!(volume.placement().place([1.0; 3]), [1.0, 2.0, 3.0]);
    assert_eq!(codes, ["first-of-4d"]);

    let last = nrrd(
        &["type: uchar", "dimension: 4", "sizes: 2 1 2 2", "encoding: gzip"],
        &gzip(&[1, 2, 3, 4, 9, 9, 9, 9]),
    );
    let (volume, codes) = read_with_findings(&Source::from_bytes("x.nrrd", last));
    assert_eq!(samples(&*volume), Block::U8(vec![1, 2, 3, 4].into()));
    assert_eq!(codes, ["first-of-4d"]);

    let colours = nrrd(
        &[
            "type: uchar",
            "dimension: 3",
            "sizes: 3 2 1",
            "kinds: RGB-color domain domain",
            "encoding: raw",
        ],
        &[255, 255, 255, 0, 255, 0],
    );
    let (volume, codes) = read_with_findings(&Source::from_bytes("x.nrrd", colours));
    assert_eq!(volume.dims(), [2, 1, 1]);
    assert_eq!(samples(&*volume), Block::U8(vec![255, 182].into()));
    assert_eq!(codes, ["colour-to-luminance"]);
}

#[test]
fn segments_of_the_first_layer_become_labels() {
    let bytes = small(&[
        "Segment0_Name:=left lung",
        "Segment0_Color:=1 0.5 0",
        "Segment0_LabelValue:=3",
        "Segment0_Layer:=0",
        "Segment10_Name:=other layer",
        "Segment10_LabelValue:=1",
        "Segment10_Layer:=1",
        "Segment2_LabelValue:=7",
        "SegmentX_Name:=nobody",
    ]);
    let volume = read("x.seg.nrrd", bytes).unwrap();
    let label = |value, name: &str, colour| Label { value, name: name.into(), colour };
    let expected = [label(3, "left lung", [255, 128, 0, 255]), label(7, "", [255; 4])];
    assert_eq!(volume.labels(), expected);
}

#[test]
fn damaged_headers_are_refused_in_words() {
    for (lines, says) in [
        (vec!["type: uchar"], "no field \"dimension\""),
        (vec!["dimension: 99"], "line 3: dimension is \"99\""),
        (vec!["dimension: 3", "sizes: 1 2"], "not 3 counts"),
        (vec!["dimension: 2", "sizes: 0 2"], "not 2 counts"),
        (vec!["dimension: 1", "sizes: 2", "type: block", "encoding: raw"], "block"),
        (vec!["dimension: 1", "sizes: 2", "type: what", "encoding: raw"], "\"what\""),
        (vec!["dimension: 1", "sizes: 2", "type: int", "encoding: raw"], "\"endian\""),
        (vec!["dimension: 1", "sizes: 2", "type: int8", "encoding: zip"], "\"zip\""),
        (vec!["nonsense"], "neither a field nor a key"),
        (
            vec!["dimension: 1", "sizes: 2", "type: int8", "encoding: txt", "byte skip: -1"],
            "byte skip of -1",
        ),
        (
            vec!["dimension: 1", "sizes: 2", "type: int8", "encoding: raw", "spacings: x"],
            "\"x\" is no number",
        ),
        (
            vec!["dimension: 1", "sizes: 2", "type: int8", "encoding: raw", "space origin: 1"],
            "no vector",
        ),
        (vec!["dimension: 1", "sizes: 2", "type: int8", "encoding: txt"], "after 1 of 2"),
        (vec!["dimension: 1", "sizes: 9", "type: int8", "encoding: txt"], "9 numbers"),
        (vec!["dimension: 1", "sizes: 2", "type: int8", "encoding: hex"], "after 1 of 2 bytes"),
        (
            vec![
                "dimension: 1",
                "sizes: 18446744073709551615",
                "type: int64",
                "encoding: raw",
                "endian: big",
            ],
            "more than this machine",
        ),
        (
            vec!["dimension: 1", "sizes: 1000000000000", "type: int8", "encoding: gzip"],
            "compressed bytes can hold",
        ),
    ] {
        let said = refusal(&Source::from_bytes("x.nrrd", nrrd(&lines, b" 10 \n")));
        assert!(said.contains(says), "{lines:?}: {said}");
    }
    let large = nrrd(&["type: int8", "dimension: 1", "sizes: 2", "encoding: txt"], b"1 200");
    assert!(refusal(&Source::from_bytes("x.nrrd", large)).contains("number 1 is \"200\""));
}

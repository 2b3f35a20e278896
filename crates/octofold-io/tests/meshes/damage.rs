//! Hostile bytes: every prefix of a valid file, and flips of single bytes.

use crate::{MESHES, pixel, read_with, write};
use octofold::{Attributes, LengthUnit, Material, Soup, SoupBuilder};
use octofold_io::Format;

/// A small shape with everything that a file can hold.
fn rich() -> Soup {
    let mut builder = SoupBuilder::default();
    builder.points =
        vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 2.0]];
    builder.face(&[3, 2, 1, 0]);
    for i in 0..4 {
        builder.face(&[i, (i + 1) % 4, 4]);
    }
    let texture =
        octofold::attributes::Texture { media_type: "image/png".into(), bytes: pixel().into() };
    let a = &mut builder.attributes;
    a.point_colours = Some((0..5).map(|i| [i, 50 * i, 255, 255]).collect());
    a.point_normals = Some(vec![[0.0, 0.0, 1.0]; 5]);
    a.corner_uvs = Some((0..16).map(|i| [i as f32 / 16.0, 0.5]).collect());
    a.materials = vec![
        Material { name: "a".into(), colour: [255, 0, 0, 255], texture: Some(texture) },
        Material { name: "b".into(), colour: [0, 255, 0, 128], texture: None },
    ];
    a.face_materials = Some(vec![0, 1, Attributes::NO_MATERIAL, 1, 0]);
    a.face_labels = Some(vec![1, 1, 2, 2, 2]);
    a.label_names = vec![(1, "one".into()), (2, "two".into())];
    builder.unit = Some(LengthUnit::Millimetre);
    builder.build().unwrap()
}

/// Files to damage: what the writers write, and texts with what they do not.
fn victims() -> Vec<(Format, Vec<u8>)> {
    let rich = rich();
    let mut victims: Vec<_> = MESHES.iter().map(|&f| (f, write(f, &rich).0)).collect();
    let stl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
        endloop\nendfacet\nendsolid a\nsolid b\nendsolid b\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n5 0 1 2 -1 0\n";
    victims.push((Format::Stl, stl.into()));
    victims.push((Format::Ply, ply.into()));
    victims
}

/// Reads, and looks at everything that was read.
fn survive(format: Format, bytes: &[u8]) {
    if let Ok((soup, _)) = read_with(format, bytes, &[]) {
        assert!(soup.points().iter().flatten().all(|x| x.is_finite()));
        assert!(soup.triangulate().check().is_ok());
    }
}

#[test]
fn no_prefix_panics() {
    for (format, bytes) in victims() {
        assert!(read_with(format, bytes.as_slice(), &[]).is_ok(), "{format:?}");
        for end in 0..bytes.len() {
            survive(format, &bytes[..end]);
        }
    }
}

#[test]
fn no_flipped_byte_panics() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    for (format, bytes) in victims() {
        for _ in 0..3000 {
            let mut bytes = bytes.clone();
            for _ in 0..1 + random(4) {
                let at = random(bytes.len());
                bytes[at] = random(256) as u8;
            }
            survive(format, &bytes);
        }
    }
}

#[test]
fn no_digit_panics() {
    // A nine in place of any digit makes counts and indices that nothing is behind.
    for (format, bytes) in victims() {
        for at in (0..bytes.len()).filter(|&at| bytes[at].is_ascii_digit()) {
            let mut bytes = bytes.clone();
            bytes[at] = b'9';
            survive(format, &bytes);
            bytes.splice(at..at, *b"999999999");
            survive(format, &bytes);
        }
    }
}

/// Every file of the fuzzers' corpora, through every reader.
#[test]
fn the_corpus_is_survived() {
    let corpus = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut count = 0;
    for format in MESHES {
        let target = if format == Format::ThreeMf { "threemf" } else { format.name() };
        let Ok(files) = std::fs::read_dir(corpus.join(target)) else { continue };
        for file in files {
            let bytes = std::fs::read(file.unwrap().path()).unwrap();
            MESHES.iter().for_each(|&any| survive(any, &bytes));
            count += 1;
        }
    }
    assert!(count > 0, "the corpus is empty");
}

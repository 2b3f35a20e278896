//! What is written is read again, down to the last bit where the format holds it.

use crate::{MESHES, corners, faces, there_and_back};
use octofold::{Soup, SoupBuilder};
use octofold_io::{Format, Source, read_mesh, write_mesh};
use proptest::prelude::*;

/// Shapes of a few polygons on points with these coordinates.
fn soups(coordinate: impl Strategy<Value = f64> + Clone + 'static) -> impl Strategy<Value = Soup> {
    let point = [coordinate.clone(), coordinate.clone(), coordinate];
    let points = proptest::collection::vec(point, 3..20);
    points.prop_flat_map(|points| {
        let corner = 0..points.len() as u32;
        let face = proptest::collection::vec(corner, 3..7);
        let faces = proptest::collection::vec(face, 0..12);
        (Just(points), faces).prop_map(|(points, faces)| {
            let mut builder = SoupBuilder::default();
            builder.points = points;
            faces.iter().for_each(|face| builder.face(face));
            builder.build().unwrap()
        })
    })
}

fn any_double() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![
        Just(0.0),
        -1000.0..1000.0f64,
        proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO,
    ]
}

fn any_single() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![Just(0.0f32), -1000.0..1000.0f32, proptest::num::f32::NORMAL].prop_map(f64::from)
}

/// With a value in every column, as `format` can hold it.
fn with_columns(soup: &Soup, seed: u8) -> Soup {
    let mut builder = SoupBuilder::default();
    builder.points = soup.points().to_vec();
    corners(soup).iter().for_each(|face| builder.face(face));
    let byte = |i: usize| (i as u8).wrapping_mul(37).wrapping_add(seed);
    let a = &mut builder.attributes;
    let (points, faces) = (builder.points.len(), soup.faces());
    a.point_colours = Some((0..points).map(|i| [byte(i), byte(i + 1), byte(i + 2), 255]).collect());
    a.point_normals = Some((0..points).map(|_| [0.0, 0.0, 1.0]).collect());
    a.corner_uvs = Some(soup.corners().iter().map(|&p| [p as f32 / 8.0, 0.25]).collect());
    a.face_labels = Some((0..faces).map(|i| 1 + u32::from(byte(i)) % 3).collect());
    builder.build().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn doubles_and_polygons_survive_text_and_ply(soup in soups(any_double())) {
        for format in [Format::Obj, Format::Ply, Format::Off] {
            prop_assert_eq!(&there_and_back(format, &soup), &soup);
        }
    }

    #[test]
    fn singles_survive_in_every_format(soup in soups(any_single())) {
        let triangles = faces(&Soup::from(soup.triangulate()));
        for format in [Format::Stl, Format::Gltf, Format::Glb] {
            prop_assert_eq!(faces(&there_and_back(format, &soup)), triangles.clone());
        }
    }

    #[test]
    fn columns_survive_where_they_fit(soup in soups(any_single()), seed: u8) {
        prop_assume!(soup.faces() > 0);
        let soup = with_columns(&soup, seed);
        let (a, ply) = (soup.attributes(), there_and_back(Format::Ply, &soup));
        prop_assert_eq!(&ply, &soup);
        let obj = there_and_back(Format::Obj, &soup);
        prop_assert_eq!(&obj.attributes().point_colours, &a.point_colours);
        prop_assert_eq!(corners(&obj), corners(&soup));
        prop_assert_eq!(&obj.attributes().corner_uvs, &a.corner_uvs);
        let off = there_and_back(Format::Off, &soup);
        prop_assert_eq!(&off.attributes().point_colours, &a.point_colours);
        prop_assert_eq!(&off.attributes().point_normals, &a.point_normals);
        let glb = there_and_back(Format::Glb, &soup);
        prop_assert_eq!(glb.triangle_count(), soup.triangle_count());
    }
}

#[test]
fn the_front_door_finds_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let mut builder = SoupBuilder::default();
    builder.points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    builder.face(&[0, 1, 2]);
    let soup = builder.build().unwrap();
    let run = octofold::Run::default();
    for format in MESHES {
        let path = folder.path().join(format!("a.{}", format.name()));
        write_mesh(&soup, &path, None, &run).unwrap();
        let back = read_mesh(&Source::open(&path).unwrap(), None, &run).unwrap();
        assert_eq!(faces(&back), faces(&soup), "{format:?}");
    }
    let wrong = folder.path().join("b.off");
    std::fs::write(&wrong, "OFF 1 1 0 0 0 0 3 0 0 9").unwrap();
    let error = read_mesh(&Source::open(&wrong).unwrap(), None, &run).unwrap_err();
    let expected =
        format!("{}: off: line 1: face 1 names vertex 9, but there are 1", wrong.display());
    assert_eq!(error.to_string(), expected);
    let volume = write_mesh(&soup, &folder.path().join("c.nrrd"), None, &run).unwrap_err();
    assert!(volume.to_string().contains("voxelize"), "{volume}");
    assert!(write_mesh(&soup, &folder.path().join("c.xyz"), None, &run).is_err());
    assert!(!folder.path().join("c.nrrd").exists());
}

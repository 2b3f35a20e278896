//! Pictures looked at as numbers: what must be on them and what must not.

use super::*;
use crate::samples::Sample;
use crate::volume::{DenseVolume, Placement, Region, Volume};

const CLEAR: Style = Style {
    shading: Shading::Flat,
    paint: Paint::Plain,
    colour: [90, 160, 90],
    back: Some([200, 0, 0]),
    wireframe: None,
    boundary: None,
    background: Background::Clear,
};

fn front(size: [u32; 2]) -> View {
    View {
        size,
        direction: [0.0, 1.0, 0.0],
        projection: Projection::Orthographic,
        margin: 0.25,
        ..View::default()
    }
}

fn drawn(mesh: &Mesh, view: &View, style: &Style) -> Picture {
    render(mesh, view, style, &Run::default()).unwrap()
}

fn pixels(picture: &Picture) -> Vec<[u8; 4]> {
    picture.rgba.as_chunks().0.to_vec()
}

/// A square of two triangles that faces -y.
fn square() -> Mesh {
    let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, z]| [x, 0.0, z]);
    Mesh::new(points.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()
}

#[test]
fn a_square_covers_its_pixels_and_no_others() {
    let picture = drawn(&square(), &front([100, 100]), &CLEAR);
    for (i, [.., alpha]) in pixels(&picture).into_iter().enumerate() {
        let inside = [i % 100, i / 100].iter().all(|p| (25..75).contains(p));
        assert_eq!(alpha, if inside { 255 } else { 0 }, "pixel {i}");
    }
}

#[test]
fn shapes_that_differ_in_format_only_look_alike() {
    let sphere = Sample::Sphere.polygons(48).unwrap();
    let mesh = sphere.triangulate();
    let mut apart = Mesh::default();
    for t in 0..mesh.triangles.len() {
        let first = apart.points.len() as u32;
        apart.points.extend(mesh.corners(t));
        apart.triangles.push([first, first + 1, first + 2]);
    }
    let style = Style { boundary: Some(Style::RED), ..Style::default() };
    let view = View::default().sized(120, 90);
    assert_eq!(drawn(&mesh, &view, &style), drawn(&apart, &view, &style));
}

#[test]
fn faces_seen_from_behind_are_tinted() {
    let mut mesh = square();
    let is_red = |p: &Picture| {
        let [r, g, b, _] = pixels(p)[50 * 100 + 50];
        r > g && r > b
    };
    assert!(!is_red(&drawn(&mesh, &front([100, 100]), &CLEAR)));
    mesh.triangles.iter_mut().for_each(|t| t.reverse());
    assert!(is_red(&drawn(&mesh, &front([100, 100]), &CLEAR)));
    let alike = Style { back: None, ..CLEAR };
    assert!(!is_red(&drawn(&mesh, &front([100, 100]), &alike)));
}

#[test]
fn edges_with_one_face_are_marked_and_others_are_not() {
    let style = Style { boundary: Some([255, 0, 0]), ..CLEAR };
    let view = front([100, 100]);
    let marked = |mesh: &Mesh| {
        let red = |p: &[u8; 4]| p[0] > 200 && p[1] < 60 && p[2] < 60 && p[3] > 200;
        pixels(&drawn(mesh, &view, &style)).iter().filter(|p| red(p)).count()
    };
    // Four sides of 50 pixels, about two pixels wide; the diagonal has two faces.
    assert!((300..600).contains(&marked(&square())));
    assert_eq!(marked(&Sample::Cube.polygons(1).unwrap().triangulate()), 0);
}

#[test]
fn the_nearer_face_is_seen() {
    let mut mesh = square();
    let behind: Vec<[f64; 3]> = mesh.points.iter().map(|&[x, _, z]| [x, 0.5, z]).collect();
    mesh.points.extend(behind);
    mesh.triangles.extend([[4, 5, 6], [4, 6, 7]]);
    mesh.attributes.face_colours =
        Some(vec![[0, 0, 255, 255], [0, 0, 255, 255], [0, 255, 0, 255], [0, 255, 0, 255]]);
    for projection in [Projection::Orthographic, Projection::Perspective { degrees: 40.0 }] {
        let view = View { projection, ..front([100, 100]) };
        let style = Style { paint: Paint::Own, ..CLEAR };
        let [r, g, b, _] = pixels(&drawn(&mesh, &view, &style))[50 * 100 + 50];
        assert!(b > r && b > g);
        let view = View { direction: [0.0, -1.0, 0.0], ..view };
        let [r, g, b, _] = pixels(&drawn(&mesh, &view, &Style { back: None, ..style }))[5050];
        assert!(g > r && g > b);
    }
}

#[test]
fn colours_come_from_where_they_are_asked_for() {
    let mut mesh = square();
    let at_middle = |mesh: &Mesh, paint| {
        let style = Style { paint, ..CLEAR };
        let [r, g, b, _] = pixels(&drawn(mesh, &front([100, 100]), &style))[50 * 100 + 50];
        [r, g, b]
    };
    let brightest = |c: [u8; 3]| (0..3).max_by_key(|&i| c[i]).unwrap();
    assert_eq!(brightest(at_middle(&mesh, Paint::Own)), 1);
    mesh.attributes.point_colours = Some(vec![[200, 10, 10, 255]; 4]);
    assert_eq!(brightest(at_middle(&mesh, Paint::Own)), 0);
    assert_eq!(brightest(at_middle(&mesh, Paint::Plain)), 1);
    mesh.attributes.face_colours = Some(vec![[10, 10, 200, 255]; 2]);
    assert_eq!(brightest(at_middle(&mesh, Paint::Own)), 2);
    mesh.attributes.face_labels = Some(vec![0, 0]);
    let zero = at_middle(&mesh, Paint::Labels);
    mesh.attributes.face_labels = Some(vec![5, 5]);
    assert_ne!(zero, at_middle(&mesh, Paint::Labels));
}

#[test]
fn a_frame_shows_several_meshes_alike() {
    let (square, mut half) = (square(), square());
    half.triangles.pop();
    half.points[3] = [0.5, 0.0, 0.5];
    let view = View { frame: square.bounds(), ..front([100, 100]) };
    assert_eq!(drawn(&square, &view, &CLEAR), drawn(&square, &front([100, 100]), &CLEAR));
    let (whole, part) = (drawn(&square, &view, &CLEAR), drawn(&half, &view, &CLEAR));
    // Below the diagonal both look the same.
    for (x, y) in [(70, 70), (40, 65), (60, 45)] {
        let at = y * 100 + x;
        assert_eq!(pixels(&whole)[at], pixels(&part)[at]);
    }
    assert_eq!(pixels(&part)[30 * 100 + 30], [0; 4]);
}

#[test]
fn odd_meshes_make_pictures_all_the_same() {
    let line = Mesh::new(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0, 1, 2], [0, 0, 1]]).unwrap();
    let dot = Mesh::new(vec![[3.0; 3]], vec![[0, 0, 0]]).unwrap();
    let huge =
        Mesh::new(vec![[-1e300, 0.0, 0.0], [1e300, 0.0, 0.0], [0.0, 0.0, 1e300]], vec![[0, 1, 2]])
            .unwrap();
    for mesh in [Mesh::default(), line, dot, huge] {
        for projection in [Projection::Orthographic, Projection::Perspective { degrees: 30.0 }] {
            for size in [[0, 0], [1, 1], [33, 65]] {
                let boundary = Some(Style::RED);
                let style = Style { boundary, wireframe: Some(Style::INK), ..Style::default() };
                let view = View { size, projection, ..View::default() };
                let picture = drawn(&mesh, &view, &style);
                assert_eq!(picture.rgba.len() as u32, size[0] * size[1] * 4);
                // A frame that shows but a corner of the mesh, from within it.
                let frame = Some([[0.9; 3], [1.0, 1.0, 1.1]]);
                drawn(&mesh, &View { frame, ..view }, &style);
            }
        }
    }
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let mesh = Sample::Scan.polygons(64).unwrap().triangulate();
    let style =
        Style { boundary: Some(Style::RED), wireframe: Some(Style::INK), ..Style::default() };
    let volume = Sample::Kettle.volume(40).unwrap();
    let both = |threads| {
        par::with_threads(threads, || {
            let cut = slices(&volume, &SliceStyle::default(), &Run::default()).unwrap();
            (drawn(&mesh, &View::default().sized(200, 150), &style), cut)
        })
    };
    let one = both(1);
    for threads in [2, 3, 8] {
        assert!(one == both(threads), "{threads} threads");
    }
}

#[test]
fn work_that_is_cancelled_stops() {
    let run = Run::default();
    run.cancel.cancel();
    let volume = Sample::Kettle.volume(8).unwrap();
    assert!(render(&square(), &View::default(), &Style::default(), &run).is_err());
    assert!(slices(&volume, &SliceStyle::default(), &run).is_err());
}

#[test]
fn slices_keep_proportions_and_show_up_as_up() {
    // Samples twice as far apart along x; everything above the middle height is set.
    let dims = [10, 20, 20];
    let samples = (0..4000).map(|i| u8::from(i / 200 >= 10)).collect();
    let placement = Placement::spacing([2.0, 1.0, 1.0]);
    let mut volume = DenseVolume::<u8>::new(dims, samples, placement).unwrap();
    volume.binary = true;
    let style = SliceStyle { height: 120, ..SliceStyle::default() };
    let picture = slices(&volume, &style, &Run::default()).unwrap();
    assert_eq!([picture.width, picture.height], [340, 120]);
    let at = |x: usize, y: usize| pixels(&picture)[y * 340 + x];
    // The first slice is set in its upper half, as is the second; the third is set all over.
    let (set, unset) = (at(60, 30), at(60, 90));
    assert_ne!(set, unset);
    assert_eq!([at(170, 30), at(170, 90)], [set, unset]);
    assert_eq!([at(280, 30), at(280, 90)], [set, set]);
}

#[test]
fn slices_of_odd_volumes_make_pictures_all_the_same() {
    let flat = |dims: [usize; 3], value: f32| {
        let samples = vec![value; dims.iter().product()];
        DenseVolume::new(dims, samples, Placement::default()).unwrap()
    };
    for volume in [flat([0, 0, 0], 0.0), flat([1, 1, 1], 3.0), flat([500, 1, 2], f32::NAN)] {
        for height in [0, 1, 60] {
            for paint in [SlicePaint::Auto, SlicePaint::Gray, SlicePaint::Labels] {
                let style = SliceStyle { height, paint, iso: Some(1.0), ..SliceStyle::default() };
                let picture = slices(&volume, &style, &Run::default()).unwrap();
                let Picture { width, rgba, .. } = &picture;
                assert_eq!(rgba.len() as u32, width * height * 4);
            }
        }
        let _ = volume.read(Region::all(Volume::dims(&volume))).unwrap();
    }
}

//! What crafting promises: sheets for anything that has a surface, no more faces than asked for where
//! the topology allows, and the same sheets each time.

use super::*;
use crate::par::with_threads;
use crate::random::Random;
use crate::samples::Sample;
use crate::soup::Soup;
use crate::sweep::cases;
use proptest::prelude::*;

fn small(faces: u64) -> CraftOptions {
    let sheets = UnfoldOptions { scale: Scale::Size(100.0), effort: 1, ..Default::default() };
    CraftOptions { faces, resolution: Some(40), sheets, ..CraftOptions::default() }
}

fn area(mesh: &Mesh) -> f64 {
    crate::measure::Extent::of(mesh, &Run::default()).unwrap().area
}

fn crafted(mesh: &Mesh, options: &CraftOptions) -> Crafted {
    craft(mesh, options, &Run::default()).unwrap()
}

#[test]
fn what_can_be_built_stays_as_it_is() {
    let cube = Sample::Cube.polygons(1).unwrap().triangulate();
    let Crafted { account, unfolded, .. } = crafted(&cube, &small(100));
    assert_eq!((account.repaired, account.attempts.len()), (None, 1));
    assert_eq!((unfolded.account.faces, unfolded.account.pieces_unlimited), (6, 1));
}

#[test]
fn the_house_with_the_chimney_is_built_of_single_sheets() {
    let house = Sample::House.polygons(1).unwrap().triangulate();
    let options = CraftOptions { resolution: Some(64), ..small(100) };
    let Crafted { mesh, steps, account, unfolded } = crafted(&house, &options);
    assert_eq!(account.repaired, Some(Cause::Crossings));
    assert!(unfolded.account.faces <= 100);
    assert!(unfolded.pattern.folded().error < 1e-4);
    let share = area(&mesh) / area(&house);
    assert!((share - 1.0).abs() < 0.05, "{share} of the area");
    // The steps that are told make the very mesh that was unfolded.
    let bare: Soup = Mesh { attributes: Default::default(), ..house }.into();
    let again = pipeline::pipeline(bare.into(), &steps, &Run::default()).unwrap();
    let Shape::Soup(soup) = again.shape else { panic!("a mesh became a volume") };
    assert_eq!(soup.triangulate(), mesh);
}

#[test]
fn a_thin_plate_is_one_sheet() {
    let cube = Sample::Cube.polygons(1).unwrap().triangulate();
    let plate = cube.map(|[x, y, z]| [x, y, 0.01 * z]);
    let Crafted { mesh, account, .. } = crafted(&plate, &small(50));
    assert_eq!(account.repaired, Some(Cause::Thin));
    let share = area(&mesh) / (area(&plate) / 2.0);
    assert!((share - 1.0).abs() < 0.03, "{share} of the area of one side");
}

#[test]
fn sheets_are_the_same_for_any_number_of_threads() {
    let house = Sample::House.polygons(1).unwrap().triangulate();
    let of = |threads| with_threads(threads, || crafted(&house, &small(60)).unfolded.pattern);
    assert!(of(1) == of(3));
}

#[test]
fn a_model_that_is_too_large_for_the_page_is_made_smaller_or_its_faces_are_cut() {
    let cube = Sample::Cube.polygons(1).unwrap().triangulate();
    let mut options = small(10);
    options.sheets.page = [80.0, 80.0];
    let account = crafted(&cube, &options).account;
    assert!(account.shrunk.is_some_and(|share| share < 0.6));
    options.shrink = false;
    let found = crafted(&cube, &options);
    assert_eq!(found.account.shrunk, None);
    assert!(found.unfolded.account.divided >= 6);
}

proptest! {
    #![proptest_config(cases(8))]

    /// Random triangles, through each other and apart.
    #[test]
    fn any_triangles_become_sheets(seed in any::<u64>(), faces in 1usize..12) {
        let mut random = Random::new(seed);
        let points = (0..3 * faces).map(|_| std::array::from_fn(|_| random.unit())).collect();
        let triangle = |t| [3 * t, 3 * t + 1, 3 * t + 2];
        let mesh = Mesh::new(points, (0..faces as u32).map(triangle).collect()).unwrap();
        match craft(&mesh, &small(50), &Run::default()) {
            Ok(Crafted { unfolded, .. }) => {
                let error = unfolded.pattern.folded().error;
                prop_assert!(error < 1e-4, "folded again, a corner is {error} mm off");
            }
            // A single needle may be thinner than a cell.
            Err(CraftError::Step(StepError::Repair(_)) | CraftError::Unfold(UnfoldError::Empty)) => {}
            Err(error) => prop_assert!(false, "{error}"),
        }
    }
}

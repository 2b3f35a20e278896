//! The guarantees, on random labellings with vertices in random places.

use super::bricks::{BRICK, Block, Bricks, Place, cell_of};
use super::labels::Labels;
use super::piercing::Target;
use super::reach::{Neighbours, Reach};
use super::*;
use crate::measure::self_intersections;
use glam::{DQuat, DVec3};
use proptest::prelude::*;

/// Puts vertices and piercing points anywhere, even outside their cells.
pub(super) struct Anywhere {
    pub(super) seed: u64,
    pub(super) steps: f64,
}

impl Anywhere {
    pub(super) fn number(&self, at: [u32; 3], salt: u64) -> f64 {
        let mut x = self.seed ^ salt.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        for a in at {
            x = (x ^ u64::from(a)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x ^= x >> 31;
        }
        (x >> 11) as f64 / (1u64 << 53) as f64
    }
}

impl Guide for Anywhere {
    fn target(&self, place: Place) -> Target {
        let at = [0, 1, 2].map(|a| (1.4 * self.number(place.at, a) - 0.2) * self.steps);
        Target { at, rank: (self.number(place.at, 3) * 4.0) as u8 }
    }

    fn crossings(&self, place: Place, axis: usize) -> Option<[f64; 2]> {
        let [a, b] = [4, 5].map(|s| self.number(place.at, s + 2 * axis as u64) * self.steps);
        (self.number(place.at, 12) < 0.8).then_some([a.min(b), a.max(b)])
    }
}

/// The labels of a grid with the given full cells, which begins near the corner of bricks.
pub(super) fn labels(side: u32, shift: u32, full: impl Fn([u32; 3]) -> bool) -> Labels {
    let dims = [(side + shift).div_ceil(BRICK) + 2; 3];
    let codes: Vec<u64> = (0..dims[0].pow(3))
        .map(|i| [i % dims[0], i / dims[0] % dims[0], i / dims[0].pow(2)])
        .filter(|b| b.iter().all(|&x| x > 0 && x + 1 < dims[0]))
        .map(|b| Bricks::code(dims, b))
        .collect();
    let mut sorted = codes;
    sorted.sort_unstable();
    let bricks = Bricks::new(dims, &sorted);
    let blocks: Vec<Block> = (0..bricks.len() as u32)
        .map(|b| {
            let mut block = [0; 8];
            for i in 0..512 {
                let local = [i & 7, i >> 3 & 7, i >> 6];
                let at: [u32; 3] = std::array::from_fn(|a| {
                    (bricks.at(b)[a] * BRICK + local[a]).wrapping_sub(BRICK + shift)
                });
                if at.iter().all(|&x| x < side) && full(at) {
                    let cell = cell_of(local);
                    block[cell as usize / 64] |= 1 << (cell % 64);
                }
            }
            block
        })
        .collect();
    let nothing = vec![[0; 8]; blocks.len()];
    Labels::new(bricks, &blocks, nothing, Reach::new(0.0), &|_, _| false, &Run::default())
        .unwrap()
        .0
}

/// Extracts until all sheets can be told apart.
fn surface(mut labels: Labels, guide: &Anywhere, lean: bool) -> Mesh {
    for _ in 0..1000 {
        match extract(&labels, guide, guide.steps as i32, lean, &Run::default()).unwrap() {
            Extracted::Done { patches, .. } => {
                let points = patches.points.iter().map(|p| p.map(f64::from)).collect();
                return Mesh::new(points, patches.triangles).unwrap();
            }
            Extracted::Shared(cells) => labels.fill(&cells),
        }
    }
    panic!("cells are filled without end");
}

/// A closed surface, or nothing: cells that do not lie four round an edge have no surface.
fn is_sound(mesh: Mesh) -> Result<(), TestCaseError> {
    if mesh.triangles.is_empty() {
        return Ok(());
    }
    let pairs = self_intersections(&mesh, &Run::default()).unwrap();
    prop_assert!(pairs.is_empty(), "{} pairs of triangles meet", pairs.len());
    let solid = Solid::try_from(mesh);
    prop_assert!(solid.is_ok(), "{}", solid.unwrap_err());
    Ok(())
}

#[test]
fn random_labellings_give_solids_that_do_not_meet_themselves() {
    let lean = prop::bool::weighted(0.8);
    let domain = (any::<u64>(), 0.02f64..0.98, 1u32..6, 0u32..8, any::<bool>(), lean);
    crate::sweep::every([400, 10_000_000], domain, |(seed, fill, side, shift, fine, lean)| {
        let guide = Anywhere { seed, steps: if fine { 4096.0 } else { 64.0 } };
        let labels = labels(side, shift, |at| guide.number(at, 99) < fill || at == [0; 3]);
        is_sound(surface(labels, &guide, lean))
    });
}

#[test]
fn every_labelling_of_two_by_two_by_two_cells_is_sound() {
    for mask in 1u32..256 {
        let guide = Anywhere { seed: u64::from(mask), steps: 256.0 };
        let full = |[x, y, z]: [u32; 3]| mask >> (x + 2 * y + 4 * z) & 1 == 1;
        is_sound(surface(labels(2, 7, full), &guide, true)).unwrap();
    }
}

/// A sphere of radius 1 in `n` rings of triangles, without those for which `drop` holds.
pub(super) fn sphere(n: u32, drop: impl Fn([f64; 3]) -> bool) -> Mesh {
    let around = 2 * n;
    let point = |i: u32, j: u32| {
        let (polar, turn) = (
            std::f64::consts::PI * f64::from(i) / f64::from(n),
            2.0 * std::f64::consts::PI * f64::from(j % around) / f64::from(around),
        );
        [polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()]
    };
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..around {
            let quad = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            let middle = [0, 1, 2].map(|a| quad.iter().map(|p| p[a]).sum::<f64>() / 4.0);
            if !drop(middle) {
                let first = points.len() as u32;
                points.extend(quad);
                triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
    }
    Mesh::new(points, triangles).unwrap()
}

pub(super) fn options(resolution: u32, gap: Gap) -> RepairOptions {
    RepairOptions { size: Size::Resolution(resolution), gap, keep_cavities: None }
}

fn volume(mesh: &Mesh) -> f64 {
    crate::measure::Extent::of(mesh, &Run::default()).unwrap().volume
}

#[test]
fn neither_order_nor_winding_nor_repeats_matter() {
    let mesh = sphere(12, |p| p[2] > 0.9);
    let repaired = repair(&mesh, &options(40, Gap::Auto), &Run::default()).unwrap().solid;
    let mut other = mesh.clone();
    other.triangles.reverse();
    other.triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    other.triangles.iter_mut().step_by(2).for_each(|t| t.rotate_left(1));
    let again = other.triangles[..100].to_vec();
    other.triangles.extend(again);
    assert_eq!(repair(&other, &options(40, Gap::Auto), &Run::default()).unwrap().solid, repaired);
    for threads in [1, 3] {
        let alone = crate::par::with_threads(threads, || {
            repair(&mesh, &options(40, Gap::Auto), &Run::default()).unwrap().solid
        });
        assert_eq!(alone, repaired);
    }
}

#[test]
fn holes_up_to_the_gap_are_closed_and_wider_ones_are_not() {
    let whole = 4.0 / 3.0 * std::f64::consts::PI;
    for (height, closes) in [(0.99, 0.4), (0.95, 0.9), (0.8, 1.6)] {
        // The hole is 2 sqrt(1 - height^2) wide, about.
        let mesh = sphere(48, |p| p[2] > height);
        let closed = repair(&mesh, &options(48, Gap::Width(closes)), &Run::default()).unwrap();
        assert!((volume(&closed.solid) / whole - 1.0).abs() < 0.1, "{height}");
        assert!(closed.account.gaps_closed >= 1);
        let open = repair(&mesh, &options(48, Gap::Width(closes / 8.0)), &Run::default()).unwrap();
        assert!(volume(&open.solid) < 0.3 * whole, "{height}");
    }
}

/// A box with sides of 2 and a slit in its top, 1.8 long and `width` wide, turned by `pose`.
fn slit_box(width: f64, pose: DQuat) -> Mesh {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let mut sheet = |corner: [f64; 3], u: DVec3, v: DVec3| {
        let (corner, first) = (DVec3::from(corner), points.len() as u32);
        let corners = [corner, corner + u, corner + u + v, corner + v];
        points.extend(corners.map(|p| (pose * p).to_array()));
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    let [x, y, z] = DVec3::AXES.map(|axis| 2.0 * axis);
    for (u, v) in [(y, x), (z, y), (x, z)] {
        sheet([-1.0; 3], u, v);
    }
    for (u, v) in [(y, z), (z, x)] {
        sheet([1.0; 3], -u, -v);
    }
    let side = 1.0 - width / 2.0;
    for left in [-1.0, 1.0 - side] {
        sheet([left, -1.0, 1.0], x * side / 2.0, y);
    }
    for low in [-1.0, 0.9] {
        sheet([side - 1.0, low, 1.0], x * width / 2.0, y / 20.0);
    }
    Mesh::new(points, triangles).unwrap()
}

#[test]
fn slits_up_to_the_gap_are_closed_and_wider_ones_are_not() {
    let turn = (prop::array::uniform3(-1f64..1.0), -1f64..1.0);
    let domain = (turn, 0.1f64..3.0, 3f64..9.0, 56u32..88);
    crate::sweep::every([24, 10_000], domain, |((axis, angle), ratio, gap, resolution)| {
        let pose = DQuat::from_xyzw(axis[0], axis[1], axis[2], angle).normalize();
        let [low, high] = slit_box(1.0, pose).bounds().unwrap().map(DVec3::from);
        let cell = (high - low).max_element() / f64::from(resolution);
        let width = ratio * gap * cell;
        let mesh = slit_box(width, pose);
        let found = repair(&mesh, &options(resolution, Gap::Cells(gap)), &Run::default()).unwrap();
        let filled = volume(&found.solid) / 8.0;
        if ratio <= 0.9 {
            prop_assert!(filled > 0.9, "a slit of {ratio} gaps is open: {filled}");
        } else if width > (1.1 * gap + 4.0) * cell {
            prop_assert!(filled < 0.6, "a slit of {ratio} gaps is closed: {filled}");
        }
        Ok(())
    });
}

#[test]
fn the_widest_throat_is_found_and_closed() {
    let whole = 4.0 / 3.0 * std::f64::consts::PI;
    let mesh = sphere(48, |p| p[2] > 0.97 || p[0] < -0.995);
    let found = repair(&mesh, &options(48, Gap::Auto), &Run::default()).unwrap();
    assert!((volume(&found.solid) / whole - 1.0).abs() < 0.1);
    let throat = &found.account.throats[0];
    assert!(throat.place[2] > 0.8, "{throat:?}");
    assert!((0.3..0.9).contains(&throat.width), "{throat:?}");
    // Half a sphere is a cup.
    let cup = sphere(48, |p| p[2] > 0.0);
    let found = repair(&cup, &options(48, Gap::Auto), &Run::default()).unwrap();
    assert_eq!(found.account.throats, []);
    assert!(volume(&found.solid) < 0.2 * whole);
}

#[test]
fn cavities_are_filled_or_kept_by_their_size() {
    let whole = 4.0 / 3.0 * std::f64::consts::PI;
    let mut mesh = sphere(32, |_| false);
    let inner = sphere(32, |_| false);
    let first = mesh.points.len() as u32;
    mesh.points.extend(inner.points.iter().map(|p| p.map(|x| x / 2.0)));
    // The inner one faces inwards.
    mesh.triangles.extend(inner.triangles.iter().map(|&[a, b, c]| [b, a, c].map(|p| p + first)));
    let volume_with = |keep_cavities| {
        let options = RepairOptions { keep_cavities, ..options(48, Gap::Cells(0.0)) };
        volume(&repair(&mesh, &options, &Run::default()).unwrap().solid) / whole
    };
    assert!((volume_with(None) - 1.0).abs() < 0.05);
    assert!((volume_with(Some(1.0)) - 1.0).abs() < 0.05);
    assert!((volume_with(Some(0.3)) - 0.875).abs() < 0.05);
}

#[test]
fn what_has_no_surface_is_refused() {
    let run = Run::default();
    let refused = |mesh: &Mesh| repair(mesh, &options(16, Gap::Auto), &run).unwrap_err();
    assert_eq!(refused(&Mesh::default()), RepairError::Empty);
    let needle = Mesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], vec![[0, 1, 2]]);
    assert!(matches!(refused(&needle.unwrap()), RepairError::Thin(_)));
}

proptest! {
    #![proptest_config(crate::sweep::cases(24))]

    #[test]
    fn any_soup_becomes_sound_and_stays_near(
        points in prop::collection::vec(prop::array::uniform3(-1f64..1.0), 3..12),
        picks in prop::collection::vec(prop::array::uniform3(0usize..12), 1..16),
        resolution in 2u32..24,
    ) {
        let triangles: Vec<[u32; 3]> =
            picks.iter().map(|t| t.map(|p| (p % points.len()) as u32)).collect();
        let mesh = Mesh::new(points, triangles).unwrap();
        let run = Run::default();
        let found = match repair(&mesh, &options(resolution, Gap::Cells(0.0)), &run) {
            Err(RepairError::Thin(_) | RepairError::Empty) => return Ok(()),
            found => found.unwrap(),
        };
        prop_assert!(found.account.exact_in_single_precision);
        let mesh_out = found.solid.as_mesh();
        prop_assert!(mesh_out.points.iter().flatten().all(|&x| f64::from(x as f32) == x));
        if found.account.filled_to_part == 0 {
            let nearest = crate::measure::Nearest::new(&mesh);
            let most = found.account.cell * 3f64.sqrt();
            for &p in &mesh_out.points {
                let hit = nearest.nearest(p).unwrap();
                prop_assert!(hit.distance_squared.sqrt() <= most);
            }
        }
        is_sound(mesh_out.clone())?;
    }
}

/// The labels of a dense grid, by the book: 1 outside, 0 full, -1 inside.
fn by_the_book(side: i32, full: &[bool], rims: &[bool], reach: Reach) -> Vec<i8> {
    let at = |x: i32, y: i32, z: i32| (x + side * (y + side * z)) as usize;
    let beside = |i: usize, most: i32| {
        let i = i as i32;
        let own = [i % side, i / side % side, i / side / side];
        (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]).filter_map(move |step| {
            let [x, y, z]: [i32; 3] = std::array::from_fn(|a| own[a] + step[a]);
            let near = step.map(i32::abs).iter().sum::<i32>() <= most;
            (near && [x, y, z].iter().all(|c| (0..side).contains(c))).then(|| at(x, y, z))
        })
    };
    let around = |i: usize| beside(i, 3);
    let spread = |cells: &[bool], most: i32| -> Vec<bool> {
        (0..cells.len()).map(|i| beside(i, most).any(|j| cells[j])).collect()
    };
    let grow = |cells: &[bool]| spread(cells, 3);
    let near = reach.kinds().fold(rims.to_vec(), |cells, kind| match kind {
        Neighbours::Faces => spread(&cells, 1),
        Neighbours::Edges => spread(&cells, 2),
        Neighbours::Corners => spread(&cells, 3),
    });
    let closed: Vec<bool> = full.iter().zip(&near).map(|(f, n)| *f || *n).collect();
    let mut outside = vec![false; full.len()];
    let mut waiting = vec![0];
    outside[0] = true;
    while let Some(i) = waiting.pop() {
        for j in around(i) {
            if !closed[j] && !std::mem::replace(&mut outside[j], true) {
                waiting.push(j);
            }
        }
    }
    let mut inside: Vec<bool> = closed.iter().zip(&outside).map(|(c, o)| !c && !o).collect();
    for _ in 0..reach.rounds() {
        for from_outside in [true, false] {
            let (own, other) =
                if from_outside { (&mut outside, &inside) } else { (&mut inside, &outside) };
            let (wider, guarded) = (grow(own), grow(other));
            for i in 0..full.len() {
                own[i] |= wider[i] && near[i] && !full[i] && !guarded[i];
            }
        }
    }
    (0..full.len()).map(|i| i8::from(outside[i]) - i8::from(inside[i])).collect()
}

proptest! {
    #![proptest_config(crate::sweep::cases(60))]

    #[test]
    fn labels_are_those_by_the_book_and_the_inside_never_touches_the_outside(
        seed in any::<u64>(),
        thick in 0.3f64..1.2,
        holes in 0.0f64..0.3,
        radius in 0f64..4.0,
    ) {
        const BRICKS: u32 = 5;
        let side = BRICKS * BRICK;
        let random = Anywhere { seed, steps: 1.0 };
        let centre = f64::from(side) / 2.0;
        // A shell with holes, and boundary cells beside these.
        let cell = |i: u32| [i % side, i / side % side, i / side / side];
        let far = |at: [u32; 3]| at.map(|x| (f64::from(x) + 0.5 - centre).powi(2)).iter().sum::<f64>();
        let count = side.pow(3);
        let full: Vec<bool> = (0..count)
            .map(|i| {
                let at = cell(i);
                let block = at.map(|x| x / 3);
                (far(at).sqrt() - 7.0).abs() < thick && random.number(block, 50) >= holes
            })
            .collect();
        let rims: Vec<bool> = (0..count)
            .map(|i| full[i as usize] && random.number(cell(i).map(|x| x / 3), 51) < 0.3)
            .collect();
        let code = |at: [u32; 3]| Bricks::code([BRICKS; 3], at.map(|x| x / BRICK));
        let set = |cells: &[bool]| -> Vec<(u64, u32)> {
            let mut found: Vec<_> = (0..count)
                .filter(|&i| cells[i as usize])
                .map(|i| (code(cell(i)), cell_of(cell(i).map(|x| x % BRICK))))
                .collect();
            found.sort_unstable();
            found
        };
        let mut codes: Vec<u64> = set(&full).iter().map(|c| c.0).collect();
        codes.dedup();
        let (bricks, near) = content::bricks_round([BRICKS; 3], codes, &set(&rims), 1);
        let mut blocks = vec![[0; 8]; bricks.len()];
        for (code, cell) in set(&full) {
            let brick = bricks.codes().position(|c| c == code).unwrap();
            blocks[brick][cell as usize / 64] |= 1u64 << (cell % 64);
        }
        let (run, reach) = (Run::default(), Reach::new(radius));
        let (labels, enclosed) =
            Labels::new(bricks, &blocks, near, reach, &|_, _| false, &run).unwrap();
        let expected = by_the_book(side as i32, &full, &rims, reach);
        let inside = |at: [u32; 3]| match labels.bricks.slot(at.map(|x| x / BRICK)) {
            bricks::Slot::Run(run) => labels.inside_runs[run as usize],
            bricks::Slot::Brick(b) => {
                bricks::has(&labels.inside[b as usize], cell_of(at.map(|x| x % BRICK)))
            }
        };
        for i in 0..count {
            let at = cell(i);
            let found = i8::from(labels.is_outside(at)) - i8::from(inside(at));
            prop_assert_eq!(found, expected[i as usize], "{:?}", at);
        }
        prop_assert_eq!(enclosed.kept, 0);
        for i in (0..count).filter(|&i| expected[i as usize] < 0) {
            let at = cell(i);
            for n in 0..27u32 {
                let beside = std::array::from_fn(|a| at[a] + n / 3u32.pow(a as u32) % 3 - 1);
                prop_assert!(!labels.is_outside(beside));
            }
        }
    }
}

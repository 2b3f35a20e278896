//! Walls between labels: on every cell, on noise, and beside marching cubes.

use super::*;
use crate::measure::{Weld, measure, self_intersections};
use crate::surface::cubes::tests::assert_closed_manifold;
use crate::surface::{CubesOptions, Inside, marching_cubes};
use crate::volume::{DenseVolume, Placement};
use proptest::prelude::*;
use std::collections::BTreeMap;

fn complex_of<T: Scalar>(dims: [usize; 3], samples: Vec<T>) -> LabelComplex {
    let volume = DenseVolume::new(dims, samples, Placement::default()).unwrap();
    label_complex(&volume, &Run::default()).unwrap()
}

fn noise(count: usize, seed: u64, labels: u64) -> impl Iterator<Item = u32> {
    let mut state = seed;
    (0..count).map(move |_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) % labels) as u32
    })
}

fn signed_volume(mesh: &Mesh) -> f64 {
    let six = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(glam::DVec3::from_array);
        a.dot(b.cross(c))
    };
    (0..mesh.triangles.len()).map(six).sum::<f64>() / 6.0
}

/// Everything that is promised of the walls between some samples.
fn assert_sound(complex: &LabelComplex, samples: &[u32]) {
    let mut labels: Vec<u32> = samples.iter().copied().filter(|&l| l != 0).collect();
    labels.sort_unstable();
    labels.dedup();
    assert_eq!(complex.labels(), labels);
    assert!(complex.sides.iter().all(|[behind, front]| behind > front));
    let shells = complex.shells(&Run::default()).unwrap();
    assert_eq!(shells.iter().map(|s| s.label).collect::<Vec<_>>(), labels);
    let mut volume = 0.0;
    let mut triangles = 0;
    for LabelMesh { label, mesh } in &shells {
        assert_closed_manifold(mesh);
        let own = signed_volume(mesh);
        assert!(own > 0.0, "label {label} has volume {own}");
        assert_eq!(&complex.shell(*label), mesh);
        volume += own;
        triangles += mesh.triangles.len();
    }
    // Walls between labels are in two shells, those to the background in one.
    let to_background: Vec<_> = (0..complex.sides.len())
        .filter(|&t| complex.sides[t][1] == 0)
        .map(|t| complex.triangles[t])
        .collect();
    assert_eq!(2 * complex.triangles.len(), triangles + to_background.len());
    let outside =
        Mesh { points: complex.points.clone(), triangles: to_background, ..Mesh::default() };
    assert!((signed_volume(&outside) - volume).abs() < 1e-9, "there are gaps or overlaps");
}

fn as_mesh(complex: &LabelComplex) -> Mesh {
    let (points, triangles) = (complex.points.clone(), complex.triangles.clone());
    Mesh { points, triangles, ..Mesh::default() }
}

proptest! {
    #![proptest_config(crate::sweep::cases(48))]

    #[test]
    fn noise_has_closed_shells_without_gaps(
        dims in (1usize..70, 1usize..7, 1usize..40),
        seed in any::<u64>(),
        labels in 2u64..9,
    ) {
        let (x, y, z) = dims;
        let samples: Vec<u32> = noise(x * y * z, seed, labels).collect();
        assert_sound(&complex_of([x, y, z], samples.clone()), &samples);
    }

    #[test]
    fn walls_meet_only_where_they_share_points(seed in any::<u64>(), labels in 2u64..9) {
        let samples: Vec<u32> = noise(64, seed, labels).collect();
        let complex = complex_of([4; 3], samples);
        let meeting = self_intersections(&as_mesh(&complex), &Run::default()).unwrap();
        prop_assert!(meeting.is_empty(), "{:?}", meeting);
    }

    #[test]
    fn one_label_is_meshed_as_a_mask(
        dims in (1usize..70, 1usize..7, 1usize..70),
        seed in any::<u64>(),
        label in prop::sample::select(vec![1u32, 255, 65_535, 4_000_000_000, u32::MAX]),
    ) {
        let (x, y, z) = dims;
        let mask: Vec<u8> = noise(x * y * z, seed, 2).map(|s| s as u8).collect();
        let samples = mask.iter().map(|&s| u32::from(s) * label).collect();
        let complex = complex_of([x, y, z], samples);
        let volume = DenseVolume::new([x, y, z], mask, Placement::default()).unwrap();
        let options = CubesOptions { iso: 0.5, inside: Inside::Above, open: false };
        let alone = marching_cubes(&volume, &options, &Run::default()).unwrap();
        prop_assert_eq!(as_mesh(&complex), alone);
        prop_assert!(complex.sides.iter().all(|&sides| sides == [label, 0]));
    }
}

/// All ways in which eight corners can hold equal labels, as labels from 1 on.
fn partitions() -> Vec<[u32; 8]> {
    let mut all = vec![([1; 8], 1)];
    for c in 1..8 {
        all = all
            .into_iter()
            .flat_map(|(labels, count)| {
                (1..=count + 1).map(move |label| {
                    let mut labels = labels;
                    labels[c] = label;
                    (labels, count.max(label))
                })
            })
            .collect();
    }
    assert_eq!(all.len(), 4140);
    all.into_iter().map(|(labels, _)| labels).collect()
}

/// The same cell with its labels in every order that can matter.
fn orders(labels: [u32; 8]) -> Vec<[u32; 8]> {
    let mut of_patch: BTreeMap<usize, [u32; 8]> = BTreeMap::new();
    let count = *labels.iter().max().unwrap();
    let mut order: Vec<u32> = (1..=count).collect();
    // Without a label on two corners of each of two kinds no face is even.
    let pairs = (1..=count).filter(|l| labels.iter().filter(|&x| x == l).count() > 1).count();
    if pairs < 2 {
        return vec![labels];
    }
    loop {
        let renamed = labels.map(|l| order[l as usize - 1]);
        let patch = std::ptr::from_ref(junction::patch(&renamed)) as usize;
        of_patch.entry(patch).or_insert(renamed);
        let Some(i) = (1..order.len()).rfind(|&i| order[i - 1] < order[i]) else { break };
        let j = (i..order.len()).rfind(|&j| order[j] > order[i - 1]).unwrap();
        order.swap(i - 1, j);
        order[i..].reverse();
    }
    let mut found: Vec<_> = of_patch.into_values().collect();
    found.sort_unstable();
    found
}

#[test]
fn every_cell_is_sound() {
    let mut cells = 0;
    for labels in partitions() {
        for labels in orders(labels) {
            let complex = complex_of([2; 3], labels.to_vec());
            assert_sound(&complex, &labels);
            let meeting = self_intersections(&as_mesh(&complex), &Run::default()).unwrap();
            assert!(meeting.is_empty(), "{labels:?}: {meeting:?}");
            cells += 1;
        }
    }
    assert!(cells > 4140, "{cells}");
}

#[test]
fn a_background_takes_part_in_every_cell() {
    for labels in partitions() {
        for labels in orders(labels) {
            for background in 1..=*labels.iter().max().unwrap() {
                let labels = labels.map(|l| if l == background { 0 } else { l });
                assert_sound(&complex_of([2; 3], labels.to_vec()), &labels);
            }
        }
    }
}

/// The segments that a patch leaves open on face `f`: both ends as positions on the face, and the
/// labels behind and in front.
fn open_segments(labels: &[u32; 8], f: usize) -> Vec<([[u32; 2]; 2], [u32; 2])> {
    let axis = f / 2;
    let mut open = Vec::new();
    for facet in &junction::patch(labels).triangles {
        for i in 0..3 {
            let ends = [facet.points[i], facet.points[(i + 1) % 3]];
            let at = ends.map(|p| junction::on_face(p, f));
            let [Some(a), Some(b)] = at else { continue };
            let [behind, front] = [facet.behind, facet.front].map(|c| labels[c as usize]);
            let place = |p: [u32; 3]| [p[(axis + 1) % 3], p[(axis + 2) % 3]];
            let ends = [place(a), place(b)];
            open.push(if behind > front {
                (ends, [behind, front])
            } else {
                ([ends[1], ends[0]], [front, behind])
            });
        }
    }
    open.sort_unstable();
    open
}

#[test]
fn what_a_face_looks_like_follows_from_its_labels() {
    // Whatever the cell, there is one look of a face from the low side for each way in which its
    // labels are equal (and which one is lower, where both diagonals are even), and the same one
    // reversed from the high side.
    let mut looks = BTreeMap::new();
    for labels in partitions().into_iter().flat_map(orders) {
        for f in 0..6 {
            let (u, v) = (1 << ((f / 2 + 1) % 3), 1 << ((f / 2 + 2) % 3));
            let base = (f % 2) << (f / 2);
            let four = [base, base | u, base | v, base | u | v].map(|c| labels[c]);
            let kind = |l: u32| four.iter().position(|&x| x == l).unwrap();
            let mut look: Vec<_> = open_segments(&labels, f)
                .into_iter()
                .map(|(ends, sides)| {
                    let [behind, front] = sides.map(kind);
                    let turned = (behind < front) != (f % 2 == 0);
                    let ends = if turned { [ends[1], ends[0]] } else { ends };
                    (ends, [behind.max(front), behind.min(front)])
                })
                .collect();
            look.sort_unstable();
            let even = four[0] == four[3] && four[1] == four[2];
            let key = (f / 2, four.map(kind), even && four[0] < four[1]);
            let known = looks.entry(key).or_insert_with(|| look.clone());
            assert_eq!(*known, look, "{labels:?}, face {f}");
        }
    }
    assert_eq!(looks.len(), 3 * (15 + 1));
}

#[test]
fn threads_slabs_and_placement_change_nothing() {
    let dims = [37, 20, 130];
    let samples: Vec<u32> = noise(dims.iter().product(), 7, 5).collect();
    let meshes = [1, 2, 3, 8]
        .map(|threads| par::with_threads(threads, || complex_of(dims, samples.clone())));
    assert!(meshes[0].triangles.len() > 100_000);
    assert!(meshes.windows(2).all(|m| m[0] == m[1]));
    let mirror = Placement {
        axes: [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        ..Placement::default()
    };
    let volume = DenseVolume::new([4; 3], samples[..64].to_vec(), mirror).unwrap();
    let mirrored = label_complex(&volume, &Run::default()).unwrap();
    assert_sound(&mirrored, &samples[..64]);
}

#[test]
fn labels_of_any_type_are_whole_numbers_above_0() {
    let mask = [0u32, 1, 0, 0, 7, 7, 1, 0, 3];
    let expected = complex_of([3, 3, 1], mask.to_vec());
    let signed = mask.map(|l| if l == 0 { -5 } else { l as i16 });
    assert_eq!(complex_of([3, 3, 1], signed.to_vec()), expected);
    assert_eq!(complex_of([3, 3, 1], mask.map(|l| l as i8).to_vec()), expected);
    assert_eq!(complex_of([3, 3, 1], mask.map(|l| l as i32).to_vec()), expected);
    let real = mask.map(|l| if l == 0 { 0.25 } else { l as f32 });
    assert_eq!(complex_of([3, 3, 1], real.to_vec()), expected);
    let mut real = mask.map(f64::from);
    (real[0], real[2]) = (f64::NAN, -3.0);
    assert_eq!(complex_of([3, 3, 1], real.to_vec()), expected);
}

#[test]
fn triple_lines_have_three_triangles() {
    // Three columns that meet along a line.
    let samples = (0..4 * 4 * 6u32).map(|i| match (i % 4 < 2, i / 4 % 4 < 2) {
        (true, _) => 1,
        (false, true) => 2,
        (false, false) => 3,
    });
    let complex = complex_of([4, 4, 6], samples.collect());
    let mut uses: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for t in &complex.triangles {
        for i in 0..3 {
            let mut edge = [t[i], t[(i + 1) % 3]];
            edge.sort_unstable();
            *uses.entry(edge).or_default() += 1;
        }
    }
    // Down the middle, one edge to a cell.
    let down = |&p: &u32| {
        let [x, y, z] = complex.points[p as usize];
        [x, y] == [1.5; 2] && (0.0..=5.0).contains(&z)
    };
    let middle: Vec<_> = uses.iter().filter(|(edge, _)| edge.iter().all(down)).collect();
    assert!(middle.len() == 5 && middle.iter().all(|(_, uses)| **uses == 3));
    let whole = measure(&complex.shell(2), Weld::Exact, &Run::default()).unwrap();
    assert!(whole.closed && whole.manifold && whole.oriented);
    assert_eq!((whole.euler, whole.self_intersections), (2, 0));
}

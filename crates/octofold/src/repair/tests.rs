//! The guarantees, on random labellings with vertices in random places.

use super::bricks::{BRICK, Block, Bricks, Place, cell_of};
use super::labels::Labels;
use super::piercing::Target;
use super::*;
use crate::measure::self_intersections;
use proptest::prelude::*;

/// Puts vertices and piercing points anywhere, even outside their cells.
struct Anywhere {
    seed: u64,
    steps: f64,
}

impl Anywhere {
    fn number(&self, at: [u32; 3], salt: u64) -> f64 {
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
fn labels(side: u32, shift: u32, full: impl Fn([u32; 3]) -> bool) -> Labels {
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
    Labels::new(bricks, &blocks, nothing, 0, None, &Run::default()).unwrap().0
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

proptest! {
    #![proptest_config(crate::sweep::cases(400))]

    #[test]
    fn random_labellings_give_solids_that_do_not_meet_themselves(
        seed in any::<u64>(),
        fill in 0.02f64..0.98,
        side in 1u32..6,
        shift in 0u32..8,
        fine in any::<bool>(),
        lean in prop::bool::weighted(0.8),
    ) {
        let guide = Anywhere { seed, steps: if fine { 4096.0 } else { 64.0 } };
        let labels = labels(side, shift, |at| guide.number(at, 99) < fill || at == [0; 3]);
        is_sound(surface(labels, &guide, lean))?;
    }
}

#[test]
fn every_labelling_of_two_by_two_by_two_cells_is_sound() {
    for mask in 1u32..256 {
        let guide = Anywhere { seed: u64::from(mask), steps: 256.0 };
        let full = |[x, y, z]: [u32; 3]| mask >> (x + 2 * y + 4 * z) & 1 == 1;
        is_sound(surface(labels(2, 7, full), &guide, true)).unwrap();
    }
}

//! The search for few pieces: trees to start from, tabu walks, cuts where these do not end well, and
//! bites where a page is too small.

use super::UnfoldOptions;
use super::facets::Facets;
use super::hanging::Hanging;
use super::hinges::Hinges;
use super::opening;
use super::patch::Patch;
use super::pieces::{self, Piece};
use super::room::Room;
use super::tabu::Walk;
use super::trees::{cheapest, steepest, weight};
use crate::par;
use crate::random::Random;
use crate::run::{Cancelled, Run};

/// What was found for one patch.
pub(super) struct Found {
    /// Pieces that fit the page.
    pub pieces: Vec<Piece>,
    /// How many there were before any was cut to fit.
    pub unlimited: usize,
    /// Climbs that it took.
    pub climbs: usize,
}

/// Trees to start from: steepest-edge ones, and minimum spanning ones.
const STEEPEST: usize = 16;
const SPANNING: usize = 4;

/// Width in millimetres from which on a cut has room for a tab.
const OPEN: f64 = 1.8;

/// Walks side by side where the first one comes to no end, and the work of the first lap; each lap
/// is twice as long as the one before.
const WALKS: usize = 4;
const LAP: u64 = 1 << 20;

/// Finds pieces of a patch.
pub(super) fn search(
    mesh: &Facets,
    hinges: &Hinges,
    patch: &Patch,
    room: &Room,
    options: &UnfoldOptions,
    run: &Run,
) -> Result<Found, Cancelled> {
    let seed = options.seed.wrapping_mul(0x9e37_79b9) ^ u64::from(patch.facets[0]);
    let mut random = Random::new(seed);
    let flat = |h: u32| weight(hinges.get(patch.hinges[h as usize]), patch.size);
    let plain = cheapest(patch, flat);
    let mut trees = vec![plain];
    if patch.len() > 2 {
        for _ in 0..STEEPEST {
            trees.push(steepest(mesh, hinges, patch, &mut random));
        }
        for _ in 0..SPANNING {
            let jitter: Vec<f64> = patch.hinges.iter().map(|_| 0.2 * random.unit()).collect();
            trees.push(cheapest(patch, |h| flat(h) + jitter[h as usize]));
        }
    }
    let mut ranked: Vec<(usize, Vec<u32>)> =
        trees.into_iter().map(|tree| (Hanging::new(patch, &tree).pairs(), tree)).collect();
    ranked.sort_by_key(|(pairs, _)| *pairs);
    run.check()?;
    let (mut best, mut climbs) = (ranked[0].clone(), 0);
    if best.0 > 0 {
        let lap = |lap: u32| LAP << lap;
        let mut walks = vec![Walk::new(patch, &best.1, Random::new(random.next()))];
        walks[0].go(lap(0), run);
        for number in 0..options.effort {
            if walks[leader(&walks)].best().0 == 0 {
                break;
            }
            if number == 0 {
                for (_, tree) in ranked.iter().cycle().skip(1).take(WALKS - 1) {
                    walks.push(Walk::new(patch, tree, Random::new(random.next())));
                }
            }
            par::chunks_mut(&mut walks, 1, |_, walk| walk[0].go(lap(number), run));
            run.check()?;
        }
        climbs = walks.iter().map(Walk::climbs).sum();
        let (pairs, tree) = walks[leader(&walks)].best();
        best = (pairs, tree.to_vec());
    }
    if best.0 == 0 {
        best.1 = opening::open(patch, &best.1, OPEN, &mut random, run);
        run.check()?;
    }
    let mut order: Vec<u32> = (0..patch.hinges.len() as u32).collect();
    order.sort_by(|&a, &b| flat(a).total_cmp(&flat(b)).then(a.cmp(&b)));
    let parted = |tree: &Vec<u32>| {
        let hanging = Hanging::new(patch, tree);
        let cut = pieces::parting(patch, &hanging);
        let parted = Piece::whole(patch, tree.clone()).without(patch, &cut);
        pieces::join(patch, parted, &order, None)
    };
    let mut whole = parted(&best.1);
    if best.0 > 0 {
        // The more faces, the fewer other trees there is time for.
        for (_, tree) in ranked.iter().take(40_000 / patch.len()) {
            let other = parted(tree);
            if other.len() < whole.len() {
                whole = other;
            }
        }
    }
    let unlimited = whole.len();
    let bitten: Vec<Piece> = whole.into_iter().flat_map(|piece| room.bite(patch, piece)).collect();
    run.check()?;
    let mut pieces = bitten;
    if pieces.len() > unlimited {
        pieces = pieces::join(patch, pieces, &order, Some(room));
        let single = |f: u32| Piece { facets: vec![f], tree: Vec::new() };
        let singles = (0..patch.len() as u32).map(single).collect();
        let greedy = pieces::join(patch, singles, &order, Some(room));
        if greedy.len() < pieces.len() {
            pieces = greedy;
        }
    }
    Ok(Found { pieces, unlimited, climbs })
}

/// The walk with the fewest pairs, the first of these.
fn leader(walks: &[Walk<'_>]) -> usize {
    (0..walks.len()).min_by_key(|&i| walks[i].best().0).unwrap_or(0)
}

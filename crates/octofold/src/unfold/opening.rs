//! Opening seams: a net without overlaps is changed step by step so that there is room for tabs.
//!
//! Where a cut ends at an almost flat point, both sides of it lie almost on one another. Facets are
//! hung elsewhere so that the middles of both sides are further apart, by threshold accepting
//! (Dueck and Scheuer 1990): a step may be a little worse, ever less so, and never brings overlaps.

use super::hanging::{Hanging, NONE};
use super::patch::Patch;
use crate::random::Random;
use crate::run::Run;

/// Steps for each hinge of the patch.
const STEPS: usize = 2400;
const MOST_STEPS: usize = 1 << 23;

/// Changes `tree`, which has no overlaps, so that fewer cuts are narrower than `width` millimetres.
pub(super) fn open(
    patch: &Patch,
    tree: &[u32],
    width: f64,
    random: &mut Random,
    run: &Run,
) -> Vec<u32> {
    let mut hanging = Hanging::new(patch, tree);
    let narrow = |hanging: &Hanging<'_>| -> f64 {
        (0..patch.hinges.len() as u32).map(|h| hanging.narrowness(h, width)).sum()
    };
    let mut best = (narrow(&hanging), tree.to_vec());
    let mut now = best.0;
    let steps = (STEPS * patch.hinges.len()).min(MOST_STEPS);
    // What spreads no further than before is not harder to fit on a page.
    let (middle, reach) = hanging.spread();
    for step in 0..steps {
        if step.is_multiple_of(256) {
            if run.check().is_err() || now <= 0.0 {
                break;
            }
            // Most subtrees are small as seen from the middle.
            hanging.root_at(hanging.middle());
        }
        let hinge = random.below(patch.hinges.len()) as u32;
        if hanging.narrowness(hinge, width) == 0.0 && !random.next().is_multiple_of(4) {
            continue;
        }
        let ends = patch.ends[hinge as usize];
        let top = ends[random.below(2)];
        let onto = patch.other(hinge, top);
        if hanging.parent(top) == NONE || hanging.parent(top) == onto || hanging.parent(onto) == top
        {
            continue;
        }
        let subtree = hanging.take_subtree(top);
        if hanging.is_inside(onto) {
            continue;
        }
        let change = hanging.narrowing_by(&subtree, hinge, width);
        let heat = patch.size * 0.4 * (1.0 - step as f64 / steps as f64);
        if change > heat * random.unit()
            || hanging.reach_by(&subtree, hinge, middle) > reach
            || hanging.crossing_by(&subtree, hinge, 0) > 0
        {
            continue;
        }
        hanging.hang(&subtree, hinge);
        now += change;
        if now < best.0 - 1e-9 {
            best = (now, hanging.tree());
        }
    }
    best.1
}

//! How much of a large domain a test takes: a sample in every run, all that is asked for in a
//! sweep (`OCTOFOLD_SWEEP=full`), or some hundredths of that (`OCTOFOLD_SWEEP=30..60`).

use crate::{par, run::Run};
use proptest::prelude::{ProptestConfig, Strategy};
use proptest::test_runner::{RngAlgorithm, TestCaseResult, TestRng, TestRunner};
use std::ops::Range;

/// Which hundredths of a domain a sweep takes; none where this is no sweep.
fn hundredths() -> Option<Range<usize>> {
    let asked = std::env::var("OCTOFOLD_SWEEP").ok()?;
    match asked.split_once("..") {
        Some((from, to)) => Some(from.parse().unwrap()..to.parse().unwrap()),
        None => (asked == "full").then_some(0..100),
    }
}

/// `few` random cases, or five hundred times as many in a sweep.
pub fn cases(few: u32) -> ProptestConfig {
    ProptestConfig::with_cases(if hundredths().is_some() { 500 * few } else { few })
}

/// Puts the first `few` values of a domain to the test, or those of the first `all` that a sweep
/// takes, on all cores; the first that fails is made simple and told.
///
/// A case is made from its number alone, so that what a sweep finds can be found again.
pub fn every<S: Strategy + Sync>(
    [few, all]: [usize; 2],
    domain: S,
    test: impl Fn(S::Value) -> TestCaseResult + Sync,
) {
    let sweep = hundredths();
    let share = |hundredth: usize| all * hundredth / 100;
    let cases = sweep.clone().map_or(0..few, |part| share(part.start)..share(part.end));
    let step = (all / 100).max(1);
    par::blocks(&Run::default(), cases.len(), 16, |numbers| {
        for number in numbers.map(|n| cases.start + n) {
            let mut seed = [0; 32];
            seed[..8].copy_from_slice(&(number as u64).to_le_bytes());
            let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
            let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
            let mut runner = TestRunner::new_with_rng(config, rng);
            let case = domain.new_tree(&mut runner).unwrap();
            if let Err(failure) = runner.run_one(case, &test) {
                panic!("case {number}: {failure}");
            }
            if sweep.is_some() && number % step == 0 {
                eprintln!("{} of 100", number / step);
            }
        }
    })
    .unwrap();
}

//! How much of a large domain a test takes: a sample in every run, all that is asked for in a
//! sweep (`OCTOFOLD_SWEEP=full`).

use crate::{par, run::Run};
use proptest::prelude::{ProptestConfig, Strategy};
use proptest::test_runner::{RngAlgorithm, TestCaseResult, TestRng, TestRunner};

fn is_full() -> bool {
    std::env::var_os("OCTOFOLD_SWEEP").is_some_and(|v| v == "full")
}

/// `few` random cases, or five hundred times as many in a sweep.
pub fn cases(few: u32) -> ProptestConfig {
    ProptestConfig::with_cases(if is_full() { 500 * few } else { few })
}

/// Puts the first `few` values of a domain to the test, or the first `all` in a sweep, on all
/// cores; the first that fails is made simple and told.
///
/// A case is made from its number alone, so that what a sweep finds can be found again.
pub fn every<S: Strategy + Sync>(
    [few, all]: [usize; 2],
    domain: S,
    test: impl Fn(S::Value) -> TestCaseResult + Sync,
) {
    let count = if is_full() { all } else { few };
    let step = (count / 100).max(1);
    par::blocks(&Run::default(), count, 16, |numbers| {
        for number in numbers {
            let mut seed = [0; 32];
            seed[..8].copy_from_slice(&(number as u64).to_le_bytes());
            let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
            let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
            let mut runner = TestRunner::new_with_rng(config, rng);
            let case = domain.new_tree(&mut runner).unwrap();
            if let Err(failure) = runner.run_one(case, &test) {
                panic!("case {number}: {failure}");
            }
            if is_full() && number % step == 0 {
                eprintln!("{} of 100", number / step);
            }
        }
    })
    .unwrap();
}

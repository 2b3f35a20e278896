//! How much of a large domain a test takes: a sample in every run, all that is asked for in a
//! sweep (`OCTOFOLD_SWEEP=full`).

use proptest::prelude::ProptestConfig;

/// `few` random cases, or five hundred times as many in a sweep.
pub fn cases(few: u32) -> ProptestConfig {
    let full = std::env::var_os("OCTOFOLD_SWEEP").is_some_and(|v| v == "full");
    ProptestConfig::with_cases(if full { 500 * few } else { few })
}

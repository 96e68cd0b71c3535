//! Integration tests of stretch-data in one program, because linking takes longer than most of the
//! tests.

mod bad_input;
mod even;
mod files;
mod round_trips;
mod trials;
mod whole;

use proptest::{prelude::ProptestConfig, test_runner::RngSeed};

/// Returns a configuration with this number of cases and a fixed seed, so that every run tests the
/// same cases.
fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() }
}

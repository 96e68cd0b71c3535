//! The tests of stretch-data from outside, one program: linking takes longer than most of them.

mod bad_input;
mod even;
mod files;
mod round_trips;
mod trials;
mod whole;

use proptest::{prelude::ProptestConfig, test_runner::RngSeed};

/// A number of cases that are the same in every run.
fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() }
}

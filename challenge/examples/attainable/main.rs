//! What the diagnosis finds at best: rigs of its own equations, effects in the catalogue's own forms, noise that is clean and known.
//! What is missed or confounded here is missed for no form and no disturbance.
//!
//! Two tables: how far nulls stray, and which effects cannot be told apart, for the trials of the paper with and without a
//! pressure column and for the paper's with one trial more at 0.7 of the excitation. `book/src/results/sealed_cases.md` says how to read them.
//!
//! `cargo run --release --manifest-path challenge/Cargo.toml --example attainable -- [NULLS [SEEDS]]`: nulls of each protocol (20), sessions of each effect
//! and strength (1). As many at a time as `RAYON_NUM_THREADS` says, else as there are cores.

mod nulls;
mod simulated;
mod strength;
mod ties;

use std::time::Instant;

/// Seed of the first null; nulls and effects have seeds of their own.
const FIRST_NULL: u64 = 5001;
/// Seed of the first session with an effect.
const FIRST_EFFECT: u64 = 6001;

fn main() -> anyhow::Result<()> {
    let mut given = std::env::args().skip(1);
    let mut count = |usual: u64| given.next().map_or(Ok(usual), |text| text.parse());
    let (nulls, seeds) = (count(20)?, count(1)?);
    let begun = Instant::now();
    print!("{}", nulls::band(FIRST_NULL..FIRST_NULL + nulls)?);
    eprintln!("{:.0} s", begun.elapsed().as_secs_f64());
    print!("\n{}", ties::matrix(FIRST_EFFECT..FIRST_EFFECT + seeds)?);
    eprintln!("{:.0} s", begun.elapsed().as_secs_f64());
    Ok(())
}

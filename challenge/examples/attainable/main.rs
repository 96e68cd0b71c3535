//! Shows the best result that the diagnosis can reach. The simulated rigs have the equations of the
//! diagnosis, effects in the forms of the catalogue, and white noise of known size. Errors here are
//! therefore not caused by other forms or by disturbances.
//!
//! There are two tables: the scatter of rigs without an effect (nulls), and the effects that cannot
//! be distinguished. Each is made for the paper's trials with and without a pressure column, and
//! for these with one more trial at 0.7 of the excitation. `book/src/results/sealed_cases.md`
//! explains how to read them.
//!
//! `cargo run --release -p stretch-challenge --example attainable -- [NULLS [SEEDS]]`: NULLS is the
//! number of nulls of each protocol (default 20), SEEDS the number of sessions of each effect and
//! strength (default 1). `RAYON_NUM_THREADS` sets the number of threads (default: one per core).

mod nulls;
mod simulated;
mod strength;
mod ties;

use std::time::Instant;

/// Seed of the first null; nulls and effects have separate seeds.
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

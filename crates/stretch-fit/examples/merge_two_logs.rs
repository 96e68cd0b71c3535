//! Accumulates two parts of a log separately, merges them, and compares the fit with that of one
//! pass: `cargo run -p stretch-fit --example merge_two_logs`.
//!
//! The parts could come from two days, two threads or two microcontrollers. For each part only a
//! triangular matrix of a few hundred bytes is kept.

use stretch_core::Degree;
use stretch_fit::{FitError, Sample, SurfaceAccumulator};

type Log = SurfaceAccumulator<f64, { Degree::POLY13.terms() }>;

/// Returns sample `k` of a log, whose value is a strain.
fn sample(k: u32) -> Sample<f64> {
    let (rate, volts) = ((f64::from(k) * 0.05).cos(), 0.5 + 0.5 * (f64::from(k) * 0.0519).sin());
    let noise = 0.004 * (f64::from(k * k % 17) / 8.0 - 1.0);
    let value = 0.06 + 0.77 * volts - 0.12 * rate * volts + 0.2 * volts * volts + noise;
    Sample { rate, volts, value }
}

fn main() -> Result<(), FitError> {
    let mut whole = Log::of::<1, 3>();
    whole.extend((0..2000).map(sample))?;

    let (mut first, mut second) = (Log::of::<1, 3>(), Log::of::<1, 3>());
    first.extend((0..700).map(sample))?;
    second.extend((700..2000).map(sample))?;
    second.merge(&first)?; // in either order

    let (whole, merged) = (whole.fit()?, second.fit()?);
    println!("term   one pass            merged              difference");
    let pairs = whole.coefficients().iter().zip(merged.coefficients());
    for ((i, j), (one, two)) in Degree::POLY13.exponents().zip(pairs) {
        println!("p{i}{j}    {one:18.15}  {two:18.15}  {:8.1e}", one - two);
        assert!((one - two).abs() < 1e-12, "merging must equal one pass");
    }
    println!("SSE    {:18.15}  {:18.15}", whole.sse(), merged.sse());
    Ok(())
}

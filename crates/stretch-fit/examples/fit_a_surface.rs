//! Fits the surface of the published method ("the paper") to noisy samples, prints confidence bounds, and finds the
//! lowest order that satisfies the acceptance criterion: `cargo run --release -p stretch-fit --example fit_a_surface`.

use stretch_core::{Degree, Poly13};
use stretch_fit::{Factor, FitError, OrderTable, Sample, SurfaceAccumulator};

/// The paper's inflation surface, over normalised rate and volts.
const TRUTH: Poly13 =
    Poly13 { p00: 0.058, p10: 0.001, p01: 0.774, p11: -0.121, p02: 2.30, p12: 0.094, p03: -2.26 };
const NOISE: f64 = 0.01;

/// Generates a trial of 1000 samples, seeded by its number, and returns its triangular factor. It accumulates poly24,
/// so that the order table can compare all neighbours of poly13 after this one pass.
fn trial(number: u64) -> Result<Factor<f64>, FitError> {
    let mut state = number;
    let mut uniform = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut sums = SurfaceAccumulator::<f64>::new(OrderTable::<f64>::covering(Degree::POLY13));
    for _ in 0..1000 {
        let (rate, volts) = (uniform(), uniform());
        let noise = NOISE * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0);
        sums.push(Sample { rate, volts, value: TRUTH.eval(rate, volts) + noise })?;
    }
    Ok(sums.factor())
}

fn main() -> Result<(), FitError> {
    let trials = (1..=6).map(trial).collect::<Result<Vec<_>, _>>()?;
    let mut all = trials[0];
    trials[1..].iter().try_for_each(|trial| all.merge(trial))?;

    let fit = all.fit_degree(Degree::POLY13)?;
    let bounds = fit.confidence(0.95)?;
    println!("term     fitted     95 % bounds          truth");
    for (k, (i, j)) in Degree::POLY13.exponents().enumerate() {
        let b = bounds.coefficient(k).expect("a coefficient a term");
        let truth = stretch_core::Surface::from(TRUTH).coefficient(i, j);
        println!("p{i}{j}   {:8.4}   {:8.4} .. {:7.4}   {truth:7.4}", b.estimate, b.lower, b.upper);
    }
    let r_squared = fit.r_squared().unwrap_or(f64::NAN);
    let rmse = fit.rmse().unwrap_or(f64::NAN);
    println!("R^2 {r_squared:.4}, RMSE {rmse:.4} of {} samples\n", fit.samples());

    let table = OrderTable::new(&trials, Degree::POLY13)?;
    println!("order    terms   RMSE      RMSE on trials left out");
    for (degree, row) in table.rows() {
        match row {
            Ok(row) => {
                let rmse = row.rmse.unwrap_or(f64::NAN);
                let left_out = row.cross_validation?.rmse;
                println!("{degree}   {:5}   {rmse:.5}   {left_out:.5}", row.terms);
            }
            Err(error) => println!("{degree}   {error}"),
        }
    }
    if let Some(degree) = table.recommended() {
        println!("lowest order that satisfies the acceptance criterion: {degree}");
    }
    Ok(())
}

//! Tests of the block-wise factor against nalgebra's Householder factor of all rows at once.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use stretch_core::Degree;
use stretch_fit::{Factor, Fit, SurfaceAccumulator};
use stretch_strategies::{degree, observations};
use testkit::tolerance as tol;

type Sample = stretch_fit::Sample<f64>;

fn folded<const ROWS: usize>(degree: Degree, samples: &[Sample]) -> Factor<f64, 21> {
    let mut sums = SurfaceAccumulator::<f64, 21, ROWS>::new(degree);
    sums.extend(samples.iter().copied()).unwrap();
    sums.factor()
}

/// Returns the design matrix in raw rate and volts and the values, both multiplied by the square
/// roots of the weights.
fn problem(degree: Degree, samples: &[Sample], weights: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let exponents: Vec<_> = degree.exponents().collect();
    let design = DMatrix::from_fn(samples.len(), exponents.len(), |row, term| {
        let (Sample { rate, volts, .. }, (i, j)) = (samples[row], exponents[term]);
        weights[row].sqrt() * rate.powi(i.into()) * volts.powi(j.into())
    });
    let values = samples.iter().zip(weights).map(|(sample, weight)| weight.sqrt() * sample.value);
    (design, DVector::from_iterator(samples.len(), values))
}

/// Checks that coefficients and fitted values equal those of nalgebra within the rounding errors of
/// both.
///
/// With residual `r`, condition `k` and unit rounding error `u`, least squares by reflections
/// has an error of `u (|A| |c| + k |r|)` in the fitted values and of `u k (|c| + k |r| / |A|)`
/// in the coefficients (Golub and Van Loan, 4th ed., section 5.3.7; Wedin 1973).
fn agrees(
    fit: &Fit<f64, 21>,
    (design, values): (DMatrix<f64>, DVector<f64>),
) -> Result<(), TestCaseError> {
    let axes = design.singular_values();
    let (norm, condition) = (axes.max(), axes.max() / axes.min());
    let (q, r) = design.clone().qr().unpack();
    let expected = r.solve_upper_triangular(&q.tr_mul(&values)).expect("all terms determined");
    let residual = (&values - &design * &expected).norm();
    let off = DVector::from_column_slice(fit.coefficients()) - &expected;

    let allowed = tol::FIT_BACKWARD * (norm * expected.norm() + condition * residual);
    let fitted = (&design * &off).norm();
    prop_assert!(fitted <= allowed, "fitted values off by {fitted:e}, allowed {allowed:e}");
    let allowed = allowed * condition / norm;
    let off = off.norm();
    prop_assert!(off <= allowed, "condition {condition:e}: off by {off:e}, allowed {allowed:e}");

    // the residual equals the smallest possible one, up to that rounding
    let allowed = tol::FIT_STATISTICS * residual + tol::FIT_BACKWARD * norm * expected.norm();
    let off = (fit.sse().sqrt() - residual).abs();
    prop_assert!(off <= allowed, "residual {residual:e} off by {off:e}");
    Ok(())
}

fn narrowed(samples: &[Sample], centre: f64, width: f64) -> Vec<Sample> {
    samples.iter().map(|s| Sample { volts: centre + width * s.volts, ..*s }).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// Tests poly00 to poly55, with conditions of 1 to 1e5.
    #[test]
    fn surfaces_of_every_degree(
        log in degree().prop_flat_map(|degree| observations(degree, 0.5, 60..300)),
    ) {
        let degree = log.surface.degree();
        let fit = folded::<32>(degree, &log.samples).fit().unwrap();
        agrees(&fit, problem(degree, &log.samples, &vec![1.0; log.samples.len()]))?;
    }

    /// Tests raw volts in a range of 3 mV to 1 V, with conditions of 1e2 to 1e12. nalgebra works in
    /// raw volts and loses accuracy with the condition; the bound allows for this.
    #[test]
    fn narrow_ranges(
        log in observations(Degree::POLY13, 0.5, 60..300),
        centre in -2.0..2.0f64,
        part in -2.5..0.0f64,
    ) {
        let samples = narrowed(&log.samples, centre, 10f64.powf(part));
        let fit = folded::<32>(Degree::POLY13, &samples).fit().unwrap();
        agrees(&fit, problem(Degree::POLY13, &samples, &vec![1.0; samples.len()]))?;
    }

    #[test]
    fn parts_merged_in_any_order(
        log in observations(Degree::POLY13, 0.5, 80..200),
        (centre, part) in (-2.0..2.0f64, -2.0..0.0f64),
        cuts in prop::collection::vec(0.0..1.0f64, 1..5),
        seed: u64,
    ) {
        let samples = narrowed(&log.samples, centre, 10f64.powf(part));
        let mut ends: Vec<usize> = cuts.iter().map(|c| (c * samples.len() as f64) as usize).collect();
        ends.extend([0, samples.len()]);
        ends.sort_unstable();
        let mut parts: Vec<&[Sample]> = ends.windows(2).map(|w| &samples[w[0]..w[1]]).collect();
        let first = seed as usize % parts.len();
        parts.rotate_left(first);
        if seed % 2 == 0 {
            parts.reverse();
        }
        let mut merged = folded::<16>(Degree::POLY13, &[]);
        for part in parts {
            merged.merge(&folded::<16>(Degree::POLY13, part)).unwrap();
        }
        agrees(&merged.fit().unwrap(), problem(Degree::POLY13, &samples, &vec![1.0; samples.len()]))?;
    }

    #[test]
    fn weights(
        log in observations(Degree::POLY13, 0.5, 60..150),
        weights in prop::collection::vec(1e-3..1e3f64, 150),
    ) {
        let mut sums = SurfaceAccumulator::<f64, 21, 16>::new(Degree::POLY13);
        for (&sample, &weight) in log.samples.iter().zip(&weights) {
            sums.push_weighted(sample, weight).unwrap();
        }
        agrees(&sums.fit().unwrap(), problem(Degree::POLY13, &log.samples, &weights))?;
    }

    /// Tests that fits of lower degrees from one triangle equal fits of their own design matrices.
    #[test]
    fn degrees_within_a_triangle(
        log in observations(Degree::new(4, 5).unwrap(), 0.5, 100..200),
        (rate, volts) in (0..=4_u8, 0..=5_u8),
    ) {
        let degree = Degree::new(rate, volts).unwrap();
        let all = folded::<16>(Degree::new(4, 5).unwrap(), &log.samples);
        let fit = all.fit_degree(degree).unwrap();
        agrees(&fit, problem(degree, &log.samples, &vec![1.0; log.samples.len()]))?;
    }
}

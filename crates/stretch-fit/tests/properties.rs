//! Property tests that must hold for any data.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use proptest::prelude::*;
use stretch_core::{Degree, Real};
use stretch_fit::{
    Factor, FitError, Loss, OrderTable, SurfaceAccumulator, cross_validate, held_out, robust_fit,
};
use stretch_strategies::{degree, observations, surface_of};
use testkit::tolerance as tol;

type Sample = stretch_fit::Sample<f64>;

fn accumulate<const ROWS: usize>(
    degree: Degree,
    samples: &[Sample],
) -> SurfaceAccumulator<f64, 21, ROWS> {
    let mut sums = SurfaceAccumulator::new(degree);
    sums.extend(samples.iter().copied()).unwrap();
    sums
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|e| e * e).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied()).max(1.0)
}

/// Returns the allowed error. Rounding grows with the condition, which is some hundred for poly13
/// and 1e5 for poly55.
fn allowed(condition: f64) -> f64 {
    tol::FIT_WELL * (condition / 1e3).max(1.0)
}

fn config() -> ProptestConfig {
    ProptestConfig { cases: 256, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_surface_of_any_degree_is_recovered(
        log in degree().prop_flat_map(|degree| observations(degree, 0.0, 120..300))
    ) {
        let degree = log.surface.degree();
        let fit = accumulate::<32>(degree, &log.samples).fit().unwrap();
        let truth = log.surface.coefficients();
        let off = distance(fit.coefficients(), &truth[..degree.terms()]);
        prop_assert!(off < allowed(fit.condition()), "{degree}: off by {off:e}");
    }

    #[test]
    fn columns_are_samples_pushed_one_by_one(
        log in observations(Degree::POLY13, 0.5, 1..200),
        cut in 0.0..1.0_f64,
    ) {
        let mut columns: SurfaceAccumulator<f64, 21, 16> = SurfaceAccumulator::new(Degree::POLY13);
        let (before, after) = log.samples.split_at((cut * log.samples.len() as f64) as usize);
        for part in [before, after] {
            let column = |of: fn(&Sample) -> f64| part.iter().map(of).collect::<Vec<f64>>();
            let [rate, volts, value] = [column(|s| s.rate), column(|s| s.volts), column(|s| s.value)];
            columns.push_columns(stretch_fit::Sample { rate: &rate[..], volts: &volts, value: &value }).unwrap();
        }
        let one_by_one = accumulate::<16>(Degree::POLY13, &log.samples);
        prop_assert_eq!(columns.factor(), one_by_one.factor());
        // if one sample is refused, no sample of its columns is added
        let infinite = stretch_fit::Sample { rate: &[1.0, f64::INFINITY][..], volts: &[0.0; 2], value: &[0.0; 2] };
        let refused = columns.push_columns(infinite);
        let is_refused = matches!(refused, Err(FitError::OutOfRange { field: "rate", .. }));
        prop_assert!(is_refused, "{refused:?}");
        prop_assert_eq!(columns.factor(), one_by_one.factor());
    }

    #[test]
    fn merging_parts_in_any_order_equals_one_pass(
        log in observations(Degree::POLY13, 0.5, 60..200),
        cuts in (0.0..1.0_f64, 0.0..1.0_f64),
        order in Just([0_usize, 1, 2]).prop_shuffle(),
    ) {
        let n = log.samples.len() as f64;
        let (a, b) = ((cuts.0 * n) as usize, (cuts.1 * n) as usize);
        let (low, high) = (a.min(b), a.max(b));
        let parts = [&log.samples[..low], &log.samples[low..high], &log.samples[high..]];
        let whole = accumulate::<16>(Degree::POLY13, &log.samples).fit().unwrap();

        let mut merged = SurfaceAccumulator::<f64, 21, 16>::new(Degree::POLY13);
        let mut factor: Factor<f64, 21> = merged.factor();
        for part in order {
            let part = accumulate::<16>(Degree::POLY13, parts[part]);
            merged.merge(&part).unwrap();
            factor.merge(&part.factor()).unwrap();
        }
        for fit in [merged.fit().unwrap(), factor.fit().unwrap()] {
            prop_assert_eq!(fit.samples(), whole.samples());
            prop_assert!(distance(fit.coefficients(), whole.coefficients()) < tol::FIT_WELL);
            assert_relative_eq!(
                fit.sse(),
                whole.sse(),
                epsilon = 0.0,
                max_relative = tol::FIT_STATISTICS
            );
            let (a, b) = (fit.r_squared().unwrap(), whole.r_squared().unwrap());
            assert_abs_diff_eq!(a, b, epsilon = tol::FIT_STATISTICS);
        }
    }

    #[test]
    fn the_length_of_a_block_changes_nothing_but_rounding(
        log in observations(Degree::POLY13, 0.5, 30..150)
    ) {
        let long = accumulate::<128>(Degree::POLY13, &log.samples).fit().unwrap();
        for fit in [
            accumulate::<1>(Degree::POLY13, &log.samples).fit().unwrap(),
            accumulate::<7>(Degree::POLY13, &log.samples).fit().unwrap(),
        ] {
            prop_assert!(distance(fit.coefficients(), long.coefficients()) < tol::FIT_WELL);
        }
    }

    /// Changed units of rate, volts and value scale the coefficients, without rounding if the
    /// factors are powers of 2. A factor s on the volts scales p_ij by s^-j.
    #[test]
    fn units_scale_the_coefficients(
        log in observations(Degree::POLY13, 0.5, 30..150),
        (r, v, z) in (-20..20_i32, -20..20_i32, -20..20_i32),
    ) {
        let [r, v, z] = [r, v, z].map(|n| 2.0_f64.powi(n));
        let fit = accumulate::<16>(Degree::POLY13, &log.samples).fit().unwrap();
        let other: Vec<Sample> =
            log.samples.iter().map(|s| Sample { rate: s.rate * r, volts: s.volts * v, value: s.value * z }).collect();
        let other = accumulate::<16>(Degree::POLY13, &other).fit().unwrap();
        for (k, (i, j)) in Degree::POLY13.exponents().enumerate() {
            let back = other.coefficients()[k] * r.powi(i.into()) * v.powi(j.into()) / z;
            prop_assert_eq!(back, fit.coefficients()[k]);
        }
    }

    /// Offsets of voltage and value shift the surface without changing its shape.
    #[test]
    fn a_shift_moves_the_surface(
        log in observations(Degree::POLY13, 0.5, 60..150),
        (by_volts, by_value) in (-5.0..5.0_f64, -100.0..100.0_f64),
    ) {
        let fit = accumulate::<16>(Degree::POLY13, &log.samples).fit().unwrap();
        let moved: Vec<Sample> =
            log.samples.iter().map(|s| Sample { volts: s.volts + by_volts, value: s.value + by_value, ..*s }).collect();
        let moved = accumulate::<16>(Degree::POLY13, &moved).fit().unwrap();
        for &Sample { rate, volts, .. } in &log.samples {
            let (a, b) = (fit.surface(), moved.surface());
            let (a, b) = (a.eval(rate, volts) + by_value, b.eval(rate, volts + by_volts));
            // Horner's rule in raw volts adds terms up to 10 * 6^3 that cancel.
            assert_abs_diff_eq!(a, b, epsilon = 1e4 * tol::FIT_WELL);
            let (h, g) = (fit.leverage(rate, volts), moved.leverage(rate, volts + by_volts));
            assert_abs_diff_eq!(h, g, epsilon = 1e2 * tol::FIT_WELL);
        }
        assert_relative_eq!(
            moved.sse(),
            fit.sse(),
            epsilon = 0.0,
            max_relative = tol::FIT_STATISTICS
        );
    }

    #[test]
    fn a_whole_weight_is_a_repetition(
        log in observations(Degree::POLY13, 0.5, 30..80),
        weights in prop::collection::vec(0..4_u8, 80),
    ) {
        let mut weighted = SurfaceAccumulator::<f64, 21, 16>::new(Degree::POLY13);
        let mut repeated = weighted.clone();
        for (&sample, &weight) in log.samples.iter().zip(&weights) {
            weighted.push_weighted(sample, weight.into()).unwrap();
            (0..weight).for_each(|_| repeated.push(sample).unwrap());
        }
        prop_assume!(weighted.samples() > 20);
        let (weighted, repeated) = (weighted.factor(), repeated.factor());
        assert_relative_eq!(
            weighted.weight(),
            repeated.weight(),
            epsilon = 0.0,
            max_relative = tol::FIT_WELL
        );
        let (a, b) = (weighted.fit().unwrap(), repeated.fit().unwrap());
        prop_assert!(distance(a.coefficients(), b.coefficients()) < allowed(b.condition()));
        assert_relative_eq!(a.sse(), b.sse(), epsilon = 0.0, max_relative = tol::FIT_STATISTICS);
        assert_abs_diff_eq!(
            a.r_squared().unwrap(),
            b.r_squared().unwrap(),
            epsilon = tol::FIT_STATISTICS
        );
    }

    #[test]
    fn lower_degrees_from_one_triangle_equal_their_own_pass(
        log in observations(Degree::new(4, 5).unwrap(), 0.5, 100..200),
        (rate, volts) in (0..=4_u8, 0..=5_u8),
    ) {
        let degree = Degree::new(rate, volts).unwrap();
        // poly45 has every term up to total degree 5 except rate^5.
        let all = accumulate::<16>(Degree::new(4, 5).unwrap(), &log.samples).factor();
        let own = accumulate::<16>(degree, &log.samples).fit().unwrap();
        let fit = all.fit_degree(degree).unwrap();
        let off = distance(fit.coefficients(), own.coefficients());
        prop_assert!(off < allowed(1e2 * own.condition()), "{degree}: off by {off:e}");
        assert_relative_eq!(
            fit.sse(),
            own.sse(),
            epsilon = 0.0,
            max_relative = tol::FIT_STATISTICS
        );
        prop_assert_eq!(fit.dof(), own.dof());
    }

    #[test]
    fn the_triangle_knows_the_error_of_any_surface(
        log in observations(Degree::POLY13, 0.5, 30..150),
        other in surface_of(Degree::POLY13),
    ) {
        let factor = accumulate::<16>(Degree::POLY13, &log.samples).factor();
        let sum: f64 = log
            .samples
            .iter()
            .map(|&Sample { rate, volts, value }| (value - other.eval(rate, volts)).powi(2))
            .sum();
        let found = factor.residual_of(&other.coefficients()[..7]);
        assert_relative_eq!(found, sum, epsilon = 0.0, max_relative = tol::FIT_STATISTICS);
    }

    #[test]
    fn leverages_sum_to_the_number_of_terms(log in observations(Degree::POLY13, 0.5, 30..100)) {
        let fit = accumulate::<16>(Degree::POLY13, &log.samples).fit().unwrap();
        let sum: f64 = log.samples.iter().map(|s| fit.leverage(s.rate, s.volts)).sum();
        assert_abs_diff_eq!(sum, 7.0, epsilon = tol::FIT_STATISTICS);
    }

    #[test]
    fn leaving_a_trial_out_equals_fitting_the_others(
        log in observations(Degree::POLY13, 0.5, 90..200), trials in 2..5_usize,
    ) {
        let parts: Vec<Vec<Sample>> = (0..trials)
            .map(|t| log.samples.iter().skip(t).step_by(trials).copied().collect())
            .collect();
        let factors: Vec<_> =
            parts.iter().map(|part| accumulate::<16>(Degree::POLY13, part).factor()).collect();
        let (mut sum, mut count) = (0.0, 0);
        let mut left_out = Vec::new();
        held_out(&factors, Degree::POLY13, |trial| left_out.push(trial.unwrap())).unwrap();
        prop_assert_eq!(left_out.len(), trials);
        for held_out in left_out {
            let others: Vec<Sample> = (0..trials)
                .filter(|&t| t != held_out.trial)
                .flat_map(|t| parts[t].iter().copied())
                .collect();
            let surface = accumulate::<16>(Degree::POLY13, &others).fit().unwrap().surface();
            let sse: f64 = parts[held_out.trial]
                .iter()
                .map(|&Sample { rate, volts, value }| (value - surface.eval(rate, volts)).powi(2))
                .sum();
            assert_relative_eq!(
                held_out.sse,
                sse,
                epsilon = 0.0,
                max_relative = tol::FIT_STATISTICS
            );
            sum += sse;
            count += parts[held_out.trial].len();
        }
        let pooled = cross_validate(&factors, Degree::POLY13).unwrap();
        prop_assert_eq!(pooled.samples, count as u64);
        assert_relative_eq!(
            pooled.rmse,
            (sum / count as f64).sqrt(),
            epsilon = 0.0,
            max_relative = tol::FIT_STATISTICS
        );
    }

    #[test]
    fn any_input_gives_finite_numbers_or_an_error(
        samples in prop::collection::vec(
            (any::<f64>(), any::<f64>(), any::<f64>(), any::<f64>()), 0..60),
        exponent in -320..320_i32,
        degree in degree(),
    ) {
        finite_or_refused::<f64>(degree, &samples, 10.0_f64.powi(exponent))?;
        // f32 gets the same numbers, most of which are out of its range, and a smaller span of
        // scales.
        finite_or_refused::<f32>(degree, &samples, 10.0_f64.powi(exponent / 8))?;
    }

    /// Up to a fifth of the samples may have arbitrary values.
    #[test]
    fn robust_fits_ignore_gross_errors(
        log in observations(Degree::POLY13, 0.01, 80..150),
        gross in prop::collection::vec(-1e6..1e6_f64, 16),
        apart in 5..9_usize,
    ) {
        let n = log.samples.len();
        let spoilt = || log.samples.iter().enumerate().map(|(k, sample)| {
            let error = if k % apart == 0 { gross[(k / apart) % 16] } else { 0.0 };
            Sample { value: sample.value + error, ..*sample }
        });
        let mut memory = vec![0.0; n];
        let absolute =
            robust_fit(Degree::POLY13, Loss::LeastAbsolute, spoilt, &mut memory);
        let surface = absolute.unwrap().fit.surface();
        for &Sample { rate, volts, .. } in &log.samples {
            let (found, truth) = (surface.eval(rate, volts), log.surface.eval(rate, volts));
            assert_abs_diff_eq!(found, truth, epsilon = tol::FIT_GROSS_ERRORS * 0.01);
        }
    }

    /// On samples without errors, a robust fit is exact and rejects nothing.
    #[test]
    fn robust_fits_of_exact_samples_are_exact(log in observations(Degree::POLY13, 0.0, 30..90)) {
        let mut memory = vec![0.0; log.samples.len()];
        let again = || log.samples.iter().copied();
        for loss in [Loss::Bisquare, Loss::LeastAbsolute] {
            let robust = robust_fit(Degree::POLY13, loss, again, &mut memory).unwrap();
            prop_assert!(robust.converged && robust.rejected == 0);
            let off = distance(robust.fit.coefficients(), &log.surface.coefficients()[..7]);
            prop_assert!(off < tol::FIT_WELL * 10.0, "off by {off:e}");
        }
    }
}

/// Checks that fits of arbitrary numbers, and of samples with a common scale, give an `Err` or
/// finite results.
fn finite_or_refused<T: Real>(
    degree: Degree,
    samples: &[(f64, f64, f64, f64)],
    scale: f64,
) -> Result<(), TestCaseError> {
    let mut gross = SurfaceAccumulator::<T, 21, 8>::new(degree);
    let mut tame = gross.clone();
    for (k, &(rate, volts, value, weight)) in samples.iter().enumerate() {
        let [r, v, z, w] = [rate, volts, value, weight.abs()].map(T::from_f64);
        let sample = stretch_fit::Sample { rate: r, volts: v, value: z };
        let _ = gross.push(sample);
        let _ = gross.push_weighted(sample, w);
        let unit = |x: f64| if x.is_finite() && x != 0.0 { x.abs().log2() % 1.0 } else { 0.5 };
        let [rate, volts, value] =
            [unit(rate) * scale, k as f64 * scale, unit(value) / scale].map(T::from_f64);
        let _ = tame.push(stretch_fit::Sample { rate, volts, value });
    }
    for sums in [gross, tame] {
        let fit = match sums.fit() {
            Ok(fit) => fit,
            Err(error) => {
                prop_assert!(!error.to_string().is_empty());
                continue;
            }
        };
        prop_assert!(fit.coefficients().iter().all(|c| c.is_finite()));
        prop_assert!(fit.sse().is_finite() && fit.condition().is_finite());
        for statistic in [fit.r_squared(), fit.adjusted_r_squared(), fit.rmse()] {
            prop_assert!(statistic.is_none_or(|s| s.is_finite()));
        }
        if let Some(mut errors) = fit.standard_errors() {
            prop_assert!(errors.all(|e| e.is_finite()));
        }
    }
    Ok(())
}

/// Returns the factor of trial number `k`, which has its own noise.
fn trial(k: u32, degree: Degree, truth: impl Fn(f64, f64) -> f64) -> Factor<f64, 21> {
    let mut sums = SurfaceAccumulator::<f64, 21, 32>::new(degree);
    let mut state = u64::from(k) * 2_654_435_761 + 1;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..250 {
        let (rate, volts) = (2.0 * uniform() - 1.0, uniform());
        let noise = 0.02 * (uniform() + uniform() + uniform() - 1.5);
        sums.push(Sample { rate, volts, value: truth(rate, volts) + noise }).unwrap();
    }
    sums.factor()
}

#[test]
fn the_order_table_recommends_the_order_of_the_truth() {
    type Truth = fn(f64, f64) -> f64;
    let truths: [(Truth, (u8, u8)); 3] = [
        (|r, v| v + r * v + v * v, (1, 2)),
        (|r, v| v + r * v * v - v * v * v, (1, 3)),
        (|r, v| v + r * v * v - v * v * v + 2.0 * v * v * v * v, (1, 4)),
    ];
    let covering = OrderTable::<f64>::covering(Degree::POLY13);
    for (truth, (rate, volts)) in truths {
        let trials: Vec<_> = (0..8).map(|k| trial(k, covering, truth)).collect();
        let table = OrderTable::new(&trials, Degree::POLY13).unwrap();
        assert_eq!(table.recommended(), Degree::new(rate, volts).ok());
        let terms: Vec<usize> = table.rows().map(|(degree, _)| degree.terms()).collect();
        assert!(terms.is_sorted() && terms.len() == 5, "{terms:?}");
    }
}

#[test]
fn one_trial_recommends_nothing_but_still_fits() {
    let covering = OrderTable::<f64>::covering(Degree::POLY13);
    let table = OrderTable::new(&[trial(1, covering, |_, v| v)], Degree::POLY13).unwrap();
    assert_eq!(table.recommended(), None);
    for (degree, row) in table.rows() {
        let row = row.as_ref().unwrap();
        assert!(row.r_squared.unwrap() > 0.9, "{degree}");
        let needed = degree.terms() as u64;
        assert_eq!(row.cross_validation, Err(FitError::TooFewSamples { needed, got: 0 }));
    }
}

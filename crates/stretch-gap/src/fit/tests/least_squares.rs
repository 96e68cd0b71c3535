//! Compares fits of a straight line with a direct solution. A line is linear in its parameters, so
//! the maximum a posteriori is a ridge regression, which nalgebra solves.

use nalgebra::{DMatrix, DVector};

use super::prepared;
use crate::{
    numerics::random::RandomGenerator,
    problem::sample_roles::BLOCK_S,
    toys::{Law, Measured, Toy},
};

/// Relative to a tolerance. The preparation makes two fits. The last step of each fit is damped by
/// a thousandth, so the fit leaves at most a thousandth of the distance to the optimum. Two fits
/// therefore reduce a distance of three tolerances to 3e-6.
const DAMPED: f64 = 1e-5;
/// Relative tolerance: a sensitivity is a difference of outputs near 1, which are rounded by 1e-16,
/// divided by a step of 0.03 parameter tolerances of 0.05 each.
const DIFFERENCED: f64 = 1e-9;

/// Returns the parameters p at the minimum of sum (m - a'p)^2/(2 b sigma^2) + sum ((p - p0)/s)^2/2,
/// and their covariance. The first sum is over the fitted samples that count, with the measured m,
/// a = (x, 1), and b samples in a block. The second sum is the prior with mean p0 and standard
/// deviation s.
///
/// An offset of standard deviation `offset` in each trial changes the covariance of the trial's
/// noise from sigma^2 I to sigma^2 I + offset^2 11', which is inverted by the formula of Sherman
/// and Morrison.
fn ridge(
    record: &Measured,
    counts: impl Fn(usize) -> bool,
    offset: f64,
) -> (DVector<f64>, DMatrix<f64>) {
    let toy = &record.toy;
    let weight = toy.dt_s / (BLOCK_S * toy.noise * toy.noise);
    let start = DVector::from_iterator(2, toy.parameters.iter().map(|p| p.nominal));
    let prior = toy.parameters.iter().map(|p| 1.0 / (p.sd * p.sd));
    let mut normal = DMatrix::from_diagonal(&DVector::from_iterator(2, prior));
    let mut right = DVector::zeros(2);
    for (range, (_, is_test)) in toy.ranges().into_iter().zip(&toy.trials) {
        if *is_test {
            continue;
        }
        let (mut sums, mut sum, mut count) = (DVector::zeros(2), 0.0, 0.0);
        for i in range.filter(|i| counts(*i)) {
            let a = DVector::from_vec(vec![record.x[i], 1.0]);
            let r = record.outputs[0][i] - start.dot(&a);
            normal += weight * &a * a.transpose();
            right += weight * r * &a;
            (sums, sum, count) = (sums + a, sum + r, count + 1.0);
        }
        let ratio = (offset / toy.noise).powi(2);
        let lost = weight * ratio / (1.0 + ratio * count);
        normal -= lost * &sums * sums.transpose();
        right -= lost * sum * sums;
    }
    let covariance = normal.try_inverse().expect("a prior makes it definite");
    (start + &covariance * right, covariance)
}

fn assert_agrees(record: &Measured, counts: impl Fn(usize) -> bool, offset: f64) {
    let (expected, covariance) = ridge(record, counts, offset);
    let nominal = prepared(record).nominal;
    for (p, spec) in record.toy.parameters.iter().enumerate() {
        let apart = (nominal.model.parameters[p] - expected[p]).abs();
        assert!(apart < DAMPED * spec.sd, "{}: {apart} of {}", spec.name, spec.sd);
        approx::assert_relative_eq!(
            nominal.spread.of_parameter(p),
            covariance[(p, p)].sqrt(),
            max_relative = DIFFERENCED
        );
    }
}

#[test]
fn re_tuning_a_line_is_ridge_regression() {
    let mut random = RandomGenerator::new(1, 0);
    for seed in 0..8 {
        let noise = 0.003 * 3.0_f64.powi((seed % 4) as i32);
        let off = [random.gauss().clamp(-2.5, 2.5), random.gauss().clamp(-2.5, 2.5)];
        let toy = Toy { noise, ..Toy::of(&[Law::Line]).off_by(&off) };
        assert_agrees(&toy.measured(seed), |_| true, 0.0);
    }
}

/// Samples that were not measured do not count, whatever their value, and neither do isolated
/// outliers.
#[test]
fn samples_that_do_not_count_are_left_out_of_the_regression() {
    let mut toy = Toy::of(&[Law::Line]).off_by(&[1.0, -1.0]);
    let is_lost = |i: usize| i % 40 < 7;
    toy.is_lost = (0..toy.samples()).map(is_lost).collect();
    let mut record = toy.measured(3);
    for (i, y) in record.outputs[0].iter_mut().enumerate().filter(|(i, _)| is_lost(*i)) {
        *y += (0.1 * i as f64).sin();
    }
    let spiked = [130, 777, 1500, 2222];
    for i in spiked {
        assert!(!is_lost(i));
        // This is thirty standard deviations; from eight on, a sample is isolated.
        record.outputs[0][i] += 0.3;
    }
    assert_agrees(&record, |i| !is_lost(i) && !spiked.contains(&i), 0.0);
}

/// An offset in each trial is a nuisance. The zero of the line is then determined only by the means
/// of the three trials, not by three thousand samples.
#[test]
fn offsets_by_trial_are_marginalised_as_generalised_least_squares_does() {
    let mut toy = Toy::of(&[Law::Line]).off_by(&[0.5, 0.5]);
    toy.parameters[1].per_trial_sd = Some(0.02);
    let steps = [0.03, -0.01, 0.02, 0.0].into_iter().zip(toy.ranges());
    toy.courses = vec![(1, steps.flat_map(|(step, range)| range.map(move |_| step)).collect())];
    assert_agrees(&toy.measured(4), |_| true, 0.02);
}

/// A parameter stays at its bound of three tolerances. The other parameter is then determined by a
/// separate regression.
#[test]
fn a_parameter_is_held_at_three_tolerances() {
    for side in [-1.0, 1.0] {
        let record = Toy::of(&[Law::Line]).off_by(&[5.0 * side, 0.0]).measured(5);
        let found = prepared(&record).nominal.model.parameters;
        let spec = &record.toy.parameters[0];
        approx::assert_relative_eq!(found[0], spec.nominal + side * 3.0 * spec.sd);
        let mut held = record.toy.clone();
        held.parameters[0].nominal = found[0];
        // The tolerance is so narrow that the regression does not change this parameter.
        held.parameters[0].sd = 1e-9;
        let mut held = held.driven_by(record.x.clone(), 0);
        held.outputs = record.outputs;
        let (expected, _) = ridge(&held, |_| true, 0.0);
        assert!((found[1] - expected[1]).abs() < DAMPED * held.toy.parameters[1].sd);
    }
}

#[test]
fn exact_parameters_and_bounds_are_kept() {
    let mut toy = Toy::of(&[Law::Line]).off_by(&[-2.0, 2.0]);
    toy.parameters[0].least = 0.96;
    toy.parameters[1].sd = 0.0;
    let found = prepared(&toy.measured(6)).nominal.model.parameters;
    assert_eq!(found, [0.96, toy.parameters[1].nominal]);
}

/// A line has no memory, so cutting a trial in two changes nothing. Sums are computed in another
/// order, so bits may differ.
#[test]
fn cutting_a_trial_of_a_line_in_two_changes_nothing() {
    let toy = Toy::of(&[Law::Line]).off_by(&[1.5, -0.5]);
    let whole = Toy { trials: vec![(2800, false), (1000, true)], ..toy };
    let cut = Toy { trials: vec![(1400, false), (1400, false), (1000, true)], ..whole.clone() };
    let x: Vec<f64> =
        (0..3800).map(|i| (0.013 * i as f64).sin() * (0.0031 * i as f64).cos()).collect();
    let [one, other] = [whole, cut].map(|toy| {
        let record = toy.driven_by(x.clone(), 7);
        let problem = prepared(&record);
        (problem.nominal.model.parameters.clone(), problem.nominal.misfits[0].fit)
    });
    approx::assert_relative_eq!(one.1, other.1, max_relative = DIFFERENCED);
    approx::assert_relative_eq!(one.0[..], other.0[..], max_relative = DIFFERENCED);
}

/// The reduced chi-square is the mean square of the residual divided by the variance of the noise.
#[test]
fn a_misfit_is_the_mean_square_in_units_of_the_noise() {
    let record = Toy::of(&[Law::Line]).measured(8);
    let problem = prepared(&record);
    let p = &problem.nominal.model.parameters;
    let fitted = 0..3000;
    let square = |i: usize| ((record.outputs[0][i] - p[0] * record.x[i] - p[1]) / 0.01).powi(2);
    let expected = fitted.clone().map(square).sum::<f64>() / fitted.len() as f64;
    let misfit = &problem.nominal.misfits[0];
    approx::assert_relative_eq!(misfit.fit, expected, max_relative = DIFFERENCED);
    // No trial is long enough to have a held-out part.
    assert_eq!(misfit.held, 1.0);
    approx::assert_relative_eq!(
        problem.gap_in(&problem.nominal, 0),
        (expected - 1.0).max(0.0),
        epsilon = DIFFERENCED
    );
}

/// Samples that were not measured do not count. 2400 samples were measured; the tolerance is three
/// standard errors, 3 sqrt(2/2400).
#[test]
fn a_misfit_is_a_mean_over_what_was_measured() {
    let mut toy = Toy::of(&[Law::Line]);
    toy.is_lost = (0..toy.samples()).map(|i| i % 5 == 0).collect();
    let record = toy.measured(9);
    approx::assert_abs_diff_eq!(prepared(&record).nominal.misfits[0].fit, 1.0, epsilon = 0.087);
}

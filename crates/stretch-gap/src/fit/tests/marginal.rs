//! Compares the marginalisation of slow drift with dense matrices, and estimates size and
//! correlation time of a drift from the recording.

use nalgebra::{DMatrix, DVector};

use super::prepared;
use crate::{
    numerics::random::RandomGenerator,
    problem::{sample_roles::Role, spec::SlowDrift},
    toys::{Law, Toy, slow},
};

/// Relative tolerance, for rounding: a filter is compared with a dense Cholesky factor of 250 rows
/// and a condition number of up to 1e4.
const DENSE: f64 = 1e-9;

/// Returns a line whose zero drifts with the given standard deviation and correlation time.
fn drifting(drift: SlowDrift, samples: usize) -> Toy {
    let mut toy = Toy { trials: vec![(samples, false), (samples, true)], ..Toy::of(&[Law::Line]) };
    toy.parameters[1].drift = Some(drift);
    toy
}

/// Returns V = I + s K of one trial, with the covariance K = exp(-|t|/tau) of the drift, and s in
/// units of the noise.
fn dense(drift: SlowDrift, noise: f64, samples: usize) -> DMatrix<f64> {
    let kept = (-0.01 / drift.correlation_s).exp();
    let size = (drift.sd / noise).powi(2);
    let prior = DMatrix::from_fn(samples, samples, |i, j| kept.powi(i.abs_diff(j) as i32));
    DMatrix::identity(samples, samples) + size * prior
}

#[test]
fn products_and_determinants_are_those_of_the_dense_covariance() {
    let samples = 245;
    for (sd, correlation_s) in [(0.005, 0.3), (0.02, 2.0), (0.1, 20.0)] {
        let drift = SlowDrift { sd, correlation_s };
        let record = drifting(drift, samples).measured(1);
        let problem = prepared(&record);
        let (roles, metric) = (&problem.compare.roles, &problem.compare.metrics[0]);
        let mut random = RandomGenerator::new(2, 0);
        let [x, y] = [0, 1].map(|_| DVector::from_fn(samples, |_, _| random.gauss()));
        let column = |x: &DVector<f64>| metric.column(roles, x.as_slice().to_vec());
        let product = metric.product(roles, &column(&x), &column(&y), Role::Fit);
        let factor = dense(drift, record.toy.noise, samples).cholesky().expect("definite");
        let expected = x.dot(&factor.solve(&y));
        // The tolerance is for a difference of sums that are as large as the number of samples.
        approx::assert_abs_diff_eq!(product, expected, epsilon = DENSE * samples as f64);
        let expected = 2.0 * factor.l().diagonal().map(f64::ln).sum();
        approx::assert_relative_eq!(
            metric.ln_det(roles, Role::Fit),
            expected,
            max_relative = DENSE
        );
        // If x is a residual, x without its most likely drift is V^-1 x.
        let mut cleaned = x.as_slice().to_vec();
        metric.clean(roles, &mut cleaned);
        let expected = factor.solve(&x);
        approx::assert_abs_diff_eq!(cleaned[..], expected.as_slice()[..], epsilon = DENSE);
    }
}

/// Re-tuning a line whose zero drifts is generalised least squares with the dense covariance.
#[test]
fn re_tuning_beside_a_drift_is_generalised_least_squares() {
    let samples = 245;
    let drift = SlowDrift { sd: 0.02, correlation_s: 2.0 };
    let mut toy = drifting(drift, samples).off_by(&[1.0, 0.5]);
    toy.courses = vec![(1, slow(0.02, 2.0, (2 * samples, 0.01), 3))];
    let record = toy.measured(3);
    let found = prepared(&record).nominal.model.parameters;
    let factor = dense(drift, toy.noise, samples).cholesky().expect("definite");
    let a = DMatrix::from_fn(samples, 2, |i, j| if j == 0 { record.x[i] } else { 1.0 } / toy.noise);
    let start = DVector::from_iterator(2, toy.parameters.iter().map(|p| p.nominal));
    let measured = DVector::from_fn(samples, |i, _| record.outputs[0][i] / toy.noise);
    let weighted = factor.solve(&a);
    // A block of half a second counts as one observation.
    let prior = toy.parameters.iter().map(|p| 1.0 / (p.sd * p.sd));
    let prior = DMatrix::from_diagonal(&DVector::from_iterator(2, prior));
    let normal = a.transpose() * &weighted / 50.0 + prior;
    let right = weighted.transpose() * (measured - &a * &start) / 50.0;
    let expected = start + normal.cholesky().expect("definite").solve(&right);
    for (p, spec) in toy.parameters.iter().enumerate() {
        // As in a fit without drift, the last step is damped by a thousandth.
        assert!((found[p] - expected[p]).abs() < 1e-5 * spec.sd, "{found:?} {expected}");
    }
}

/// Three trials of 29 s contain 15 to 60 correlation times, which determine the size to 10 % and
/// the correlation time to about 30 %. Sizes are tried in ratios of up to 1.75 and times in ratios
/// of up to 2.5, so the right value or one of its neighbours must win.
#[test]
fn size_and_time_of_a_drift_are_found_to_the_next_that_is_tried() {
    let described = SlowDrift { sd: 0.05, correlation_s: 3.0 };
    for (seed, (size, time_s)) in
        [(0.4, 1.5), (1.0, 3.0), (2.0, 3.0), (1.0, 6.0)].into_iter().enumerate()
    {
        let mut toy = drifting(described, 2900);
        toy.trials = vec![(2900, false); 3];
        let count = (toy.samples(), toy.dt_s);
        toy.courses = vec![(1, slow(size * described.sd, time_s, count, seed as u64))];
        let record = toy.measured(seed as u64);
        let problem = prepared(&record);
        let adapted = problem.adapted(&problem.nominal.model, 1).expect("it can be simulated");
        let problem = adapted.unwrap_or(problem);
        let level = problem.compare.metrics[0].loose()[0].level;
        assert!((0.55..1.8).contains(&(level.size / size)), "{level:?} for {size} {time_s}");
        assert!((0.38..2.6).contains(&(level.time_s / time_s)), "{level:?} for {size} {time_s}");
    }
}

//! Tests that one simulation per start shows which effects are worth a fit.

use nalgebra::{DMatrix, DVector};

use crate::{
    fit::{prepared::PreparedProblem, tests::prepared},
    search::screen::{Ground, Screened},
    toys::{Effect, Law, Toy},
};

fn screened(problem: &PreparedProblem<'_>) -> Vec<Screened> {
    let ground =
        Ground::around(&problem.compare, problem.nominal.model.clone()).expect("simulated");
    let effects = 0..problem.simulator().effects().len();
    let screen = |effect| problem.compare.screen(&ground, effect).expect("simulated");
    effects.map(screen).collect()
}

#[test]
fn the_effect_that_is_hidden_promises_most() {
    let hidden: [(Effect, &[f64]); 6] = [
        (Effect::Play, &[0.1]),
        (Effect::Quadratic, &[0.08]),
        (Effect::Cubic, &[0.15]),
        (Effect::Late, &[0.08]),
        (Effect::Drift, &[0.001]),
        (Effect::Creep, &[0.15, 1.0]),
    ];
    let mut wrong = Vec::new();
    for law in [Law::Line, Law::Lag, Law::Oscillator, Law::Delay] {
        for (effect, values) in hidden {
            let toy = Toy::of(&[law]).may_lack(&Effect::ALL).hiding(&[(effect, values)]);
            let record = toy.measured(1);
            let problem = prepared(&record);
            let mut all = screened(&problem);
            all.sort_by(|a, b| b.gain().total_cmp(&a.gain()));
            // A delay and a lag with the same time constant differ only by terms of second order in
            // time constant times frequency, so either may come first.
            let mut ranks = all.iter().map(|s| Effect::ALL[s.effect]);
            let first = ranks.find(|e| effect != Effect::Late || *e != Effect::Slow);
            if first != Some(effect) {
                let gains: Vec<_> = all.iter().map(|s| (Effect::ALL[s.effect], s.gain())).collect();
                wrong.push((law, effect, gains));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The promised gain of a linear effect equals the reduction of a ridge regression's cost by one
/// more regressor with a flat prior.
#[test]
fn the_gain_of_a_linear_effect_is_the_fall_of_a_regression() {
    for size in [0.004, 0.02, 0.1] {
        let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic]);
        let record = toy.hiding(&[(Effect::Quadratic, &[size])]).measured(2);
        let problem = prepared(&record);
        let found = &screened(&problem)[0];
        let cost = |columns: usize| {
            let gain = problem.nominal.model.parameters[0];
            let (sd, weight) = (0.05, 1.0 / (50.0 * 0.01 * 0.01));
            let a = DMatrix::from_fn(3000, columns, |i, j| match j {
                0 => record.x[i],
                1 => 1.0,
                _ => gain * record.x[i].powi(2),
            });
            let start = DVector::from_fn(columns, |j, _| [1.0, 0.2, 0.0][j]);
            let r = DVector::from_fn(3000, |i, _| record.outputs[0][i]) - &a * start;
            let prior = |j: usize| if j < 2 { 1.0 / (sd * sd) } else { 0.0 };
            let prior =
                DMatrix::from_fn(columns, columns, |i, j| if i == j { prior(i) } else { 0.0 });
            let normal = weight * a.transpose() * &a + &prior;
            let step = normal.cholesky().expect("definite").solve(&(weight * a.transpose() * &r));
            0.5 * weight * (r - a * &step).norm_squared()
                + 0.5 * (step.transpose() * prior * &step)[0]
        };
        // A screen ignores the pull of the priors. The data outweigh the priors by at least a
        // factor of 180, so an amplitude changes by at most 1/180, and its square by twice that.
        approx::assert_relative_eq!(found.gain(), cost(2) - cost(3), max_relative = 0.02);
        // The size agrees with the regression, within three standard deviations of 0.01/sqrt(3000 *
        // 0.02) = 0.0013.
        approx::assert_abs_diff_eq!(found.starts[0].0[0], size, epsilon = 0.004);
    }
}

/// A change that re-tuned parameters can explain promises nothing: an effect that only changes the
/// gain is projected out.
#[test]
fn what_parameters_can_do_is_no_gain() {
    let toy = Toy::of(&[Law::Lag]).may_lack(&[Effect::Slow, Effect::Late]).off_by(&[2.0, 2.0]);
    let record = toy.measured(3);
    let problem = prepared(&record);
    // A regressor without effect gains half a nat on average if samples are independent. Here fifty
    // samples count as one, which divides the gain by 50. A single regressor gains 12 nats by
    // chance about once in 10^6 cases.
    assert!(screened(&problem).iter().all(|s| s.gain() < 12.0 / 50.0));
}

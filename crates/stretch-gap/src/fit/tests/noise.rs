//! Compares the variance of the input noise that arrives at an output with theory.

use super::prepared;
use crate::{
    fit::noise_level::noise_levels,
    problem::{
        noise::Noise,
        runs::Runs,
        sample_roles::SampleRoles,
        simulator::{Model, Simulator},
    },
    toys::{Effect, Law, Measured, Toy},
};

/// Relative tolerance: three times the standard error of a standard deviation that is estimated
/// from twelve draws of 4000 samples. With a lag of ten samples, every twentieth sample is
/// independent, i.e. 2400 in total. The standard error is 1/sqrt(2 * 2400) = 1.4 %.
const DRAWN: f64 = 0.045;

fn root_mean_square(record: &Measured, stage: usize) -> f64 {
    let runs = Runs::new(record, &super::GO_ON).expect("measured");
    let roles = SampleRoles::of(record).expect("something to fit");
    let levels = noise_levels(&runs, &roles, &Model::nominal(record), 1).expect("simulated");
    levels[stage].rms
}

/// Through a line, sigma^2 = own^2 + gain^2 s^2. Through a lag that keeps k = exp(-dt/tau) from
/// sample to sample, sigma^2 = own^2 + s^2 (1 - k)/(1 + k).
#[test]
fn noise_of_the_input_arrives_as_theory_says() {
    let kept = (-0.1_f64).exp();
    for (law, share) in
        [(Law::Line, 1.0), (Law::Lag, (1.0 - kept) / (1.0 + kept)), (Law::Delay, 1.0)]
    {
        let toy = Toy { input_noise: 0.05, ..Toy::of(&[law]) };
        let expected = f64::sqrt(0.01_f64.powi(2) + share * 0.05_f64.powi(2));
        let found = root_mean_square(&toy.measured(1), 0);
        approx::assert_relative_eq!(found, expected, max_relative = DRAWN);
    }
    let quiet = Toy::of(&[Law::Lag]).measured(1);
    assert_eq!(root_mean_square(&quiet, 0), 0.01);
}

/// Noise of the input is no gap: if the transmitted noise is included, the reduced chi-square is
/// one.
#[test]
fn an_input_that_is_noisy_leaves_no_gap() {
    for law in [Law::Line, Law::Lag, Law::Oscillator] {
        let toy = Toy { input_noise: 0.03, ..Toy::of(&[law]) };
        let record = toy.measured(2);
        let problem = prepared(&record);
        // The tolerance is three standard errors. 3000 samples that are correlated over ten have
        // the standard error sqrt(2/300) = 0.08.
        approx::assert_abs_diff_eq!(problem.nominal.misfits[0].fit, 1.0, epsilon = 0.25);
    }
}

/// If no noise level is stated, the recording's second differences determine it, with a relative
/// standard error of 1.6/sqrt(3000). The tolerance is five times that.
#[test]
fn noise_that_is_not_stated_comes_from_the_record() {
    for law in [Law::Line, Law::Lag, Law::Oscillator] {
        for noise in [0.001, 0.01, 0.1] {
            let toy =
                Toy { noise, stated: None, ..Toy::of(&[law]).hiding(&[(Effect::Play, &[0.1])]) };
            let found = root_mean_square(&toy.measured(3), 0);
            approx::assert_relative_eq!(found, noise, max_relative = 0.15);
        }
    }
}

/// The motion has only four samples per period. Second differences of the recording therefore
/// contain the motion itself; those of the residual of the true law contain only the noise.
#[test]
fn motion_that_is_quick_is_no_noise() {
    let toy = Toy { dt_s: 0.25, noise: 0.01, stated: None, ..Toy::of(&[Law::Oscillator]) };
    let record = toy.measured(4);
    let simulator: &dyn Simulator = &record;
    let own = Noise::of_differences([simulator.measured(0)].into_iter(), 0.25).sd();
    assert!(own > 0.05, "{own}");
    approx::assert_relative_eq!(root_mean_square(&record, 0), 0.01, max_relative = 0.15);
}

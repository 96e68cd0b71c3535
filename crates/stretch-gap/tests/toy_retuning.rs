//! Tests that re-tuning recovers parameters and reports their uncertainties.

use stretch_gap::{Diagnosis, Knowledge, Options, RandomGenerator};

use crate::toys::{Effect, Law, Measured, Toy, binomial_bound, slow};

/// Number of samples that a fit counts as one observation: half a second at 100 Hz.
const BLOCK: f64 = 50.0;

fn told(record: &Measured) -> Diagnosis {
    record.diagnosed().0
}

/// In white noise, the error of a parameter is its posterior standard deviation divided by sqrt(50), because a block
/// counts as one observation. In addition, the prior pulls it towards its nominal value by sd^2/tolerance^2 of the
/// distance. None of 80 parameters should have an error of 4.5 standard deviations (probability 7e-6 each). Half a
/// standard deviation is added for the midpoint rule, whose relative error of the rate is (2 pi rate h)^2/6 = 1.6e-4.
#[test]
fn parameters_come_back_as_near_as_theory_says() {
    let mut random = RandomGenerator::new(1, 0);
    for law in [Law::Line, Law::Lag, Law::Oscillator, Law::Delay] {
        for seed in 0..8 {
            let off: Vec<f64> = (0..3).map(|_| random.gauss().clamp(-2.5, 2.5)).collect();
            let toy = Toy::of(&[law]).off_by(&off);
            let told = told(&toy.measured(seed));
            for ((p, spec), truth) in told.parameters.iter().zip(&toy.parameters).zip(&toy.truth) {
                let drawn = (truth - spec.nominal).abs() * (p.sd / spec.sd).powi(2);
                let error = (p.fitted - truth).abs();
                assert!(error < 5.0 * p.sd / BLOCK.sqrt() + drawn, "{law:?} {seed} {p:?} {truth}");
                assert!(p.sd < spec.sd, "no worse known than before");
                assert_eq!((p.nominal, &p.name), (spec.nominal, &spec.name));
                approx::assert_relative_eq!(
                    p.sigmas,
                    (p.fitted - p.nominal) / spec.sd,
                    epsilon = 1e-12,
                    max_relative = 1e-12
                );
            }
        }
    }
}

/// A block counts as one observation. This is right for noise with a correlation time of a quarter of a second. The
/// 95 % intervals then miss one in twenty values. Of 80 values, the test allows the number of misses that a binomial
/// count exceeds once in a thousand.
#[test]
fn intervals_cover_where_noise_has_a_memory() {
    const SEEDS: u64 = 40;
    let mut random = RandomGenerator::new(2, 0);
    let mut missed = 0;
    for seed in 0..SEEDS {
        let mut toy = Toy::of(&[Law::Line]).off_by(&[random.gauss(), random.gauss()]);
        // The correlation time of the noise is 0.25 s, so its integral time is half a second.
        toy.courses = vec![(1, slow(0.01, 0.25, (toy.samples(), toy.dt_s), seed))];
        (toy.noise, toy.stated) = (0.001, Some(10.0));
        let told = told(&toy.measured(seed));
        let pairs = told.parameters.iter().zip(&toy.truth);
        missed += pairs.filter(|(p, truth)| (p.fitted - **truth).abs() > 1.96 * p.sd).count();
    }
    let most = binomial_bound(2 * SEEDS as usize, 0.05, 1e-3);
    assert!(missed <= most, "{missed} of {} missed, at most {most}", 2 * SEEDS);
}

/// The same test for the parameter of an effect. The noise is white, so far fewer than one in twenty intervals miss.
#[test]
fn intervals_of_effects_cover() {
    const SEEDS: u64 = 20;
    let mut missed = 0;
    for seed in 0..SEEDS {
        let size = 0.05 + 0.01 * seed as f64;
        let hidden: &[(Effect, &[f64])] = &[(Effect::Quadratic, &[size])];
        let toy = Toy::of(&[Law::Line]).may_lack(&[Effect::Quadratic, Effect::Play]).hiding(hidden);
        let told = told(&toy.measured(seed));
        assert_eq!(told.named(), ["quadratic"], "{}", told.sentence);
        let value = &told.candidates[0].parameters[0];
        let [low, high] = value.interval;
        missed += usize::from(!(low..=high).contains(&size));
        approx::assert_relative_eq!(value.value, size, epsilon = 0.01);
    }
    assert!(missed <= binomial_bound(SEEDS as usize, 0.05, 1e-3), "{missed} of {SEEDS}");
}

/// With a constant input, gain and zero of a line have the same effect, and the time constant of a lag has none.
#[test]
fn what_nothing_excites_is_told() {
    let constant = |law| {
        let toy = Toy::of(&[law]);
        let x = vec![0.5; toy.samples()];
        told(&toy.driven_by(x, 1)).identifiability
    };
    let line = constant(Law::Line);
    assert_eq!(
        (line[0].like.as_slice(), line[1].like.as_slice()),
        (&["line.zero".into()][..], &["line.gain".into()][..])
    );
    let sentence = line[0].sentence().expect("something to say");
    assert!(sentence.starts_with("line.gain cannot be distinguished from line.zero"), "{sentence}");
    let lag = constant(Law::Lag);
    assert_eq!(lag[1].knowledge, Knowledge::Dead);
    assert_eq!(lag[0].knowledge, Knowledge::Determined);
    assert!(lag[0].like.is_empty() && lag[0].sentence().is_none());
}

/// The posterior standard deviation of the gain of a line is that of a ridge regression: 1/sd^2 = 1/tolerance^2 + sum
/// (x - mean x)^2/(50 noise^2). This neglects the prior of the zero.
#[test]
fn deviations_are_those_of_a_regression_whatever_the_noise_is() {
    for noise in [0.002, 0.05, 0.4, 4.0] {
        let toy = Toy { noise, ..Toy::of(&[Law::Line]) };
        let record = toy.measured(1);
        let told = told(&record);
        let x = &record.x[..3000];
        let mean = x.iter().sum::<f64>() / 3000.0;
        let data = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (BLOCK * noise * noise);
        let expected = 1.0 / (data + 1.0 / 0.05_f64.powi(2)).sqrt();
        let gain = &told.identifiability[0];
        // The mean of x is up to 0.1. If the zero is known from its prior and not from the data, the gain has up to
        // 0.01/0.125 more information.
        approx::assert_relative_eq!(gain.sd, expected, max_relative = 0.05);
        assert!(gain.sd_alone <= gain.sd);
        let share = gain.sd / gain.tolerance;
        let knowledge = match share {
            s if s <= 1.0 / 3.0 => Knowledge::Determined,
            s if s <= 0.9 => Knowledge::Weakly,
            _ => Knowledge::Not,
        };
        assert_eq!(gain.knowledge, knowledge, "{share}");
    }
}

#[test]
fn a_parameter_at_the_end_of_its_tolerances_is_told() {
    let told = told(&Toy::of(&[Law::Line]).off_by(&[4.0, 0.0]).measured(1));
    let [gain, zero] = &told.identifiability[..] else { panic!("two parameters") };
    assert!(gain.at_bound && !zero.at_bound);
    assert_eq!(
        gain.sentence().as_deref(),
        Some("line.gain is at the limit of what its tolerance allows")
    );
}

/// Stages that share a parameter are fitted together: the gain of two lags is known better than from one lag alone.
#[test]
fn a_shared_parameter_is_known_from_both_stages() {
    let alone = Toy::of(&[Law::Lag]).off_by(&[1.0, 0.0]);
    let mut both = Toy::of(&[Law::Lag, Law::Lag]).off_by(&[1.0]);
    both.shared = vec![(1, 0)];
    let [alone, both] = [alone, both].map(|toy| told(&toy.measured(3)));
    let (one, two) = (&alone.parameters[0], &both.parameters[0]);
    assert!(two.sd < one.sd, "{} {}", two.sd, one.sd);
    approx::assert_abs_diff_eq!(two.fitted, 1.05, epsilon = 5.0 * two.sd / BLOCK.sqrt());
}

/// Held-out and test samples enter no fit: if their values change, the re-tuned parameters stay the same to the bit.
#[test]
fn nothing_is_fitted_by_what_is_held_out_or_tested() {
    let toy = Toy { trials: vec![(4000, false), (1000, true)], ..Toy::of(&[Law::Line]) };
    let record = toy.measured(4);
    let mut other = toy.measured(4);
    // The last three tenths of the first trial are held out, and the second trial is tested on.
    other.outputs[0][2900..]
        .iter_mut()
        .enumerate()
        .for_each(|(i, y)| *y += 0.02 * (0.1 * i as f64).sin());
    let [one, other] = [record, other].map(|r| r.diagnosed_by(&Options::default()).1.retuned);
    assert_eq!(one.parameters, other.parameters);
}

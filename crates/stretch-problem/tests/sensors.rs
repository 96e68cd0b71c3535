//! All sensors of a recorder in one problem: a shift that they share comes from the recorder.

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator};
use stretch_problem::{Problem, ProblemError, sensors};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 2500;
const SIGNALS: [&str; 3] = ["s1", "s2", "s3"];

/// Trials in which all signals are late by `late_s`, and increasingly so if the clock drifts. The
/// second signal has a play of `slip_deg`.
fn recorded(late_s: f64, drift: f64, slip_deg: f64) -> Vec<SessionTrial> {
    moved(late_s, drift, slip_deg, 0.0)
}

/// The same trials with a movement below the sensors that was not recorded. It drifts within
/// seconds, with a standard deviation of `below_deg`.
fn moved(late_s: f64, drift: f64, slip_deg: f64, below_deg: f64) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let angle = |t: f64| {
            let waves = [(0.7, 25.0), (1.9, 15.0), (4.3, 6.0)];
            waves.iter().map(|(w, a)| a * (w * t + 1.3 * trial as f64 * w).sin()).sum::<f64>()
        };
        let start_s = 30.0 * trial as f64;
        let below = wandering(trial, below_deg);
        let column = |which: usize| -> Vec<f64> {
            let mut random = RandomGenerator::new(31, (10 * trial + which) as u64);
            let [gain, offset] = [[0.02, 1.2], [-0.05, 3.0], [0.011, 0.4]][which];
            let mut held = angle(0.0);
            let one = |i: usize| {
                let t = i as f64 * DT_S;
                let x = angle(t - late_s - drift * (start_s + t));
                held = held.clamp(x - slip_deg, x + slip_deg);
                let x = if which == 1 { held } else { x } + [1.0, 0.9, 1.1][which] * below[i];
                offset + gain * x + 0.02 * gain.abs() * random.gauss()
            };
            (0..SAMPLES).map(one).collect()
        };
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let angles = (0..SAMPLES).map(|i| angle(i as f64 * DT_S)).collect();
        let mut channels = vec![channel("angle_deg", angles)];
        channels.extend(SIGNALS.iter().enumerate().map(|(i, name)| channel(name, column(i))));
        let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let trial_of = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        SessionTrial { start_s, split, ..SessionTrial::new(trial_of) }
    };
    (0..3).map(one).collect()
}

/// An Ornstein-Uhlenbeck process with a standard deviation of `sd` and a correlation time of 3 s.
fn wandering(trial: usize, sd: f64) -> Vec<f64> {
    let mut random = RandomGenerator::new(32, trial as u64);
    let (kept, mut z) = ((-DT_S / 3.0).exp(), random.gauss());
    let one = |_| {
        z = kept * z + (1.0 - kept * kept).sqrt() * random.gauss();
        sd * z
    };
    (0..SAMPLES).map(one).collect()
}

fn diagnosed(trials: Vec<SessionTrial>) -> Diagnosis {
    let problem = Problem::from(sensors(trials, "angle_deg", &SIGNALS, &[]).expect("a problem"));
    let examined = problem.examine(&Options::default(), false, &|_| (), &|| false);
    examined.expect("a diagnosis").diagnosis
}

#[test]
fn what_all_sensors_share_is_the_recorders_clock() {
    let found = diagnosed(recorded(0.08, 0.0, 0.0));
    assert_eq!(found.named(), ["record.skew"], "{}", found.sentence);
    let late = &found.candidates[0].parameters[0];
    assert!((late.value - 0.08).abs() < 0.005, "{late:?}");
}

#[test]
fn a_clock_that_drifts_is_the_recorders_too() {
    let found = diagnosed(recorded(0.05, 1e-3, 0.0));
    let is_clock = |name: &String| name == "record.clock_drift";
    let is_tied = found.answer.tied().iter().chain(&found.ambiguous).any(is_clock);
    assert!(found.named().iter().any(is_clock) || is_tied, "{}", found.sentence);
}

#[test]
fn what_one_sensor_does_is_its_own() {
    let found = diagnosed(recorded(0.0, 0.0, 2.0));
    assert_eq!(found.named(), ["s2.output.backlash"], "{}", found.sentence);
}

#[test]
fn sensors_that_do_as_they_should_lack_nothing() {
    let found = diagnosed(recorded(0.0, 0.0, 0.0));
    assert!(found.named().is_empty(), "{:?}: {}", found.named(), found.sentence);
}

/// If three sensors have an error in common, crosstalk from the other two could explain each of
/// them. Such an error is not named as crosstalk, and a shift by the recorder is still found.
#[test]
fn an_error_that_all_sensors_share_is_no_crosstalk() {
    for late_s in [0.0, 0.08] {
        let found = diagnosed(moved(late_s, 0.0, 0.0, 1.0));
        let effects = found.candidates.iter().flat_map(|c| &c.effects);
        let crosstalk: Vec<&String> = effects.filter(|e| e.contains("crosstalk(s")).collect();
        assert!(crosstalk.is_empty(), "{crosstalk:?}: {}", found.sentence);
        let first = &found.candidates[0];
        match late_s {
            0.0 => assert!(found.named().is_empty(), "{}", found.sentence),
            _ => assert!(first.effects.iter().any(|e| e == "record.skew"), "{first:?}"),
        }
    }
}

#[test]
fn a_signal_that_is_not_there_is_named() {
    let error: ProblemError =
        sensors(recorded(0.0, 0.0, 0.0), "angle_deg", &["s1", "s9"], &[]).unwrap_err();
    assert!(error.to_string().contains("s9"), "{error}");
}

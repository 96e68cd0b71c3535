//! Several signals of one recorder: a delay of all signals comes from the recorder's clock, a delay
//! of one signal from that signal.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 2500;
const SIGNALS: [&str; 3] = ["grip_N", "bend_deg", "turn_dps"];

fn motion(trial: usize, t: f64) -> f64 {
    let waves = [(0.7, 1.0), (1.9, 0.6), (4.3, 0.35), (7.1, 0.2)];
    waves.iter().map(|(w, a)| a * (w * t + 1.3 * trial as f64 * w).sin()).sum()
}

/// Each signal as a function of the motion.
fn signal(which: usize, x: f64) -> f64 {
    [2.0 * x, 1.0 + x + 0.2 * x * x, x.powi(3) - x][which]
}

/// Trials in which each signal has its own delay, and the last one a lag of `tau_s`.
fn recorded(late_s: [f64; 3], tau_s: f64) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let t = |i: usize| i as f64 * DT_S;
        let column = |which: usize| -> Vec<f64> {
            let mut random = RandomGenerator::new(31, (10 * trial + which) as u64);
            let mut slow: Option<f64> = None;
            let kept = (-DT_S / tau_s).exp();
            (0..SAMPLES)
                .map(|i| {
                    let y = signal(which, motion(trial, t(i) - late_s[which]));
                    let is_slow = which == 2 && tau_s > 0.0;
                    let y = if is_slow { kept * slow.unwrap_or(y) + (1.0 - kept) * y } else { y };
                    slow = Some(y);
                    y + 0.005 * random.gauss()
                })
                .collect()
        };
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let mut channels =
            vec![channel("motion_rad", (0..SAMPLES).map(|i| motion(trial, t(i))).collect())];
        channels.extend(SIGNALS.iter().enumerate().map(|(i, name)| channel(name, column(i))));
        let time_s = (0..SAMPLES).map(t).collect();
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        let trial_of = Trial { name: format!("t{trial}.csv"), time_s, channels };
        SessionTrial { start_s: 60.0 * trial as f64, split, ..SessionTrial::new(trial_of) }
    };
    (0..3).map(one).collect()
}

fn diagnosed(late_s: [f64; 3], tau_s: f64) -> Diagnosis {
    let stage = |name: &&str| StageEntry {
        name: name.split('_').next().unwrap_or(name).into(),
        output: (*name).into(),
        inputs: vec!["motion_rad".into()],
        ..StageEntry::default()
    };
    let scale = |name: &str| Parameter {
        name: format!("scale_{name}"),
        unit: "1".into(),
        value: 1.0,
        tolerance: Tolerance::Absolute(0.1),
        stages: vec![name.into()],
        ..Parameter::default()
    };
    let problem = Checked::new(ProblemSpec {
        stages: SIGNALS.iter().map(stage).collect(),
        parameters: ["grip", "bend", "turn"].map(scale).into(),
        wrap: ["skew", "clock_drift", "lag", "backlash", "offset"]
            .map(|k| format!("output.{k}"))
            .into(),
        trials: recorded(late_s, tau_s),
        ..ProblemSpec::default()
    })
    .expect("a problem");
    let motion = problem.session().column("motion_rad").expect("a column").to_vec();
    let plant = closure(move |ask: &Ask<'_>| {
        let x = &motion[..ask.trials * SAMPLES];
        Ok(x.iter().map(|x| ask.parameters[ask.stage] * signal(ask.stage, *x)).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(plant));
    diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0
}

#[test]
fn a_shift_that_all_signals_share_is_the_recorders() {
    let found = diagnosed([0.06; 3], 0.0);
    assert_eq!(found.named(), ["record.skew"], "{}", found.sentence);
    let late = &found.candidates[0].parameters[0];
    assert!((late.value - 0.06).abs() < 0.005, "{}", late.value);
}

#[test]
fn a_shift_that_one_signal_has_is_its_own() {
    let found = diagnosed([0.0, 0.06, 0.0], 0.0);
    assert_eq!(found.named(), ["bend.output.skew"], "{}", found.sentence);
}

#[test]
fn what_one_signal_remembers_is_no_shift() {
    let found = diagnosed([0.0; 3], 0.1);
    assert_eq!(found.named(), ["turn.output.lag"], "{}", found.sentence);
    let found = diagnosed([0.06; 3], 0.1);
    let mut named = found.named();
    named.sort();
    assert_eq!(named, ["record.skew", "turn.output.lag"], "{}", found.sentence);
}

//! Ten small simulators with known defects, each a closure that takes microseconds. The defects are
//! written here, not taken from the catalogue.

use std::{fmt::Write as _, sync::Arc};

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, Problem, ProblemSpec, StageEntry, Tolerance, closure,
};
use testkit::random::Random;

use super::summary::{assert_golden, summarize};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 1000;
const NOISE_MM: f64 = 0.02;

/// Force of a trial, N: three sines without a common period.
fn force_n(trial: usize) -> Vec<f64> {
    let at = |t: f64| {
        20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t + trial as f64).sin() + 4.0 * (7.7 * t).cos()
    };
    (0..SAMPLES).map(|i| at(DT_S * i as f64)).collect()
}

/// A spring that follows with a lag: y' = (compliance u - y)/lag_s, from rest.
fn spring([compliance, lag_s]: [f64; 2], u: &[f64]) -> Vec<f64> {
    let mut y = compliance * u[0];
    let step = |u: &f64| {
        y += DT_S / (lag_s + DT_S) * (compliance * u - y);
        y
    };
    u.iter().map(step).collect()
}

/// Defect that the machine has and the simulator lacks.
#[derive(Debug, Clone, Copy)]
enum Defect {
    Nothing,
    Softer,
    Late,
    Play,
    Saturation,
    SlowSensor,
    DeadZone,
    Reversed,
    RandomZero,
    Brake,
}

const DEFECTS: [Defect; 10] = [
    Defect::Nothing,
    Defect::Softer,
    Defect::Late,
    Defect::Play,
    Defect::Saturation,
    Defect::SlowSensor,
    Defect::DeadZone,
    Defect::Reversed,
    Defect::RandomZero,
    Defect::Brake,
];

/// The machine's output, mm, without noise.
fn machine(defect: Defect, u: &[f64], random: &mut Random) -> Vec<f64> {
    let nominal = [2.0, 0.05];
    let (mut held, mut zero) = (0.0, 0.0);
    let after: Box<dyn FnMut(f64) -> f64> = match defect {
        Defect::Play => Box::new(move |y: f64| {
            held = f64::clamp(held, y - 1.5, y + 1.5);
            held
        }),
        Defect::Saturation => Box::new(|y: f64| y.min(45.0)),
        Defect::SlowSensor => Box::new(move |y: f64| {
            held += DT_S / 0.12 * (y - held);
            held
        }),
        Defect::Reversed => Box::new(|y: f64| -y),
        Defect::RandomZero => Box::new(|y: f64| {
            zero += 0.15 * random.noise();
            y + zero
        }),
        _ => Box::new(|y| y),
    };
    let driven = match defect {
        Defect::Softer => spring([2.3, 0.05], u),
        Defect::Late => {
            let late: Vec<f64> = (0..u.len()).map(|i| u[i.saturating_sub(6)]).collect();
            spring(nominal, &late)
        }
        Defect::DeadZone => {
            let past = |u: &f64| u - f64::clamp(*u, -2.0, 2.0);
            spring(nominal, &u.iter().map(past).collect::<Vec<_>>())
        }
        Defect::Brake => braked(nominal, u),
        _ => spring(nominal, u),
    };
    driven.into_iter().map(after).collect()
}

/// The spring with a brake: a distance of up to 3 mm to the target moves nothing.
fn braked([compliance, lag_s]: [f64; 2], u: &[f64]) -> Vec<f64> {
    let mut y = compliance * u[0];
    let step = |u: &f64| {
        let push = compliance * u - y;
        y += DT_S / (lag_s + DT_S) * (push - push.clamp(-3.0, 3.0));
        y
    };
    u.iter().map(step).collect()
}

fn problem(defect: Defect) -> Problem {
    let mut random = Random::new(41);
    let trial = |trial: usize| {
        let u = force_n(trial);
        let y = machine(defect, &u, &mut random);
        let y = y.iter().map(|y| y + NOISE_MM * random.noise()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let recorded = SessionTrial::new(Trial {
            name: format!("{trial}.csv"),
            time_s: (0..SAMPLES).map(|i| DT_S * i as f64).collect(),
            channels: vec![channel("force_N", u), channel("length_mm", y)],
        });
        SessionTrial { split: if trial == 2 { Split::Test } else { Split::Fit }, ..recorded }
    };
    let trials = (0..3).map(trial).collect();
    let parameter = |name: &str, value| Parameter {
        name: name.into(),
        value,
        tolerance: Tolerance::Relative(0.1),
        least: Some(1e-3),
        ..Parameter::default()
    };
    let checked = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "spring".into(),
            output: "length_mm".into(),
            inputs: vec!["force_N".into()],
            ..StageEntry::default()
        }],
        parameters: vec![parameter("compliance", 2.0), parameter("lag_s", 0.05)],
        wrap: vec!["all".into()],
        trials,
        ..ProblemSpec::default()
    });
    let checked = checked.expect("a problem");
    let forces = checked.session().column("force_N").expect("it is used").to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let u = ask.inputs.map_or(&forces[..ask.trials * SAMPLES], |inputs| &inputs[0]);
        let parameters = [ask.parameters[0], ask.parameters[1]];
        Ok(u.chunks(SAMPLES).flat_map(|u| spring(parameters, u)).collect())
    });
    Problem::from(BlackBox::new(checked, Arc::new(source)))
}

#[test]
fn ten_small_simulators_answer_as_before() {
    let mut text = String::new();
    for defect in DEFECTS {
        let _ = write!(text, "{}", summarize(&format!("{defect:?}"), &problem(defect)));
    }
    assert_golden("small.txt", &text);
}

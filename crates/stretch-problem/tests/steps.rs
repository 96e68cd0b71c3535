//! Step tests that begin with their step give the same answer as those that begin at rest.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator, VerdictKind, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.02;
const NOISE: f64 = 0.002;
const TARGETS: [f64; 9] = [0.9, -0.7, 0.5, -0.4, 0.2, -0.9, 0.7, -0.5, 0.6];

/// A servo of first order, x' = (u - x)/lag_s, from rest at `x`.
fn servo(lag_s: f64, mut x: f64, command: &[f64]) -> Vec<f64> {
    let step = |u: &f64| {
        let shown = x;
        x += DT_S / lag_s * (u - x);
        shown
    };
    command.iter().map(step).collect()
}

/// Operator of the machine's firmware in front of the servo.
#[derive(Debug, Clone, Copy)]
enum Front {
    /// Rate of 2 units/s.
    Limit,
    /// Delay of 0.1 s.
    Delay,
}

fn fronted(front: Front, before: f64, command: &[f64]) -> Vec<f64> {
    let mut held = before;
    let after = |(i, u): (usize, &f64)| {
        held = match front {
            Front::Limit => held + (u - held).clamp(-2.0 * DT_S, 2.0 * DT_S),
            Front::Delay => {
                if i < 5 {
                    before
                } else {
                    command[i - 5]
                }
            }
        };
        held
    };
    command.iter().enumerate().map(after).collect()
}

/// Diagnoses step tests from a level, each with `rest` samples of rest before the step.
fn told(front: Front, level: f64, rest: usize) -> (Diagnosis, Vec<String>) {
    let samples = rest + 90;
    let mut random = RandomGenerator::new(5, 0);
    let mut trial = |(i, target): (usize, &f64)| {
        let at = |k| if k < rest { level } else { level + target };
        let command: Vec<f64> = (0..samples).map(at).collect();
        let angle = servo(0.08, level, &fronted(front, level, &command));
        let angle = angle.iter().map(|x| x + NOISE * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("command_rad", command), channel("angle_rad", angle)];
        let time_s = (0..samples).map(|k| DT_S * k as f64).collect();
        let split = if i > 5 { Split::Test } else { Split::Fit };
        SessionTrial {
            split,
            start_s: 10.0 * i as f64,
            ..SessionTrial::new(Trial { name: format!("{i}.csv"), time_s, channels })
        }
    };
    let trials = TARGETS.iter().enumerate().map(&mut trial).collect();
    let wrap = ["input.slew_limit", "input.delay", "output.slew_limit", "output.lag"];
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "servo".into(),
            output: "angle_rad".into(),
            inputs: vec!["command_rad".into()],
            noise: Some(NOISE),
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "lag_s".into(),
            value: 0.08,
            tolerance: Tolerance::Relative(0.1),
            ..Parameter::default()
        }],
        wrap: wrap.map(str::to_owned).to_vec(),
        trials,
        ..ProblemSpec::default()
    });
    let problem = problem.expect("a problem");
    let notes = problem.notes().to_vec();
    let recorded = problem.session().column("command_rad").expect("it is used").to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let u = ask.inputs.map_or(&recorded[..ask.trials * samples], |inputs| &inputs[0]);
        Ok(u.chunks(samples).flat_map(|u| servo(ask.parameters[0], level, u)).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    (diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0, notes)
}

#[test]
fn step_tests_answer_alike_with_rest_before_and_without() {
    for (front, name, truth) in
        [(Front::Limit, "input.slew_limit", 2.0), (Front::Delay, "input.delay", 0.1)]
    {
        for (level, rest) in [(0.0, 25), (0.0, 0), (0.4, 0)] {
            let (told, notes) = told(front, level, rest);
            let case = format!("{name} {level} {rest}: {} {notes:?}", told.sentence);
            assert_eq!(told.named(), [name], "{case}");
            assert_eq!(told.verdict(), VerdictKind::Effect, "{case}");
            let value = told.candidates[0].parameters[0].value;
            assert!((value / truth - 1.0).abs() < 0.03, "{value} {case}");
            assert!((told.parameters[0].sigmas).abs() < 0.5, "{case}");
            // At least 270 samples are tested: 3 sqrt(2/270) of the noise's variance.
            assert!(told.gap.left < 0.26, "{} {case}", told.gap.left);
            assert!(notes.iter().all(|note| !note.contains("steps at the first")), "{case}");
        }
    }
}

//! A toy plant, a servo of first order, beside recordings in which each wrapper was hidden in turn.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Dice, Options, diagnose};
use stretch_problem::{
    Argument, Ask, BlackBox, OwnEffect, Parameter, Problem, ProblemSpec, Stage, Tolerance, closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 3000;

/// Command of a trial: steps, ramps and waves.
fn command(trial: usize) -> Vec<f64> {
    let mut dice = Dice::new(40 + trial as u64, 0);
    let (mut held, mut out) = (0.0, Vec::with_capacity(SAMPLES));
    for i in 0..SAMPLES {
        let t = i as f64 * DT_S;
        if i % 130 == 0 {
            held = (4.0 * dice.gauss()).clamp(-6.0, 6.0);
        }
        let wave = 3.0 * (1.1 * t).sin() + 2.0 * (2.9 * t + trial as f64).sin();
        out.push(if (i / 600) % 2 == 0 { held } else { wave });
    }
    out
}

/// Angle of the servo: angle' = (gain u - angle)/tau, exact for a held command; brake takes from the command against its change.
fn servo(gain: f64, tau: f64, brake: f64, u: &[f64]) -> Vec<f64> {
    let decay = (-DT_S / tau).exp();
    let mut angle = 0.0;
    u.iter()
        .map(|u| {
            let before = angle;
            let push = gain * u - angle;
            let held = push - push.clamp(-brake, brake);
            angle += (1.0 - decay) * held;
            before
        })
        .collect()
}

fn servo_of(ask: &Ask<'_>, measured: &[f64]) -> Vec<f64> {
    let u = ask.inputs.map_or(&measured[..ask.trials * SAMPLES], |inputs| &inputs[0]);
    let [gain, tau, offset] = [ask.parameters[0], ask.parameters[1], ask.parameters[2]];
    let trials = u.chunks(SAMPLES);
    trials.flat_map(|u| servo(gain, tau, ask.effects[0], u)).map(|y| offset + y).collect()
}

/// Trials recorded of a plant that makes an angle of a command.
fn recorded(plant: impl Fn(&[f64], f64) -> Vec<f64>) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let (u, start_s) = (command(trial), 60.0 * trial as f64);
        let mut dice = Dice::new(7, trial as u64);
        let angle = plant(&u, start_s).iter().map(|y| y + 0.02 * dice.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("command_V", u), channel("angle_deg", angle)];
        let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let trial = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if start_s > 100.0 { Split::Test } else { Split::Fit };
        SessionTrial { start_s, split, ..SessionTrial::new(trial) }
    };
    (0..3).map(one).collect()
}

fn parameter(name: &str, unit: &str, value: f64, tolerance: Tolerance) -> Parameter {
    Parameter { name: name.into(), unit: unit.into(), value, tolerance, ..Parameter::default() }
}

fn problem(trials: Vec<SessionTrial>, wrap: &[&str]) -> ProblemSpec {
    ProblemSpec {
        stages: vec![Stage {
            name: "servo".into(),
            output: "angle_deg".into(),
            inputs: vec!["command_V".into()],
            ..Stage::default()
        }],
        parameters: vec![
            parameter("gain", "deg/V", 10.0, Tolerance::Relative(0.1)),
            parameter("tau", "s", 0.1, Tolerance::Relative(0.1)),
            parameter("zero", "deg", 0.0, Tolerance::Absolute(1.0)),
        ],
        effects: vec![OwnEffect {
            name: "brake".into(),
            arguments: vec![Argument {
                unit: "deg".into(),
                min: 0.0,
                max: 20.0,
                off: Some(0.0),
                ..Argument::default()
            }],
            ..OwnEffect::default()
        }],
        wrap: wrap.iter().map(|w| (*w).to_owned()).collect(),
        trials,
        ..ProblemSpec::default()
    }
}

/// Diagnoses; hands back how often the servo was run, too.
fn diagnosed(spec: ProblemSpec, budget: Option<usize>) -> (Diagnosis, usize) {
    let problem = Problem::new(spec).unwrap();
    let measured = problem.session().column("command_V").unwrap().to_vec();
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&calls);
    let source = closure(move |ask: &Ask<'_>| {
        counted.fetch_add(1, Ordering::Relaxed);
        Ok(servo_of(ask, &measured))
    });
    let bench = BlackBox::within(problem, Arc::new(source), budget);
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let calls = calls.load(Ordering::Relaxed);
    assert_eq!(bench.model_runs(), calls, "every run is counted, and counted once");
    (diagnosis, calls)
}

/// The true servo with something that the simulator leaves out.
fn plain(u: &[f64], brake: f64) -> Vec<f64> {
    servo(10.4, 0.095, brake, u).into_iter().map(|y| 0.2 + y).collect()
}

const MANY: [&str; 9] = [
    "input.delay",
    "input.dead_zone",
    "input.saturation",
    "output.lag",
    "output.backlash",
    "output.hysteresis",
    "output.curve",
    "output.saturation",
    "output.drift",
];

/// Something hidden behind or in front of the servo: its name, and the plant.
type Hidden = (&'static str, Box<dyn Fn(&[f64], f64) -> Vec<f64>>);

fn hidden() -> Vec<Hidden> {
    vec![
        (
            "input.delay",
            Box::new(|u, _| {
                let late: Vec<f64> = (0..u.len()).map(|i| u[i.saturating_sub(7)]).collect();
                plain(&late, 0.0)
            }),
        ),
        (
            "input.dead_zone",
            Box::new(|u, _| {
                let dead: Vec<f64> = u.iter().map(|u| u - u.clamp(-0.4, 0.4)).collect();
                plain(&dead, 0.0)
            }),
        ),
        (
            "input.saturation",
            Box::new(|u, _| {
                let held: Vec<f64> = u.iter().map(|u| u.clamp(-3.5, 3.5)).collect();
                plain(&held, 0.0)
            }),
        ),
        (
            "output.lag",
            Box::new(|u, _| {
                let mut z = None;
                let slow = |y: f64| {
                    let z = z.get_or_insert(y);
                    *z += (y - *z) * (1.0 - (-DT_S / 0.04_f64).exp());
                    *z
                };
                plain(u, 0.0).into_iter().map(slow).collect()
            }),
        ),
        (
            "output.backlash",
            Box::new(|u, _| {
                let mut z = 0.0_f64;
                plain(u, 0.0)
                    .into_iter()
                    .map(|y| {
                        z = z.clamp(y - 1.0, y + 1.0);
                        z
                    })
                    .collect()
            }),
        ),
        (
            "output.curve",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| y + 0.0006 * y * y).collect()),
        ),
        (
            "output.saturation",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| y.min(35.0)).collect()),
        ),
        (
            "output.drift",
            Box::new(|u, start_s| {
                let y = plain(u, 0.0).into_iter().enumerate();
                y.map(|(i, y)| y + 0.01 * (start_s + i as f64 * DT_S)).collect()
            }),
        ),
        ("brake", Box::new(|u, _| plain(u, 3.0))),
    ]
}

#[test]
fn each_hidden_effect_is_named_within_four_hundred_runs() {
    let mut wrong = Vec::new();
    for (name, plant) in hidden() {
        let (diagnosis, runs) = diagnosed(problem(recorded(plant), &MANY), None);
        println!(
            "{name}: {:?} {runs} runs of {} simulations, {}",
            diagnosis.named, diagnosis.simulations, diagnosis.sentence
        );
        let is_family = diagnosis.named.iter().any(|n| n == name)
            || diagnosis.ambiguous.iter().any(|n| n == name);
        if !is_family || runs > 400 {
            wrong.push(format!("{name}: {:?} in {runs} runs", diagnosis.named));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

//! Angles that wrap in the recording, in the command or in the simulator's answer are compared as
//! if they did not.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator, VerdictKind, diagnose};
use stretch_problem::{Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, closure};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 1500;
const DEG: f64 = 180.0 / std::f64::consts::PI;

/// A turntable behind a servo, in degrees.
fn turntable([kp, kd]: [f64; 2], command: &[f64]) -> Vec<f64> {
    let (mut x, mut v) = (0.0, 0.0);
    let step = |u: &f64| {
        let shown = x;
        for _ in 0..5 {
            v += DT_S / 5.0 * (kp * (u - x) - kd * v);
            x += DT_S / 5.0 * v;
        }
        shown
    };
    command.iter().map(step).collect()
}

/// A command that turns in both directions.
fn command(trial: u64) -> Vec<f64> {
    let mut random = RandomGenerator::new(7 + trial, 0);
    let (mut u, mut rate) = (0.0, 0.0);
    let step = |i| {
        if i % 150 == 0 {
            rate = 500.0 * random.unit() - 250.0;
        }
        u += rate * DT_S;
        u
    };
    (0..SAMPLES).map(step).collect()
}

fn wrapped(x: f64, low: f64) -> f64 {
    (x - low).rem_euclid(360.0) + low
}

/// Diagnoses a turntable whose angle wraps to the range from `low` to `low` + 360 degrees. The
/// column `output` holds `scale` times the angle in degrees.
fn told(output: &str, scale: f64, low: f64, wraps: [bool; 2]) -> (Diagnosis, Vec<String>) {
    let mut random = RandomGenerator::new(11, 0);
    let [command_wraps, simulator_wraps] = wraps;
    let input = output.replace("angle", "command").replace('q', "goal");
    let mut trial = |trial: u64| {
        let truth = command(trial);
        let angle = turntable([400.0, 32.0], &truth);
        let angle = angle.iter().map(|x| scale * wrapped(x + 0.05 * random.gauss(), low));
        let shown = |u: &f64| scale * if command_wraps { wrapped(*u, low) } else { *u };
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![
            channel(&input, truth.iter().map(shown).collect()),
            channel(output, angle.collect()),
        ];
        let time_s = (0..SAMPLES).map(|i| DT_S * i as f64).collect();
        let split = if trial == 1 { Split::Test } else { Split::Fit };
        let name = format!("{trial}.csv");
        SessionTrial { split, ..SessionTrial::new(Trial { name, time_s, channels }) }
    };
    let parameter =
        |name: &str, value| Parameter { name: name.into(), value, ..Parameter::default() };
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "table".into(),
            output: output.into(),
            inputs: vec![input.clone()],
            ..StageEntry::default()
        }],
        parameters: vec![parameter("kp", 400.0), parameter("kd", 32.0)],
        wrap: ["input.delay", "output.backlash", "output.saturation"].map(str::to_owned).to_vec(),
        trials: vec![trial(0), trial(1)],
        ..ProblemSpec::default()
    });
    let problem = problem.expect("a problem");
    let notes = problem.notes().to_vec();
    let recorded = problem.session().column(&input).expect("it is used").to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let u = ask.inputs.map_or(&recorded[..ask.trials * SAMPLES], |inputs| &inputs[0]);
        let own = [ask.parameters[0], ask.parameters[1]];
        let angles = u.chunks(SAMPLES).flat_map(|u| {
            let u: Vec<f64> = u.iter().map(|u| u / scale).collect();
            turntable(own, &u)
        });
        let shown = |x| scale * if simulator_wraps { wrapped(x, low) } else { x };
        Ok(angles.map(shown).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    (diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0, notes)
}

#[test]
fn a_simulator_agrees_with_a_record_that_wraps() {
    for (output, scale, low, wraps) in [
        ("angle_deg", 1.0, -180.0, [false, false]),
        ("angle_deg", 1.0, -180.0, [true, false]),
        ("angle_deg", 1.0, 0.0, [true, true]),
        ("q", 1.0 / DEG, -180.0, [false, true]),
        ("angle_rad", 1.0 / DEG, 0.0, [true, false]),
    ] {
        let (told, notes) = told(output, scale, low, wraps);
        let case = format!("{output}, {low}, {wraps:?}: {} {notes:?}", told.sentence);
        assert!(matches!(told.verdict(), VerdictKind::NoGap | VerdictKind::Parameters), "{case}");
        assert!(told.gap.raw < 0.1, "{case}");
        let says =
            format!("{output} jumps by {}", if scale == 1.0 { "360 deg" } else { "2 pi rad" });
        let noted = notes.iter().filter(|note| note.contains(&says)).count();
        assert_eq!(noted, 2, "{case}");
        let unwrapped = notes.iter().filter(|note| note.ends_with("and is unwrapped")).count();
        assert_eq!(unwrapped, if wraps[0] { 4 } else { 2 }, "{case}");
    }
}

//! Six joints in one problem: sixty parameters, some of them shared, ten effects a joint, a simulator of the whole arm.

use std::{sync::Arc, time::Instant};

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Diagnosable, Parameter, ProblemSpec, Source, SourceError, StageEntry,
    Tolerance,
};

const JOINTS: usize = 6;
const DT_S: f64 = 0.02;
const SAMPLES: usize = 1500;
/// Parameters of each joint (`OWN`) and of all joints together (`SHARED`), with their shipped
/// values.
const OWN: [(&str, f64); 9] = [
    ("gain", 8.0),
    ("tau", 0.12),
    ("offset", 0.0),
    ("bias", 0.0),
    ("sides", 0.0),
    ("weight", 0.4),
    ("bend", 0.0),
    ("spring", 0.1),
    ("carry", 0.05),
];
const SHARED: [(&str, f64); 6] = [
    ("supply", 1.0),
    ("gravity", 1.0),
    ("warmth", 1.0),
    ("base", 0.0),
    ("table", 0.0),
    ("mains", 0.0),
];

fn command(trial: usize, joint: usize) -> Vec<f64> {
    let mut random = RandomGenerator::new(40 + trial as u64, joint as u64);
    let mut held = 0.0;
    let one = |i: usize| {
        let t = i as f64 * DT_S;
        if i.is_multiple_of(50 + 7 * joint) {
            held = (2.0 * random.gauss()).clamp(-3.0, 3.0);
        }
        held + 1.5 * ((0.9 + 0.2 * joint as f64) * t + trial as f64).sin()
    };
    (0..SAMPLES).map(one).collect()
}

/// Angles of all joints over one trial, joint by joint; an angle contains a share of the angle of
/// the joint before.
fn arm(p: &[f64], commands: &[&[f64]]) -> Vec<Vec<f64>> {
    let shared = &p[JOINTS * OWN.len()..];
    let mut out = vec![Vec::new(); JOINTS];
    let mut angle = [0.0_f64; JOINTS];
    for i in 0..commands[0].len() {
        let mut before = shared[3];
        for joint in 0..JOINTS {
            let own = &p[joint * OWN.len()..];
            let u = commands[joint][i] + own[3] + 0.01 * shared[5];
            let u = shared[0] * u * (1.0 + own[4] * u.signum());
            let y = angle[joint];
            let shown = y + own[2] + own[6] * 0.01 * y * y + own[8] * before + 0.1 * shared[4];
            out[joint].push(shown);
            let pull = own[5] * shared[1] * (0.1 * y).sin() + own[7] * 0.1 * y;
            angle[joint] += DT_S / (own[1] * shared[2]) * (own[0] * u - y - pull);
            before = y;
        }
    }
    out
}

/// The arm as a simulator that runs as a whole.
struct Arm {
    commands: Vec<Vec<f64>>,
}

impl Source for Arm {
    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>> {
        let one = |ask: &Ask<'_>| {
            let mut all = vec![Vec::new(); JOINTS];
            for trial in 0..ask.trials {
                let range = trial * SAMPLES..(trial + 1) * SAMPLES;
                let other = |joint| ask.others.iter().find(|o| o.stage == joint);
                let of = |joint: usize| match (ask.inputs, other(joint)) {
                    (Some(inputs), _) if joint == ask.stage => &inputs[0][range.clone()],
                    (_, Some(other)) => &other.values[range.clone()],
                    _ => &self.commands[joint][range.clone()],
                };
                let commands: Vec<&[f64]> = (0..JOINTS).map(of).collect();
                let angles = arm(ask.parameters, &commands);
                all.iter_mut().zip(angles).for_each(|(all, own)| all.extend(own));
            }
            Ok(all.concat())
        };
        asks.iter().map(one).collect()
    }

    fn answers_all(&self) -> bool {
        true
    }

    fn takes_inputs_of_several(&self) -> bool {
        true
    }
}

/// Recordings of an arm whose second joint has play at its output, and whose fifth joint ignores
/// small commands.
fn recorded(truth: &[f64]) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(3, trial as u64);
        let commands: Vec<Vec<f64>> = (0..JOINTS).map(|joint| command(trial, joint)).collect();
        let mut passed = commands.clone();
        passed[4].iter_mut().for_each(|u| *u -= u.clamp(-0.4, 0.4));
        let passed: Vec<&[f64]> = passed.iter().map(Vec::as_slice).collect();
        let mut angles = arm(truth, &passed);
        let mut held = angles[1][0];
        for y in &mut angles[1] {
            held = held.clamp(*y - 0.8, *y + 0.8);
            *y = held;
        }
        let mut channels = Vec::new();
        for (joint, (u, mut y)) in commands.into_iter().zip(angles).enumerate() {
            y.iter_mut().for_each(|y| *y += 0.02 * random.gauss());
            channels.push(Channel { name: format!("u{joint}_V"), values: u });
            channels.push(Channel { name: format!("y{joint}_deg"), values: y });
        }
        let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let trial_of = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 60.0 * trial as f64, split, ..SessionTrial::new(trial_of) }
    };
    (0..3).map(one).collect()
}

#[test]
#[ignore = "a figure of seconds and runs; ./ci.sh runs it"]
fn six_joints_with_sixty_parameters_are_diagnosed() {
    let mut random = RandomGenerator::new(11, 0);
    let (mut parameters, mut truth) = (Vec::new(), Vec::new());
    let mut add = |name: String, value: f64, stages: Vec<String>| {
        let sd = if value == 0.0 { 0.05 } else { 0.08 * value };
        truth.push(value + sd * random.gauss().clamp(-2.0, 2.0));
        let tolerance = Tolerance::Absolute(sd);
        parameters.push(Parameter { name, value, tolerance, stages, ..Parameter::default() });
    };
    for joint in 0..JOINTS {
        for (name, value) in OWN {
            // A parameter that moves a joint also moves the next one, which contains a share of its
            // angle. A parameter that only changes the measured angle does not.
            let is_carried = !["offset", "bend", "carry"].contains(&name);
            let last = (joint + usize::from(is_carried)).min(JOINTS - 1);
            let stages = (joint..=last).map(|j| format!("joint{j}")).collect();
            add(format!("{name}{joint}"), value, stages);
        }
    }
    SHARED.iter().for_each(|(name, value)| add((*name).to_owned(), *value, Vec::new()));
    assert_eq!(truth.len(), 60);
    let stage = |joint: usize| StageEntry {
        name: format!("joint{joint}"),
        output: format!("y{joint}_deg"),
        inputs: vec![format!("u{joint}_V")],
        ..StageEntry::default()
    };
    let behind = ["backlash", "lag", "curve", "saturation", "hysteresis", "relaxation"];
    let before = ["delay", "dead_zone", "saturation", "backlash"];
    let wrap = behind.map(|k| format!("output.{k}")).into_iter();
    let problem = Checked::new(ProblemSpec {
        stages: (0..JOINTS).map(stage).collect(),
        parameters,
        wrap: wrap.chain(before.map(|k| format!("input.{k}"))).collect(),
        trials: recorded(&truth),
        ..ProblemSpec::default()
    })
    .expect("a problem");
    assert_eq!(problem.description().spec().effects.len(), 10 * JOINTS);
    let column =
        |joint: usize| problem.session().column(&format!("u{joint}_V")).expect("a column").to_vec();
    let arm = Arm { commands: (0..JOINTS).map(column).collect() };
    let asked =
        Ask { stage: 0, parameters: &truth, effects: &[], inputs: None, others: &[], trials: 3 };
    let begun = Instant::now();
    assert!(arm.simulate_many(&[asked])[0].is_ok());
    let each = begun.elapsed();
    let bench = BlackBox::new(problem, Arc::new(arm));
    let begun = Instant::now();
    let found = diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0;
    println!(
        "{:?} in {:.1} s, {} runs of {:.2} ms, {} simulations: {}",
        found.named(),
        begun.elapsed().as_secs_f64(),
        bench.model_runs(),
        1e3 * each.as_secs_f64(),
        found.simulations,
        found.sentence
    );
    let notes = bench.afterwards();
    assert!(notes.len() == 1 && notes[0].starts_with("altered inputs act"), "{notes:?}");
    let mut named = found.named();
    named.sort();
    assert_eq!(named, ["joint1.output.backlash", "joint4.input.dead_zone"], "{}", found.sentence);
}

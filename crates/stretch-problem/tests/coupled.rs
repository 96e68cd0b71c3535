//! Coupled stages: an effect in front of one stage acts on the outputs of others.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Laboratory, Model, Options, RandomGenerator, Simulator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Diagnosable, EffectEntry, Parameter, ProblemSpec, Source, SourceError,
    StageEntry, Tolerance,
};

const DT_S: f64 = 0.02;
const SAMPLES: usize = 1000;
const NAMES: [&str; 2] = ["hip", "knee"];
/// Gain and time constant of each joint.
const TRUE: [f64; 4] = [8.4, 0.11, 6.2, 0.16];
const SHIPPED: [f64; 4] = [8.0, 0.12, 6.5, 0.15];

fn command(trial: usize, joint: usize) -> Vec<f64> {
    let mut random = RandomGenerator::new(20 + trial as u64, joint as u64);
    let mut held = 0.0;
    let one = |i: usize| {
        if i.is_multiple_of(40 + 7 * joint) {
            held = (2.0 * random.gauss()).clamp(-3.0, 3.0);
        }
        held + ((0.9 + 0.3 * joint as f64) * i as f64 * DT_S + trial as f64).sin()
    };
    (0..SAMPLES).map(one).collect()
}

/// Angles of two lags, of which the second carries a share of the first.
fn leg(p: &[f64], carried: f64, commands: [&[f64]; 2]) -> [Vec<f64>; 2] {
    let mut angle = [0.0; 2];
    let mut out = [Vec::new(), Vec::new()];
    for i in 0..commands[0].len() {
        out[0].push(angle[0]);
        out[1].push(angle[1] + carried * angle[0]);
        for joint in 0..2 {
            let push = p[2 * joint] * commands[joint][i] - angle[joint];
            angle[joint] += DT_S / p[2 * joint + 1] * push;
        }
    }
    out
}

/// The leg as a simulator that runs as a whole.
struct Leg {
    carried: f64,
    takes_several: bool,
}

impl Source for Leg {
    fn simulate_many(&self, asks: &[Ask<'_>]) -> Vec<Result<Vec<f64>, SourceError>> {
        let one = |ask: &Ask<'_>| {
            assert!(self.takes_several || ask.others.is_empty());
            let mut all = [Vec::new(), Vec::new()];
            for trial in 0..ask.trials {
                let range = trial * SAMPLES..(trial + 1) * SAMPLES;
                let command = |joint: usize| {
                    let own = ask.inputs.filter(|_| joint == ask.stage).map(|own| &own[0][..]);
                    let other = ask.others.iter().find(|o| o.stage == joint).map(|o| o.values);
                    let altered = own.or(other).map(|column| column[range.clone()].to_vec());
                    altered.unwrap_or_else(|| self::command(trial, joint))
                };
                let commands = [command(0), command(1)];
                let angles = leg(ask.parameters, self.carried, [&commands[0], &commands[1]]);
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
        self.takes_several
    }
}

/// Widths of the dead zone and of the play between the commands and the joints.
#[derive(Clone, Copy)]
struct Lost {
    /// Half width of the hip's dead zone, V.
    hip: f64,
    /// Half width of the knee's play, V.
    knee: f64,
}

fn recorded(carried: f64, lost: Lost) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(3, trial as u64);
        let commands = [command(trial, 0), command(trial, 1)];
        let hip: Vec<f64> = commands[0].iter().map(|u| u - u.clamp(-lost.hip, lost.hip)).collect();
        let mut held = commands[1][0];
        let play = |u: &f64| {
            held = held.clamp(u - lost.knee, u + lost.knee);
            held
        };
        let knee: Vec<f64> = commands[1].iter().map(play).collect();
        let angles = leg(&TRUE, carried, [&hip, &knee]);
        let mut channels = Vec::new();
        for ((name, u), mut y) in NAMES.iter().zip(commands).zip(angles) {
            y.iter_mut().for_each(|y| *y += 0.05 * random.gauss());
            channels.push(Channel { name: format!("{name}_V"), values: u });
            channels.push(Channel { name: format!("{name}_deg"), values: y });
        }
        let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let trial_of = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 60.0 * trial as f64, split, ..SessionTrial::new(trial_of) }
    };
    (0..3).map(one).collect()
}

/// The problem; `of_hip` names the joints in which the hip's parameters are declared to act.
fn problem(carried: f64, lost: Lost, of_hip: &[&str]) -> ProblemSpec {
    let stage = |name: &&str| StageEntry {
        name: (*name).into(),
        output: format!("{name}_deg"),
        inputs: vec![format!("{name}_V")],
        ..StageEntry::default()
    };
    let parameter = |(at, value): (usize, &f64)| Parameter {
        name: format!("{}{}", ["gain", "tau"][at % 2], at / 2),
        value: *value,
        tolerance: Tolerance::Relative(0.1),
        stages: if at < 2 { of_hip } else { &NAMES[1..] }.iter().map(|s| (*s).into()).collect(),
        ..Parameter::default()
    };
    ProblemSpec {
        stages: NAMES.iter().map(stage).collect(),
        parameters: SHIPPED.iter().enumerate().map(parameter).collect(),
        wrap: ["input.dead_zone", "input.backlash", "output.backlash", "output.curve"]
            .map(str::to_owned)
            .into(),
        trials: recorded(carried, lost),
        ..ProblemSpec::default()
    }
}

fn diagnosed(problem: ProblemSpec, carried: f64, takes_several: bool) -> (Diagnosis, BlackBox) {
    let problem = Checked::new(problem).expect("a problem");
    let bench = BlackBox::new(problem, Arc::new(Leg { carried, takes_several }));
    let found = diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0;
    (found, bench)
}

/// A value of the most probable set.
fn value(found: &Diagnosis, effect: &str) -> f64 {
    let all = &found.candidates[0].parameters;
    all.iter().find(|p| p.effect == effect).map_or(f64::NAN, |p| p.value)
}

const CARRIED: f64 = 0.5;
const DEAD: Lost = Lost { hip: 0.4, knee: 0.0 };

#[test]
fn what_the_knee_carries_of_the_hips_dead_zone_is_no_effect_of_its_own() {
    let (found, bench) = diagnosed(problem(CARRIED, DEAD, &NAMES), CARRIED, true);
    assert_eq!(found.named(), ["hip.input.dead_zone"], "{}", found.sentence);
    assert!(found.candidates[0].closed > 0.99, "{}", found.sentence);
    assert!((value(&found, "hip.input.dead_zone") - DEAD.hip).abs() < 0.01, "{}", found.sentence);
    let touches = |bench: &BlackBox, name: &str| {
        let effects = &bench.description().spec().effects;
        effects.iter().find(|e| e.name == name).map(|e| e.touches.clone())
    };
    assert_eq!(touches(&bench, "hip.input.dead_zone"), Some(vec![0, 1]));
    assert_eq!(touches(&bench, "hip.output.backlash"), Some(vec![0]));
    assert_eq!(touches(&bench, "knee.input.dead_zone"), Some(vec![1]));
    let note = "altered inputs act on outputs of other stages: hip_V of hip moves knee; these outputs are compared as well";
    assert_eq!(bench.afterwards(), [note]);

    // A simulator that takes altered inputs of one stage at a time: the effect on the knee stays
    // without a cause.
    let (left_out, bench) = diagnosed(problem(CARRIED, DEAD, &NAMES), CARRIED, false);
    assert_ne!(left_out.named(), found.named(), "{}", left_out.sentence);
    assert!(bench.afterwards()[0].contains("this is left out"), "{:?}", bench.afterwards());
    assert_eq!(touches(&bench, "hip.input.dead_zone"), Some(vec![0]));
}

#[test]
fn altered_inputs_of_both_joints_are_run_at_once() {
    let lost = Lost { hip: 0.4, knee: 0.3 };
    let (found, _) = diagnosed(problem(CARRIED, lost, &NAMES), CARRIED, true);
    let mut named = found.named();
    named.sort();
    assert_eq!(named, ["hip.input.dead_zone", "knee.input.backlash"], "{}", found.sentence);
    assert!((value(&found, "knee.input.backlash") - lost.knee).abs() < 0.03, "{}", found.sentence);
}

#[test]
fn a_wrapper_that_acts_in_every_run_acts_on_both_joints() {
    let values = [("w".to_owned(), DEAD.hip)].into();
    let wrapped = vec![EffectEntry { name: "hip.input.dead_zone".into(), parameters: values }];
    let problem = ProblemSpec { wrapped, ..problem(CARRIED, DEAD, &NAMES) };
    let (found, _) = diagnosed(problem, CARRIED, true);
    assert!(found.named().is_empty(), "{}", found.sentence);
}

#[test]
fn an_experiment_drives_both_joints_at_once() {
    let problem = Checked::new(problem(CARRIED, DEAD, &NAMES)).expect("a problem");
    let bench = BlackBox::new(problem, Arc::new(Leg { carried: CARRIED, takes_several: true }));
    let effects = &bench.description().spec().effects;
    let dead_zone = effects.iter().position(|e| e.name == "hip.input.dead_zone").expect("a zone");
    let mut values = effects[dead_zone].starts[0].clone();
    values[0] = DEAD.hip;
    let model = Model { parameters: SHIPPED.into(), effects: vec![(dead_zone, values)] };
    let plan = bench.experiments().remove(0);
    let predicted = bench.predict(&model, &plan.trial).expect("a prediction");
    let command = |name: &str| plan.trial.channel(name).expect("a column").to_vec();
    let hip: Vec<f64> = command("hip_V").iter().map(|u| u - u.clamp(-DEAD.hip, DEAD.hip)).collect();
    let angles = leg(&SHIPPED, CARRIED, [&hip, &command("knee_V")]);
    for (angle, predicted) in angles.iter().zip(&predicted) {
        // Predictions are multiples of the noise.
        let noise = angle[500] / predicted[500];
        let differs = |(y, p): (&f64, &f64)| (y - noise * p).abs() > 1e-9;
        assert!(noise > 0.0 && !angle.iter().zip(predicted).any(differs));
    }
}

#[test]
fn joints_that_do_not_hang_together_are_diagnosed_as_ever() {
    let (several, bench) = diagnosed(problem(0.0, DEAD, &NAMES[..1]), 0.0, true);
    let (single, other) = diagnosed(problem(0.0, DEAD, &NAMES[..1]), 0.0, false);
    assert_eq!(several.named(), ["hip.input.dead_zone"], "{}", several.sentence);
    assert!(bench.description().spec().effects.iter().all(|e| e.touches.len() == 1));
    assert_eq!(bench.model_runs(), other.model_runs());
    let alike = |found| Diagnosis { runtime_s: 0.0, ..found };
    assert_eq!(alike(several), alike(single));
    assert!(bench.afterwards().is_empty() && other.afterwards().is_empty());
}

#[test]
fn a_parameter_that_moves_an_output_it_is_not_said_to_act_on_is_told() {
    let (_, bench) = diagnosed(problem(CARRIED, DEAD, &NAMES[..1]), CARRIED, true);
    let told = bench.afterwards();
    let begun = "gain0 and tau0 are declared to act on hip alone, but a change of each by one tolerance moves knee by up to ";
    assert!(told[1].starts_with(begun), "{told:?}");
    assert!(told[1].ends_with(" times its noise: add knee to the `stages`"), "{told:?}");
    assert_eq!(told.len(), 2, "{told:?}");
}

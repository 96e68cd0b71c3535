//! A state that spills is named with its level, because the simulator can limit its states.

use std::{path::Path, sync::Arc};

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, State, Tolerance, closure,
    worker::{Workers, WorkersSpec},
};

const DT_S: f64 = 0.5;
const SAMPLES: usize = 800;

/// Level of the lower of two tanks, which is measured; the upper tank spills.
fn tanks([inflow, drain, spill]: [f64; 3], pump: &[f64]) -> Vec<f64> {
    let (mut upper, mut lower) = (2.0_f64, 2.0_f64);
    let one = |u: &f64| {
        let before = lower;
        let through = upper.sqrt() - lower.sqrt();
        upper = (upper + DT_S * (inflow * u - drain * upper.sqrt())).max(0.0).min(spill);
        lower = (lower + DT_S * drain * through).max(0.0);
        before
    };
    pump.iter().map(one).collect()
}

fn recorded(spill: f64) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(12, trial as u64);
        let mut held = 0.0;
        let pump: Vec<f64> = (0..SAMPLES)
            .map(|i| {
                if i % 40 == 0 {
                    held = (0.45 + 0.35 * random.gauss()).clamp(0.1, 1.0);
                }
                held
            })
            .collect();
        let level = tanks([1.05, 0.29, spill], &pump);
        let level = level.iter().map(|y| y + 0.01 * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("pump_V", pump), channel("level_cm", level)];
        let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let trial_of = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 600.0 * trial as f64, split, ..SessionTrial::new(trial_of) }
    };
    (0..3).map(one).collect()
}

fn problem(spill: f64, wrap: &[&str]) -> ProblemSpec {
    let parameter = |name: &str, value| Parameter {
        name: name.into(),
        value,
        tolerance: Tolerance::Relative(0.1),
        ..Parameter::default()
    };
    ProblemSpec {
        stages: vec![StageEntry {
            name: "tanks".into(),
            output: "level_cm".into(),
            inputs: vec!["pump_V".into()],
            ..StageEntry::default()
        }],
        parameters: vec![parameter("inflow", 1.0), parameter("drain", 0.3)],
        wrap: wrap.iter().map(|name| (*name).to_owned()).collect(),
        trials: recorded(spill),
        ..ProblemSpec::default()
    }
}

const WRAP: [&str; 4] = ["state.all", "input.saturation", "output.curve", "output.lag"];

fn states(greatest: f64) -> Vec<State> {
    let state = |name: &str| State { name: name.into(), unit: "cm".into(), least: 0.0, greatest };
    vec![state("upper"), state("lower")]
}

/// Diagnoses with the tanks of this file as the simulator; `greatest` is the greatest level that it
/// declares.
fn diagnosed(spill: f64, greatest: f64) -> Diagnosis {
    let spec = problem(spill, &WRAP).with_states(&states(greatest)).expect("states");
    let problem = Checked::new(spec).expect("a problem");
    let pump = problem.session().column("pump_V").expect("a column").to_vec();
    let names = problem.session().effects.clone();
    let plant = closure(move |ask: &Ask<'_>| {
        let of = |name: &str, off: f64| {
            let at = names.iter().position(|n| n == name);
            at.map_or(off, |at| ask.effects[at])
        };
        let pump = ask.inputs.map_or(&pump[..ask.trials * SAMPLES], |inputs| &inputs[0]);
        let [inflow, drain] = [ask.parameters[0], ask.parameters[1]];
        let held = |level: f64, name: &str| {
            let level = level * (-of(&format!("state.{name}.leak"), 0.0) * DT_S).exp();
            let level = level.min(of(&format!("state.{name}.spill"), f64::INFINITY));
            level.max(of(&format!("state.{name}.floor"), 0.0))
        };
        let one = |pump: &[f64]| {
            let (mut upper, mut lower) = (2.0_f64, 2.0_f64);
            let step = |u: &f64| {
                let before = lower;
                let through = upper.sqrt() - lower.sqrt();
                let into = inflow * u - drain * upper.sqrt();
                upper = held((upper + DT_S * into).max(0.0), "upper");
                lower = held((lower + DT_S * drain * through).max(0.0), "lower");
                before
            };
            pump.iter().map(step).collect::<Vec<f64>>()
        };
        Ok(pump.chunks(SAMPLES).flat_map(one).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(plant));
    diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0
}

fn is_overflow(found: &Diagnosis, spill: f64) {
    assert_eq!(found.named(), ["state.upper.spill"], "{}", found.sentence);
    let level = &found.candidates[0].parameters[0];
    assert!((level.value - spill).abs() < 0.2, "{level:?}");
}

#[test]
fn an_overflow_is_named_with_its_level() {
    is_overflow(&diagnosed(5.0, 12.0), 5.0);
}

/// The declared range goes far beyond the levels that are reached. The search starts at 28.5, 24,
/// 12 and 3 cm. At the first three the effect changes nothing; at the last it changes far too much.
#[test]
fn an_overflow_is_named_where_most_of_its_range_does_nothing() {
    for spill in [5.0, 6.0, 7.0] {
        is_overflow(&diagnosed(spill, 30.0), spill);
    }
}

#[test]
fn tanks_that_spill_nothing_are_agreed_with() {
    let found = diagnosed(f64::INFINITY, 30.0);
    assert!(found.named().is_empty(), "{:?}: {}", found.named(), found.sentence);
}

#[test]
fn a_state_that_nobody_declares_is_refused_with_those_that_are() {
    let error = problem(5.0, &["state.midle.spill"]).with_states(&states(12.0)).unwrap_err();
    assert!(error.to_string().contains("no effect on a state state.midle.spill"), "{error}");
    let mut wrong = states(12.0);
    wrong[0].greatest = 0.0;
    let error = problem(5.0, &["state.all"]).with_states(&wrong).unwrap_err();
    assert!(error.to_string().starts_with("state upper: its range, 0 to 0, is empty"), "{error}");
}

#[test]
#[ignore = "needs python3; ./ci.sh runs it"]
fn with_python_a_worker_that_declares_its_states_has_its_overflow_named() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/workers");
    let workers = WorkersSpec { jobs: 2, ..WorkersSpec::new(&["python3", "tanks.py"], folder) };
    let (problem, source) = Workers::bound(problem(5.0, &WRAP), workers).expect("workers");
    assert_eq!(problem.session().effects.len(), 6);
    let bench = BlackBox::new(problem, Arc::new(source));
    let found = diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0;
    is_overflow(&found, 5.0);
}

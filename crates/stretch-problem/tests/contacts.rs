//! Friction of contacts by position, by load or behind a play, and a motor that gets weaker with
//! speed. The forces are computed from recorded motions by their equations, without any operator of
//! the project.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 3000;
const NOISE: f64 = 0.3;

/// Recorded quantities at one time.
#[derive(Clone, Copy)]
struct Motion {
    position: f64,
    velocity: f64,
    acceleration: f64,
    load: f64,
}

fn motion(trial: usize, t: f64) -> Motion {
    let waves = [(1.7, 0.10), (4.3, 0.05), (0.6, 0.06)];
    let phase = |w: f64| w * t + w * trial as f64;
    let sum = |f: fn(f64, f64, f64) -> f64| waves.iter().map(|(w, a)| f(*w, *a, phase(*w))).sum();
    Motion {
        position: sum(|_, a, p| a * p.sin()),
        velocity: sum(|w, a, p| a * w * p.cos()),
        acceleration: sum(|w, a, p| -a * w * w * p.sin()),
        load: 40.0 + 30.0 * (0.9 * t + trial as f64).sin() + 8.0 * (2.9 * t).cos(),
    }
}

/// What a contact adds to the force, sample by sample.
type Contact = fn() -> Box<dyn FnMut(Motion) -> f64>;

/// Trials of a mass. The force is computed from the motion, with the friction of `contact` and
/// limited by `limit`.
fn recorded(contact: Contact, limit: Option<(f64, f64)>) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(90, trial as u64);
        let mut rub = contact();
        let time_s: Vec<f64> = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let all: Vec<Motion> = time_s.iter().map(|t| motion(trial, *t)).collect();
        let force = all.iter().map(|m| {
            let force = 95.0 * m.acceleration + rub(*m);
            let force = match limit {
                Some((stall, slope)) => {
                    let ahead = (stall - slope * m.velocity.max(0.0)).max(0.0);
                    let back = (stall - slope * (-m.velocity).max(0.0)).max(0.0);
                    force.min(ahead).max(-back)
                }
                None => force,
            };
            force + NOISE * random.gauss()
        });
        let channel = |name: &str, values: Vec<f64>| Channel { name: name.into(), values };
        let of = |f: fn(&Motion) -> f64| all.iter().map(f).collect::<Vec<f64>>();
        let channels = vec![
            channel("force_N", force.collect()),
            channel("position_m", of(|m| m.position)),
            channel("acceleration", of(|m| m.acceleration)),
            channel("load_N", of(|m| m.load)),
        ];
        let trial_of = Trial { name: format!("c{trial}.csv"), time_s, channels };
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 60.0 * trial as f64, split, ..SessionTrial::new(trial_of) }
    };
    (0..3).map(one).collect()
}

fn diagnosed(trials: Vec<SessionTrial>) -> Diagnosis {
    let wrap = ["friction", "torque_speed_limit", "lag", "curve", "saturation"];
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "drive".into(),
            output: "force_N".into(),
            inputs: vec!["acceleration".into()],
            position: Some("position_m".into()),
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "mass".into(),
            unit: "kg".into(),
            value: 92.0,
            tolerance: Tolerance::Relative(0.1),
            ..Parameter::default()
        }],
        beside: vec!["load_N".into()],
        wrap: wrap.map(|kind| format!("output.{kind}")).into(),
        trials,
        ..ProblemSpec::default()
    })
    .expect("a problem");
    let a = problem.session().column("acceleration").expect("a column").to_vec();
    let plant = closure(move |ask: &Ask<'_>| {
        Ok(a[..ask.trials * SAMPLES].iter().map(|a| ask.parameters[0] * a).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(plant));
    diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0
}

/// Whether the effect is named, or reported as an alternative to the named effects.
fn is_told(found: &Diagnosis, name: &str) -> bool {
    let name = name.to_owned();
    println!("{name}: {:?}, tied {:?}, {}", found.named(), found.answer.tied(), found.sentence);
    let is_tied = found.answer.tied().contains(&name) || found.ambiguous.contains(&name);
    found.named().contains(&name) || (!found.named().is_empty() && is_tied)
}

fn value(found: &Diagnosis, effect: &str, name: &str) -> f64 {
    let all = &found.candidates[0].parameters;
    all.iter().find(|p| p.effect == effect && p.name == name).map(|p| p.value).expect("a value")
}

/// Dahl's equation in steps of a hundredth of each move.
fn dahl(force: f64, length: f64) -> impl FnMut(f64) -> f64 {
    let (mut u, mut last) = (0.0_f64, None);
    move |position: f64| {
        let step = (position - last.unwrap_or(position)) / 100.0;
        last = Some(position);
        for _ in 0..100 {
            u += step / length * (1.0 - u * step.signum());
        }
        force * u
    }
}

#[test]
fn friction_that_builds_up_over_a_way_is_named_with_its_length() {
    let contact: Contact = || {
        let mut rub = dahl(12.0, 0.02);
        Box::new(move |m| rub(m.position))
    };
    let found = diagnosed(recorded(contact, None));
    assert!(is_told(&found, "output.dahl_friction"), "{}", found.sentence);
    if found.named() == ["output.dahl_friction"] {
        let (f, s) = (
            value(&found, "output.dahl_friction", "f"),
            value(&found, "output.dahl_friction", "s"),
        );
        assert!((f - 12.0).abs() < 0.5 && (s - 0.02).abs() < 0.003, "{f} {s}");
    }
}

#[test]
fn friction_over_a_way_that_a_load_scales_is_told() {
    let contact: Contact = || {
        let mut rub = dahl(1.0, 0.02);
        Box::new(move |m| 0.25 * m.load.abs() * rub(m.position))
    };
    let found = diagnosed(recorded(contact, None));
    assert!(is_told(&found, "output.load_dahl_friction(load_N)"), "{}", found.sentence);
}

#[test]
fn friction_that_grows_with_the_load_is_told() {
    let contact: Contact = || Box::new(|m| 0.2 * m.load.abs() * (m.velocity / 2e-3).tanh());
    let found = diagnosed(recorded(contact, None));
    assert!(is_told(&found, "output.load_friction(load_N)"), "{}", found.sentence);
}

#[test]
fn friction_behind_a_play_is_told() {
    let contact: Contact = || {
        let (mut rub, mut z) = (dahl(12.0, 0.01), 0.0_f64);
        Box::new(move |m| {
            z = z.clamp(m.position - 0.03, m.position + 0.03);
            rub(z)
        })
    };
    let found = diagnosed(recorded(contact, None));
    assert!(is_told(&found, "output.play_friction"), "{}", found.sentence);
}

#[test]
fn a_motor_that_gets_weaker_with_speed_is_told() {
    let found = diagnosed(recorded(|| Box::new(|_| 0.0), Some((115.0, 250.0))));
    assert!(is_told(&found, "output.torque_speed_limit"), "{}", found.sentence);
}

#[test]
fn a_mass_alone_rubs_nowhere() {
    let found = diagnosed(recorded(|| Box::new(|_| 0.0), None));
    assert!(found.named().is_empty(), "{:?}: {}", found.named(), found.sentence);
}

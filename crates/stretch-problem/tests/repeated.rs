//! A simulator whose answers are not repeatable or ignore its parameters is detected.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::{GapError, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Diagnosable, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

/// Rows of a trial.
const ROWS: usize = 3000;

/// A spring in a number of trials. Its simulator receives the compliance, the forces of the run,
/// and the number of the run.
fn springs(
    trials: usize,
    simulator: impl Fn(f64, &[f64], u64) -> Vec<f64> + Send + Sync + 'static,
) -> BlackBox {
    let mut random = RandomGenerator::new(3, 0);
    let time_s: Vec<f64> = (0..ROWS).map(|i| 0.01 * i as f64).collect();
    let force: Vec<f64> = time_s.iter().map(|t| 20.0 * (1.3 * t).sin() + 5.0 * t.cos()).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let mut trial = |at: usize| {
        let length = force.iter().map(|f| 2.1 * f + 0.05 * random.gauss()).collect();
        let channels = vec![channel("force_N", force.clone()), channel("length_mm", length)];
        let name = if at == 0 { "spring.csv".to_owned() } else { format!("spring_{at}.csv") };
        let trial = Trial { name, time_s: time_s.clone(), channels };
        SessionTrial { start_s: 60.0 * at as f64, ..SessionTrial::new(trial) }
    };
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "spring".into(),
            output: "length_mm".into(),
            inputs: vec!["force_N".into()],
            noise: Some(0.05),
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "compliance".into(),
            value: 2.0,
            tolerance: Tolerance::Relative(0.1),
            ..Parameter::default()
        }],
        wrap: vec!["output.backlash".into()],
        trials: (0..trials).map(&mut trial).collect(),
        ..ProblemSpec::default()
    });
    let runs = AtomicU64::new(0);
    let forces = force.repeat(trials);
    let source = closure(move |ask: &Ask<'_>| {
        let run = runs.fetch_add(1, Ordering::Relaxed);
        Ok(simulator(ask.parameters[0], &forces[..ask.trials * ROWS], run))
    });
    BlackBox::new(problem.expect("a problem"), Arc::new(source))
}

/// The correct spring.
fn sound(compliance: f64, force: &[f64]) -> Vec<f64> {
    force.iter().map(|f| compliance * f).collect()
}

/// The spring with noise that differs from run to run, from row 1234 on.
fn noisy(compliance: f64, force: &[f64], run: u64) -> Vec<f64> {
    let mut random = RandomGenerator::new(run, 1);
    let mut out = sound(compliance, force);
    out[1234..].iter_mut().for_each(|y| *y += 1e-3 * random.gauss());
    out
}

/// A doubtful simulator: the number of trials, the simulator, whether it is refused, and parts of
/// the message.
type Doubtful = (usize, fn(f64, &[f64], u64) -> Vec<f64>, bool, &'static [&'static str]);

const REFUSED: [&str; 2] = [
    "stage spring: the simulator answers the same question differently, ",
    " in row 1234 of spring.csv; seed its random numbers, and begin every run from the same state",
];

const DOUBTFUL: [Doubtful; 7] = [
    (1, noisy, true, &REFUSED),
    (2, noisy, true, &REFUSED),
    // a state that is carried from one run to the next
    (
        1,
        |compliance, force, run| {
            sound(compliance, force).iter().map(|y| y + 1e-6 * run as f64).collect()
        },
        true,
        &["in row 0 of spring.csv"],
    ),
    // an offset that depends on how long the run is
    (
        2,
        |compliance, force, _| {
            let offset = 1e-4 * force.len() as f64 / ROWS as f64;
            sound(compliance, force).iter().map(|y| y + offset).collect()
        },
        false,
        &["the same rows differently in runs over", "row 0 of spring.csv; compute each sample"],
    ),
    (
        1,
        |_, force, _| sound(2.0, force),
        false,
        &[
            "ignores the parameters of spring: its output is bit for bit the same for all values of compliance",
        ],
    ),
    // a difference by rounding, as from a sum in another order, is accepted
    (1, |compliance, force, run| sound(compliance * (1.0 + 1e-15 * run as f64), force), false, &[]),
    (2, |compliance, force, _| sound(compliance, force), false, &[]),
];

#[test]
fn a_simulator_that_does_not_answer_what_it_is_asked_is_told() {
    for (i, (trials, simulator, is_refused, says)) in DOUBTFUL.into_iter().enumerate() {
        let bench = springs(trials, simulator);
        let told = match diagnose(&bench, &Options::default(), &|_| (), &|| false) {
            Err(error @ GapError::Broken(_)) if is_refused => error.to_string(),
            Ok((found, _)) if !is_refused && found.named().is_empty() => {
                bench.afterwards().join("\n")
            }
            other => panic!("{i}: {other:?}"),
        };
        assert_eq!(told.is_empty(), says.is_empty(), "{i}: {told}");
        assert!(says.iter().all(|part| told.contains(part)), "{i}: {told}");
    }
}

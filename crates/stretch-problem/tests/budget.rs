//! With any budget of runs, the result is a diagnosis or an error that states the smallest
//! sufficient budget.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, GapError, Note, NoteCode, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Input, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

const SAMPLES: usize = 200;

/// Three trials of a spring that is a little softer than its simulator, and lags.
fn trials(lag: usize) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(3, trial as u64);
        let force: Vec<f64> = (0..SAMPLES)
            .map(|i| {
                let t = 0.01 * i as f64;
                5.0 * (2.1 * t + trial as f64).sin() + 3.0 * (5.3 * t).sin()
            })
            .collect();
        let length =
            (0..SAMPLES).map(|i| 2.1 * force[i.saturating_sub(lag)] + 0.02 * random.gauss());
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("length_mm", length.collect()), channel("force_N", force)];
        let time_s = (0..SAMPLES).map(|i| 0.01 * i as f64).collect();
        let trial = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial.name == "t2.csv" { Split::Test } else { Split::Fit };
        SessionTrial {
            start_s: 60.0 * f64::from(u8::from(split == Split::Test)) + 20.0,
            split,
            ..SessionTrial::new(trial)
        }
    };
    (0..3).map(one).collect()
}

fn spec(input_noise: f64, lag: usize) -> ProblemSpec {
    ProblemSpec {
        stages: vec![StageEntry {
            name: "spring".into(),
            output: "length_mm".into(),
            inputs: vec!["force_N".into()],
            ..StageEntry::default()
        }],
        inputs: vec![Input { column: "force_N".into(), noise: input_noise, ..Input::default() }],
        parameters: vec![
            Parameter {
                name: "compliance".into(),
                unit: "mm/N".into(),
                value: 2.0,
                tolerance: Tolerance::Relative(0.1),
                ..Parameter::default()
            },
            Parameter {
                name: "zero".into(),
                unit: "mm".into(),
                value: 0.0,
                tolerance: Tolerance::Absolute(1.0),
                ..Parameter::default()
            },
        ],
        wrap: ["input.delay", "output.skew", "output.backlash", "input.dead_zone"]
            .map(Into::into)
            .into(),
        trials: trials(lag),
        ..ProblemSpec::default()
    }
}

/// Diagnoses within a budget; also returns how often the simulator was run.
fn within(spec: ProblemSpec, budget: Option<usize>) -> (Result<Diagnosis, GapError>, usize) {
    let problem = Checked::new(spec).unwrap();
    let measured = problem.session().column("force_N").unwrap().to_vec();
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&calls);
    let source = closure(move |ask: &Ask<'_>| {
        counted.fetch_add(1, Ordering::Relaxed);
        let force = ask.inputs.map_or(&measured[..ask.trials * SAMPLES], |inputs| &inputs[0]);
        Ok(force.iter().map(|f| ask.parameters[0] * f + ask.parameters[1]).collect())
    });
    let bench = BlackBox::within(problem, Arc::new(source), budget);
    let found = diagnose(&bench, &Options::default(), &|_| (), &|| false).map(|(found, _)| found);
    (found, calls.load(Ordering::Relaxed))
}

/// Input noise raises the least number of runs, because it is drawn in further runs. An effect
/// makes a search spend more runs.
#[test]
fn every_budget_ends_in_a_diagnosis_or_says_which_is_the_least() {
    for (noise, lag, least, all) in [(0.0, 4, 4, 40), (0.05, 4, 20, 60)] {
        for budget in 1..=all {
            let (found, calls) = within(spec(noise, lag), Some(budget));
            assert!(calls <= budget, "{calls} runs of {budget}");
            match found {
                Ok(found) => {
                    let runs = found.model_runs.unwrap();
                    assert!(runs.is_spent && calls == runs.count, "{budget}: {runs:?}");
                    let is_told = |note: &Note| note.code == NoteCode::BudgetSpent;
                    assert!(found.notes.iter().any(is_told), "{budget}");
                    assert!(found.sentence.starts_with("The budget of runs was spent"));
                    let all =
                        found.cut_short.as_ref().unwrap().len() == spec(noise, lag).wrap.len();
                    let sentence = &found.sentence;
                    assert_eq!(sentence.contains("before any effect could be examined"), all);
                    assert!(!all || !sentence.contains("none of the examined"), "{sentence}");
                }
                Err(GapError::Spent { budget: told, least: needed }) => {
                    assert!(told == budget && needed == least && budget < least, "{budget}");
                }
                Err(other) => panic!("{budget}: {other}"),
            }
        }
    }
}

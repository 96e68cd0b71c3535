//! A simulator that diverges: a run that fails discards the candidate that needed it, and nothing
//! else.

use std::sync::{Arc, Mutex};

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Diagnosis, GapError, NoteCode, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.05;
const SAMPLES: usize = 1500;

/// First order by explicit Euler, which diverges with a time constant below half a sample.
fn first_order(tau_s: f64, u: &[f64]) -> Vec<f64> {
    let mut y = 0.0;
    let step = |u: &f64| {
        let before = y;
        y += DT_S / tau_s * (2.0 * u - y);
        before
    };
    u.iter().map(step).collect()
}

/// Trials of step commands and a response within about a sample, which is recorded 0.15 s early.
fn recorded() -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(5, trial as u64);
        let mut held = 0.0;
        let mut command = |i: usize| {
            if i.is_multiple_of(23) {
                held = random.unit();
            }
            held
        };
        let u: Vec<f64> = (0..SAMPLES + 3).map(&mut command).collect();
        let y =
            first_order(1.2 * DT_S, &u)[3..].iter().map(|y| y + 0.01 * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("command_bar", u[..SAMPLES].to_vec()), channel("angle_deg", y)];
        let time_s = (0..SAMPLES).map(|i| DT_S * i as f64).collect();
        let own = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial == 1 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 200.0 * trial as f64, split, ..SessionTrial::new(own) }
    };
    (0..2).map(one).collect()
}

/// Diagnoses with a nominal time constant; also returns the least time constant of any run.
fn diagnosed(tau: Parameter) -> (Result<Diagnosis, GapError>, f64) {
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "plant".into(),
            output: "angle_deg".into(),
            inputs: vec!["command_bar".into()],
            noise: Some(0.01),
            ..StageEntry::default()
        }],
        parameters: vec![Parameter { name: "tau".into(), unit: "s".into(), ..tau }],
        wrap: ["output.skew", "output.lag", "output.curve", "output.backlash"]
            .map(String::from)
            .into(),
        trials: recorded(),
        ..ProblemSpec::default()
    });
    let problem = problem.expect("a problem");
    let session = problem.session().clone();
    let u = session.column("command_bar").expect("the input").to_vec();
    let least = Arc::new(Mutex::new(f64::INFINITY));
    let asked = Arc::clone(&least);
    let source = closure(move |ask: &Ask<'_>| {
        let mut least = asked.lock().expect("not poisoned");
        *least = least.min(ask.parameters[0]);
        let parts = session.trials[..ask.trials].iter();
        Ok(parts.flat_map(|t| first_order(ask.parameters[0], &u[t.samples.clone()])).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    let told = diagnose(&bench, &Options::default(), &|_| (), &|| false);
    let least = *least.lock().expect("not poisoned");
    (told.map(|(told, _)| told), least)
}

/// The text of the note with a code.
fn noted(told: &Diagnosis, code: NoteCode) -> String {
    let note = told.notes.iter().find(|note| note.code == code);
    note.unwrap_or_else(|| panic!("no {code:?} among {:?}", told.notes)).to_string()
}

#[test]
fn what_diverges_ends_nothing_and_a_share_of_a_value_keeps_its_sign() {
    let tau = |tolerance| Parameter { value: 0.5, tolerance, ..Parameter::default() };
    let share = tau(Tolerance::Relative(0.5));
    let allowed = Parameter { least: Some(-1.0), ..share.clone() };
    let cases = [
        (share, 0.01),
        (tau(Tolerance::Absolute(0.3)), 0.01),
        (allowed, -1.0),
        (tau(Tolerance::Absolute(0.6)), -2.0),
    ];
    for (tau, bound) in cases {
        let (told, least) = diagnosed(tau);
        let told = told.expect("an answer");
        assert_eq!(told.named(), ["output.skew"], "{}", told.sentence);
        let note = noted(&told, NoteCode::FailedRuns);
        assert!(note.contains("(asked for tau = "), "{note}");
        assert!(least >= bound && (bound > 0.0 || least < 0.0), "{least} {bound}");
    }
}

#[test]
fn a_simulator_that_diverges_as_shipped_is_refused_with_its_values() {
    // One diverges to infinity, the other to numbers whose squares are infinite.
    for tau in [0.01, 0.02] {
        let (told, _) = diagnosed(Parameter { value: tau, ..Parameter::default() });
        let said = told.expect_err("it diverges").to_string();
        assert!(said.contains("plant: the simulat"), "{said}");
        assert!(said.ends_with(&format!("(asked for tau = {tau} s)")), "{said}");
    }
}

/// Diagnoses a spring with play whose length follows its load. `simulate` returns the simulator's
/// output from the compliance, the trial and the load.
fn spring_told(
    compliance: f64,
    wrap: &[&str],
    simulate: impl Fn(f64, usize, f64) -> f64 + Send + Sync + 'static,
) -> Result<Diagnosis, GapError> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(9, trial as u64);
        let at = |i: usize, rate: f64| (rate * DT_S * i as f64 + trial as f64).sin();
        let u: Vec<f64> = (0..SAMPLES).map(|i| 10.0 * at(i, 1.3) + 4.0 * at(i, 3.1)).collect();
        let mut held = 0.0_f64;
        let play = |x: f64| {
            held = held.clamp(x - 0.5, x + 0.5);
            held
        };
        let y = u.iter().map(|u| compliance * u).map(play);
        let y = y.map(|y| y + 0.02 * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("force_N", u), channel("length_mm", y)];
        let time_s = (0..SAMPLES).map(|i| DT_S * i as f64).collect();
        let own = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial == 1 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 200.0 * trial as f64, split, ..SessionTrial::new(own) }
    };
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "spring".into(),
            output: "length_mm".into(),
            inputs: vec!["force_N".into()],
            noise: Some(0.02),
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "compliance".into(),
            unit: "mm/N".into(),
            value: 2.0,
            tolerance: Tolerance::Relative(0.05),
            ..Parameter::default()
        }],
        wrap: wrap.iter().map(|name| (*name).to_owned()).collect(),
        trials: (0..2).map(one).collect(),
        ..ProblemSpec::default()
    });
    let problem = problem.expect("a problem");
    let session = problem.session().clone();
    let u = session.column("force_N").expect("the input").to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let parts = session.trials[..ask.trials].iter().enumerate();
        let own = parts.flat_map(|(trial, part)| part.samples.clone().map(move |i| (trial, i)));
        Ok(own.map(|(trial, i)| simulate(ask.parameters[0], trial, u[i])).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    Ok(diagnose(&bench, &Options::default(), &|_| (), &|| false)?.0)
}

/// Fits run only the fitted trials, so the failure appears only in the final evaluation.
#[test]
fn re_tuned_parameters_that_diverge_on_test_trials_end_nothing() {
    for beyond in [f64::INFINITY, f64::NAN, 1e160, -1e160] {
        let softer = move |compliance: f64, trial: usize, u: f64| match trial {
            1 if compliance > 2.02 => beyond,
            _ => compliance * u,
        };
        let told = spring_told(2.1, &["output.backlash", "output.lag"], softer);
        let told = told.expect("an answer");
        assert!(told.gap.raw.is_finite() && told.gap.retuned.is_finite(), "{:?}", told.gap);
        assert!(told.gap.retuned > 1.0, "{:?}", told.gap);
        assert_eq!(told.parameters[0].bent, 2.0);
        noted(&told, NoteCode::KeptParameters);
        let lost = noted(&told, NoteCode::FailedRuns);
        assert!(lost.contains(" s of t1.csv"), "{lost}");
        assert!(!told.not_examined.is_empty(), "{:?}", told.notes);
    }
}

#[test]
fn answers_beyond_all_squares_are_refused_with_trial_time_and_value() {
    for (trial, from_s) in [(0, "0 s of t0.csv"), (1, "0 s of t1.csv")] {
        for (beyond, shown) in [(1e160, "1e160"), (-1e200, "-1e200"), (f64::INFINITY, "inf")] {
            let told = spring_told(2.0, &["output.backlash"], move |compliance, own, u| {
                if own == trial { beyond } else { compliance * u }
            });
            let said = told.expect_err("it is no output").to_string();
            assert!(said.contains(&format!("gave {shown} at {from_s}")), "{said}");
            assert!(said.ends_with("(asked for compliance = 2 mm/N)"), "{said}");
        }
    }
}

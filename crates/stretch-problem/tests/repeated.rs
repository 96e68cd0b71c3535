//! A simulator that answers the same question differently is found out before it is believed.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::{GapError, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

/// A spring whose answers are altered by the number of the run.
fn spring(altered: impl Fn(u64, &mut [f64]) + Send + Sync + 'static) -> BlackBox {
    let mut random = RandomGenerator::new(3, 0);
    let time_s: Vec<f64> = (0..3000).map(|i| 0.01 * f64::from(i)).collect();
    let force: Vec<f64> = time_s.iter().map(|t| 20.0 * (1.3 * t).sin() + 5.0 * t.cos()).collect();
    let length = force.iter().map(|f| 2.1 * f + 0.05 * random.gauss()).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("force_N", force.clone()), channel("length_mm", length)];
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
        trials: vec![SessionTrial::new(Trial { name: "spring.csv".into(), time_s, channels })],
        ..ProblemSpec::default()
    });
    let runs = AtomicU64::new(0);
    let source = closure(move |ask: &Ask<'_>| {
        let mut out: Vec<f64> = force.iter().map(|f| ask.parameters[0] * f).collect();
        altered(runs.fetch_add(1, Ordering::Relaxed), &mut out);
        Ok(out)
    });
    BlackBox::new(problem.expect("a problem"), Arc::new(source))
}

fn refused(bench: &BlackBox) -> String {
    match diagnose(bench, &Options::default(), &|_| (), &|| false) {
        Err(error @ GapError::Broken(_)) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn noise_without_a_seed_is_told_with_both_values() {
    let bench = spring(|run, out| {
        let mut random = RandomGenerator::new(run, 1);
        out[1234..].iter_mut().for_each(|y| *y += 1e-3 * random.gauss());
    });
    let said = refused(&bench);
    let begins = "stage spring: the simulator answers the same question differently, ";
    let ends = " in row 1234 of trial spring.csv; seed its random numbers, and begin every run from the same state";
    assert!(said.starts_with(begins) && said.ends_with(ends), "{said}");
    assert_eq!(bench.model_runs(), 2);
}

/// A state that is carried from one run to the next.
#[test]
fn a_state_that_is_not_reset_is_told() {
    let bench = spring(|run, out| out[0] += 1e-6 * run as f64);
    assert!(refused(&bench).contains("in row 0 of trial"));
}

/// A sum in another order is no other answer.
#[test]
fn rounding_is_no_difference() {
    let bench = spring(|run, out| out.iter_mut().for_each(|y| *y *= 1.0 + 1e-15 * run as f64));
    let (told, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis");
    assert!(told.named.is_empty());
}

//! Tests of plans and rehearsals, on a small simulator that is a function.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, ends};
use stretch_problem::{
    Ask, Parameter, PlanEntry, PlanInput, Planned, PlannedRun, ProblemError, ProblemSpec,
    RecordedSession, Source, StageEntry, Tolerance, closure, plan_with, rehearse_with,
};

const DT_S: f64 = 0.02;
/// Greatest rate of the input, N/s.
const FASTEST: f64 = 40.0;

/// Starts a lag with a gain, driven by a force.
fn start(session: &RecordedSession) -> Result<Arc<dyn Source>, ProblemError> {
    let session = session.clone();
    Ok(Arc::new(closure(move |ask: &Ask<'_>| {
        let [gain, tau_s] = [ask.parameters[0], ask.parameters[1]];
        let recorded = session.column("force_N").unwrap();
        let force = ask.inputs.map_or(recorded, |inputs| &inputs[0]);
        let mut out = Vec::new();
        for trial in &session.trials[..ask.trials] {
            let mut x = force[trial.samples.start];
            for u in &force[trial.samples.clone()] {
                x += (u - x) * DT_S / tau_s;
                out.push(gain * x);
            }
        }
        Ok(out)
    })))
}

fn spec(wrap: &[&str]) -> ProblemSpec {
    let parameter = |name: &str, value: f64| Parameter {
        name: name.into(),
        value,
        tolerance: Tolerance::Relative(0.2),
        ..Parameter::default()
    };
    let column = "force_N".to_owned();
    let input = PlanInput { column, low: 0.0, high: 10.0, fastest: FASTEST, rest: None };
    ProblemSpec {
        wrap: wrap.iter().map(|name| (*name).to_owned()).collect(),
        stages: vec![StageEntry {
            name: "spring".into(),
            output: "length_mm".into(),
            inputs: vec!["force_N".into()],
            noise: Some(0.02),
            ..StageEntry::default()
        }],
        parameters: vec![parameter("gain", 2.0), parameter("tau_s", 0.1)],
        plan: Some(PlanEntry {
            seconds: 20.0,
            sample_rate_hz: 1.0 / DT_S,
            runs: None,
            inputs: vec![input],
        }),
        ..ProblemSpec::default()
    }
}

fn planned(wrap: &[&str]) -> Planned {
    plan_with(spec(wrap), &start, &|_| ()).unwrap()
}

fn run<'a>(planned: &'a Planned, name: &str) -> &'a PlannedRun {
    planned.runs.iter().find(|run| run.name == name).unwrap()
}

/// Slow motion shifts the output by the sum of delay and lag, whichever of the two it is.
#[test]
fn slow_loops_confuse_a_delay_with_a_lag_and_fast_loops_do_not() {
    let planned = planned(&["input.delay", "input.lag"]);
    let slow = run(&planned, "slow_loops");
    assert_eq!(slow.shown.confused(), [("input.delay", "input.lag")]);
    let fast = run(&planned, "fast_loops");
    assert_eq!(fast.shown.named(), ["input.lag", "input.delay"]);
    assert!(planned.chosen().all(|run| run.name != "slow_loops"), "{}", planned.sentence());
    assert_eq!(planned.together.determined(), ["gain", "tau_s"]);
    assert_eq!(planned.together.named().len(), 2);
    assert_eq!(planned, plan_with(spec(&["input.delay", "input.lag"]), &start, &|_| ()).unwrap());
}

/// The output of a play reverses later than its input. A motion in one direction shows only its
/// beginning.
#[test]
fn a_staircase_in_one_direction_shows_backlash_worse_than_loops_do() {
    let planned = planned(&["output.backlash"]);
    let limit = |name: &str| run(&planned, name).shown.limits[0].strength.unwrap();
    let [one_way, loops] = ["staircase", "slow_fast_loops"].map(limit);
    assert!(one_way > 1.5 * loops, "{one_way} {loops}");
    assert!(planned.chosen().all(|run| run.name != "staircase"), "{}", planned.sentence());
}

#[test]
fn every_run_of_the_menu_stays_within_the_limits() {
    for run in planned(&["output.delay"]).runs {
        let [force] = &run.trial.channels[..] else { panic!("{}", run.name) };
        assert_eq!((force.name.as_str(), force.values.len()), ("force_N", 1000));
        let (low, high) = ends(&force.values);
        assert!(low >= 0.0 && high <= 10.0, "{}: {low} to {high}", run.name);
        let rates = force.values.windows(2).map(|pair| (pair[1] - pair[0]).abs() / DT_S);
        let fastest = rates.fold(0.0, f64::max);
        assert!(fastest > 0.1 && fastest <= FASTEST, "{}: {fastest}", run.name);
    }
}

/// An input that rests would be a dead channel, so every input moves in every run.
#[test]
fn all_inputs_move_within_their_own_limits() {
    let mut spec = spec(&["output.delay"]);
    spec.stages[0].inputs.push("load_N".to_owned());
    let column = "load_N".to_owned();
    let load = PlanInput { column, low: 1.0, high: 2.0, fastest: 1.0, rest: None };
    spec.plan.as_mut().unwrap().inputs.push(load);
    let planned = plan_with(spec, &start, &|_| ()).unwrap();
    assert_eq!(planned.runs.len(), 16);
    for run in &planned.runs {
        let [_, load] = &run.trial.channels[..] else { panic!("{}", run.name) };
        let rates = load.values.windows(2).map(|pair| (pair[1] - pair[0]).abs() / DT_S);
        let fastest = rates.fold(0.0, f64::max);
        assert!(fastest > 0.1 && fastest <= 1.0, "{}: {fastest}", run.name);
        let (low, high) = ends(&load.values);
        assert!(low >= 1.0 && high <= 2.0, "{}: {low} to {high}", run.name);
    }
}

#[test]
fn a_plan_without_what_it_needs_says_what_to_write() {
    let changed = |change: &dyn Fn(&mut ProblemSpec)| {
        let mut spec = spec(&["output.delay"]);
        change(&mut spec);
        let planned = plan_with(spec, &start, &|_| ());
        planned.map(|planned| planned.sentence()).unwrap_err().to_string()
    };
    let limits = |change: &dyn Fn(&mut PlanInput)| {
        changed(&|spec| change(&mut spec.plan.as_mut().unwrap().inputs[0]))
    };
    for (error, expected) in [
        (limits(&|i| i.high = i.low), "plan.input force_N: low = 0, high = "),
        (limits(&|i| i.fastest = 0.0), "plan.input force_N: low = 0, high = "),
        (
            limits(&|i| i.high = -1.0),
            "plan.input force_N: low = 0, high = -1 and fastest = 40 allow no motion",
        ),
        (
            limits(&|i| i.rest = Some(11.0)),
            "plan.input force_N: low = 0, high = 10 and fastest = 40 allow no motion, or rest",
        ),
        (
            limits(&|i| i.column = "u".into()),
            "plan.input: there is none for the column force_N; write one with column",
        ),
        (
            limits(&|i| i.fastest = 1e-9),
            "plan: no run within the limits determines a parameter or names an effect; give",
        ),
        (
            changed(&|spec| {
                spec.parameters.iter_mut().for_each(|p| p.tolerance = Tolerance::Exact)
            }),
            "parameter: no parameter has a tolerance",
        ),
        (changed(&|spec| spec.stages[0].noise = None), "stage spring: there is no recording"),
        (changed(&|spec| spec.plan = None), "plan: the problem states no limits; write the table"),
        (
            changed(&|spec| spec.plan.as_mut().unwrap().seconds = 5.0),
            "plan: no effect can be named from 5 s; give seconds = 20",
        ),
    ] {
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn a_rehearsal_names_a_delay_and_a_backlash_at_three_times_their_limits() {
    let wrap = ["input.delay", "output.backlash"];
    let planned = planned(&wrap);
    let recorded = |(at, run): (usize, &PlannedRun)| {
        let mut trial = run.trial.clone();
        let ripple = |i: usize| 0.02 * ((i * i * 7919) % 1000) as f64 / 300.0;
        let values = (0..trial.len()).map(ripple).collect();
        trial.channels.push(Channel { name: "length_mm".into(), values });
        SessionTrial { start_s: 40.0 * at as f64, ..SessionTrial::new(trial) }
    };
    let trials = planned.chosen().enumerate().map(recorded).collect();
    let spec = ProblemSpec { trials, ..spec(&wrap) };
    let rehearsal = rehearse_with(spec.clone(), &start, &[], &|_| ()).unwrap();
    assert_eq!(rehearsal.effects.len(), 4);
    for one in rehearsal.effects.iter().filter(|one| one.times == 3.0) {
        assert_eq!(one.outcome, "named", "{one:?}");
        assert!(one.probability > 0.9 && one.named == [one.effect.clone()], "{one:?}");
    }
    let only = rehearse_with(spec.clone(), &start, &["input.delay".into()], &|_| ()).unwrap();
    assert_eq!(only.effects[..], rehearsal.effects[..2]);
    let error = rehearse_with(spec, &start, &["input.dely".into()], &|_| ()).unwrap_err();
    assert!(error.to_string().contains("did you mean input.delay?"), "{error}");
}

//! Tests of linked stages, of the count of runs, and of altered tolerances, on toy simulators.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::{
    problem::{
        altered::Altered,
        error::GapError,
        linked_stages::{groups, linked},
        runs::Runs,
        simulator::{Model, Run, Simulator},
        spec::ParameterSpec,
    },
    toys::{Law, Toy},
};

static GO_ON: fn() -> bool = || false;

#[test]
fn stages_that_share_a_fitted_parameter_are_one_group() {
    let mut toy = Toy::of(&[Law::Line, Law::Lag, Law::Line]);
    assert_eq!(groups(&toy.measured(1)), [vec![0], vec![1], vec![2]]);
    // The third stage has the same gain parameter as the first.
    toy.shared = vec![(2, 0)];
    assert_eq!(groups(&toy.measured(1)), [vec![0, 2], vec![1]]);
    assert_eq!(linked(&toy.measured(1), &[2]), [0, 2]);
    // An exact parameter is not fitted, so it links no stages.
    toy.parameters[0].sd = 0.0;
    assert_eq!(groups(&toy.measured(1)), [vec![0], vec![1], vec![2]]);
    // The first parameter acts in all three stages.
    toy.parameters[0].sd = 0.05;
    toy.shared = vec![(1, 0), (2, 0)];
    assert_eq!(groups(&toy.measured(1)), [vec![0, 1, 2]]);
}

#[test]
fn runs_are_counted_and_none_is_made_once_stopped() {
    static IS_OVER: AtomicBool = AtomicBool::new(false);
    static STOP: fn() -> bool = || IS_OVER.load(Ordering::Relaxed);
    let record = Toy::of(&[Law::Lag]).measured(1);
    let (runs, model) = (Runs::new(&record, &STOP).expect("measured"), Model::nominal(&record));
    let beside = runs.beside(&record);
    for _ in 0..3 {
        runs.output(0, &model, 4).expect("simulated");
    }
    let run = Run::exact(0, &model, 4);
    assert_eq!(beside.run_many(&[run, run]).len(), 2);
    assert_eq!((runs.count(), record.runs()), (5, 5));
    IS_OVER.store(true, Ordering::Relaxed);
    assert!(matches!(runs.run(run), Err(GapError::Stopped)));
    assert!(runs.run_many(&[run, run]).iter().all(|r| matches!(r, Err(GapError::Stopped))));
    assert_eq!(record.runs(), 5);
}

/// A run over the first trials equals the beginning of a run over all.
#[test]
fn a_run_over_fewer_trials_is_the_same_up_to_there() {
    for law in [Law::Line, Law::Lag, Law::Oscillator, Law::Delay] {
        let record = Toy::of(&[law]).measured(2);
        let (runs, model) =
            (Runs::new(&record, &GO_ON).expect("measured"), Model::nominal(&record));
        let whole = runs.output(0, &model, 4).expect("simulated");
        let part = runs.output(0, &model, 2).expect("simulated");
        assert_eq!(part[..], whole[..2000]);
    }
}

#[test]
fn tolerances_told_another_way_leave_the_simulator_as_it_is() {
    let record = Toy::of(&[Law::Lag, Law::Line]).measured(3);
    let held = Altered::of(&record, |i, p| match i {
        0 => ParameterSpec { sd: 0.0, ..p.clone() },
        _ => p.clone(),
    });
    let (own, other) = (record.description(), held.description());
    assert_eq!(other.spec().parameters[0].sd, 0.0);
    assert_eq!(other.spec().parameters[1..], own.spec().parameters[1..]);
    assert_eq!((&other.spec().trials, held.measured(1)), (&own.spec().trials, record.measured(1)));
    let model = Model::nominal(&record);
    let [own, other] = [&record as &dyn Simulator, &held].map(|simulator| {
        let runs = Runs::new(simulator, &GO_ON).expect("measured");
        runs.output(1, &model, 4).expect("simulated")
    });
    assert_eq!(own, other);
}

//! Invalid data that no file could hold, built in memory, are refused with a reason and without a
//! panic.

use std::panic::{AssertUnwindSafe, catch_unwind};

use stretch_calibrate::{Options, apply, calibrate, evaluate, without_gross_errors};
use stretch_data::{Channel, EvenSession, SessionTrial, Split, Trial};
use stretch_gap::{Description, DescriptionSpec, Simulator};
use stretch_problem::{
    Checked, Diagnosable, GaugeSetup, GaugeSimulator, ProblemError, ProblemSpec, RigSession,
    RigSetup, RigSimulator, StageEntry,
};
use stretch_sim::{Catalogue, Rig, RigParams, RunSettings, TrialPlan};

const COLUMNS: [&str; 5] = ["inlet", "outlet", "length_mm", "bridge_v", "pressure_kpa"];

fn trial() -> Trial {
    trial_of(1500)
}

fn trial_of(rows: u32) -> Trial {
    let channel = |(k, name): (usize, &&str)| Channel {
        name: (*name).to_owned(),
        values: (0..rows)
            .map(|i| 0.5 + 0.4 * (0.01 * f64::from(i) * (k + 1) as f64).sin())
            .collect(),
    };
    Trial {
        name: "a.csv".into(),
        time_s: (0..rows).map(|i| 0.01 * f64::from(i)).collect(),
        channels: COLUMNS.iter().enumerate().map(channel).collect(),
    }
}

/// Invalid trials of all kinds, each with a description.
fn spoilt() -> Vec<(String, Trial)> {
    let mut all = vec![("no sample".to_owned(), Trial { time_s: Vec::new(), ..trial() })];
    all.push(("nothing".to_owned(), Trial::default()));
    for k in 0..COLUMNS.len() {
        for length in [0, 1, 700, 1600] {
            let mut one = trial();
            one.channels[k].values.resize(length, 0.5);
            all.push((format!("{} of {length} values", COLUMNS[k]), one));
        }
    }
    for (name, change) in [
        ("time stands", (|t: &mut Vec<f64>| t.fill(1.0)) as fn(&mut Vec<f64>)),
        ("time runs back", |t| t.reverse()),
        ("time is none", |t| t[7] = f64::NAN),
        ("time is endless", |t| t[1499] = f64::INFINITY),
        ("a step of 1e-30 s", |t| t.iter_mut().for_each(|t| *t *= 1e-28)),
        ("a step of 1e30 s", |t| t.iter_mut().for_each(|t| *t *= 1e32)),
    ] {
        let mut one = trial();
        change(&mut one.time_s);
        all.push((name.to_owned(), one));
    }
    all
}

/// Asserts that a call returns an error; a panic is reported with the description of the input.
#[track_caller]
fn refuses<T, E: std::fmt::Display>(what: &str, call: impl FnOnce() -> Result<T, E>) {
    match catch_unwind(AssertUnwindSafe(call)) {
        Err(_) => panic!("{what}: it panicked"),
        Ok(Ok(_)) => panic!("{what}: it was taken"),
        Ok(Err(error)) => assert!(!error.to_string().is_empty(), "{what}"),
    }
}

/// Asserts that a call does not panic; it may succeed or fail.
#[track_caller]
fn survives<T>(what: &str, call: impl FnOnce() -> T) {
    assert!(catch_unwind(AssertUnwindSafe(call)).is_ok(), "{what}: it panicked");
}

#[test]
fn trials_that_are_none_are_refused_by_every_simulator() {
    let catalogue = Catalogue::default();
    for (what, trial) in spoilt() {
        let trials = [SessionTrial::new(trial)];
        refuses(&format!("session, {what}"), || {
            let session = RigSession::new(&trials)?;
            RigSimulator::new(RigSetup { session, rig: Rig::default(), catalogue: &catalogue })
        });
        if what.contains("inlet") || what.contains("outlet") {
            continue; // a gauge looks at neither
        }
        let (reference, signal) = ("length_mm", "bridge_v");
        let setup =
            GaugeSetup { trials: &trials, reference, signal, rig: None, catalogue: &catalogue };
        if what.contains("pressure") {
            survives(&format!("gauge, {what}"), || GaugeSimulator::new(&setup).map(drop));
        } else {
            refuses(&format!("gauge, {what}"), || GaugeSimulator::new(&setup).map(drop));
        }
    }
    refuses("a session of no trial", || RigSession::new(&[]));
    refuses("an even session of no trial", || EvenSession::new(&[], &["length_mm"], 50));
    let test = SessionTrial { split: Split::Test, ..SessionTrial::new(trial()) };
    refuses("a session to test on alone", || RigSession::new(&[test]));
}

#[test]
fn trials_that_are_none_are_refused_by_calibrations() {
    let calibration = stretch_receptor::example_calibration();
    for (what, trial) in spoilt() {
        let trials = [trial];
        survives(&format!("gross errors, {what}"), || {
            without_gross_errors(trials.to_vec(), &["length_mm", "bridge_v"])
        });
        survives(&format!("calibrate, {what}"), || calibrate(&trials, &Options::default()).is_ok());
        survives(&format!("apply, {what}"), || apply(&calibration, &trials[0]).is_ok());
        survives(&format!("evaluate, {what}"), || {
            evaluate(&[("poly13", &calibration)], &trials).is_ok()
        });
        if what.contains("values") {
            refuses(&format!("apply, {what}"), || apply(&calibration, &trials[0]));
            refuses(&format!("replay, {what}"), || {
                TrialPlan::from_trial(&trials[0], &RigParams::default())
            });
        }
    }
    refuses("no calibration", || evaluate(&[], &[trial()]));
    refuses("no trial", || calibrate(&[], &Options::default()));
}

/// Samples of each trial that is used, and notes.
type Shortened = (Vec<usize>, Vec<String>);

/// A simulator that shortens long trials: its name, the greatest number of rows that it takes, and
/// its constructor.
type Shortening =
    (&'static str, usize, Box<dyn Fn(&[SessionTrial]) -> Result<Shortened, ProblemError>>);

fn shortening() -> Vec<Shortening> {
    let samples = |about: &Description| about.spec().trials.iter().map(|t| t.samples).collect();
    let gauge = move |trials: &[SessionTrial]| {
        let catalogue = &Catalogue::default();
        let (reference, signal) = ("length_mm", "bridge_v");
        let gauge =
            GaugeSimulator::new(&GaugeSetup { trials, reference, signal, rig: None, catalogue })?;
        Ok((samples(gauge.description()), gauge.notes().to_vec()))
    };
    let rig = |trials: &[SessionTrial]| {
        let session = RigSession::new(trials)?;
        let samples = session.trials().iter().map(|t| t.samples).collect();
        Ok((samples, session.notes().to_vec()))
    };
    let black_box = |outputs: usize| {
        move |trials: &[SessionTrial]| {
            let stage = |k: usize| StageEntry {
                name: format!("stage {k}"),
                output: format!("output_{k}"),
                inputs: vec!["inlet".into()],
                ..StageEntry::default()
            };
            let stages = (0..outputs).map(stage).collect();
            let spec = ProblemSpec { stages, trials: trials.to_vec(), ..ProblemSpec::default() };
            let checked = Checked::new(spec)?;
            Ok((samples(checked.description()), checked.notes().to_vec()))
        }
    };
    vec![
        ("gauge", 240_000, Box::new(gauge)),
        ("rig", 80_000, Box::new(rig)),
        ("one output", 240_000, Box::new(black_box(1))),
        ("six outputs", 40_000, Box::new(black_box(6))),
    ]
}

#[test]
fn long_recordings_are_shortened_and_a_note_says_so() {
    let of = |rows: usize, start_s: f64| {
        let mut trial = trial_of(rows as u32);
        // millimetres and kilopascals
        for column in [2, 4] {
            trial.channels[column].values.iter_mut().for_each(|x| *x = 100.0 + 50.0 * *x);
        }
        let output = |k| Channel { name: format!("output_{k}"), ..trial.channels[2].clone() };
        let outputs: Vec<_> = (0..6).map(output).collect();
        trial.channels.extend(outputs);
        SessionTrial { start_s, ..SessionTrial::new(trial) }
    };
    for (what, most, call) in shortening() {
        let long = most / 2 + 7;
        for (rows, expected) in [
            (vec![most], vec![most]),
            (vec![most + 1], vec![most]),
            (vec![2000, long, long], vec![2000, most / 2 - 1000, most / 2 - 1000]),
        ] {
            let trials: Vec<_> =
                rows.iter().enumerate().map(|(i, rows)| of(*rows, 1e4 * i as f64)).collect();
            let (samples, notes) = call(&trials).unwrap_or_else(|e| panic!("{what}: {e}"));
            assert_eq!(samples, expected, "{what}");
            let said = notes.iter().filter(|note| note.starts_with("only the first")).count();
            assert_eq!(said, usize::from(rows != expected), "{what}: {notes:?}");
        }
        // beginnings that are too short to diagnose are refused
        let many = vec![of(1000, 0.0); most / 1000 + 1];
        let error = call(&many).map(drop).unwrap_err().to_string();
        assert!(error.contains("rows in total") && error.contains("--grid HZ"), "{what}: {error}");
    }
}

#[test]
fn trials_that_are_too_long_for_a_calibration_are_refused() {
    // the check comes first: a trial without a channel is refused because of its length
    let of = |rows| Trial { name: "long.csv".into(), time_s: vec![0.0; rows], ..Trial::default() };
    let calibration = stretch_receptor::example_calibration();
    for (what, most) in [
        ("evaluate", 10_000_000),
        ("linear", 10_000_000),
        ("poly13", 10_000_000),
        ("history", 3_000_000),
        ("observer", 3_000_000),
    ] {
        let message = |rows: usize| {
            let trials = [of(rows)];
            let answer = match what.parse() {
                Ok(model) => calibrate(&trials, &Options { model, ..Options::default() }).map(drop),
                Err(_) => evaluate(&[("a", &calibration)], &trials).map(drop),
            };
            answer.unwrap_err().to_string()
        };
        let refused = message(most + 1);
        let expected = format!("{} rows in total, and at most {most} can be processed", most + 1);
        assert!(refused.contains(&expected) && refused.contains("--grid HZ"), "{what}: {refused}");
        assert!(!message(most).contains("rows in total"), "{what}");
    }
}

#[test]
fn plans_that_cannot_be_are_refused() {
    for number in [0, 1, usize::MAX / 2, usize::MAX - 1, usize::MAX] {
        survives("arbitrary", || TrialPlan::arbitrary(number, u64::MAX));
        survives("pulses", || TrialPlan::pulses(number, u64::MAX));
    }
    let plan = || TrialPlan::inflation(0.5);
    let held = || TrialPlan { set_length_mm: Some(vec![170.0; 1500]), ..plan() };
    let plans = [
        ("opening", TrialPlan::inflation(f64::NAN)),
        ("opening of 7", TrialPlan::deflation(7.0)),
        ("one valve", TrialPlan { outlet: Vec::new(), ..plan() }),
        ("rate of 0", TrialPlan { rate_hz: 0.0, ..plan() }),
        ("rate of NaN", TrialPlan { rate_hz: f64::NAN, ..plan() }),
        ("start of NaN", TrialPlan { start_s: Some(f64::NAN), ..plan() }),
        ("short length", TrialPlan { set_length_mm: Some(vec![170.0; 3]), ..plan() }),
        ("short shunt", TrialPlan { shunt: Some(vec![0.1; 3]), ..held() }),
        ("late start", TrialPlan { start_s: Some(1e300), ..plan() }),
        ("very late start", TrialPlan { start_s: Some(1e15), full: true, ..plan() }),
    ];
    for (what, plan) in plans {
        refuses(what, || {
            let mut session = stretch_sim::Session::new(&Rig::default(), &RunSettings::default())?;
            session.run(&TrialPlan::pulses(1, 1))?;
            session.run(&plan)
        });
    }
}

#[test]
fn a_sample_time_that_cannot_be_is_refused() {
    for dt_s in [0.0, -0.01, f64::NAN, f64::INFINITY, 1e-30, 1e-12, 1e30] {
        refuses(&format!("dt_s of {dt_s}"), || {
            Description::new(DescriptionSpec {
                stages: Vec::new(),
                parameters: Vec::new(),
                effects: Vec::new(),
                trials: Vec::new(),
                dt_s,
            })
        });
    }
}

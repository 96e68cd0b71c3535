//! Small sessions simulated by the built-in rig, diagnosed from end to end.

use crate::support::effects::effect;
use crate::support::rigs::own_rig;
use crate::support::rows::{PROBABILITY, with_lost_rows};
use crate::support::session::{session, session_from};
use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq};
use stretch_data::{RigFile, SessionTrial, Split};
use stretch_gap::{Diagnosis, Evidence, NoteCode, Options, Run, Simulator, VerdictKind, diagnose};
use stretch_problem::{Problem, RigSession, RigSetup, RigSimulator};
use stretch_sim::{Catalogue, EffectSet, Rig, RigParams, SimError, Start, default_rig_text};
use testkit::tolerance::{FLOW_FOUND, GAP_NULL, LAG_FOUND, POLE_FOUND_S, TRAINED_AGAIN, TURNED};

/// The stock rig with trials.
fn setup<'a>(trials: &[SessionTrial], catalogue: &'a Catalogue) -> RigSetup<'a> {
    let session = RigSession::new(trials).expect("a session");
    RigSetup { session, rig: Rig::default(), catalogue }
}

fn run(trials: Vec<SessionTrial>, without: &[&str], options: &Options) -> Diagnosis {
    let catalogue = Catalogue::default().without(without).expect("known names");
    let simulator = RigSimulator::new(setup(&trials, &catalogue)).expect("a simulator");
    diagnose(&simulator, options, &|_| (), &|| false).expect("a diagnosis").0
}

fn examined(trials: Vec<SessionTrial>) -> Diagnosis {
    let catalogue = Catalogue::default();
    let rig = RigSimulator::new(setup(&trials, &catalogue)).expect("a simulator");
    Problem::from(rig)
        .examine(&shallow(), false, &|_| (), &|| false)
        .expect("a diagnosis")
        .diagnosis
}

fn run_of(simulator: &dyn Simulator) -> Evidence {
    diagnose(simulator, &shallow(), &|_| (), &|| false).expect("a diagnosis").1
}

fn shallow() -> Options {
    Options { depth: std::num::NonZeroUsize::new(1).unwrap(), ..Options::default() }
}

#[test]
fn a_rig_off_its_data_sheet_lacks_no_effect() {
    let diagnosis = run(session(&own_rig(), &EffectSet::new(), true, 1), &[], &shallow());
    assert_eq!(diagnosis.verdict(), VerdictKind::Parameters, "{}", diagnosis.sentence);
    assert!(diagnosis.named().is_empty() && diagnosis.ambiguous.is_empty());
    let tuned = |name: &str| {
        let p = diagnosis.parameters.iter().find(|p| p.name == name).expect("a parameter");
        p.fitted / p.nominal
    };
    assert_abs_diff_eq!(tuned("C_in"), 1.2, epsilon = FLOW_FOUND);
    assert_abs_diff_eq!(tuned("tau_m"), 1.3, epsilon = LAG_FOUND);
    for stage in &diagnosis.location.stages {
        assert_abs_diff_eq!(stage.excess, 0.0, epsilon = GAP_NULL);
        assert!(stage.raw > 1.0, "{stage:?}");
    }
}

#[test]
fn a_rig_as_shipped_has_no_gap() {
    let diagnosis =
        run(session(&RigParams::default(), &EffectSet::new(), false, 2), &[], &shallow());
    assert!(
        [VerdictKind::NoGap, VerdictKind::Parameters].contains(&diagnosis.verdict()),
        "{}",
        diagnosis.sentence
    );
    for stage in &diagnosis.location.stages {
        assert_abs_diff_eq!(stage.excess, 0.0, epsilon = GAP_NULL);
    }
}

#[test]
fn a_slow_amplifier_is_named_and_measured_whatever_the_number_of_threads() {
    let effects = effect("amplifier_lowpass", &[("tau", 0.03)]);
    let trials = session(&own_rig(), &effects, false, 3);
    let one = run(trials.clone(), &[], &Options { threads: 1, ..shallow() });
    assert_eq!(one.verdict(), VerdictKind::Effect, "{}", one.sentence);
    assert_eq!(one.named(), ["amplifier_lowpass"]);
    let first = &one.candidates[0];
    assert!(first.closed > 0.98 && first.closed_ci[0] > 0.9, "{first:?}");
    let tau = first.parameters.iter().find(|p| p.name == "tau").expect("tau");
    assert_abs_diff_eq!(tau.value, 0.03, epsilon = POLE_FOUND_S);
    let two = run(trials, &[], &Options { threads: 2, ..shallow() });
    let text = |d: &Diagnosis| {
        serde_json::to_string(&Diagnosis { runtime_s: 0.0, ..d.clone() }).expect("JSON")
    };
    assert_eq!(text(&one), text(&two));
}

/// A memory of 25 s is longer than the pauses. Whether a rig was in a steady state before the first trial, before
/// every trial, or before none, is estimated.
#[test]
fn a_long_memory_is_named_wherever_the_trials_begin() {
    let effects = effect("muscle_creep", &[("c", 0.2), ("tau", 25.0)]);
    let carried = |_| Start::Carried { rest_s: 14.0 };
    let first = |trial| if trial == 0 { Start::Settled } else { Start::Carried { rest_s: 14.0 } };
    for start in [carried, first, |_| Start::Settled] {
        let trials = session_from(start, &own_rig(), &effects, true, 11);
        let found = run(trials, &[], &shallow());
        assert_eq!(found.verdict(), VerdictKind::Effect, "{}", found.sentence);
        assert_eq!(found.named(), ["muscle_creep"]);
        assert!(found.candidates[0].closed > 0.95, "{}", found.sentence);
    }
}

/// Without a pressure column, re-tuning absorbs most of a chamber that grows: parameters end at the ends of their
/// tolerances, and around them a chamber that grows explains nothing.
#[test]
fn an_effect_that_re_tuning_has_absorbed_is_found_around_the_parameters_as_shipped() {
    let effects = effect("chamber_volume", &[("g", 0.3)]);
    for seed in 1..4 {
        let found = run(session(&RigParams::default(), &effects, false, seed), &[], &shallow());
        assert_eq!(found.verdict(), VerdictKind::Effect, "{seed}: {}", found.sentence);
        assert_eq!(found.named(), ["chamber_volume"]);
        assert!(found.candidates[0].closed > 0.95, "{seed}: {}", found.sentence);
    }
}

#[test]
fn turned_numbers_answer_as_the_simulator_does() {
    let effects = effect("gauge_relaxation", &[("c", 0.3), ("tau", 0.1)]);
    let trials = session(&own_rig(), &effects, false, 7);
    let catalogue = Catalogue::default();
    let simulator = RigSimulator::new(setup(&trials, &catalogue)).expect("a simulator");
    let options = Options { responses: true, ..shallow() };
    let (diagnosis, evidence) =
        diagnose(&simulator, &options, &|_| (), &|| false).expect("a diagnosis");
    let responses = evidence.responses.as_ref().expect("an effect that can be turned");
    let stage = responses.stage;
    assert_eq!(diagnosis.location.worst(), Some(stage));
    assert_eq!(responses.parameters[0].effect, diagnosis.named()[0]);
    // the residual at the fit agrees with the excess of the stage
    let own = &evidence.stages[stage];
    assert_relative_eq!(responses.products[0][0], 1.0 + own.excess_after, max_relative = TURNED);
    for (turned, one) in responses.parameters.iter().enumerate() {
        assert!(one.answers.len() >= 3, "{}", one.name);
        assert!(one.answers.is_sorted_by(|a, b| a.value < b.value));
        let answer = &one.answers[0];
        let mut model = evidence.best.clone();
        model.effects[0].1[turned] = answer.value;
        let mut out = vec![0.0; own.after.len()];
        let run = Run::exact(stage, &model, simulator.description().spec().trials.len());
        simulator.simulate(run, &mut out).expect("a run");
        let predicted = own.after.iter().zip(&answer.output).map(|(y, change)| y + change);
        assert!(
            out.iter()
                .zip(predicted)
                .all(|(y, predicted)| (y - predicted).abs() <= TURNED * y.abs())
        );
        // a changed value fits worse, because all trials are of the same rig
        let k = 1 + responses.parameters[..turned].iter().map(|p| p.answers.len()).sum::<usize>();
        let products = &responses.products;
        let left = products[0][0] - 2.0 * products[0][k] + products[k][k];
        assert!(left > products[0][0], "{}: {left}", one.name);
    }
    assert!(run_of(&simulator).responses.is_none(), "nobody asked");
}

#[test]
fn a_calibration_trained_with_the_effect_is_as_good_as_one_trained_on_the_rig() {
    let effects = effect("gauge_relaxation", &[("c", 0.3), ("tau", 0.1)]);
    for pressure in [true, false] {
        let trials = session(&own_rig(), &effects, pressure, 7);
        let diagnosis = examined(trials);
        assert_eq!(diagnosis.named(), ["gauge_relaxation"], "{}", diagnosis.sentence);
        let transfer = diagnosis.transfer.expect("a gauge has a calibration");
        let poly13 = transfer.poly13;
        // Without the effect, the simulated signal does not depend on the rate. With it, the two
        // trained calibrations differ only by noise.
        assert!(poly13.sim > 1.5 * poly13.real, "{poly13:?}");
        let (with, real) = (poly13.sim_with_effect, poly13.real);
        assert_abs_diff_eq!(with, real, epsilon = TRAINED_AGAIN * real);
        assert!(transfer.linear.real > poly13.real, "{transfer:?}");
    }
}

#[test]
fn parameters_that_are_off_blame_no_effect() {
    let trials = session(&own_rig(), &EffectSet::new(), true, 8);
    let diagnosis = examined(trials);
    assert!(diagnosis.named().is_empty() && diagnosis.transfer.is_none());
}

#[test]
fn what_the_catalogue_lacks_is_unknown() {
    let effects = effect("thermal_drift", &[("d", 3e-4)]);
    let trials = session(&own_rig(), &effects, true, 4);
    let without = ["thermal_drift", "gauge_softening", "self_heating"];
    let diagnosis = run(trials, &without, &shallow());
    assert_eq!(diagnosis.verdict(), VerdictKind::Unknown, "{}", diagnosis.sentence);
    assert!(diagnosis.named().is_empty());
    let worst = diagnosis.location.stages.iter().max_by(|a, b| a.share.total_cmp(&b.share));
    assert_eq!(worst.expect("stages").stage, "sensing");
}

#[test]
fn bad_input_is_refused_in_a_sentence() {
    let good = session(&RigParams::default(), &EffectSet::new(), true, 5);
    let refused = |change: &dyn Fn(&mut SessionTrial)| {
        let mut trials = good.clone();
        trials.iter_mut().for_each(change);
        RigSession::new(&trials).expect_err("refused").to_string()
    };
    let each = |column: &str, change: &dyn Fn(&mut Vec<f64>)| {
        refused(&|t| {
            let channel = t.trial.channels.iter_mut().find(|c| c.name == column);
            change(&mut channel.expect("the column").values);
        })
    };
    let metres = each("length_mm", &|l| l.iter_mut().for_each(|l| *l *= 1e-3));
    assert!(metres.contains("metres"), "{metres}");
    let swapped = refused(&|t| {
        for channel in &mut t.trial.channels {
            channel.name = match channel.name.as_str() {
                "length_mm" => "bridge_v".into(),
                "bridge_v" => "length_mm".into(),
                other => other.into(),
            };
        }
    });
    assert!(swapped.contains("swapped"), "{swapped}");
    let dead = each("bridge_v", &|v| v.fill(1.24));
    assert!(dead.contains("dead"), "{dead}");
    let shut = refused(&|t| t.trial.channels[..2].iter_mut().for_each(|c| c.values.fill(0.0)));
    assert!(shut.contains("no valve ever opens"), "{shut}");
    let tests = refused(&|t| t.split = Split::Test);
    assert!(tests.contains("not a test trial"), "{tests}");
    let ragged = each("bridge_v", &|v| v.truncate(40));
    assert!(ragged.contains("trial_0.csv, column bridge_v: it has 40 values"), "{ragged}");
    let hole = each("bridge_v", &|v| v[40] = f64::NAN);
    assert!(hole.contains("trial_0.csv, row 42, column bridge_v"), "{hole}");
    let still = refused(&|t| t.trial.time_s[7] = t.trial.time_s[6]);
    assert!(still.contains("trial_0.csv, row 9, column time_s"), "{still}");
    let gone = refused(&|t| t.trial.channels.retain(|c| c.name != "inlet"));
    assert!(gone.contains("no column inlet"), "{gone}");
    assert!(RigSession::new(&[]).is_err());
    let unknown = Catalogue::default().without(&["leek"]);
    assert!(
        matches!(unknown, Err(SimError::UnknownEffect { nearest: Some(n), .. }) if n == "leak")
    );
}

#[test]
fn without_test_trials_the_last_part_is_held_back() {
    let mut trials = session(&own_rig(), &EffectSet::new(), true, 6);
    trials.iter_mut().for_each(|t| t.split = Split::Fit);
    let diagnosis = run(trials, &[], &shallow());
    let is_noted = diagnosis.notes.iter().any(|note| note.code == NoteCode::NoTestTrial);
    assert!(is_noted, "{:?}", diagnosis.notes);
    assert!(diagnosis.named().is_empty());
}

#[test]
#[ignore = "eighteen whole diagnoses; ./ci.sh runs it"]
fn lost_rows_change_no_verdict() {
    let cases = [
        effect("gauge_relaxation", &[("c", 0.3), ("tau", 0.1)]),
        effect("valve_delay", &[("delay_s", 0.03)]),
        EffectSet::new(),
    ];
    for (effects, pressure) in cases.iter().flat_map(|e| [(e, true), (e, false)]) {
        let trials = session(&own_rig(), effects, pressure, 7);
        let whole = run(trials.clone(), &[], &shallow());
        let names: Vec<&str> = effects.iter().map(|e| e.name()).collect();
        assert_eq!(whole.named(), names, "{}", whole.sentence);
        for share in [0.0, 0.01] {
            let d = run(with_lost_rows(&trials, share, 5), &[], &shallow());
            let what = format!("{names:?}, pressure {pressure}, {share} lost: {}", d.sentence);
            assert_eq!((d.verdict(), &d.named()), (whole.verdict(), &whole.named()), "{what}");
            if let (Some(was), Some(is)) = (whole.candidates.first(), d.candidates.first()) {
                let (was, is) = (was.probability, is.probability);
                assert!(abs_diff_eq!(was, is, epsilon = PROBABILITY), "{what}: {was} {is}");
            }
        }
    }
}

#[test]
fn what_becomes_of_lost_rows_is_told() {
    let trials = session(&own_rig(), &EffectSet::new(), true, 7);
    let samples = |s: &RigSession| s.column("bridge_v").len();
    let all = samples(&RigSession::new(&trials).expect("a session"));
    let read = RigSession::new(&with_lost_rows(&trials, 0.01, 5)).expect("a session");
    // A row that is lost at the very end of a trial cannot be bridged.
    assert!(samples(&read) + 4 >= all, "{} of {all}", samples(&read));
    assert!(
        read.notes().iter().any(|n| n.contains("lost samples are bridged")),
        "{:?}",
        read.notes()
    );
}

/// The stock rig's file with an effect appended, read as a program reads it.
fn with_effect(entry: &str) -> Rig {
    let text = default_rig_text() + "\n[[effect]]\n" + entry;
    Rig::from_file(&RigFile::parse("rig.toml", &text).expect("TOML")).expect("a rig")
}

#[test]
fn a_simulator_that_has_the_effect_agrees_and_is_not_offered_it_again() {
    let cases = [
        ("gauge_relaxation", "name = 'gauge_relaxation'\nc = 0.3\ntau = 0.1"),
        ("amplifier_lowpass", "name = 'amplifier_lowpass'\ntau = 0.03"),
        ("muscle_hysteresis", "name = 'muscle_hysteresis'\nh = 0.3\ns = 0.02"),
        ("valve_delay", "name = 'valve_delay'\ndelay_s = 0.03"),
        ("channel_skew", "name = 'channel_skew'\nskew_s = 0.03"),
        ("valve_deadband", "name = 'valve_deadband'\nu_db = 0.05"),
    ];
    for (seed, (name, entry)) in cases.into_iter().enumerate() {
        let rig = with_effect(entry);
        let pressure = seed % 2 == 0;
        let trials = session(&own_rig(), &rig.effects, pressure, 11 + seed as u64);
        // The first trial is left out, because it starts without a previous motion, unlike the
        // trials of a measured rig.
        let session = RigSession::new(&trials[1..]).expect("a session");
        let simulator =
            RigSimulator::new(RigSetup { session, rig, catalogue: &Catalogue::default() })
                .expect("a simulator");
        assert!(simulator.description().spec().effects.iter().all(|e| e.name != name));
        let d = diagnose(&simulator, &shallow(), &|_| (), &|| false).expect("a diagnosis").0;
        let agrees = matches!(d.verdict(), VerdictKind::NoGap | VerdictKind::Parameters);
        assert!(agrees && d.named().is_empty(), "{name}: {}", d.sentence);
    }
}

#[test]
fn a_parameter_without_tolerance_stays_put() {
    let text = "[muscle]\ntau_m = { value = 0.03 }\nL0 = { value = 180.0, tolerance_abs = 0.5 }\n";
    let rig = Rig::from_file(&RigFile::parse("rig.toml", text).expect("TOML")).expect("a rig");
    let trials = session(&RigParams::default(), &EffectSet::new(), true, 2);
    let session = RigSession::new(&trials).expect("a session");
    let simulator = RigSimulator::new(RigSetup { session, rig, catalogue: &Catalogue::default() })
        .expect("a simulator");
    let tuned: Vec<&str> =
        simulator.description().spec().parameters.iter().map(|p| p.name.as_str()).collect();
    // A parameter that the file omits keeps its stock tolerance. A parameter to which the file
    // gives a tolerance is free in its stage.
    assert!(!tuned.contains(&"tau_m") && tuned.contains(&"k_max"), "{tuned:?}");
    let at = tuned.iter().position(|name| *name == "L0").expect("L0 is free");
    assert!(simulator.description().spec().stages[1].parameters.contains(&at));
    let d = diagnose(&simulator, &shallow(), &|_| (), &|| false).expect("a diagnosis").0;
    assert!(d.named().is_empty(), "{}", d.sentence);
}

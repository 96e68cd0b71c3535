//! Small sessions simulated by the catalogue's own rig, diagnosed from end to end.

mod support;

use stretch_bench::{RigSimulator, RigTrial, Session};
use stretch_data::TrialKind;
use stretch_gap::{Diagnosis, Options, VerdictKind, diagnose};
use stretch_sim::{
    Catalogue, Chain, DEFAULT_STEP_S, EffectSet, Key, Openings, Recorded, RigParams, SimError,
    Start,
};
use support::Noise;

const DT_S: f64 = 0.01;

fn openings(trial: usize, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let (mut inlet, mut outlet) = (vec![0.0; 50], vec![0.0; 50]);
    if trial == 0 {
        inlet.extend([0.25; 600]);
        outlet.extend([0.0; 600]);
        return (inlet, outlet);
    }
    while inlet.len() < 1800 {
        let length = (20.0 + 100.0 * noise.unit()) as usize;
        let opening = [0.125, 0.25, 0.5, 1.0][(4.0 * noise.unit()) as usize % 4];
        let choice = noise.unit();
        let (i, o) = match choice {
            c if c < 0.42 => (opening, 0.0),
            c if c < 0.84 => (0.0, opening),
            _ => (0.0, 0.0),
        };
        inlet.extend(std::iter::repeat_n(i, length));
        outlet.extend(std::iter::repeat_n(o, length));
    }
    inlet.truncate(1800);
    outlet.truncate(1800);
    (inlet, outlet)
}

/// A session of four trials, the last to test on.
fn session(params: &RigParams, effects: &EffectSet, pressure: bool, seed: u64) -> Vec<RigTrial> {
    let chain = Chain::new(params, effects, DT_S, DEFAULT_STEP_S).expect("a rig");
    let mut memory = chain.memory();
    let mut noise = Noise(seed);
    let mut start_s = 0.0;
    (0..4)
        .map(|trial| {
            let (inlet, outlet) = openings(trial, &mut noise);
            let n = inlet.len();
            let [mut p, mut l, mut v] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            let recorded = Recorded { pressure_kpa: &mut p, length_mm: &mut l, bridge_v: &mut v };
            let valves = Openings { inlet: &inlet, outlet: &outlet };
            let start = Start::Carried { rest_s: 14.0 };
            chain.run(&mut memory, start, start_s, valves, 0.1, recorded).expect("a trial");
            p.iter_mut().for_each(|x| *x += 1.2 * noise.gauss());
            l.iter_mut().for_each(|x| *x += 0.05 * noise.gauss());
            v.iter_mut().for_each(|x| *x += 0.002 * noise.gauss());
            let begun_s = start_s;
            start_s += n as f64 * DT_S + 15.0;
            RigTrial {
                name: format!("trial_{trial}.csv"),
                kind: TrialKind::Arbitrary,
                start_s: begun_s,
                is_test: trial == 3,
                dt_s: DT_S,
                inlet,
                outlet,
                pressure_kpa: pressure.then_some(p),
                length_mm: l,
                bridge_v: v,
            }
        })
        .collect()
}

/// A rig within its tolerances but not as shipped.
fn own_rig() -> RigParams {
    let mut params = RigParams::default();
    params[Key::CIn] *= 1.2;
    params[Key::KMax] *= 1.04;
    params[Key::TauM] *= 1.3;
    params[Key::VRef] += 0.015;
    params
}

fn run(trials: Vec<RigTrial>, without: &[&str], options: &Options) -> Diagnosis {
    let catalogue = Catalogue::default().without(without).expect("known names");
    let session = Session::new(trials).expect("a session");
    let simulator = RigSimulator::new(session, None, &catalogue).expect("a simulator");
    diagnose(&simulator, options, &|_| (), &|| false).expect("a diagnosis").0
}

fn effect(name: &str, values: &[(&str, f64)]) -> EffectSet {
    let mut effects = EffectSet::new();
    effects.insert(name, values).expect("an effect");
    effects
}

fn shallow() -> Options {
    Options { depth: 1, ..Options::default() }
}

#[test]
fn a_rig_off_its_data_sheet_lacks_no_effect() {
    let diagnosis = run(session(&own_rig(), &EffectSet::new(), true, 1), &[], &shallow());
    assert_eq!(diagnosis.verdict, VerdictKind::Parameters, "{}", diagnosis.sentence);
    assert!(diagnosis.named.is_empty() && diagnosis.ambiguous.is_empty());
    let tuned = |name: &str| {
        let p = diagnosis.parameters.iter().find(|p| p.name == name).expect("a parameter");
        p.fitted / p.nominal
    };
    assert!((tuned("C_in") - 1.2).abs() < 0.03, "{}", tuned("C_in"));
    assert!((tuned("tau_m") - 1.3).abs() < 0.1, "{}", tuned("tau_m"));
    for stage in &diagnosis.location.stages {
        assert!(stage.excess.abs() < 0.1 && stage.raw > 1.0, "{stage:?}");
    }
}

#[test]
fn a_rig_as_shipped_has_no_gap() {
    let diagnosis =
        run(session(&RigParams::default(), &EffectSet::new(), false, 2), &[], &shallow());
    assert!(
        [VerdictKind::NoGap, VerdictKind::Parameters].contains(&diagnosis.verdict),
        "{}",
        diagnosis.sentence
    );
    assert!(diagnosis.location.stages.iter().all(|s| s.excess.abs() < 0.1));
}

#[test]
fn a_slow_amplifier_is_named_and_measured_whatever_the_number_of_threads() {
    let effects = effect("amplifier_lowpass", &[("tau", 0.03)]);
    let trials = session(&own_rig(), &effects, false, 3);
    let one = run(trials.clone(), &[], &Options { threads: 1, ..shallow() });
    assert_eq!(one.verdict, VerdictKind::Effect, "{}", one.sentence);
    assert_eq!(one.named, ["amplifier_lowpass"]);
    let first = &one.candidates[0];
    assert!(first.closed > 0.98 && first.closed_ci[0] > 0.9, "{first:?}");
    let tau = first.parameters.iter().find(|p| p.name == "tau").expect("tau");
    assert!((tau.value - 0.03).abs() < 0.002, "{tau:?}");
    let two = run(trials, &[], &Options { threads: 2, ..shallow() });
    let text = |d: &Diagnosis| {
        serde_json::to_string(&Diagnosis { runtime_s: 0.0, ..d.clone() }).expect("JSON")
    };
    assert_eq!(text(&one), text(&two));
}

#[test]
fn a_calibration_trained_with_the_effect_is_as_good_as_one_trained_on_the_rig() {
    let effects = effect("gauge_relaxation", &[("c", 0.3), ("tau", 0.1)]);
    for pressure in [true, false] {
        let trials = session(&own_rig(), &effects, pressure, 7);
        let diagnosis = run(trials, &[], &Options { baselines: true, ..shallow() });
        assert_eq!(diagnosis.named, ["gauge_relaxation"], "{}", diagnosis.sentence);
        let transfer = diagnosis.transfer.expect("a gauge has a calibration");
        let poly13 = transfer.poly13;
        // Without the effect the rate says nothing in the simulator; with it the two trainings differ by their noise.
        assert!(poly13.sim > 1.5 * poly13.real, "{poly13:?}");
        assert!((poly13.sim_with_effect / poly13.real - 1.0).abs() < 0.1, "{poly13:?}");
        assert!(transfer.linear.real > poly13.real, "{transfer:?}");
        let said = diagnosis.baselines.expect("asked for");
        assert_eq!(said.bic.as_deref(), Some("gauge_relaxation"));
        assert_eq!(said.signature.as_deref(), Some("gauge_relaxation"));
    }
}

#[test]
fn simpler_methods_blame_an_effect_for_parameters_that_are_off() {
    let trials = session(&own_rig(), &EffectSet::new(), true, 8);
    let diagnosis = run(trials, &[], &Options { baselines: true, ..shallow() });
    assert!(diagnosis.named.is_empty() && diagnosis.transfer.is_none());
    // The parameters are off by their tolerances and nothing else is wrong.
    let said = diagnosis.baselines.expect("asked for");
    assert!(said.largest_drop.is_some(), "{said:?}");
    assert!(
        run(session(&own_rig(), &EffectSet::new(), true, 8), &[], &shallow()).baselines.is_none()
    );
}

#[test]
fn what_the_catalogue_lacks_is_unknown() {
    let effects = effect("thermal_drift", &[("d", 3e-4)]);
    let trials = session(&own_rig(), &effects, true, 4);
    let without = ["thermal_drift", "gauge_softening", "self_heating"];
    let diagnosis = run(trials, &without, &shallow());
    assert_eq!(diagnosis.verdict, VerdictKind::Unknown, "{}", diagnosis.sentence);
    assert!(diagnosis.named.is_empty());
    let worst = diagnosis.location.stages.iter().max_by(|a, b| a.share.total_cmp(&b.share));
    assert_eq!(worst.expect("stages").stage, "sensing");
}

#[test]
fn bad_input_is_refused_in_a_sentence() {
    let good = session(&RigParams::default(), &EffectSet::new(), true, 5);
    let changed = |change: &dyn Fn(&mut RigTrial)| {
        let mut trials = good.clone();
        trials.iter_mut().for_each(change);
        Session::new(trials).expect_err("refused").to_string()
    };
    let metres = changed(&|t| t.length_mm.iter_mut().for_each(|l| *l *= 1e-3));
    assert!(metres.contains("metres"), "{metres}");
    let swapped = changed(&|t| std::mem::swap(&mut t.length_mm, &mut t.bridge_v));
    assert!(swapped.contains("swapped"), "{swapped}");
    let dead = changed(&|t| t.bridge_v.fill(1.24));
    assert!(dead.contains("dead"), "{dead}");
    let shut = changed(&|t| {
        t.inlet.fill(0.0);
        t.outlet.fill(0.0);
    });
    assert!(shut.contains("no valve ever opens"), "{shut}");
    let tests = changed(&|t| t.is_test = true);
    assert!(tests.contains("split"), "{tests}");
    let unknown = Catalogue::default().without(&["leek"]);
    assert!(
        matches!(unknown, Err(SimError::UnknownEffect { nearest: Some(n), .. }) if n == "leak")
    );
}

#[test]
fn without_test_trials_the_last_part_is_held_back() {
    let mut trials = session(&own_rig(), &EffectSet::new(), true, 6);
    trials.iter_mut().for_each(|t| t.is_test = false);
    let diagnosis = run(trials, &[], &shallow());
    assert!(diagnosis.notes.iter().any(|n| n.contains("no test trial")), "{:?}", diagnosis.notes);
    assert!(diagnosis.named.is_empty());
}

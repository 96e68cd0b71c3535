//! Changes that must not change the named effects: dropped rows, shifted time, scaled units,
//! permuted trials, a trial less, noise of a known level. Also, no simulation may depend on test
//! samples.

use crate::support::Noise;
use crate::support::effects::effect;
use crate::support::rigs::own_rig;
use crate::support::session::{DT_S, session};
use stretch_data::{Channel, SessionTrial, Split};
use stretch_gap::{Diagnosis, Model, Options, Run, Simulator, VerdictKind, diagnose};
use stretch_problem::{
    Diagnosable, GaugeSetup, GaugeSimulator, RigSession, RigSetup, RigSimulator,
};
use stretch_sim::{Catalogue, EffectSet, Key, Rig, RigParams};

/// A case: effects that the real rig has in addition to its file.
struct Case {
    name: &'static str,
    effects: EffectSet,
    pressure: bool,
}

fn cases() -> [Case; 3] {
    let case = |name, effects, pressure| Case { name, effects, pressure };
    [
        case("none", EffectSet::new(), true),
        case("amplifier_lowpass", effect("amplifier_lowpass", &[("tau", 0.08)]), true),
        case("leak", effect("leak", &[("c", 5e-11)]), false),
    ]
}

fn recorded(case: &Case) -> Vec<SessionTrial> {
    session(&own_rig(), &case.effects, case.pressure, 11)
}

fn diagnosed(trials: &[SessionTrial], rig: Rig) -> Diagnosis {
    let catalogue = Catalogue::default();
    let session = RigSession::new(trials).expect("a session");
    let rig = RigSimulator::new(RigSetup { session, rig, catalogue: &catalogue }).expect("a rig");
    let options = Options { depth: std::num::NonZeroUsize::new(2).unwrap(), ..Options::default() };
    diagnose(&rig, &options, &|_| (), &|| false).expect("a diagnosis").0
}

/// Asserts that a change keeps the verdict and the names, and that the 95 % set still holds the
/// true effect.
fn holds(what: &str, change: impl Fn(&Case, &mut Vec<SessionTrial>) -> Rig) {
    for case in cases() {
        let before = diagnosed(&recorded(&case), Rig::default());
        let expected: &[&str] = if case.name == "none" { &[] } else { &[case.name] };
        assert_eq!(before.named(), expected, "as recorded: {}", before.sentence);
        let mut trials = recorded(&case);
        let rig = change(&case, &mut trials);
        let after = diagnosed(&trials, rig);
        let what = format!("{what}, {}: {}", case.name, after.sentence);
        assert_eq!(after.named(), before.named(), "{what}");
        assert_eq!(after.verdict(), before.verdict(), "{what}");
        // A set may lose or gain improbable effects; it still holds the true effect.
        assert!(expected.iter().all(|name| after.ambiguous.iter().any(|a| a == name)), "{what}");
        assert_eq!(after.verdict() == VerdictKind::Parameters, case.name == "none", "{what}");
    }
}

fn each_column(trials: &mut [SessionTrial], name: &str, change: impl Fn(f64) -> f64) {
    let channels = trials.iter_mut().flat_map(|t| &mut t.trial.channels);
    for channel in channels.filter(|c| c.name == name) {
        channel.values.iter_mut().for_each(|x| *x = change(*x));
    }
}

#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn every_second_row_dropped() {
    holds("every second row dropped", |_, trials| {
        for one in trials.iter_mut() {
            let decimate =
                |values: &mut Vec<f64>| *values = values.iter().copied().step_by(2).collect();
            decimate(&mut one.trial.time_s);
            one.trial.channels.iter_mut().for_each(|c| decimate(&mut c.values));
        }
        Rig::default()
    });
}

#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn rows_lost_while_valves_switch() {
    holds("rows lost in which a valve switched", |_, trials| {
        for one in trials.iter_mut() {
            let inlet = &one.trial.channels[0].values;
            let switches = (1..inlet.len()).filter(|&i| inlet[i] != inlet[i - 1]);
            // The sixth switch of each trial.
            let lost: Vec<usize> = switches.skip(5).take(1).collect();
            let mut row = 0..;
            one.trial.time_s.retain(|_| row.next().is_none_or(|i| !lost.contains(&i)));
            for channel in &mut one.trial.channels {
                let mut row = 0..;
                channel.values.retain(|_| row.next().is_none_or(|i| !lost.contains(&i)));
            }
        }
        Rig::default()
    });
}

#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn single_values_off_amid_a_motion() {
    holds("single values off amid a motion", |_, trials| {
        for (column, off) in [("length_mm", 0.6), ("bridge_v", -0.03)] {
            for one in trials.iter_mut() {
                let length = &one.trial.channels[2].values;
                let moves =
                    (3..length.len() - 3).filter(|&i| (length[i + 3] - length[i - 3]).abs() > 3.0);
                let places: Vec<usize> = moves.step_by(97).collect();
                let channels = one.trial.channels.iter_mut();
                for channel in channels.filter(|c| c.name == column) {
                    places.iter().for_each(|&i| channel.values[i] += off);
                }
            }
        }
        Rig::default()
    });
}

#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn time_shifted() {
    holds("session an hour later", |_, trials| {
        trials.iter_mut().for_each(|t| t.start_s += 3600.0);
        Rig::default()
    });
    holds("stamps of each trial a minute later", |_, trials| {
        trials.iter_mut().flat_map(|t| &mut t.trial.time_s).for_each(|s| *s += 60.0);
        Rig::default()
    });
}

/// An amplifier of twice the gain: the voltages and the rig file's values for them are doubled
/// together.
#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn units_scaled_together() {
    holds("volts doubled", |_, trials| {
        each_column(trials, "bridge_v", |v| 2.0 * v);
        let mut rig = Rig::default();
        for key in [Key::G, Key::VRef, Key::VFs, Key::SigmaV] {
            rig.params[key] *= 2.0;
        }
        rig
    });
}

#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn trials_permuted_within_their_split() {
    holds("fitted trials in another order", |_, trials| {
        // The contents of trials change places; the start times stay.
        let starts: Vec<f64> = trials.iter().map(|t| t.start_s).collect();
        trials.swap(1, 2);
        trials.iter_mut().zip(starts).for_each(|(t, start_s)| t.start_s = start_s);
        Rig::default()
    });
}

#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn a_trial_less() {
    holds("a trial less", |_, trials| {
        trials.remove(1);
        Rig::default()
    });
}

/// Adds noise as large as the channel's own, which the rig file states.
#[test]
#[ignore = "whole diagnoses of three rigs; ./ci.sh runs it"]
fn noise_added_to_a_known_level() {
    holds("noise of bridge and pot 1.41 times as large", |_, trials| {
        let mut noise = Noise(77);
        for channel in trials.iter_mut().flat_map(|t| &mut t.trial.channels) {
            let sd = match channel.name.as_str() {
                "bridge_v" => 0.002,
                "length_mm" => 0.05,
                _ => 0.0,
            };
            channel.values.iter_mut().for_each(|x| *x += sd * noise.gauss());
        }
        let mut rig = Rig::default();
        for key in [Key::SigmaV, Key::SigmaL] {
            rig.params[key] *= 2.0_f64.sqrt();
        }
        rig
    });
}

/// The simulation of a model with a hum does not depend on the measured test samples: those of test
/// trials, or the last quarter of each trial if there is no test trial.
#[test]
fn nothing_follows_what_is_tested_on() {
    let all = session(&own_rig(), &effect("mains_hum", &[("a", 0.02)]), true, 5);
    let hum = |simulator: &dyn Simulator| -> Vec<f64> {
        let index = simulator.effects().iter().position(|e| e.name == "mains_hum").expect("hum");
        let mut model = Model::nominal(simulator);
        model.effects.push((index, vec![0.02, 50.0]));
        let (stage, trials) = (simulator.stages().len() - 1, simulator.trials().len());
        let mut out = vec![0.0; simulator.trials().iter().map(|t| t.samples).sum()];
        let run = Run::exact(stage, &model, trials);
        simulator.simulate(run, &mut out).expect("a run");
        out
    };
    let catalogue = Catalogue::default();
    for has_test in [true, false] {
        let mut trials = all.clone();
        if !has_test {
            trials.iter_mut().for_each(|t| t.split = Split::Fit);
        }
        let mut other = trials.clone();
        let last = other.last_mut().expect("trials");
        let volts = last.trial.channels.iter_mut().find(|c| c.name == "bridge_v").expect("volts");
        let from = if has_test { 0 } else { volts.values.len() * 3 / 4 };
        volts.values[from..].iter_mut().for_each(|v| *v = 3.0 - *v);
        let rig = |trials: &[SessionTrial]| {
            let session = RigSession::new(trials).expect("a session");
            let setup = RigSetup { session, rig: Rig::default(), catalogue: &catalogue };
            hum(&RigSimulator::new(setup).expect("a rig"))
        };
        assert!(rig(&trials) == rig(&other), "rig, test trials: {has_test}");
        let gauge = |trials: &[SessionTrial]| {
            let setup = GaugeSetup {
                trials,
                reference: "length_mm",
                signal: "bridge_v",
                rig: None,
                catalogue: &catalogue,
            };
            hum(&GaugeSimulator::new(&setup).expect("a gauge"))
        };
        assert!(gauge(&trials) == gauge(&other), "gauge, test trials: {has_test}");
    }
}

/// In a recording that is too slow to show the mains, hum is not looked for, and a note states it.
#[test]
fn what_a_rate_cannot_show_is_not_looked_for() {
    let mut trials = session(&RigParams::default(), &EffectSet::new(), true, 6);
    for one in &mut trials {
        // The same samples, with time stamps every 20 ms.
        one.trial.time_s.iter_mut().for_each(|s| *s *= 2.0);
        one.start_s *= 2.0;
    }
    let catalogue = Catalogue::default();
    let session = RigSession::new(&trials).expect("a session");
    let setup = RigSetup { session, rig: Rig::default(), catalogue: &catalogue };
    let rig = RigSimulator::new(setup).expect("a rig");
    assert!(rig.description().spec().effects.iter().all(|e| e.name != "mains_hum"));
    assert!(rig.notes().iter().any(|n| n.starts_with("mains_hum is not looked for")));
    assert_eq!(rig.description().spec().dt_s, 2.0 * DT_S);
}

/// Slack and a saturated amplifier bend the same end of the voltage, but only one of them moves
/// with the excitation. A trial at 0.7 of the excitation is simulated at that excitation, so that a
/// rig without either effect has no gap.
#[test]
fn a_trial_at_another_excitation_is_no_gap() {
    let mut low = own_rig();
    low[Key::VExc] *= 0.7;
    let mut trials = session(&own_rig(), &EffectSet::new(), true, 8);
    let mut dimmed = session(&low, &EffectSet::new(), true, 8).remove(2);
    let share = vec![0.7; dimmed.trial.len()];
    dimmed.trial.channels.push(Channel { name: "excitation_share".into(), values: share });
    trials[2] = dimmed;
    let diagnosis = diagnosed(&trials, Rig::default());
    assert_eq!(diagnosis.verdict(), VerdictKind::Parameters, "{}", diagnosis.sentence);
    // Without the column, the same recordings show a gap.
    trials[2].trial.channels.pop();
    let blind = diagnosed(&trials, Rig::default());
    assert!(blind.gap.retuned > 1.0, "{}", blind.sentence);
}

/// If gaps leave less than half of the rows, no effect is named, and the answer states the share of
/// the rows on which it is based.
#[test]
fn few_rows_carry_no_name() {
    let mut trials = session(&own_rig(), &effect("amplifier_lowpass", &[("tau", 0.08)]), true, 9);
    for one in &mut trials {
        // Four seconds in one piece, then pieces of half a second, which are too short, with gaps
        // of 0.6 s, because shorter gaps may be bridged.
        let keep = |i: usize| !(380..).contains(&i) || i % 110 < 50;
        let decimate = |values: &mut Vec<f64>| {
            *values =
                values.iter().enumerate().filter(|(i, _)| keep(*i)).map(|(_, x)| *x).collect();
        };
        decimate(&mut one.trial.time_s);
        one.trial.channels.iter_mut().for_each(|c| decimate(&mut c.values));
    }
    let diagnosis = diagnosed(&trials, Rig::default());
    assert!(diagnosis.rows_used.share() < 0.5, "{:?}", diagnosis.rows_used);
    assert_eq!(diagnosis.verdict(), VerdictKind::Unknown, "{}", diagnosis.sentence);
    assert!(diagnosis.named().is_empty() && diagnosis.sentence.contains("of the rows"));
}

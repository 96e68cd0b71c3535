//! Tests of the candidate experiments: some of them distinguish effects that recordings of motion
//! alone cannot distinguish.

use stretch_data::SessionTrial;
use stretch_gap::{Laboratory, Model, Simulator, differences};
use stretch_problem::{RigSession, RigSetup, RigSimulator};
use stretch_sim::Catalogue;

/// Greatest difference between a prediction in steps of 10 ms and a simulation in steps of 2.5 ms,
/// in standard deviations of the noise.
const SAME: f64 = 1.0;

/// A rig with an arbitrary trial.
fn rig() -> RigSimulator {
    let plan = stretch_sim::TrialPlan::arbitrary(1, 5);
    let mut session = stretch_sim::Session::new(&Default::default(), &Default::default()).unwrap();
    let (_, mut trial) = session.run(&plan).unwrap();
    trial.channels.retain(|c| c.name != "pressure_kpa");
    let session = RigSession::new(&[SessionTrial::new(trial)]).unwrap();
    let catalogue = &Catalogue::default();
    RigSimulator::new(RigSetup { session, rig: Default::default(), catalogue }).unwrap()
}

/// Distance D between the predictions for two effects at given first parameters, for every candidate experiment.
fn of(rig: &RigSimulator, one: (&str, f64), two: (&str, f64)) -> Vec<(String, f64)> {
    let model = |(name, value): (&str, f64)| {
        let at = rig.description().spec().effects.iter().position(|e| e.name == name).unwrap();
        let mut values = rig.description().spec().effects[at].starts[0].clone();
        let which = rig.description().spec().effects[at]
            .parameters
            .iter()
            .position(|p| p.name != "v_lo")
            .unwrap();
        values[which] = value;
        let mut model = Model::nominal(rig);
        model.effects.push((at, values));
        model
    };
    differences(rig, &model(one), &model(two)).unwrap()
}

#[test]
fn what_motion_cannot_part_other_experiments_do() {
    let rig = rig();
    let d = |all: &[(String, f64)], name: &str| all.iter().find(|x| x.0 == name).unwrap().1;
    // A slack sleeve stops at a strain, an amplifier at a voltage: another excitation moves only one of them.
    let bridge = stretch_sim::Bridge::new(rig.nominal());
    let (shortest_mm, _) = stretch_data::ends(rig.measured(0));
    let strain = bridge.strain(shortest_mm + 6.0);
    let top = bridge.volts(bridge.resistance(strain));
    let all = of(&rig, ("sleeve_slack", strain), ("amplifier_saturation", top));
    assert!(d(&all, "excitation_0.7") > 3.0 * d(&all, "arbitrary"), "{all:?}");
    // An independent length is needed to distinguish which of two scales is nonlinear.
    let all = of(&rig, ("pot_nonlinearity", 0.6), ("gauge_nonlinearity", -0.01));
    assert!(d(&all, "gauge_blocks") > 2.0 * d(&all, "minor_loops"), "{all:?}");
    assert!(all.iter().all(|x| x.1.is_finite()));
}

/// The trial of a candidate experiment describes it completely: a simulator that replays the trial
/// gives the prediction of the candidate.
#[test]
fn every_experiment_is_replayed_from_its_columns() {
    let rig = rig();
    let nominal = Model::nominal(&rig);
    for plan in rig.experiments() {
        let replay = stretch_sim::TrialPlan::from_trial(&plan.trial, rig.nominal()).unwrap();
        let quiet = stretch_sim::RunSettings { noise: false, ..Default::default() };
        let mut session = stretch_sim::Session::new(&Default::default(), &quiet).unwrap();
        let (_, trial) = session.run(&replay).unwrap();
        // Length and voltage in multiples of their noise; there is no pressure here.
        let predicted = rig.predict(&nominal, &plan.trial).unwrap();
        for (column, values) in ["length_mm", "bridge_v"].into_iter().zip(&predicted) {
            let noise = if column == "length_mm" { 0.05 } else { 0.002 };
            let shown = trial.channel(column).unwrap();
            let worst = shown.iter().zip(values).map(|(a, b)| (a / noise - b).abs());
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < SAME, "{}, {column}: {worst} noises apart", plan.trial.name);
        }
    }
}

//! The facts of a rig's recording that a diagnosis takes in addition to stages, parameters, effects and trials.

use stretch_gap::{Description, MotionSpec, ParameterSpec, RecordFacts, Recorded, RowsUsed};
use stretch_sim::{Key, RigStage};

use super::{
    nominal::TunedParameter,
    record_columns::record_columns,
    session::{Inputs, RigSession},
    smooth::Smoothed,
    timing,
};

/// The facts of a session; `measured` holds the measured outputs of the stages.
pub(super) fn facts(
    about: &Description,
    session: &RigSession,
    inputs: &Inputs,
    (stage_kinds, tuned): (&[RigStage], &[TunedParameter]),
    measured: &[Vec<f64>],
) -> RecordFacts {
    let length = about.stages.iter().position(|s| s.channel == "length_mm").unwrap_or(0);
    RecordFacts {
        is_lost: session.trials.iter().flat_map(|t| &t.is_lost).copied().collect(),
        rows_used: Some(RowsUsed { used: session.rows.used(), read: session.rows.read }),
        motion: Some(MotionSpec {
            values: measured[length].clone(),
            unit: "mm".into(),
            falling: "inflation".into(),
            rising: "deflation".into(),
        }),
        signals: signals(session, inputs),
        columns: record_columns(about, stage_kinds),
        sensor: stage_kinds.iter().position(|kind| *kind == RigStage::Sensing),
        command_timing: command_timing(session, tuned),
        drift_clocks: drift_clocks(session, tuned),
        ..RecordFacts::default()
    }
}

/// The openings, and pressure and length smoothed as the stages see them.
fn signals(session: &RigSession, inputs: &Inputs) -> Vec<Recorded> {
    let trials = &session.trials;
    let command = |name: &str, values: Vec<f64>| Recorded {
        is_command: true,
        ..Recorded::measured(name, "1", values)
    };
    let smooth = |all: &[Smoothed]| all.iter().flat_map(|s| &s.values).copied().collect();
    let mut out = vec![
        command("inlet", trials.iter().flat_map(|t| &t.inlet).copied().collect()),
        command("outlet", trials.iter().flat_map(|t| &t.outlet).copied().collect()),
        Recorded::measured("length_mm", "mm", smooth(&inputs.length)),
    ];
    if !inputs.pressure.is_empty() {
        out.push(Recorded::measured("pressure_kpa", "kPa", smooth(&inputs.pressure)));
    }
    out
}

fn command_timing(session: &RigSession, tuned: &[TunedParameter]) -> Vec<(usize, ParameterSpec)> {
    if !timing::is_slow(session.dt_s()) {
        return Vec::new();
    }
    let timing = |(i, parameter): (usize, &TunedParameter)| match parameter {
        TunedParameter::CommandLead(which) => Some((i, timing::anywhere(*which))),
        _ => None,
    };
    tuned.iter().enumerate().filter_map(timing).collect()
}

/// Returns the index and the clock of every parameter with a clock (see `RecordFacts::drift_clocks`). The supply
/// reaches the chamber only through the inlet, so the clock of the supply stops while the inlet is shut. The clock of a
/// command lead counts the switches of the valves.
fn drift_clocks(session: &RigSession, tuned: &[TunedParameter]) -> Vec<(usize, Vec<u32>)> {
    let trials = &session.trials;
    let switches = || trials.iter().flat_map(|t| timing::switches(&t.inlet, &t.outlet)).collect();
    let open = || trials.iter().flat_map(|t| last_open(&t.inlet)).collect();
    let clock = |(i, parameter): (usize, &TunedParameter)| match parameter {
        TunedParameter::Rig(Key::PS) => Some((i, open())),
        TunedParameter::CommandLead(_) => Some((i, switches())),
        _ => None,
    };
    tuned.iter().enumerate().filter_map(clock).collect()
}

/// For every sample of a trial, the last one at which the inlet was open.
fn last_open(inlet: &[f64]) -> impl Iterator<Item = u32> {
    inlet.iter().enumerate().scan(0, |last, (i, opening)| {
        if *opening > 0.0 {
            *last = i as u32;
        }
        Some(*last)
    })
}

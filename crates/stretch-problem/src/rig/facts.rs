//! What is known of a rig's record: what a diagnosis is told beside stages, parameters, effects and trials.

use stretch_gap::{Description, MotionSpec, ParameterSpec, RecordFacts, Recorded, RowsUsed};
use stretch_sim::{Key, Stage};

use super::{
    nominal::Knob,
    record_columns::record_columns,
    session::{Inputs, RigSession},
    smooth::Smoothed,
    timing,
};

/// The facts of a session, of whose stages `measured` are the outputs.
pub(super) fn facts(
    about: &Description,
    session: &RigSession,
    inputs: &Inputs,
    (stage_kinds, knobs): (&[Stage], &[Knob]),
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
        sensor: stage_kinds.iter().position(|kind| *kind == Stage::Sensing),
        command_timing: command_timing(session, knobs),
        drift_clocks: drift_clocks(session, knobs),
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

fn command_timing(session: &RigSession, knobs: &[Knob]) -> Vec<(usize, ParameterSpec)> {
    if !timing::is_slow(session.dt_s()) {
        return Vec::new();
    }
    let timing = |(i, knob): (usize, &Knob)| match knob {
        Knob::Lead(which) => Some((i, timing::anywhere(*which))),
        _ => None,
    };
    knobs.iter().enumerate().filter_map(timing).collect()
}

/// The supply reaches the chamber through the inlet only: while that is shut, its clock stands still. The lead of commands has a
/// tick for each switch.
fn drift_clocks(session: &RigSession, knobs: &[Knob]) -> Vec<(usize, Vec<u32>)> {
    let trials = &session.trials;
    let switches = || trials.iter().flat_map(|t| timing::switches(&t.inlet, &t.outlet)).collect();
    let open = || trials.iter().flat_map(|t| last_open(&t.inlet)).collect();
    let clock = |(i, knob): (usize, &Knob)| match knob {
        Knob::Rig(Key::PS) => Some((i, open())),
        Knob::Lead(_) => Some((i, switches())),
        _ => None,
    };
    knobs.iter().enumerate().filter_map(clock).collect()
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

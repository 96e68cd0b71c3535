//! The facts of a rig's recording that a diagnosis takes in addition to stages, parameters, effects and trials.

use std::ops::Range;

use stretch_calibrate::PRESSURE;
use stretch_gap::{MotionSpec, ParameterSpec, RecordFacts, Recorded};
use stretch_sim::{Key, RigStage};

use super::{
    nominal::TunedParameter,
    record_columns::record_columns,
    session::{Inputs, LENGTH, VALVES},
    timing,
};
use crate::bench::{Bench, columns::Columns};

/// The facts of a session.
pub(super) fn facts(
    Bench { about, columns, sensor, .. }: &Bench,
    inputs: &Inputs,
    (stage_kinds, tuned): (&[RigStage], &[TunedParameter]),
) -> RecordFacts {
    RecordFacts {
        is_lost: columns.is_lost.clone(),
        rows_used: Some(columns.rows_used()),
        motion: Some(MotionSpec {
            values: columns.all(LENGTH).to_vec(),
            unit: "mm".into(),
            falling: "inflation".into(),
            rising: "deflation".into(),
        }),
        signals: signals(inputs),
        columns: record_columns(about, stage_kinds),
        sensor: Some(*sensor),
        command_timing: command_timing(columns.dt_s, tuned),
        drift_clocks: drift_clocks(columns, tuned),
        ..RecordFacts::default()
    }
}

/// The openings, and pressure and length smoothed as the stages see them.
fn signals(inputs: &Inputs) -> Vec<Recorded> {
    let command = |(name, values): (&str, &Vec<f64>)| Recorded {
        is_command: true,
        ..Recorded::measured(name, "1", values.clone())
    };
    let mut out: Vec<Recorded> = VALVES.into_iter().zip(&inputs.openings).map(command).collect();
    out.push(Recorded::measured(LENGTH, "mm", inputs.length.values()));
    let pressure = inputs.pressure.iter();
    out.extend(pressure.map(|own| Recorded::measured(PRESSURE, "kPa", own.values())));
    out
}

fn command_timing(dt_s: f64, tuned: &[TunedParameter]) -> Vec<(usize, ParameterSpec)> {
    if !timing::is_slow(dt_s) {
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
fn drift_clocks(columns: &Columns, tuned: &[TunedParameter]) -> Vec<(usize, Vec<u32>)> {
    let trials = || {
        let of = |range: &Range<usize>| VALVES.map(|name| &columns.all(name)[range.clone()]);
        columns.ranges.iter().map(of)
    };
    let switches =
        || trials().flat_map(|[inlet, outlet]| timing::switches(inlet, outlet)).collect();
    let open = || trials().flat_map(|[inlet, _]| last_open(inlet)).collect();
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

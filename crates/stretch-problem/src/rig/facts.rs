//! The facts of a rig's recording that a diagnosis takes in addition to stages, parameters, effects and trials.

use std::{borrow::Cow, ops::Range};

use stretch_calibrate::PRESSURE;
use stretch_gap::{
    Column, Description, Distortion, MotionSpec, ParameterSpec, RecordFacts, Recorded,
};
use stretch_sim::{Key, RigStage};

use super::{
    RigSimulator,
    nominal::TunedParameter,
    session::{Inputs, LENGTH, VALVES},
    timing,
};
use crate::bench::{Bench, columns::Columns, skew_of};

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

/// Name of the column that replaces both openings.
const COMMANDS: &str = "inlet, outlet";

/// Range of the delays of the voltage if the catalogue has no skew, s.
const SKEW_S: [f64; 2] = [-0.1, 0.2];

/// The columns of a recording, and the stages that each column drives.
fn record_columns(about: &Description, stage_kinds: &[RigStage]) -> Vec<Column<'static>> {
    // The start of a trial is read from the pressure, or from the length if there is no pressure.
    let reads = |stages: [RigStage; 2]| -> Vec<usize> {
        (0..stage_kinds.len()).filter(|&i| stages.contains(&stage_kinds[i])).collect()
    };
    let skew_s = skew_of(about, SKEW_S);
    let output = |(stage, kind): (usize, &RigStage)| {
        let (read_by, skew_s, hint) = match kind {
            RigStage::Pneumatics => (
                reads([RigStage::Pneumatics, RigStage::Muscle]),
                [0.0; 2],
                "the pressure gauge, its scale and its zero",
            ),
            RigStage::Sensing => (
                Vec::new(),
                skew_s,
                "the bridge's wires, the amplifier and the scale of its converter",
            ),
            _ => (
                reads([RigStage::Actuation, RigStage::Sensing]),
                [0.0; 2],
                "the potentiometer, its scale and its zero, and L0 in the rig file",
            ),
        };
        Column {
            read_by,
            skew_s,
            hint: Cow::Borrowed(hint),
            ..Column::output(stage, &about.spec().stages[stage])
        }
    };
    let commanded =
        |&i: &usize| matches!(stage_kinds[i], RigStage::Pneumatics | RigStage::Actuation);
    let commands = Column {
        name: Cow::Borrowed(COMMANDS),
        unit: Cow::Borrowed("1"),
        output_of: None,
        read_by: (0..stage_kinds.len()).filter(commanded).collect(),
        is_command: true,
        hint: Cow::Borrowed(
            "the scale on which commands are written, the valves' supply, and the volume and the conductances in the rig file",
        ),
        ..Column::output(0, &about.spec().stages[0])
    };
    stage_kinds.iter().enumerate().map(output).chain([commands]).collect()
}

impl RigSimulator {
    /// The rig on inputs in which one column is corrected; `None` if the column drives no stage.
    /// The measured outputs stay as they are.
    pub(super) fn with_corrected(&self, column: &str, error: Distortion) -> Option<Self> {
        let names: &[&str] = match column {
            PRESSURE => &[PRESSURE],
            LENGTH => &[LENGTH],
            COMMANDS => &VALVES,
            _ => return None,
        };
        let mut columns = self.bench.columns.clone();
        for (name, values) in columns.names.iter().zip(&mut columns.values) {
            if !names.contains(&name.as_str()) {
                continue;
            }
            for range in &columns.ranges {
                let own = &mut values[range.clone()];
                own.copy_from_slice(&error.undone(own, columns.dt_s));
            }
            if column == COMMANDS {
                // An opening stays between shut (0) and open (1).
                values.iter_mut().for_each(|opening| *opening = opening.clamp(0.0, 1.0));
            }
        }
        let (corrected, supply_kpa) = ((column, error.scale.abs()), 1e-3 * self.base[Key::PS]);
        let inputs = Inputs::of(&columns, &self.noises, Some(corrected), supply_kpa);
        Some(Self { inputs, ..self.clone() })
    }
}

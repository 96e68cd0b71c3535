//! Facts about the recording of a gauge alone.

use std::borrow::Cow;

use stretch_data::unit_of;
use stretch_gap::{Column, MotionSpec, RecordFacts, Recorded};

use super::session::{REFERENCE, pressure};
use crate::bench::{Bench, skew_of};

/// Range of the delays between two recorders that were not started together, s; used if the
/// catalogue has no skew.
const SKEW_S: [f64; 2] = [-1.0, 1.0];

/// The facts about a recording; `driving` is the smoothed reference that drives the gauge, all
/// trials concatenated.
pub(super) fn facts(Bench { about, columns, .. }: &Bench, driving: Vec<f64>) -> RecordFacts {
    let (name, values) = (&columns.names[REFERENCE], &columns.values[REFERENCE]);
    let unit = unit_of(name);
    let mut signals = vec![Recorded::measured(name, &unit, driving)];
    let pressure = pressure(columns);
    if !pressure.is_empty() {
        signals.push(Recorded::measured("pressure_kpa", "kPa", pressure.to_vec()));
    }
    let signal = Column {
        skew_s: skew_of(about, SKEW_S),
        hint: Cow::Borrowed("the gauge, its wires and its amplifier"),
        ..Column::output(0, &about.spec().stages[0])
    };
    let reference = Column {
        name: Cow::Owned(name.clone()),
        unit: Cow::Owned(unit.clone()),
        values: Cow::Owned(values.clone()),
        output_of: None,
        hint: Cow::Borrowed("the reference, its cable and its scale"),
        ..signal.clone()
    };
    RecordFacts {
        is_lost: columns.is_lost.clone(),
        gauge_alone: true,
        rows_used: Some(columns.rows_used()),
        motion: Some(MotionSpec::new(values.clone(), &unit)),
        signals,
        columns: vec![signal, reference],
        sensor: Some(0),
        // A straight line fits most signals of a gauge. If the line leaves half of the signal
        // unexplained, reference and signal are hardly related.
        gross_misfit_share: 0.5,
        ..RecordFacts::default()
    }
}

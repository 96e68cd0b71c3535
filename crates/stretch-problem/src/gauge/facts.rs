//! What is known of the record of a gauge alone.

use std::borrow::Cow;

use stretch_data::{unit, written_unit};
use stretch_gap::{Column, Description, MotionSpec, RecordFacts, Recorded, RowsUsed};

use super::record::Record;
use crate::{bench::specs::skew_of, rig::smooth::Smoothed};

/// Delays of two recorders that were not started together, without a catalogue, s.
const SKEW_S: [f64; 2] = [-1.0, 1.0];

/// The facts of a record with the column `reference`, of whose trials `inputs` are the references as they drive the gauge.
pub(super) fn facts(
    about: &Description,
    reference: &str,
    record: &Record,
    inputs: &[Smoothed],
) -> RecordFacts {
    RecordFacts {
        is_lost: record.is_lost.clone(),
        rows_used: Some(RowsUsed { used: record.rows.used(), read: record.rows.read }),
        motion: Some(MotionSpec::new(record.reference.clone(), unit_of(reference))),
        signals: signals(reference, record, inputs),
        columns: columns(about, reference, record),
        sensor: Some(0),
        // A line follows whatever it is fitted to; where it does not follow half of it, the two have little to do with each other.
        gross_misfit_share: 0.5,
        ..RecordFacts::default()
    }
}

/// The reference as it drives the gauge, and the pressure where it was recorded.
fn signals(reference: &str, record: &Record, inputs: &[Smoothed]) -> Vec<Recorded> {
    let driving = inputs.iter().flat_map(|s| &s.values).copied().collect();
    let mut out = vec![Recorded::measured(reference, unit_of(reference), driving)];
    if !record.pressure.is_empty() {
        out.push(Recorded::measured("pressure_kpa", "kPa", record.pressure.clone()));
    }
    out
}

/// The signal, and the reference that drives the gauge.
fn columns(about: &Description, name: &str, record: &Record) -> Vec<Column<'static>> {
    let signal = Column {
        skew_s: skew_of(about, SKEW_S),
        hint: Cow::Borrowed("the gauge, its wires and its amplifier"),
        ..Column::output(0, &about.stages[0])
    };
    let reference = Column {
        name: Cow::Owned(name.to_owned()),
        unit: Cow::Owned(unit_of(name).to_owned()),
        values: Cow::Owned(record.reference.clone()),
        output_of: None,
        hint: Cow::Borrowed("the reference, its cable and its scale"),
        ..signal.clone()
    };
    vec![signal, reference]
}

/// Unit of a column, empty where its name gives none.
pub(super) fn unit_of(column: &str) -> &str {
    unit(column).map_or("", written_unit)
}

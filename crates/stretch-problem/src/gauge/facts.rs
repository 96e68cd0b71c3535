//! Facts about the recording of a gauge alone.

use std::borrow::Cow;

use stretch_data::{unit, written_unit};
use stretch_gap::{Column, Description, MotionSpec, RecordFacts, Recorded, RowsUsed};

use super::session::GaugeSession;
use crate::{bench::specs::skew_of, rig::smooth::Smoothed};

/// Range of the delays between two recorders that were not started together, s; used if the
/// catalogue has no skew.
const SKEW_S: [f64; 2] = [-1.0, 1.0];

/// The facts about a session with the column `reference`; `inputs` are the smoothed references that
/// drive the gauge, one for each trial.
pub(super) fn facts(
    about: &Description,
    reference: &str,
    session: &GaugeSession,
    inputs: &[Smoothed],
) -> RecordFacts {
    RecordFacts {
        is_lost: session.is_lost.clone(),
        gauge_alone: true,
        rows_used: Some(RowsUsed { used: session.rows.used(), read: session.rows.read }),
        motion: Some(MotionSpec::new(session.reference.clone(), unit_of(reference))),
        signals: signals(reference, session, inputs),
        columns: columns(about, reference, session),
        sensor: Some(0),
        // A straight line fits most signals of a gauge. If the line leaves half of the signal
        // unexplained, reference and signal are hardly related.
        gross_misfit_share: 0.5,
        ..RecordFacts::default()
    }
}

/// The smoothed reference that drives the gauge, and the pressure if it was recorded.
fn signals(reference: &str, session: &GaugeSession, inputs: &[Smoothed]) -> Vec<Recorded> {
    let driving = inputs.iter().flat_map(|s| &s.values).copied().collect();
    let mut out = vec![Recorded::measured(reference, unit_of(reference), driving)];
    if !session.pressure.is_empty() {
        out.push(Recorded::measured("pressure_kpa", "kPa", session.pressure.clone()));
    }
    out
}

/// The signal, and the reference that drives the gauge.
fn columns(about: &Description, name: &str, session: &GaugeSession) -> Vec<Column<'static>> {
    let signal = Column {
        skew_s: skew_of(about, SKEW_S),
        hint: Cow::Borrowed("the gauge, its wires and its amplifier"),
        ..Column::output(0, &about.stages[0])
    };
    let reference = Column {
        name: Cow::Owned(name.to_owned()),
        unit: Cow::Owned(unit_of(name).to_owned()),
        values: Cow::Owned(session.reference.clone()),
        output_of: None,
        hint: Cow::Borrowed("the reference, its cable and its scale"),
        ..signal.clone()
    };
    vec![signal, reference]
}

/// Unit of a column, empty if the column's name gives none.
pub(super) fn unit_of(column: &str) -> &str {
    unit(column).map_or("", written_unit)
}

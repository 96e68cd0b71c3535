//! The columns of a gauge alone.

use std::borrow::Cow;

use stretch_gap::Column;

use super::{GaugeSimulator, unit_of};
use crate::bench::specs::skew_of;

/// Delays of two recorders that were not started together, without a catalogue, s.
const SKEW_S: [f64; 2] = [-1.0, 1.0];

impl GaugeSimulator {
    /// The signal, and the reference that drives it.
    pub(super) fn record_columns(&self) -> Vec<Column<'_>> {
        let signal = Column {
            skew_s: skew_of(&self.about, SKEW_S),
            hint: Cow::Borrowed("the gauge, its wires and its amplifier"),
            ..Column::output(0, &self.about.stages[0], &self.record.signal)
        };
        let reference = Column {
            name: Cow::Borrowed(&self.reference),
            unit: Cow::Borrowed(unit_of(&self.reference)),
            values: Cow::Borrowed(&self.record.reference),
            output_of: None,
            hint: Cow::Borrowed("the reference, its cable and its scale"),
            ..signal.clone()
        };
        vec![signal, reference]
    }
}

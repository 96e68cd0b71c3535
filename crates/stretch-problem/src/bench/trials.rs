//! Trials on one even grid: their description for a diagnosis, and their samples end to end.

use std::ops::Range;

use stretch_data::{EvenSession, EvenTrial};
use stretch_gap::{SampleRoles, TrialSpec};

/// The trials of a session as a diagnosis takes them.
pub(crate) fn specs(session: &EvenSession) -> Vec<TrialSpec> {
    let spec = |trial: &EvenTrial| TrialSpec {
        name: trial.name().to_owned(),
        samples: trial.columns()[0].len(),
        start_s: trial.start_s(),
        is_test: trial.is_test(),
    };
    session.trials().iter().map(spec).collect()
}

/// A column of a session, all trials end to end; empty if there is no such column.
pub(crate) fn column(session: &EvenSession, column: usize) -> Vec<f64> {
    session.trials().iter().filter_map(|t| t.columns().get(column)).flatten().copied().collect()
}

/// Ranges of the samples outside the test samples.
pub(crate) fn looked_at(trials: &[TrialSpec]) -> Vec<Range<usize>> {
    let parts = TrialSpec::ranges(trials).into_iter().zip(SampleRoles::not_tested(trials));
    parts.map(|(all, fit)| all.start..all.start + fit).filter(|r| !r.is_empty()).collect()
}

/// Time from the first to the last sample of a session, s.
pub(crate) fn session_s(trials: &[TrialSpec], dt_s: f64) -> f64 {
    let end_s = |t: &TrialSpec| t.start_s + t.samples as f64 * dt_s;
    let begun_s = trials.first().map_or(0.0, |t| t.start_s);
    trials.last().map_or(0.0, end_s) - begun_s
}

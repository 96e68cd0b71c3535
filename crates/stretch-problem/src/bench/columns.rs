//! Recorded columns on one grid, and the samples outside the test samples.

use std::ops::Range;

use stretch_data::{EvenSession, EvenTrial, Rows, SessionTrial, Split, ends};
use stretch_gap::{RowsUsed, SampleRoles, TrialSpec};

use crate::{
    bench::{isolated_outliers::replace_isolated_outliers, shortened::shortened},
    black_box::{StageEntry, velocity::of_position},
    error::ProblemError,
};

/// Bounds of the least number of samples of a part of a trial. The least number is the number of samples in five
/// seconds, limited to these bounds. Shorter parts are left out.
const SHORTEST: [usize; 2] = [20, 50];
const SHORTEST_S: f64 = 5.0;

/// Parts with fewer samples are left out if the simulator is built in.
const SHORTEST_BUILT_IN: usize = 100;
/// Smallest number of samples to fit if the simulator is built in.
const LEAST: usize = 300;

/// Returns the least number of samples of a part, from the sample rate of the trials.
pub(crate) fn shortest(trials: &[SessionTrial]) -> usize {
    let rate_hz = trials.iter().find_map(|t| t.trial.rate_hz()).unwrap_or(f64::INFINITY);
    ((SHORTEST_S * rate_hz) as usize).clamp(SHORTEST[0], SHORTEST[1])
}

/// Columns of all trials, concatenated.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    pub(crate) names: Vec<String>,
    pub(crate) values: Vec<Vec<f64>>,
    /// For each column, the period at which it wrapped (a full turn), if it did; the values are
    /// unwrapped.
    turns: Vec<Option<f64>>,
    pub(crate) trials: Vec<TrialSpec>,
    /// Range of samples of every trial.
    pub(crate) ranges: Vec<Range<usize>>,
    /// For each trial, the index of the recording that contains it.
    pub(crate) sources: Vec<usize>,
    pub(crate) is_lost: Vec<bool>,
    pub(crate) dt_s: f64,
    rows: Rows,
    pub(crate) notes: Vec<String>,
    /// What may be wrong with the recording, in sentences.
    pub(crate) doubts: Vec<String>,
}

impl Columns {
    /// Brings columns of trials onto one even grid. Parts of fewer than `shortest` samples are left out.
    pub(crate) fn even(
        trials: &[SessionTrial],
        names: Vec<String>,
        shortest: usize,
    ) -> Result<Self, ProblemError> {
        let asked: Vec<&str> = names.iter().map(String::as_str).collect();
        let session = EvenSession::new(trials, &asked, shortest)?;
        let each = || session.trials().iter();
        let column = |at: usize| each().flat_map(|t| &t.columns()[at]).copied().collect();
        let spec = |t: &EvenTrial| {
            TrialSpec::new(t.name(), t.columns()[0].len(), t.start_s(), t.is_test())
        };
        let trials: Vec<TrialSpec> = each().map(spec).collect();
        Ok(Self {
            values: (0..names.len()).map(column).collect(),
            names,
            turns: session.turns().to_vec(),
            ranges: TrialSpec::ranges(&trials),
            trials,
            sources: each().map(EvenTrial::source).collect(),
            is_lost: each().flat_map(EvenTrial::is_lost).copied().collect(),
            dt_s: session.dt_s(),
            rows: session.rows(),
            notes: session.notes().to_vec(),
            doubts: Vec::new(),
        })
    }

    /// Reads the columns of a simulator with this number of `outputs`. The trials are brought onto one even grid,
    /// without parts of fewer than `shortest` samples. Recordings that are too long are cut, and isolated outliers of
    /// the columns of `sensors` are replaced before, because the grid would spread an outlier over its neighbours.
    ///
    /// # Errors
    /// Columns that are missing, trials of different rates or of no plausible rate, and no trial that may be fitted.
    pub(crate) fn read(
        trials: &[SessionTrial],
        names: Vec<String>,
        sensors: &[&str],
        outputs: usize,
        shortest: usize,
    ) -> Result<Self, ProblemError> {
        let (mut trials, cut) = shortened(trials, outputs)?;
        let outliers = match sensors {
            [] => Vec::new(),
            _ => replace_isolated_outliers(trials.to_mut(), sensors),
        };
        let mut columns = Self::even(&trials, names, shortest)?;
        if !trials.is_empty() && trials.iter().all(|t| t.split == Split::Test) {
            let hint = "give at least one trial that is not a test trial";
            return Err(ProblemError::too_little("there is no trial to fit", hint));
        }
        if columns.trials.is_empty() {
            return Err(ProblemError::value(
                "recordings",
                format!("no trial has {shortest} samples in a row"),
                "record at least 10 s to fit and 5 s to test on, without gaps",
            ));
        }
        // A sample time outside of these limits means that the time stamps are in another unit.
        if !(1e-7..=1e3).contains(&columns.dt_s) {
            let hint = "rates from 0.001 to 10 000 000 Hz are understood; is the time in seconds?";
            let found = format!("a sample every {} s", columns.dt_s);
            return Err(ProblemError::value("time_s", found, hint));
        }
        columns.notes.splice(0..0, cut);
        columns.notes.extend(outliers);
        Ok(columns)
    }

    /// Columns of a simulator that is built in. Samples that gaps leave [`undetermined`] are marked as lost, too.
    /// `by_motion` states whether a part behind a gap depends on the motion before it.
    ///
    /// # Errors
    /// As [`Columns::read`], and too few samples to fit.
    pub(crate) fn built_in(
        trials: &[SessionTrial],
        names: Vec<String>,
        sensors: &[&str],
        outputs: usize,
        by_motion: bool,
    ) -> Result<Self, ProblemError> {
        let mut columns = Self::read(trials, names, sensors, outputs, SHORTEST_BUILT_IN)?;
        for (trial, range) in columns.ranges.iter().enumerate() {
            let is_lost = &columns.is_lost[range.clone()];
            let marked = match by_motion && columns.goes_on(trial) {
                true => undetermined_behind_gap(is_lost, columns.dt_s),
                false => undetermined(is_lost),
            };
            columns.is_lost[range.clone()].copy_from_slice(&marked);
        }
        let samples: usize = columns.fitted().map(|r| r.len()).sum();
        if samples < LEAST {
            return Err(ProblemError::too_little(
                format!("the trials to fit have {samples} samples"),
                format!("at least {LEAST} are needed for a diagnosis"),
            ));
        }
        Ok(columns)
    }

    /// Whether a trial continues the trial before it after a gap.
    pub(crate) fn goes_on(&self, trial: usize) -> bool {
        trial.checked_sub(1).is_some_and(|before| self.sources[before] == self.sources[trial])
    }

    /// Numbers of rows that are used and that were read.
    pub(crate) fn rows_used(&self) -> RowsUsed {
        RowsUsed { used: self.rows.used(), read: self.rows.read }
    }

    /// Time from the first to the last sample of the session, s.
    pub(crate) fn session_s(&self) -> f64 {
        let end_s = |t: &TrialSpec| t.start_s + t.samples as f64 * self.dt_s;
        let begun_s = self.trials.first().map_or(0.0, |t| t.start_s);
        self.trials.last().map_or(0.0, end_s) - begun_s
    }

    /// The values of a column; none if there is no such column.
    pub(crate) fn all(&self, name: &str) -> &[f64] {
        self.of(name).unwrap_or(&[])
    }

    /// Smallest and largest of some values outside the test samples.
    pub(crate) fn range(&self, values: &[f64]) -> (f64, f64) {
        ends(self.looked_at().into_iter().flat_map(|range| &values[range]))
    }

    pub(crate) fn of(&self, name: &str) -> Option<&[f64]> {
        let at = self.names.iter().position(|n| n == name)?;
        Some(&self.values[at])
    }

    /// The period at which a column wrapped.
    pub(crate) fn turn_of(&self, name: &str) -> Option<f64> {
        self.turns[self.names.iter().position(|n| n == name)?]
    }

    /// In each trial, shifts every column that wrapped by a multiple of a whole turn. A column begins as near as
    /// possible to 0, where simulators begin. If an input or the position of a stage wraps at the same period as its
    /// output, it begins as near as possible to the output instead, because noise decides on which side of the jump
    /// each of them begins.
    pub(crate) fn choose_turns(&mut self, stages: &[StageEntry]) {
        let shift = |values: &mut [f64], to: f64, turn: f64| {
            let turns = turn * values.first().map_or(0.0, |x| ((x - to) / turn).round());
            values.iter_mut().for_each(|x| *x -= turns);
        };
        let index = |names: &[String], name: &String| names.iter().position(|n| n == name);
        for range in self.ranges.clone() {
            for (values, turn) in self.values.iter_mut().zip(&self.turns) {
                turn.iter().for_each(|turn| shift(&mut values[range.clone()], 0.0, *turn));
            }
            for stage in stages {
                let Some(output) = index(&self.names, &stage.output) else { continue };
                let Some(turn) = self.turns[output] else { continue };
                let begin = self.values[output][range.start];
                let beside = stage.inputs.iter().chain(&stage.position);
                for at in beside.filter_map(|name| index(&self.names, name)) {
                    if self.turns[at] == Some(turn) {
                        shift(&mut self.values[at][range.clone()], begin, turn);
                    }
                }
            }
        }
        let still: Vec<String> =
            stages.iter().flat_map(|stage| self.still_wrapped(stage)).collect();
        self.notes.extend(still);
    }

    /// Returns a note for each input of a stage that may wrap as its output does, but was not unwrapped because it also
    /// has other large steps.
    fn still_wrapped(&self, stage: &StageEntry) -> Vec<String> {
        let Some(turn) = self.turn_of(&stage.output) else { return Vec::new() };
        let is_wrapped = |name: &&String| {
            let Some(values) = self.of(name).filter(|_| self.turn_of(name).is_none()) else {
                return false;
            };
            let (low, high) = ends(values);
            high - low <= 1.01 * turn && values.windows(2).any(|w| (w[1] - w[0]).abs() > 0.9 * turn)
        };
        let note = |name: &String| {
            format!(
                "{name} jumps by nearly a full turn and is not unwrapped, because it also has other large steps; {} is unwrapped: if {name} \
                 wraps, unwrap it before the diagnosis",
                stage.output
            )
        };
        stage.inputs.iter().filter(is_wrapped).map(note).collect()
    }

    /// Trials that come from recordings with an index of at least `first`.
    pub(crate) fn sources_from(&self, first: usize) -> Vec<usize> {
        (0..self.sources.len()).filter(|trial| self.sources[*trial] >= first).collect()
    }

    /// Greatest rate of a signal outside the test samples, per second.
    pub(crate) fn fastest(&self, values: &[f64]) -> f64 {
        let rates = of_position(values, &self.ranges, self.dt_s);
        self.fitted().flat_map(|range| &rates[range]).fold(0.0, |a, rate| rate.abs().max(a))
    }

    /// Range of the samples of every trial outside the test samples; empty for a test trial.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = Range<usize>> {
        let parts = self.ranges.iter().zip(SampleRoles::not_tested(&self.trials));
        parts.map(|(all, fit)| all.start..all.start + fit)
    }

    /// Ranges of the samples outside the test samples.
    pub(crate) fn looked_at(&self) -> Vec<Range<usize>> {
        self.fitted().filter(|range| !range.is_empty()).collect()
    }
}

/// Greatest number of lost samples in a row that a straight line bridges well.
const SHORT: usize = 3;
/// Number of samples before a longer gap that are smoothed together with samples in the gap.
const BEFORE: usize = 3;

/// Marks lost samples. Around a gap of more than three samples, it also marks the three samples
/// before the gap and as many samples after the gap as were lost, because these depend on values
/// that were not measured. This assumes that the memory of a stage is shorter than the gap.
fn undetermined(is_lost: &[bool]) -> Vec<bool> {
    let mut out = is_lost.to_vec();
    let mut from = 0;
    for stretch in is_lost.chunk_by(|a, b| a == b) {
        let to = from + stretch.len();
        if stretch[0] && stretch.len() > SHORT {
            let end = (to + stretch.len()).min(out.len());
            out[from.saturating_sub(BEFORE)..end].fill(true);
        }
        from = to;
    }
    out
}

/// Time for which a part of a trial that begins during a motion depends on the motion before it, s:
/// a few time constants of a muscle.
const AMID_S: f64 = 1.0;

/// Marks samples as [`undetermined`] does in a part of a trial that follows a gap. It also marks
/// the first second of the part, because the motion during the gap still acts there.
fn undetermined_behind_gap(is_lost: &[bool], dt_s: f64) -> Vec<bool> {
    let mut out = undetermined(is_lost);
    let amid = ((AMID_S / dt_s) as usize).min(out.len());
    out[..amid].fill(true);
    out
}

#[cfg(test)]
mod tests {
    use super::{undetermined, undetermined_behind_gap};

    #[test]
    fn a_part_begins_with_a_second_that_counts_for_nothing() {
        let open: Vec<bool> = undetermined_behind_gap(&[false; 250], 0.01);
        assert!(open[..100].iter().all(|o| *o) && !open[100..].iter().any(|o| *o));
        assert_eq!(undetermined_behind_gap(&[false; 2], 0.01), [true; 2]);
    }

    #[test]
    fn a_long_gap_leaves_as_many_samples_open_behind_it() {
        let mut lost = vec![false; 40];
        lost[5] = true;
        lost[20..25].fill(true);
        let open: Vec<usize> =
            undetermined(&lost).iter().enumerate().filter(|(_, o)| **o).map(|(i, _)| i).collect();
        assert_eq!(open, [[5].as_slice(), &(17..30).collect::<Vec<_>>()].concat());
    }
}

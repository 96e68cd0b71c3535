//! The measured trials of a gauge alone: two columns, evenly sampled, and notes on the trials.

use std::ops::Range;

use stretch_calibrate::PRESSURE;
use stretch_data::{EvenSession, Rows, SessionTrial, ends, unit};
use stretch_gap::{Noise, TrialSpec};

use crate::{
    bench::{
        shortened::shortened,
        trials::{column, looked_at, specs},
        undetermined::undetermined,
    },
    error::{ProblemError, check_rate},
};

/// Smallest number of samples to fit.
const LEAST: usize = 300;
/// Parts of a trial with fewer samples are left out.
const SHORTEST: usize = 100;

/// The measured session of a gauge alone; columns hold all trials end to end.
#[derive(Debug)]
pub(super) struct GaugeSession {
    pub(super) trials: Vec<TrialSpec>,
    pub(super) reference: Vec<f64>,
    pub(super) signal: Vec<f64>,
    /// Empty unless every trial has a pressure column.
    pub(super) pressure: Vec<f64>,
    pub(super) is_lost: Vec<bool>,
    pub(super) dt_s: f64,
    pub(super) rows: Rows,
    pub(super) notes: Vec<String>,
}

impl GaugeSession {
    /// Reads two columns of some trials, and the pressure if every trial has one.
    ///
    /// # Errors
    /// Columns that are missing, dead or hold values that are not numbers, rates that differ, too
    /// little to fit.
    pub(super) fn read(
        trials: &[SessionTrial],
        reference: &str,
        signal: &str,
    ) -> Result<Self, ProblemError> {
        let (trials, cut) = shortened(trials, 1)?;
        let mut columns = vec![reference, signal];
        if trials.iter().all(|t| t.trial.channel(PRESSURE).is_some()) {
            columns.push(PRESSURE);
        }
        let session = EvenSession::new(&trials, &columns, SHORTEST)?;
        check_rate(session.dt_s())?;
        let mut own = Self {
            trials: specs(&session),
            reference: column(&session, 0),
            signal: column(&session, 1),
            pressure: column(&session, 2),
            is_lost: session.trials().iter().flat_map(|t| undetermined(t.is_lost())).collect(),
            dt_s: session.dt_s(),
            rows: session.rows(),
            notes: cut.into_iter().chain(session.notes().iter().cloned()).collect(),
        };
        own.check(reference, signal)?;
        Ok(own)
    }

    /// Ranges of the samples outside the test samples.
    pub(super) fn fitted(&self) -> impl Iterator<Item = Range<usize>> {
        looked_at(&self.trials).into_iter()
    }

    /// Smallest and largest value of a column over the trials that are fitted.
    pub(super) fn range(&self, values: &[f64]) -> (f64, f64) {
        ends(self.fitted().flat_map(|r| &values[r]))
    }

    /// Noise of a column from the median of its second differences in the trials that are fitted.
    pub(super) fn noise(&self, values: &[f64]) -> Noise {
        Noise::of_differences(self.fitted().map(|r| &values[r]), self.dt_s)
    }

    fn check(&mut self, reference: &str, signal: &str) -> Result<(), ProblemError> {
        let samples: usize = self.fitted().map(|r| r.len()).sum();
        if samples < LEAST {
            return Err(ProblemError::few_samples(samples, LEAST));
        }
        if reference == "bridge_v" || signal == "length_mm" {
            let column = format!("--reference {reference}, --signal {signal}");
            let hint =
                "exchange them: the reference is the length, the signal is the output of the gauge";
            return Err(ProblemError::value(column, "the two look swapped", hint));
        }
        let mut shares = Vec::new();
        for (name, values) in [(reference, &self.reference), (signal, &self.signal)] {
            let (low, high) = self.range(values);
            if high <= low {
                return Err(ProblemError::dead(name, format!("{low} in every sample")));
            }
            shares.push(self.noise(values).sd() / (high - low));
        }
        let mut notes = Vec::new();
        if shares[0] > 3.0 * shares[1] {
            notes.push(format!(
                "{reference} is noisier than {signal}, each compared with its own range: are reference and signal swapped?"
            ));
        }
        for (name, values) in [(reference, &self.reference), (signal, &self.signal)] {
            let (low, high) = self.range(values);
            if unit(name) == Some("mm") && high.abs().max(low.abs()) < 1.0 {
                notes.push(format!(
                    "{name} goes from {low} to {high}: this looks like metres; the verdict does not depend on it"
                ));
            }
            for (end, which) in [(low, "least"), (high, "greatest")] {
                let share = self.standing(values, end);
                if share > 0.01 {
                    notes.push(format!(
                        "{name} is at its {which} value, {end}, in {:.1} % of the samples: if this is a limit of its converter, all \
                         values beyond it are lost",
                        100.0 * share
                    ));
                }
            }
        }
        self.notes.append(&mut notes);
        Ok(())
    }

    /// Share of the samples that have the value `end`, in sequences of at least five such samples.
    fn standing(&self, values: &[f64], end: f64) -> f64 {
        let (mut count, mut all) = (0, 0);
        for range in self.fitted() {
            all += range.len();
            let rows = values[range].chunk_by(|a, b| (*a == end) == (*b == end));
            count += rows.filter(|r| r[0] == end && r.len() >= 5).map(<[f64]>::len).sum::<usize>();
        }
        count as f64 / all.max(1) as f64
    }
}

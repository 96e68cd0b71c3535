//! Several signals and a reference on an even time grid. Calibrations of many channels and priors (distributions learnt
//! from earlier sessions) are fitted to these.

use stretch_calibrate::{
    CalibrateError, MOST_ROWS,
    toolkit::{SETTLE, States, check_rate, even, extent, sample_rate_hz},
};
use stretch_core::SampleRate;
use stretch_data::{Trial, check_rows};
use stretch_metrics::{Agreement, Pair};

use crate::{MAX_CHANNELS, SleeveError};

use super::bank::{BANK, Bank};

/// Channels are copies if their absolute correlation differs from one by less than this.
const COPY: f64 = 1e-9;

/// A stretch of a trial without gaps in time.
pub(crate) struct Stretch {
    pub(crate) trial: usize,
    pub(crate) signals: Vec<Vec<f64>>,
    pub(crate) states: Vec<States>,
    pub(crate) reference: Vec<f64>,
}

impl Stretch {
    pub(crate) fn len(&self) -> usize {
        self.reference.len()
    }

    /// Returns the states of each channel at a sample.
    pub(crate) fn at(&self, sample: usize) -> impl Iterator<Item = &[f64]> {
        self.states.iter().map(move |states| states.at(sample))
    }

    /// Returns the samples after the warm-up, which is excluded because the low-passes still depend on their initial
    /// values.
    pub(crate) fn warmed_up(&self) -> std::ops::Range<usize> {
        SETTLE.min(self.len())..self.len()
    }
}

/// Trials with several signals.
pub(crate) struct Channels {
    pub(crate) sample_rate: SampleRate,
    pub(crate) stretches: Vec<Stretch>,
    pub(crate) notes: Vec<String>,
}

impl Channels {
    pub(crate) fn new(
        trials: &[Trial],
        signals: &[String],
        reference: &str,
    ) -> Result<Self, SleeveError> {
        if signals.is_empty() || signals.len() > MAX_CHANNELS {
            return Err(SleeveError::Channels { asked: signals.len(), most: MAX_CHANNELS });
        }
        let first = trials.first().ok_or(CalibrateError::NoTrials)?;
        // Each signal adds its states to a row, so more signals allow fewer rows.
        check_rows(trials, MOST_ROWS / signals.len()).map_err(CalibrateError::from)?;
        let sample_rate = SampleRate::new(sample_rate_hz(first)?)?;
        let mut all = Self { sample_rate, stretches: Vec::new(), notes: Vec::new() };
        for (index, trial) in trials.iter().enumerate() {
            all.take(index, trial, signals, reference, &first.name)?;
        }
        if all.stretches.is_empty() {
            return Err(CalibrateError::too_short(first).into());
        }
        all.check(signals)?;
        Ok(all)
    }

    /// Reads signals without a reference. The first signal is used in place of the reference.
    pub(crate) fn without_reference(
        trials: &[Trial],
        signals: &[String],
    ) -> Result<Self, SleeveError> {
        Self::new(trials, signals, signals.first().map_or("", String::as_str))
    }

    fn take(
        &mut self,
        index: usize,
        trial: &Trial,
        signals: &[String],
        reference: &str,
        first: &str,
    ) -> Result<(), SleeveError> {
        check_rate(trial, first, self.sample_rate)?;
        let (trial, note) = without_an_open_end(trial, reference)?;
        self.notes.extend(note);
        let mut columns: Vec<&str> = signals.iter().map(String::as_str).collect();
        columns.push(reference);
        let even = even(&trial, &columns, signals.len(), self.sample_rate)?;
        self.notes.extend(even.rows.note());
        self.notes.extend(even.gaps.into_iter().chain(even.notes));
        let period_s = self.sample_rate.period_s();
        for mut part in even.parts {
            let Some(reference) = part.columns.pop() else { continue };
            let signals = part.columns;
            let states = signals.iter().map(|signal| BANK.states(signal, period_s)).collect();
            self.stretches.push(Stretch { trial: index, signals, states, reference });
        }
        Ok(())
    }

    /// Refuses channels that never change and channels that are copies.
    fn check(&self, signals: &[String]) -> Result<(), SleeveError> {
        for (k, column) in signals.iter().enumerate() {
            let range = extent(self.signal(k));
            if range.min >= range.max {
                let (column, value) = (column.clone(), range.min);
                return Err(CalibrateError::Constant { column, value }.into());
            }
        }
        for a in 0..signals.len() {
            for b in 0..a {
                if 1.0 - correlation(self.signal(a), self.signal(b)).abs() < COPY {
                    let (first, second) = (signals[b].clone(), signals[a].clone());
                    return Err(SleeveError::Copies { first, second });
                }
            }
        }
        Ok(())
    }

    /// Returns each stretch with the number of samples in all previous stretches.
    pub(crate) fn placed(&self) -> impl Iterator<Item = (usize, &Stretch)> {
        let mut before = 0;
        self.stretches.iter().map(move |stretch| {
            let at = before;
            before += stretch.len();
            (at, stretch)
        })
    }

    /// All samples of a channel.
    pub(crate) fn signal(&self, channel: usize) -> impl Iterator<Item = f64> + Clone {
        self.stretches.iter().flat_map(move |s| s.signals[channel].iter().copied())
    }

    /// All samples of the reference.
    pub(crate) fn reference(&self) -> impl Iterator<Item = f64> + Clone {
        self.stretches.iter().flat_map(|s| s.reference.iter().copied())
    }

    /// Returns the bank (set of terms) whose states are scaled by their ranges in these data.
    pub(crate) fn bank(&self) -> Bank {
        let channels = self.stretches.first().map_or(0, |s| s.signals.len());
        let domain = |k: usize| BANK.domain(self.stretches.iter().map(move |s| &s.states[k]));
        Bank::new((0..channels).map(domain).collect())
    }
}

/// Returns a trial up to the last sample with a reference, and a note if there are samples after it.
fn without_an_open_end(
    trial: &Trial,
    reference: &str,
) -> Result<(Trial, Option<String>), SleeveError> {
    trial.check_lengths()?;
    let values = trial.require(reference)?;
    let last = values.iter().rposition(|x| x.is_finite()).map_or(0, |last| last + 1);
    if last == values.len() || last == 0 {
        return Ok((trial.clone(), None));
    }
    let mut cut = trial.clone();
    cut.time_s.truncate(last);
    cut.channels.iter_mut().for_each(|channel| channel.values.truncate(last));
    let end_s = cut.time_s.last().copied().unwrap_or_default();
    let note = format!(
        "{}: {reference} ends at {end_s:.2} s; the {} samples after it are not fitted",
        trial.name,
        values.len() - last
    );
    Ok((cut, Some(note)))
}

/// Returns Pearson's correlation of two equally long sequences; zero if one of them is constant.
pub(crate) fn correlation(a: impl Iterator<Item = f64>, b: impl Iterator<Item = f64>) -> f64 {
    let mut agreement = Agreement::new();
    for (truth, estimate) in a.zip(b) {
        agreement.push(Pair { truth, estimate });
    }
    agreement.correlation().unwrap_or(0.0)
}

/// Returns the equivalent number of independent values for correlated values, and the standard deviation of one value
/// from their variance about their mean.
///
/// Consecutive values are dependent if their correlation `r` is above zero. `n` of them are then equivalent to `n (1 -
/// r)/(1 + r)` independent values (Bayley and Hammersley, J. Roy. Stat. Soc. Suppl. 8 (1946) 184, for a process of
/// first order). Their mean and their variance are as accurate as if they were computed from this number of independent
/// values.
pub(crate) fn independent(count: f64, variance: f64, alike: f64) -> (f64, f64) {
    let independent = count * (1.0 - alike) / (1.0 + alike);
    (independent, (variance * independent / (independent - 1.0)).sqrt())
}

/// Statistics of consecutive values in stretches.
pub(crate) struct Levels {
    pub(crate) mean: f64,
    /// Mean squared deviation from the mean, divided by `count`.
    pub(crate) variance: f64,
    /// Correlation of neighbours.
    pub(crate) alike: f64,
    pub(crate) count: f64,
}

/// Returns the mean, variance and neighbour correlation of values in stretches; `None` without values.
pub(crate) fn levels(stretches: &[Vec<f64>]) -> Option<Levels> {
    let all: Vec<f64> = stretches.iter().flatten().copied().collect();
    let count = all.len() as f64;
    let mean = all.iter().sum::<f64>() / count;
    let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    let products: f64 = stretches
        .iter()
        .flat_map(|own| own.windows(2))
        .map(|pair| (pair[0] - mean) * (pair[1] - mean))
        .sum();
    let pairs: usize = stretches.iter().map(|own| own.len().saturating_sub(1)).sum();
    let alike = match pairs {
        0 => 0.0,
        pairs => products / pairs as f64 / variance,
    };
    (count > 0.0).then_some(Levels { mean, variance, alike, count })
}

//! Cross-validation of one model: its errors on parts of the trials that are left out of its fit in turn.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use stretch_core::{Calibration, Interval, Model};
use stretch_data::Trial;
use stretch_metrics::lag;
use stretch_receptor::Reading;

use crate::{
    CalibrateError, ModelKind, Options,
    fit::{Choice, TABLE_PARTS, calibrate_with},
    prepare::{LEAST_TRIALS, extent, fold_of, rows, sample_rate_hz},
};

use super::apply::each_reading;

/// Time on either side of a left-out part that is not fitted either, because neighbouring samples are correlated, s.
const GAP_S: f64 = 2.0;
/// Number of warm-up samples that are not evaluated.
const SETTLE: usize = 20;
/// Number of parts into which each trial is divided if there are few trials.
pub(crate) const PARTS: usize = 6;
/// Smallest movement of the reference in the opposite direction that counts as a reversal, as a share of its range.
const TURN: f64 = 0.1;
/// Number of reversals from which a trial counts as reversing.
const LEAST_TURNS: usize = 3;
const MAX_LAG_S: f64 = 0.5;

/// Returns whether a trial can distinguish memory from position, because it reverses at least three times.
fn reverses(reference: &[f64]) -> bool {
    let range = extent(reference.iter().copied());
    let turn = TURN * (range.max - range.min);
    if turn <= 0.0 {
        return false;
    }
    let (mut turns, mut rising, mut extreme) = (0, None, reference[0]);
    for &x in reference {
        let back = if rising == Some(true) { extreme - x } else { x - extreme };
        match rising {
            None if (x - extreme).abs() > turn => {
                rising = Some(x > extreme);
                extreme = x;
            }
            Some(up) if back > turn => {
                turns += 1;
                rising = Some(!up);
                extreme = x;
            }
            Some(up) => extreme = if up { extreme.max(x) } else { extreme.min(x) },
            None => {}
        }
    }
    turns >= LEAST_TURNS
}

/// Data that are left out together: a range of samples of some trials.
struct Fold {
    trials: Vec<usize>,
    samples: Range<usize>,
}

/// Result of the cross-validation of one model, from which [`choose_among`](crate::choose_among) chooses. It serialises
/// as JSON, so that separate processes can evaluate models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Number of parameters of the fit.
    pub(crate) parameters: usize,
    pub(crate) errors: Errors,
}

/// Errors of one model on all parts left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Errors {
    /// Mean squared error of each part left out; `None` if nothing was estimated.
    pub(crate) parts: Vec<Option<f64>>,
    /// Sum of squares and count for each kind of motion: arbitrary, pulses, ramps.
    kinds: [(f64, f64); 3],
    pub(crate) worst: f64,
    /// Number of samples that are not judged, because their signal is outside the range of the fit without them.
    pub(crate) not_judged: usize,
    /// Sum of the lags, in seconds, and their count.
    pub(crate) lag: (f64, f64),
}

/// Cross-validates one model as [`choose_model`](crate::choose_model) does.
///
/// # Errors
/// The errors of [`calibrate`](crate::calibrate).
pub fn judge_model(
    trials: &[Trial],
    options: &Options,
    kind: ModelKind,
) -> Result<Judged, CalibrateError> {
    let turning = turning(trials, options)?;
    let options = Options { model: kind, ..options.clone() };
    let (whole, choice): (_, Option<Choice>) = calibrate_with(trials, &options, None)?;
    let parameters = whole
        .fits
        .iter()
        .map(|fit| {
            let own = fit.orders.iter().find(|order| order.model == fit.model);
            own.map_or(fit.coefficients.len(), |order| order.terms)
        })
        .sum::<usize>()
        + if matches!(kind, ModelKind::Remembering { rest: true, .. }) { 3 } else { 0 };
    let mut errors = Errors::default();
    for fold in folds(trials, &options) {
        let rest = without(trials, &fold, &options);
        let (calibrated, _) = calibrate_with(&rest, &options, choice.clone())?;
        let fitted = fitted_range(&rest, &options)?;
        for &index in &fold.trials {
            let left_out = (&trials[index], fold.samples.clone());
            errors.take_trial(
                &calibrated.calibration,
                left_out,
                fitted,
                turning[index],
                &options,
            )?;
        }
    }
    Ok(Judged { parameters, errors })
}

/// Returns in which trials the reference reverses. In a table it never does, because the rows have no order.
pub(crate) fn turning(trials: &[Trial], options: &Options) -> Result<Vec<bool>, CalibrateError> {
    let one = |trial: &Trial| Ok(!options.is_table && reverses(trial.require(&options.reference)?));
    trials.iter().map(one).collect()
}

fn folds(trials: &[Trial], options: &Options) -> Vec<Fold> {
    if trials.len() >= LEAST_TRIALS {
        let all = || 0..trials.len();
        let last = all().map(fold_of).max().unwrap_or(0);
        let whole = |fold| Fold {
            trials: all().filter(|&trial| fold_of(trial) == fold).collect(),
            samples: 0..usize::MAX,
        };
        return (0..=last).map(whole).collect();
    }
    let parts = if options.is_table { TABLE_PARTS } else { PARTS };
    let cut = |trial: usize| {
        let samples = trials[trial].len();
        let parts = parts.min(samples);
        (0..parts).map(move |part| Fold {
            trials: vec![trial],
            samples: samples * part / parts..samples * (part + 1) / parts,
        })
    };
    (0..trials.len()).flat_map(cut).collect()
}

/// Returns the trials without a fold.
fn without(trials: &[Trial], fold: &Fold, options: &Options) -> Vec<Trial> {
    let mut rest = Vec::new();
    for (index, trial) in trials.iter().enumerate() {
        if !fold.trials.contains(&index) {
            rest.push(trial.clone());
            continue;
        }
        if options.is_table {
            let stays: Vec<bool> = (0..trial.len()).map(|i| !fold.samples.contains(&i)).collect();
            let mut part = rows(trial, &stays);
            // The rows of a table have no order, so none of them counts as lost.
            part.time_s = (0..part.len()).map(|i| i as f64).collect();
            rest.extend((!part.is_empty()).then_some(part));
            continue;
        }
        let gap = sample_rate_hz(trial).map_or(0, |hz| (GAP_S * hz) as usize);
        let Range { start, end } = fold.samples;
        for span in [0..start.saturating_sub(gap), end.saturating_add(gap)..trial.len()] {
            // A short remainder is not fitted, because the estimators would hardly warm up on it.
            if span.len() > 5 * SETTLE {
                let stays: Vec<bool> = (0..trial.len()).map(|i| span.contains(&i)).collect();
                rest.push(rows(trial, &stays));
            }
        }
    }
    rest
}

/// Returns the range of the fitted signal. Left-out samples beyond this range are not judged. A calibration to all data
/// would not clamp them, and clamping would favour a line, because it increases the error of a curve more. For a table,
/// there is no limit: see [`beyond_its_ends`].
fn fitted_range(fitted: &[Trial], options: &Options) -> Result<Interval, CalibrateError> {
    if options.is_table {
        return Ok(Interval { min: f64::NEG_INFINITY, max: f64::INFINITY });
    }
    let signals: Result<Vec<&[f64]>, _> =
        fitted.iter().map(|trial| trial.require(&options.signal)).collect();
    Ok(extent(signals?.into_iter().flatten().copied()))
}

/// Returns a line or a curve that is not clamped to the signals of its fit. If a table is fitted without its largest
/// weight, the estimate of that weight is an extrapolation. Its error shows how good the form of the model is.
fn beyond_its_ends(
    calibration: Calibration,
    signals: &[f64],
) -> Result<Calibration, CalibrateError> {
    let mut spec = calibration.into_spec();
    let all = extent(signals.iter().copied());
    match &mut spec.model {
        Model::Linear(line) => line.signal_domain = all,
        Model::Surfaces { inflation, deflation } => {
            (inflation.signal_domain, deflation.signal_domain) = (all, all);
        }
        _ => {}
    }
    Ok(Calibration::new(spec)?)
}

impl Errors {
    /// Returns the root mean square error over all parts.
    pub(crate) fn rmse(&self) -> Option<f64> {
        root_mean(self.kinds.iter().fold((0.0, 0.0), |(s, n), k| (s + k.0, n + k.1)))
    }

    /// Returns the root mean square error over arbitrary motion (0), pulses (1) or ramps (2).
    pub(crate) fn rmse_of(&self, kind: usize) -> Option<f64> {
        root_mean(self.kinds[kind])
    }

    /// Adds the errors of a calibration on samples of a trial to which it was not fitted.
    fn take_trial(
        &mut self,
        calibration: &Calibration,
        (trial, samples): (&Trial, Range<usize>),
        fitted: Interval,
        turns: bool,
        options: &Options,
    ) -> Result<(), CalibrateError> {
        let signals = trial.require(&options.signal)?;
        let reference = trial.require(&options.reference)?;
        let mut estimates = Vec::with_capacity(trial.len());
        let take = |reading: Result<Reading, _>| {
            estimates.push(reading.map_or(f64::NAN, |reading| reading.estimate));
        };
        match options.is_table {
            true => each_reading(&beyond_its_ends(calibration.clone(), signals)?, trial, take)?,
            false => each_reading(calibration, trial, take)?,
        };
        let period_s = 1.0 / sample_rate_hz(trial)?;
        let which = match (trial.name.contains("pulse"), turns) {
            (true, true) => 1,
            (false, true) => 0,
            (_, false) => 2,
        };
        let settle = if options.is_table { 0 } else { SETTLE };
        let end = samples.end.min(trial.len());
        let judged = samples.start.max(settle).min(end)..end;
        let is_fitted = |signal: &f64| (fitted.min..=fitted.max).contains(signal);
        let is_judged: Vec<bool> = signals[judged.clone()].iter().map(is_fitted).collect();
        self.take(&reference[judged.clone()], &estimates[judged], &is_judged, period_s, which);
        Ok(())
    }

    fn take(
        &mut self,
        truth: &[f64],
        estimate: &[f64],
        is_judged: &[bool],
        period_s: f64,
        which: usize,
    ) {
        let (mut sum, mut count) = (0.0, 0.0);
        for ((t, e), is_judged) in truth.iter().zip(estimate).zip(is_judged) {
            let error = (t - e).abs();
            self.not_judged += usize::from(!is_judged);
            if error.is_finite() && *is_judged {
                sum += error * error;
                count += 1.0;
                self.worst = self.worst.max(error);
            }
        }
        self.kinds[which].0 += sum;
        self.kinds[which].1 += count;
        self.parts.push((count > 0.0).then_some(sum / count));
        let most = ((MAX_LAG_S / period_s) as usize).min(truth.len() / 4);
        if which < 2
            && let Ok(found) = lag(truth, estimate, most)
            && !found.at_limit
        {
            self.lag.0 += found.samples * period_s;
            self.lag.1 += 1.0;
        }
    }
}

fn root_mean((sum, count): (f64, f64)) -> Option<f64> {
    (count > 0.0).then(|| (sum / count).sqrt())
}

/// Returns the mean difference of two models' squared errors over the parts, and its standard error. Each part counts
/// as one observation, independent of its length.
pub(crate) fn excess(parts: &[Option<f64>], best: &[Option<f64>]) -> Option<(f64, f64)> {
    let differences: Vec<f64> =
        parts.iter().zip(best).filter_map(|(a, b)| Some((*a)? - (*b)?)).collect();
    let n = differences.len() as f64;
    if n < 2.0 {
        return None;
    }
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Some((mean, (variance / n).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sample_is_left_out_once_in_few_folds() {
        let trial = Trial { name: String::new(), time_s: vec![0.0; 60], channels: Vec::new() };
        for (trials, most) in [(1, PARTS), (2, 2 * PARTS), (3, 3), (16, 16), (17, 16), (1000, 16)] {
            let folds = folds(&vec![trial.clone(); trials], &Options::default());
            assert!(folds.len() <= most, "{trials} trials: {} folds", folds.len());
            let mut left_out = vec![0; trials];
            for fold in &folds {
                let samples = fold.samples.start..fold.samples.end.min(trial.len());
                fold.trials.iter().for_each(|&index| left_out[index] += samples.len());
            }
            assert_eq!(left_out, vec![trial.len(); trials]);
        }
    }

    #[test]
    fn ramps_do_not_reverse() {
        let ramp: Vec<f64> = (0..500).map(|n| 180.0 - 0.05 * f64::from(n)).collect();
        let noisy: Vec<f64> =
            ramp.iter().enumerate().map(|(n, x)| x + 0.3 * (n as f64).sin()).collect();
        let wave: Vec<f64> = (0..500).map(|n| 165.0 + 15.0 * (0.05 * f64::from(n)).sin()).collect();
        assert!(!reverses(&ramp) && !reverses(&noisy) && !reverses(&[1.0; 9]));
        assert!(reverses(&wave));
    }
}

//! Errors of estimates, computed with the paper's measures.

use serde::Serialize;
use stretch_core::{Calibration, Polarity};
use stretch_data::{Trial, check_rows, in_digits, resampling, unit_of};
use stretch_metrics::{Agreement, Delta, Pair, PairedBlocks, PairedT, TTest, lag};

use crate::{
    CalibrateError,
    error::PACE_TOLERANCE,
    prepare::{MOST_ROWS, extent, polarity, sample_rate_hz},
};

use super::{apply::apply, doubt::is_outside};

/// Length of the blocks of the paired test, in seconds.
const BLOCK_S: f64 = 0.5;

/// Largest lag that is searched, in seconds.
pub const MAX_LAG_S: f64 = 1.0;

/// Errors of one method, on one trial or pooled.
#[derive(Debug, Clone, Serialize)]
pub struct MethodErrors {
    /// `raw`, or the calibration's name.
    pub method: String,
    /// Samples compared.
    pub samples: u64,
    /// Samples without an estimate: warm-up and gaps.
    pub withheld: u64,
    /// Samples outside the calibrated domain: the signal was limited and is outside the range of the fitted trials
    /// (`signal_range` of the calibration), or the rate of change was limited.
    pub clamped: u64,
    /// Root mean square error, in the unit of the reference.
    pub rmse: f64,
    /// Root mean square error in percent of the reference's range.
    pub rmse_percent: f64,
    /// The paper's average error: `100 mean|d_p - d_s|/range of d_s`, where `d_p` is the reference and `d_s` the
    /// estimate.
    pub average_error_percent: f64,
    /// The average error in percent of the reference's range: `100 mean|d_p - d_s|/range of d_p`, where `d_p` is the
    /// reference and `d_s` the estimate.
    pub average_error_percent_of_reference: f64,
    /// The average error with its sign: `100 mean(d_p - d_s)/range of d_s`, where `d_p` is the reference and `d_s` the
    /// estimate.
    pub signed_error_percent: f64,
    /// Mean of estimate minus reference.
    pub bias: f64,
    /// Mean absolute error.
    pub mae: f64,
    /// Greatest absolute error.
    pub max: f64,
    /// Coefficient of determination.
    pub r_squared: f64,
    /// Delay of the estimate behind the reference, in seconds; `None` if no trial determines it.
    pub lag_s: Option<f64>,
}

/// A paired t test between two methods' absolute errors.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// First method.
    pub first: String,
    /// Second method.
    pub second: String,
    /// Mean of first minus second, in the unit of the reference.
    pub mean_difference: f64,
    /// P value if samples are assumed to be independent, as in the paper.
    pub p_samples: Option<f64>,
    /// P value for means of half-second blocks.
    pub p_blocks: Option<f64>,
    /// Number of blocks.
    pub blocks: u64,
    /// 95 % interval of the mean difference, from blocks.
    pub interval_95: Option<(f64, f64)>,
}

/// Errors of each trial, pooled errors, and tests between the methods.
#[derive(Debug, Clone, Serialize)]
pub struct Evaluation {
    /// Unit of the reference, such as `mm` or `N`.
    pub unit: String,
    /// Errors by trial; the order of the methods is the same in all trials.
    pub trials: Vec<TrialErrors>,
    /// Errors over all trials.
    pub pooled: Vec<MethodErrors>,
    /// Tests of `raw` against each calibration, and of each calibration against the next.
    pub comparisons: Vec<Comparison>,
}

/// Errors of one trial and, for plots, its curves.
#[derive(Debug, Clone, Serialize)]
pub struct TrialErrors {
    /// The trial.
    pub trial: String,
    /// Errors of each method.
    pub methods: Vec<MethodErrors>,
    /// Time stamps, in seconds.
    #[serde(skip)]
    pub time_s: Vec<f64>,
    /// The signal, as it was recorded.
    #[serde(skip)]
    pub signal: Vec<f64>,
    /// The reference.
    #[serde(skip)]
    pub reference: Vec<f64>,
    /// Estimates of each method; NaN if withheld.
    #[serde(skip)]
    pub estimates: Vec<Vec<f64>>,
    /// Rates of each method's estimate; NaN if a method has no rate.
    #[serde(skip)]
    pub rates: Vec<Vec<f64>>,
}

/// The estimates of one method for one trial.
#[derive(Debug)]
pub struct Estimates {
    /// One estimate for each sample; NaN if withheld.
    pub values: Vec<f64>,
    /// Rate of each estimate; NaN if there is none.
    pub rates: Vec<f64>,
    /// Samples whose inputs were outside the calibrated domain.
    pub clamped: u64,
}

/// Methods that are compared with a reference.
#[derive(Debug)]
pub struct Methods<'a> {
    /// Names of the methods. Methods before the first calibration are not calibrated.
    pub names: Vec<&'a str>,
    /// Index of the first calibration.
    pub first: usize,
    /// Column of the signal that plots show.
    pub signal: &'a str,
    /// Column of the reference.
    pub reference: &'a str,
    /// Sample rate of the calibrations, in Hz.
    pub rate_hz: f64,
    /// Largest lag that is searched, in seconds; 0 for no lags.
    pub most_s: f64,
}

/// Evaluates calibrations against the reference of each trial.
///
/// The first method is always `raw`: the trial's signal, scaled so that its extremes equal those of the reference. All
/// calibrations must use the same signal and reference.
///
/// # Errors
/// [`CalibrateError::Data`] if a trial lacks signal or reference, or if the trials have more than
/// [`MOST_ROWS`](crate::MOST_ROWS) rows, [`CalibrateError::Refused`] for a trial that is shorter than the
/// warm-up, or has a lower sample rate than the calibration.
pub fn evaluate(
    calibrations: &[(&str, &Calibration)],
    trials: &[Trial],
) -> Result<Evaluation, CalibrateError> {
    evaluate_lag(calibrations, trials, MAX_LAG_S)
}

/// Evaluates calibrations as [`evaluate`] does, but without lags, whose search takes most of the time.
///
/// # Errors
/// The errors of [`evaluate`].
pub fn evaluate_errors(
    calibrations: &[(&str, &Calibration)],
    trials: &[Trial],
) -> Result<Evaluation, CalibrateError> {
    evaluate_lag(calibrations, trials, 0.0)
}

/// Evaluates calibrations and searches lags up to `most_s`; with zero, no lag is returned.
fn evaluate_lag(
    calibrations: &[(&str, &Calibration)],
    trials: &[Trial],
    most_s: f64,
) -> Result<Evaluation, CalibrateError> {
    let (_, first) = calibrations.first().ok_or(CalibrateError::NoTrials)?;
    // The rows of a table have no times, so there is no lag.
    let most_s = if trials.iter().all(Trial::counts_rows) { 0.0 } else { most_s };
    let methods = Methods {
        names: std::iter::once("raw").chain(calibrations.iter().map(|(name, _)| *name)).collect(),
        first: 1,
        signal: first.spec().signal.as_str(),
        reference: first.spec().reference.as_str(),
        rate_hz: first.spec().sample_rate_hz.hz(),
        most_s,
    };
    evaluate_methods(&methods, trials, |trial, reference| {
        let of_one = |(_, calibration): &(&str, &Calibration)| estimates(calibration, trial);
        let raw = std::iter::once_with(|| raw(first, trial, reference));
        raw.chain(calibrations.iter().map(of_one)).collect()
    })
}

/// Evaluates methods against the reference of each trial. `estimates` returns the estimates of all methods from a trial
/// and its reference.
///
/// # Errors
/// The errors of [`evaluate`], and those that `estimates` returns.
pub fn evaluate_methods(
    all: &Methods<'_>,
    trials: &[Trial],
    estimates: impl Fn(&Trial, &[f64]) -> Result<Vec<Estimates>, CalibrateError>,
) -> Result<Evaluation, CalibrateError> {
    check_rows(trials, MOST_ROWS)?;
    let names = &all.names;
    let mut pooled = vec![Tally::default(); names.len()];
    let mut tests = Tests::new(names.len(), all.rate_hz);
    let mut rows = Vec::new();
    let mut unwrapped = Vec::new();
    for trial in trials {
        trial.check_lengths()?;
        unwrapped.push(trial.unwrapped(trial.full_name(all.reference))?);
    }
    let turn = unwrapped.iter().find_map(|(_, wrap)| wrap.map(|wrap| wrap.turn));
    for (trial, (reference, _)) in trials.iter().zip(unwrapped) {
        let mut reference = reference.into_owned();
        let mut methods = estimates(trial, &reference)?;
        if let Some(turn) = turn {
            onto_first_turn(&mut reference, &mut methods, all.first, turn);
        }
        let rate_hz = sample_rate_hz(trial)?;
        let period_s = 1.0 / rate_hz;
        let mut errors = Vec::new();
        for ((name, method), pooled) in names.iter().zip(&methods).zip(&mut pooled) {
            let tally = Tally::of(&reference, method, period_s, all.most_s);
            pooled.merge(&tally);
            let errors_of = tally.errors(name);
            errors.push(errors_of.ok_or_else(|| nothing_estimated(trial, rate_hz, all.rate_hz))?);
        }
        tests.push(&reference, &methods);
        rows.push(TrialErrors {
            trial: trial.name.clone(),
            methods: errors,
            time_s: trial.time_s.clone(),
            signal: trial.require(all.signal)?.to_vec(),
            reference,
            rates: methods.iter().map(|m| m.rates.clone()).collect(),
            estimates: methods.into_iter().map(|m| m.values).collect(),
        });
    }
    let nothing = || CalibrateError::NoTrials;
    let pooled =
        names.iter().zip(&pooled).map(|(name, tally)| tally.errors(name).ok_or_else(nothing));
    Ok(Evaluation {
        unit: unit_of(all.reference),
        trials: rows,
        pooled: pooled.collect::<Result<_, _>>()?,
        comparisons: tests.compare(names),
    })
}

/// Explains why no sample of a trial has an estimate. If samples come more slowly than a calibration expects, samples
/// are missing between them, and the rate estimator restarts at each sample.
fn nothing_estimated(trial: &Trial, rate_hz: f64, expected_hz: f64) -> CalibrateError {
    let why = match (expected_hz / rate_hz - 1.0).abs() > PACE_TOLERANCE {
        true => format!(
            "it has {} samples a second, but the calibration needs {expected_hz}: resample it ({})",
            in_digits(rate_hz, 6),
            resampling(expected_hz)
        ),
        false => {
            "it is shorter than the warm-up of the rate estimator: use a longer trial".to_owned()
        }
    };
    CalibrateError::Refused(format!("{}: no sample has an estimate; {why}", trial.name))
}

/// Shifts the reference, an angle that wraps, by whole turns to the estimates of the first calibration. The estimates
/// of methods without a calibration are shifted by the same amount.
fn onto_first_turn(reference: &mut [f64], methods: &mut [Estimates], first: usize, turn: f64) {
    let off = reference.iter().zip(&methods[first].values).map(|(x, y)| y - x);
    let known: Vec<f64> = off.filter(|off| off.is_finite()).collect();
    let shift = turn * (known.iter().sum::<f64>() / known.len().max(1) as f64 / turn).round();
    reference.iter_mut().for_each(|x| *x += shift);
    let uncalibrated = methods.iter_mut().take(first);
    uncalibrated.flat_map(|method| &mut method.values).for_each(|x| *x += shift);
}

/// Returns the uncalibrated signal, with its extremes scaled to those of the reference.
fn raw(
    calibration: &Calibration,
    trial: &Trial,
    reference: &[f64],
) -> Result<Estimates, CalibrateError> {
    let signal = trial.require(calibration.spec().signal.as_str())?;
    let (seen, stroke) = (extent(signal.iter().copied()), extent(reference.iter().copied()));
    let together = polarity(signal.iter().copied().zip(reference.iter().copied()));
    let (start, end) = match together {
        Polarity::Rising => (stroke.min, stroke.max),
        Polarity::Falling => (stroke.max, stroke.min),
    };
    let gain = (end - start) / (seen.max - seen.min);
    let gain = if gain.is_finite() { gain } else { 0.0 };
    let values: Vec<f64> = signal.iter().map(|v| start + gain * (v - seen.min)).collect();
    Ok(Estimates { rates: vec![f64::NAN; values.len()], values, clamped: 0 })
}

fn estimates(calibration: &Calibration, trial: &Trial) -> Result<Estimates, CalibrateError> {
    let applied = apply(calibration, trial)?;
    let read = |of: fn(&stretch_receptor::Reading) -> f64| {
        applied.readings.iter().map(|r| r.as_ref().map_or(f64::NAN, of)).collect()
    };
    let spec = calibration.spec();
    let samples = trial.require(spec.signal.as_str())?.iter().zip(&applied.readings);
    let outside = |(signal, reading): &(&f64, &Result<_, _>)| {
        reading.as_ref().is_ok_and(|reading| is_outside(&spec.signal_range, **signal, reading))
    };
    let clamped = samples.filter(outside).count() as u64;
    Ok(Estimates { values: read(|r| r.estimate), rates: read(|r| r.rate), clamped })
}

/// Sums from which one [`MethodErrors`] is computed. The sums of several trials can be merged.
#[derive(Debug, Clone, Default)]
struct Tally {
    agreement: Agreement<f64>,
    withheld: u64,
    clamped: u64,
    /// Sum of the lags, each weighted by its number of samples, and the sum of these numbers.
    lag: (f64, u64),
}

impl Tally {
    /// Compares estimates with the reference, and searches lags up to `most_s`, if that is not zero.
    fn of(reference: &[f64], method: &Estimates, period_s: f64, most_s: f64) -> Self {
        let mut tally = Self { clamped: method.clamped, ..Self::default() };
        for (&truth, &estimate) in reference.iter().zip(&method.values) {
            if estimate.is_nan() {
                tally.withheld += 1;
            } else {
                tally.agreement.push(Pair { truth, estimate });
            }
        }
        // The warm-up is at the start. The lag is computed from the first estimate on.
        let start = method.values.iter().position(|x| !x.is_nan()).unwrap_or(reference.len());
        let (truth, estimate) = (&reference[start..], &method.values[start..]);
        let most = ((most_s / period_s) as usize).min(truth.len() / 4);
        if most_s > 0.0
            && let Ok(found) = lag(truth, estimate, most)
            && !found.at_limit
        {
            tally.lag = (found.samples * period_s * truth.len() as f64, truth.len() as u64);
        }
        tally
    }

    fn merge(&mut self, other: &Self) {
        self.agreement.merge(&other.agreement);
        self.withheld += other.withheld;
        self.clamped += other.clamped;
        self.lag.0 += other.lag.0;
        self.lag.1 += other.lag.1;
    }

    fn errors(&self, method: &str) -> Option<MethodErrors> {
        let (all, errors) = (&self.agreement, self.agreement.errors());
        Some(MethodErrors {
            method: method.to_owned(),
            samples: all.count(),
            withheld: self.withheld,
            clamped: self.clamped,
            rmse: errors.rmse()?,
            rmse_percent: all.rmse_percent(Delta::Truth).unwrap_or(f64::NAN),
            average_error_percent: all.average_error_percent(Delta::Estimate).unwrap_or(f64::NAN),
            average_error_percent_of_reference: all
                .average_error_percent(Delta::Truth)
                .unwrap_or(f64::NAN),
            signed_error_percent: all.signed_error_percent(Delta::Estimate).unwrap_or(f64::NAN),
            bias: errors.bias()?,
            mae: errors.mae()?,
            max: errors.max_abs()?,
            r_squared: all.r_squared().unwrap_or(f64::NAN),
            lag_s: (self.lag.1 > 0).then(|| self.lag.0 / self.lag.1 as f64),
        })
    }
}

/// Paired tests of absolute errors, for all pairs of methods that are reported.
struct Tests {
    pairs: Vec<(usize, usize)>,
    samples: Vec<PairedT<f64>>,
    blocks: Vec<PairedBlocks<f64>>,
}

impl Tests {
    fn new(methods: usize, rate_hz: f64) -> Self {
        let raw = (1..methods).map(|m| (0, m));
        let next = (2..methods).map(|m| (m - 1, m));
        let pairs: Vec<_> = raw.chain(next).collect();
        let length = ((BLOCK_S * rate_hz) as u64).max(1);
        let blocks = pairs.iter().filter_map(|_| PairedBlocks::new(length).ok()).collect();
        Self { samples: vec![PairedT::new(); pairs.len()], blocks, pairs }
    }

    fn push(&mut self, reference: &[f64], methods: &[Estimates]) {
        for (test, &(a, b)) in self.pairs.iter().enumerate() {
            for (i, truth) in reference.iter().enumerate() {
                let first = (truth - methods[a].values[i]).abs();
                let second = (truth - methods[b].values[i]).abs();
                if first.is_finite() && second.is_finite() {
                    self.samples[test].push(first - second);
                    self.blocks[test].push(first - second);
                }
            }
            self.blocks[test].end_recording();
        }
    }

    fn compare(&self, names: &[&str]) -> Vec<Comparison> {
        let row = |(test, &(a, b)): (usize, &(usize, usize))| {
            let samples: Option<TTest> = self.samples[test].test().ok();
            let blocks = self.blocks[test].test().ok();
            Comparison {
                first: names[a].to_owned(),
                second: names[b].to_owned(),
                mean_difference: samples.as_ref().map_or(f64::NAN, |t| t.mean_difference),
                p_samples: samples.map(|t| t.p),
                p_blocks: blocks.as_ref().map(|t| t.p),
                blocks: self.blocks[test].count(),
                interval_95: blocks.map(|t| (t.interval_95.min, t.interval_95.max)),
            }
        };
        self.pairs.iter().enumerate().map(row).collect()
    }
}

//! Doubts about estimates and their errors: values with codes, which each program displays in its own way.

use std::fmt;

use serde::Serialize;
use stretch_core::{Calibration, Range};
use stretch_data::{Trial, in_digits, out_of_order, rate_of, resampling};
use stretch_receptor::{Domain, Reading, Withheld};

use super::{
    acceptance::{
        beside_a_constant, delayed, fitted_trials, off_throughout, other_reference, outside_range,
        without_estimate, worse_than_the_mean,
    },
    apply::{Applied, at_rate},
    evaluate::Evaluation,
    reach::Reach,
};
use crate::{
    error::PACE_TOLERANCE,
    prepare::{Line, clipped},
};

/// A doubt about a result. `Display` writes its text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Doubt {
    /// Stable code for programs: `other_rate`, `constant_signal`, `clipped_signal`, `other_unit`, `other_sensor`,
    /// `outside_range`, `fitted_trials`, `other_reference`, `constant_error`, `delayed`, `worse_than_the_mean`,
    /// `constant_reference` or `without_estimate`.
    pub code: &'static str,
    /// A sentence for users that includes advice.
    pub text: String,
}

impl Doubt {
    pub(super) fn new(code: &'static str, text: String) -> Self {
        Self { code, text }
    }

    /// Whether this doubt is the cause of all others: the signal is in another unit, or the sensor is not connected.
    pub fn explains_others(&self) -> bool {
        matches!(self.code, "other_unit" | "constant_signal")
    }

    /// Returns doubts about one method of an evaluation: trials whose reference is in another unit or reversed, trials
    /// whose estimates are shifted or delayed, and errors that have no meaning. A doubt about one of several trials
    /// names the trial. `method` is the index of the method in the evaluation, `fit_rmse` the RMSE of its fit in the
    /// unit of the reference, and `reference` the name of the reference column.
    pub fn of_method(
        evaluation: &Evaluation,
        method: usize,
        fit_rmse: f64,
        reference: &str,
    ) -> Vec<Self> {
        let Evaluation { unit, trials, pooled, .. } = evaluation;
        let pooled = &pooled[method];
        let range = 100.0 * pooled.rmse / pooled.rmse_percent;
        let mut all: Vec<Self> = Vec::new();
        for trial in trials {
            let pairs =
                trial.estimates[method].iter().copied().zip(trial.reference.iter().copied());
            let line = Line::through(pairs.filter(|(estimate, _)| estimate.is_finite()));
            let shift = || off_throughout(&trial.methods[method], (fit_rmse, range), unit);
            let delay = || delayed(trial, method, fit_rmse, unit);
            let found = other_reference(&line, reference).or_else(shift).or_else(delay);
            let Some(found) = found else { continue };
            match all.iter_mut().find(|doubt| doubt.code == found.code) {
                Some(first) => first.text = format!("{}; also {}", first.text, trial.trial),
                None if trials.len() == 1 => all.push(found),
                None => all.push(found.of(&trial.trial)),
            }
        }
        if !all.iter().any(|doubt| doubt.code == "other_reference") {
            all.extend(worse_than_the_mean(pooled));
        }
        all.extend(beside_a_constant(pooled));
        all.extend(without_estimate(trials.iter().map(|trial| &trial.estimates[method][..])));
        all
    }

    /// Prefixes the text with the name of a trial or a method.
    #[must_use]
    pub fn of(self, name: &str) -> Self {
        Self { text: format!("{name}: {}", self.text), ..self }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Counts of the samples to which a calibration was applied, and the doubts that follow from them.
///
/// ```
/// use stretch_calibrate::{LiveReceptor, Seen};
/// use stretch_core::Seconds;
/// let calibration = stretch_receptor::example_calibration();
/// let (mut seen, mut live) = (Seen::of(&calibration), LiveReceptor::new(&calibration)?);
/// // a sensor that is not connected, logged twice as fast as the calibration's trials
/// let doubts = (0..100).filter_map(|n| {
///     let time_s = 0.005 * f64::from(n);
///     seen.take(time_s, 1.5, &live.step(Seconds(time_s), 1.5))
/// });
/// assert_eq!(doubts.map(|doubt| doubt.code).collect::<Vec<_>>(), ["other_rate"]);
/// assert_eq!(seen.doubt().map(|doubt| doubt.code), Some("constant_signal"));
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
#[derive(Debug)]
pub struct Seen {
    /// All samples.
    pub samples: u64,
    /// Samples without an estimate.
    pub withheld: u64,
    /// Samples whose signal or rate of change was clamped to the ends of the model's curve.
    pub limited: u64,
    /// Clamped samples that are also outside the calibrated domain: see
    /// [`MethodErrors::clamped`](crate::MethodErrors::clamped).
    pub clamped: u64,
    range: Range<f64>,
    reach: Reach,
    pace: Pace,
}

impl Seen {
    /// Returns empty counts for a calibration.
    pub fn of(calibration: &Calibration) -> Self {
        let (reach, pace) = (Reach::of(calibration), Pace::of(calibration));
        let range = calibration.spec().signal_range;
        Self { samples: 0, withheld: 0, limited: 0, clamped: 0, range, reach, pace }
    }

    /// Counts a sample with its time in seconds and its reading. Returns a doubt, at most once, if samples come at
    /// another rate than that of the calibration.
    pub fn take(
        &mut self,
        time_s: f64,
        signal: f64,
        reading: &Result<Reading, Withheld>,
    ) -> Option<Doubt> {
        self.samples += 1;
        self.reach.take(signal);
        match reading {
            Ok(reading) => {
                let is_limited =
                    !matches!(reading.domain, Domain::Inside | Domain::EstimateClamped);
                self.limited += u64::from(is_limited);
                self.clamped += u64::from(is_outside(&self.range, signal, reading));
            }
            Err(_) => self.withheld += 1,
        }
        self.pace.take(time_s)
    }

    /// Returns a doubt if the samples so far are probably not a log of the calibration's sensor.
    pub fn doubt(&self) -> Option<Doubt> {
        outside(&self.reach, self.clamped, self.samples - self.withheld)
    }
}

/// Whether a signal or its rate of change is outside the range of the fitted trials.
///
/// A model clamps the signal to the ends of its fitted curve. Because trials have noise, these ends lie inside the
/// range of the fitted trials. Therefore some samples of the fit are clamped although they are inside the range.
pub(super) fn is_outside(range: &Range<f64>, signal: f64, reading: &Reading) -> bool {
    match reading.domain {
        Domain::Inside | Domain::EstimateClamped => false,
        Domain::SignalClamped => !range.contains(signal),
        Domain::RateClamped | Domain::BothClamped => true,
    }
}

fn outside(reach: &Reach, clamped: u64, samples: u64) -> Option<Doubt> {
    reach.doubt().or_else(|| outside_range(clamped, samples))
}

impl Applied {
    /// Returns the counts of a trial to which the calibration was applied, and doubts about the estimates.
    pub fn seen(&self, calibration: &Calibration, trial: &Trial) -> (Seen, Vec<Doubt>) {
        let mut seen = Seen::of(&at_own_rate(calibration, trial));
        let signal = trial.require(calibration.spec().signal.as_str()).into_iter().flatten();
        let samples = trial.time_s.iter().zip(signal).zip(&self.readings);
        let pace = samples.filter_map(|((time_s, signal), reading)| {
            Some(seen.take(*time_s, *signal, reading)?.of(&trial.name))
        });
        let pace: Vec<Doubt> = pace.collect();
        let doubts = seen.doubt().into_iter().chain(pace).collect();
        (seen, doubts)
    }
}

/// Returns the calibration at the trial's sample rate, if it is a line or a curve.
fn at_own_rate(calibration: &Calibration, trial: &Trial) -> Calibration {
    let own = trial.rate_hz().and_then(|rate_hz| at_rate(calibration, rate_hz).ok());
    own.unwrap_or_else(|| calibration.clone())
}

/// Returns doubts about the errors that [`evaluate`](crate::evaluate()) found for calibrations on trials. Each sentence
/// names its calibration.
pub fn evaluation_doubts(
    calibrations: &[(&str, &Calibration)],
    trials: &[Trial],
    evaluation: &Evaluation,
) -> Vec<Doubt> {
    let mut all = Vec::new();
    let named: Vec<(String, &Calibration)> =
        calibrations.iter().map(|(name, own)| (format!("calibration {name}"), *own)).collect();
    for (name, calibration) in &named {
        let paces = trials.iter().filter_map(|trial| {
            let mut pace = Pace::of(&at_own_rate(calibration, trial));
            Some(trial.time_s.iter().find_map(|time_s| pace.take(*time_s))?.of(&trial.name))
        });
        let spec = calibration.spec();
        let columns = [spec.signal.as_str(), spec.reference.as_str()];
        let fitted = fitted_trials(&spec.provenance, &columns, trials);
        let clipped = trials.iter().filter_map(|trial| clipped(trial, columns));
        let clipped = clipped.map(|text| Doubt::new("clipped_signal", text));
        all.extend(paces.chain(fitted).chain(clipped).map(|doubt| doubt.of(name)));
    }
    // The first method is the raw signal.
    for (method, (name, calibration)) in (1..).zip(&named) {
        let errors = &evaluation.pooled[method];
        let mut reach = Reach::of(calibration);
        let signal = calibration.spec().signal.as_str();
        let signals = trials.iter().filter_map(|trial| trial.require(signal).ok());
        signals.flatten().for_each(|value| reach.take(*value));
        let spec = calibration.spec();
        let unit = spec.target.reference_per_normalised(spec.target_range).abs();
        let fit_rmse = unit * spec.model.fit_rmse();
        let said = Doubt::of_method(evaluation, method, fit_rmse, spec.reference.as_str());
        let outside = outside(&reach, errors.clamped, errors.samples);
        match outside {
            // Most estimates were computed from clamped inputs, so doubts about their errors would be misleading.
            Some(cause) if cause.explains_others() || cause.code == "other_sensor" => {
                all.push(cause.of(name));
            }
            // Doubts about a shift come first, because a shift also moves samples out of the range.
            outside => all.extend(said.into_iter().chain(outside).map(|doubt| doubt.of(name))),
        }
    }
    all
}

/// Number of intervals from which the usual sample interval is computed.
const INTERVALS: usize = 51;

/// The usual sample interval of a stream compared with that of the calibration.
#[derive(Debug)]
struct Pace {
    rate_hz: f64,
    needs_signal_only: bool,
    /// Time stamps of the first samples, until they determine the rate.
    stamps_s: Vec<f64>,
    is_told: bool,
}

impl Pace {
    fn of(calibration: &Calibration) -> Self {
        let rate_hz = calibration.spec().sample_rate_hz.hz();
        let needs_signal_only = calibration.spec().model.needs_signal_only();
        Self { rate_hz, needs_signal_only, stamps_s: Vec::new(), is_told: false }
    }

    /// Counts the time of a sample. Returns a doubt, at most once, if the usual interval differs from that of the
    /// calibration. If the stream is slower, the samples in between count as missing: the rates are right, but there
    /// are gaps. If the stream is faster, the rates are wrong. If its rate is a thousand times too low, the times are
    /// probably in milliseconds.
    fn take(&mut self, time_s: f64) -> Option<Doubt> {
        if self.is_told || !time_s.is_finite() || self.stamps_s.last() == Some(&time_s) {
            return None;
        }
        self.stamps_s.push(time_s);
        if self.stamps_s.len() <= INTERVALS {
            return None;
        }
        self.is_told = true;
        let mut stamps_s = std::mem::take(&mut self.stamps_s);
        // Rows that go back in time are left out, because a reader of files leaves them out as well.
        for at in out_of_order(&stamps_s).into_iter().rev() {
            stamps_s.remove(at);
        }
        stamps_s.dedup();
        let (found_hz, rate_hz) = (rate_of(&stamps_s)?, self.rate_hz);
        if (rate_hz / found_hz - 1.0).abs() <= PACE_TOLERANCE {
            return None;
        }
        let [found, rate] = [found_hz, rate_hz].map(|hz| in_digits(hz, 6));
        let units = [(1e3, "ms"), (1e6, "us"), (1e9, "ns")];
        let is_near = |factor: f64| (rate_hz / found_hz / factor - 1.0).abs() <= PACE_TOLERANCE;
        if let Some((_, unit)) = units.into_iter().find(|(factor, _)| is_near(*factor)) {
            let text = format!(
                "the log has {found} samples a second, the calibration {rate}: are its times in {unit}? Then read them with \
                 --time COL:{unit}, where COL is the time column"
            );
            return Some(Doubt::new("other_rate", text));
        }
        let what = if self.needs_signal_only {
            "the estimates are right, but their rates of change are wrong"
        } else if found_hz > rate_hz {
            "rates of change, and estimates that use them, are wrong"
        } else {
            "the samples that the log lacks count as missing"
        };
        let text = format!(
            "the log has {found} samples a second, the calibration {rate}: {what}; log at that rate, or resample the log ({})",
            resampling(rate_hz)
        );
        Some(Doubt::new("other_rate", text))
    }
}

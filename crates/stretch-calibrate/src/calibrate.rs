//! From logged trials to a calibration.

use stretch_core::{
    Branch, BranchSurface, Calibration, CalibrationSpec, Degree, Interval, Label, LinearMap, Model,
    Normalisation, Provenance, Range, RangeSpec, RateEstimator, RateSource, SampleRate, Schema,
    Target,
};
use stretch_data::{EvenSpec, Rows, Trial};
use stretch_filter::RateFilter;

use crate::{
    CalibrateError, FitReport, Memory, ModelKind, Options,
    fitting::{Sample, fit},
    history_fit::{HistoryChoice, history},
    observer_fit::{ObserverChoice, observer},
    series::{Series, extent, noise, polarity, sample_rate_hz, series},
    split::{DeadBands, branches},
};

/// Parts of a trial with fewer samples have no rate.
const SHORTEST: usize = 3;

/// A calibration and what there is to say about it.
#[derive(Debug, Clone)]
pub struct Calibrated {
    /// The record.
    pub calibration: Calibration,
    /// The linear fit, or one fit a branch.
    pub fits: Vec<FitReport>,
    /// What had to be done to the data, one sentence each.
    pub notes: Vec<String>,
}

/// Fits a calibration to logged trials.
///
/// Ranges are pooled over all trials (of rates, over each branch) and frozen.
/// Trials are brought onto an even grid as [`Trial::even`] does it: lost samples are bridged, long gaps cut a trial,
/// uneven stamps are resampled; [`Calibrated::notes`] says where.
///
/// # Errors
/// [`CalibrateError`], which names the trial and column, or the branch and term.
///
/// ```
/// use stretch_calibrate::{Options, calibrate, evaluate};
/// use stretch_data::{Channel, Trial};
///
/// // a gauge whose voltage follows the contraction of a 180 mm muscle, up and down
/// let time_s: Vec<f64> = (0..2000).map(|n| n as f64 * 0.01).collect();
/// let length_mm: Vec<f64> = time_s.iter().map(|t| 165.0 + 15.0 * (0.7 * t).cos()).collect();
/// let bridge_v = length_mm.iter().map(|l| 1.24 + 0.03 * (180.0 - l)).collect();
/// let channel = |name: &str, values| Channel { name: name.into(), values };
/// let trial = Trial {
///     name: "loop".into(),
///     time_s,
///     channels: vec![channel("length_mm", length_mm), channel("bridge_v", bridge_v)],
/// };
/// let calibrated = calibrate(std::slice::from_ref(&trial), &Options::default())?;
/// assert_eq!(calibrated.fits.len(), 2); // inflation and deflation
/// let evaluation = evaluate(&[("poly13", &calibrated.calibration)], &[trial])?;
/// assert!(evaluation.pooled[1].rmse < 0.01); // millimetres
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
pub fn calibrate(trials: &[Trial], options: &Options) -> Result<Calibrated, CalibrateError> {
    calibrate_with(trials, options, None).map(|(calibrated, _)| calibrated)
}

/// The same, keeping a choice made before, and the choice that was made.
pub(crate) fn calibrate_with(
    trials: &[Trial],
    options: &Options,
    choice: Option<Choice>,
) -> Result<(Calibrated, Option<Choice>), CalibrateError> {
    let mut made = None;
    let prepared = Prepared::new(trials, options)?;
    let (model, fits, mut notes) = match options.model {
        ModelKind::Linear => linear(&prepared, options)?,
        ModelKind::Surface(degree) => surfaces(&prepared, options, degree)?,
        ModelKind::Blended(degree) => match surfaces(&prepared, options, degree)? {
            (Model::Surfaces { inflation, deflation }, fits, notes) => {
                (Model::Blended { inflation, deflation }, fits, notes)
            }
            other => other,
        },
        ModelKind::Remembering { kind, rest } => {
            let (fitted, chosen) = remembering(&prepared, kind, rest, choice)?;
            made = Some(chosen);
            fitted
        }
    };
    notes.splice(0..0, prepared.notes.iter().cloned());
    let names = trials.iter().map(|t| t.name.as_str());
    let calibration = prepared.calibration(model, Provenance::new(&options.date, names))?;
    Ok((Calibrated { calibration, fits, notes }, made))
}

/// What was chosen about a model that remembers, to be kept when it is fitted
/// to parts of the same data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Choice {
    History(HistoryChoice),
    Observer(ObserverChoice),
}

fn remembering(
    prepared: &Prepared,
    kind: Memory,
    rest: bool,
    choice: Option<Choice>,
) -> Result<(Fitted, Choice), CalibrateError> {
    if kind == Memory::Observer {
        let choice = choice.and_then(|c| if let Choice::Observer(c) = c { Some(c) } else { None });
        return observer(prepared, rest, choice).map(|(fitted, c)| (fitted, Choice::Observer(c)));
    }
    let choice = choice.and_then(|c| if let Choice::History(c) = c { Some(c) } else { None });
    history(prepared, kind, rest, choice).map(|(fitted, c)| (fitted, Choice::History(c)))
}

/// All trials, even in time, with pooled ranges.
pub(crate) struct Prepared {
    pub series: Vec<Series>,
    pub sample_rate: SampleRate,
    pub target: Target,
    pub polarity: stretch_core::Polarity,
    pub signal_range: Range,
    pub target_range: Range,
    pub dead: DeadBands,
    pub notes: Vec<String>,
    options: Options,
}

impl Prepared {
    pub(crate) fn new(trials: &[Trial], options: &Options) -> Result<Self, CalibrateError> {
        let first = trials.first().ok_or(CalibrateError::NoTrials)?;
        let first_hz = sample_rate_hz(first)?;
        let sample_rate = SampleRate::new(first_hz)?;
        let mut pieces = Vec::new();
        let mut notes = Vec::new();
        let mut rows = Rows::default();
        for (index, trial) in trials.iter().enumerate() {
            let rate_hz = sample_rate_hz(trial)?;
            if (rate_hz / first_hz - 1.0).abs() > 0.05 {
                let (trial, first) = (trial.name.clone(), first.name.clone());
                return Err(CalibrateError::SampleRates { trial, rate_hz, first, first_hz });
            }
            let columns = [options.signal.as_str(), options.reference.as_str()];
            let spec = EvenSpec { rate_hz: sample_rate.hz(), shortest: SHORTEST };
            let even = trial.even(&columns, spec)?;
            rows.add(even.rows);
            notes.extend(even.notes);
            pieces.extend(even.parts.into_iter().filter_map(|part| {
                let [signal, reference] = part.columns.try_into().ok()?;
                Some((index, (signal, reference)))
            }));
        }
        notes.extend(rows.note());
        if pieces.is_empty() {
            let (trial, samples) = (first.name.clone(), first.len());
            return Err(CalibrateError::TooShort { trial, samples });
        }
        let target = target(options, &pieces)?;
        let pairs = pieces.iter().flat_map(|(_, (signal, reference))| {
            signal.iter().zip(reference).map(|(&v, &x)| (v, target.from_reference(x)))
        });
        let polarity = polarity(pairs.clone());
        let range = |column: &str, zero, values: &mut dyn Iterator<Item = f64>| {
            pooled_range(column, options.normalisation, zero, values)
        };
        let signal_range =
            range(&options.signal, options.zero(), &mut pairs.clone().map(|(v, _)| v))?;
        let target_range = range(&options.reference, 0.0, &mut pairs.map(|(_, t)| t))?;
        let noise_v = noise(pieces.iter().map(|(_, (v, _))| v.as_slice()));
        let signal_dead = match options.dead_band {
            Some(dead_band) => dead_band,
            None => 3.0 * noise_v * noise_gain(options.rate, sample_rate)?,
        };
        let dead = DeadBands {
            signal: signal_dead,
            target: signal_dead * target_range.span() / signal_range.span(),
        };
        let series = pieces
            .into_iter()
            .map(|(trial, piece)| series(trial, piece, target, polarity, options.rate, sample_rate))
            .collect::<Result<_, _>>()?;
        let options = options.clone();
        Ok(Self {
            series,
            sample_rate,
            target,
            polarity,
            signal_range,
            target_range,
            dead,
            notes,
            options,
        })
    }

    /// A record of a model fitted to these trials.
    pub(crate) fn calibration(
        &self,
        model: Model,
        provenance: Provenance,
    ) -> Result<Calibration, CalibrateError> {
        Ok(Calibration::new(CalibrationSpec {
            schema: Schema::CURRENT,
            signal: Label::new(&self.options.signal)?,
            reference: Label::new(&self.options.reference)?,
            sample_rate_hz: self.sample_rate,
            target: self.target,
            polarity: self.polarity,
            signal_range: self.signal_range,
            target_range: self.target_range,
            rate_estimator: self.options.rate,
            rate_source: self.options.rate_source,
            dead_band: self.dead.signal,
            model,
            provenance,
        })?)
    }

    /// Which part of the data is left out together in cross-validation: a trial
    /// each, or a tenth of the samples when there are fewer than three trials.
    pub(crate) fn fold(&self, series: &Series, index: usize, before: usize, total: usize) -> usize {
        let trials = self.series.iter().map(|s| s.trial).max().map_or(0, |last| last + 1);
        if trials >= 3 { series.trial } else { (before + index) * 10 / total.max(1) }
    }
}

/// Standard deviation of an estimator's rate for white noise of one.
fn noise_gain(estimator: RateEstimator, rate: SampleRate) -> Result<f64, CalibrateError> {
    match estimator {
        RateEstimator::CentralDifference => Ok(rate.hz() / 2f64.sqrt()),
        live => Ok(RateFilter::<f64>::new(live, rate)?.noise_gain()),
    }
}

type Pieces = [(usize, (Vec<f64>, Vec<f64>))];

fn target(options: &Options, pieces: &Pieces) -> Result<Target, CalibrateError> {
    let longest = || {
        pieces
            .iter()
            .flat_map(|(_, (_, reference))| reference.iter().copied())
            .fold(f64::MIN, f64::max)
    };
    let rest_length = match options.rest_length {
        Some(rest_length) => Some(rest_length),
        None => options.reference.starts_with("length").then(longest),
    };
    Ok(match rest_length {
        Some(rest_length) => {
            stretch_core::DesignError::check("rest_length", rest_length, rest_length > 0.0)?;
            Target::Contraction { rest_length }
        }
        None => Target::Direct,
    })
}

fn pooled_range(
    column: &str,
    mode: Normalisation,
    zero: f64,
    values: &mut dyn Iterator<Item = f64>,
) -> Result<Range, CalibrateError> {
    let Interval { min, max } = extent(values);
    Range::new(RangeSpec { mode, zero, min, max })
        .map_err(|_| CalibrateError::Constant { column: column.to_owned(), value: min })
}

pub(crate) type Fitted = (Model, Vec<FitReport>, Vec<String>);

fn linear(prepared: &Prepared, options: &Options) -> Result<Fitted, CalibrateError> {
    let mut samples = Vec::new();
    let mut seen = Vec::new();
    let total = prepared.series.iter().map(|s| s.signal.len()).sum();
    let mut before = 0;
    for series in &prepared.series {
        for (i, (&v, &t)) in series.signal.iter().zip(&series.target).enumerate() {
            seen.push(v);
            samples.push(Sample {
                fold: prepared.fold(series, i, before, total),
                rate: 0.0,
                signal: prepared.signal_range.normalise(v),
                target: prepared.target_range.normalise(t),
            });
        }
        before += series.signal.len();
    }
    let degree = Degree::new(0, 1)?;
    let (report, surface) = fit("linear fit", None, &samples, degree, options.robust)?;
    let line = LinearMap {
        slope: surface.coefficient(0, 1),
        intercept: surface.coefficient(0, 0),
        signal_domain: extent(seen.into_iter()),
        fit: report.summary(),
    };
    Ok((Model::Linear(line), vec![report], Vec::new()))
}

/// What one branch's samples are before normalisation.
#[derive(Default)]
struct Raw {
    fold: Vec<usize>,
    signal: Vec<f64>,
    signal_rate: Vec<f64>,
    target: Vec<f64>,
    target_rate: Vec<f64>,
}

fn surfaces(
    prepared: &Prepared,
    options: &Options,
    degree: Degree,
) -> Result<Fitted, CalibrateError> {
    let mut raw = [Raw::default(), Raw::default()];
    let total = prepared.series.iter().map(|s| s.signal.len()).sum();
    let mut before = 0;
    for series in &prepared.series {
        for (i, branch) in branches(series, options, prepared.dead).into_iter().enumerate() {
            let (Some(branch), Some(signal_rate)) = (branch, series.signal_rate[i]) else {
                continue;
            };
            let raw = &mut raw[usize::from(branch == Branch::Deflation)];
            raw.fold.push(prepared.fold(series, i, before, total));
            raw.signal.push(series.signal[i]);
            raw.signal_rate.push(signal_rate);
            raw.target.push(series.target[i]);
            raw.target_rate.push(series.target_rate[i]);
        }
        before += series.signal.len();
    }
    for (raw, branch) in raw.iter().zip(["inflation", "deflation"]) {
        let (samples, terms) = (raw.signal.len() as u64, degree.terms());
        if samples <= terms as u64 {
            return Err(CalibrateError::OneBranch { branch, samples, terms });
        }
    }
    let [up, down] = raw;
    let (inflation, first) = surface(prepared, options, degree, Branch::Inflation, up)?;
    let (deflation, second) = surface(prepared, options, degree, Branch::Deflation, down)?;
    let notes = [&first, &second].into_iter().filter_map(FitReport::note).collect();
    Ok((Model::Surfaces { inflation, deflation }, vec![first, second], notes))
}

fn surface(
    prepared: &Prepared,
    options: &Options,
    degree: Degree,
    branch: Branch,
    raw: Raw,
) -> Result<(BranchSurface, FitReport), CalibrateError> {
    let name = match branch {
        Branch::Inflation => "inflation",
        Branch::Deflation => "deflation",
    };
    let range = |rates: &[f64]| {
        let Interval { min, max } = extent(rates.iter().copied());
        Range::new(RangeSpec { mode: options.normalisation, zero: 0.0, min, max }).map_err(|_| {
            CalibrateError::Constant {
                column: format!("the rate in the {name} branch"),
                value: min,
            }
        })
    };
    let rate_range = range(&raw.signal_rate)?;
    let (rates, fitted_range) = match options.rate_source {
        RateSource::Voltage => (&raw.signal_rate, rate_range),
        RateSource::Strain => (&raw.target_rate, range(&raw.target_rate)?),
    };
    let samples: Vec<Sample> = (0..raw.signal.len())
        .map(|i| Sample {
            fold: raw.fold[i],
            rate: fitted_range.normalise(rates[i]),
            signal: prepared.signal_range.normalise(raw.signal[i]),
            target: prepared.target_range.normalise(raw.target[i]),
        })
        .collect();
    let (report, surface) = fit(name, Some(branch), &samples, degree, options.robust)?;
    let fitted = BranchSurface {
        rate_range,
        surface,
        signal_domain: extent(raw.signal.iter().copied()),
        rate_domain: extent(raw.signal_rate.iter().copied()),
        fit: report.summary(),
    };
    Ok((fitted, report))
}

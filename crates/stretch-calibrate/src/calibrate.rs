//! From logged trials to a calibration.

use stretch_core::{
    Branch, BranchSurface, Calibration, Degree, Interval, LinearMap, Model, Provenance, Range,
    RangeSpec, RateSource,
};
use stretch_data::Trial;

use crate::{
    CalibrateError, FitReport, Memory, ModelKind, Options,
    diagnosed_fit::{DiagnosedChoice, diagnosed},
    fitting::{Fitted, Sample, fit},
    history_fit::{HistoryChoice, history},
    observer_fit::observer,
    observer_model::ObserverChoice,
    prepared::Prepared,
    series::extent,
    split::branches,
    turns::with_turns,
    twice::fitted_twice,
};

/// A calibration with the reports and notes of its fit.
#[derive(Debug, Clone)]
pub struct Calibrated {
    /// The record.
    pub calibration: Calibration,
    /// The report of the linear fit, or one report for each branch.
    pub fits: Vec<FitReport>,
    /// Changes made to the data before the fit, one sentence each.
    pub notes: Vec<String>,
}

/// Fits a calibration to logged trials.
///
/// Ranges are pooled over all trials (of rates, over each branch) and frozen.
/// Trials are brought onto an even grid by [`Trial::even`]: lost samples are bridged, long gaps cut a trial, uneven
/// stamps are resampled. [`Calibrated::notes`] says where.
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

/// Fits a calibration, with an earlier choice where one is given; answers with the choice that was made.
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
    let columns = [options.signal.as_str(), options.reference.as_str()];
    let checksums: Vec<Option<u32>> = trials.iter().map(|t| t.checksum(&columns)).collect();
    notes.extend(fitted_twice(names.clone(), checksums.iter().copied()));
    let provenance =
        Provenance::new(&options.date, names).with_checksums(checksums.into_iter().flatten());
    let signals: Vec<&[f64]> = prepared.series.iter().map(|s| s.signal.as_slice()).collect();
    let calibration = with_turns(prepared.calibration(model, provenance)?, &signals)?;
    Ok((Calibrated { calibration, fits, notes }, made))
}

/// Choices about a model that remembers, kept when the model is fitted to parts of the same data.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Choice {
    History(HistoryChoice),
    Observer(ObserverChoice),
    Diagnosed(DiagnosedChoice),
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
    if kind == Memory::Diagnosed {
        let choice = choice.and_then(|c| if let Choice::Diagnosed(c) = c { Some(c) } else { None });
        return diagnosed(prepared, rest, choice).map(|(fitted, c)| (fitted, Choice::Diagnosed(c)));
    }
    let choice = choice.and_then(|c| if let Choice::History(c) = c { Some(c) } else { None });
    history(prepared, kind, rest, choice).map(|(fitted, c)| (fitted, Choice::History(c)))
}

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

/// Samples of one branch before normalisation.
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

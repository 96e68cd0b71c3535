//! Fits a line, a curve, or a surface for each branch (direction of motion).

use stretch_core::{
    Branch, BranchSurface, Degree, Interval, LinearMap, MAX_DEGREE, Model, Range, RangeSpec,
    RateSource, sizes::MOST,
};
use stretch_fit::{
    Factor, Fit, FitError, Loss, OrderTable, Sample, SurfaceAccumulator, robust_fit,
};

use crate::{
    CalibrateError, Options, Robust,
    prepare::{Prepared, branches, extent, pooled_range},
};

use super::report::{Coefficient, FitReport, Fitted, Order};

/// The index of the fold that contains a sample, and the normalised sample.
type Folded = (usize, Sample<f64>);

/// Returns all samples without their rates, and the range of the signal.
fn of_signal(prepared: &Prepared) -> (Vec<Folded>, Interval) {
    let mut samples = Vec::new();
    for (series, folds) in prepared.folds() {
        for ((&v, &t), fold) in series.signal.iter().zip(&series.target).zip(folds) {
            let volts = prepared.signal_range.normalise(v);
            let value = prepared.target_range.normalise(t);
            samples.push((fold, Sample { rate: 0.0, volts, value }));
        }
    }
    let signals = prepared.series.iter().flat_map(|series| series.signal.iter().copied());
    (samples, extent(signals))
}

/// Fits a line of the signal.
pub(crate) fn linear(prepared: &Prepared, options: &Options) -> Result<Fitted, CalibrateError> {
    let (samples, signal_domain) = of_signal(prepared);
    let report = fit("linear fit", None, &samples, Degree::LINE, options.robust)?;
    Ok((line(signal_domain, &report), vec![report], Vec::new()))
}

fn line(signal_domain: Interval, report: &FitReport) -> Model {
    Model::Linear(LinearMap {
        slope: report.surface.coefficient(0, 1),
        intercept: report.surface.coefficient(0, 0),
        signal_domain,
        fit: report.summary(),
    })
}

/// Number of parts into which a table, or the levels of a reference, are divided for cross-validation.
pub(crate) const TABLE_PARTS: usize = 10;

/// Fits a polynomial of the signal alone, for both directions. Its degree is the lowest that cross-validation accepts:
/// see [`OrderTable`].
pub(crate) fn curve(prepared: &Prepared, options: &Options) -> Result<Fitted, CalibrateError> {
    let failed = |cause| CalibrateError::Fit { branch: "curve", cause };
    let (mut samples, signal_domain) = of_signal(prepared);
    leave_out_levels(&mut samples, options.is_table);
    let highest = Degree::new(0, MAX_DEGREE as u8)?;
    let folds = factors(&samples, highest).map_err(failed)?;
    let table = OrderTable::curves(&folds).map_err(failed)?;
    let degree = table.recommended().unwrap_or(Degree::LINE);
    let mut report = fit("curve", None, &samples, degree, options.robust)?;
    let named = |degree: Degree| format!("degree {}", degree.volts());
    report.model = "curve".to_owned();
    (report.orders, report.recommended) = (orders(&table, named), Some(named(degree)));
    let model = if degree == Degree::LINE {
        line(signal_domain, &report)
    } else {
        let any = RangeSpec { mode: options.normalisation, zero: 0.0, min: -0.5, max: 0.5 };
        let both = BranchSurface {
            rate_range: Range::new(any)?,
            surface: report.surface,
            signal_domain,
            // The domain contains every rate.
            rate_domain: Interval { min: -MOST, max: MOST },
            fit: report.summary(),
        };
        Model::Surfaces { inflation: both, deflation: both }
    };
    let note = format!("the curve is of degree {}, by cross-validation", degree.volts());
    Ok((model, vec![report], vec![note]))
}

/// Assigns samples to the folds of a cross-validation by the level of the reference. This applies to tables, and to
/// references with levels (weights that were held for many samples). Otherwise samples of one level would be both
/// fitted and tested.
fn leave_out_levels(samples: &mut [Folded], is_table: bool) {
    let mut levels: Vec<f64> = samples.iter().map(|(_, s)| s.value).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    if is_table || 2 * levels.len() <= samples.len() {
        for (fold, sample) in samples {
            *fold = levels.partition_point(|&level| level < sample.value) % TABLE_PARTS;
        }
    }
}

/// A sample before normalisation.
struct Raw {
    fold: usize,
    signal: f64,
    signal_rate: f64,
    target: f64,
    target_rate: f64,
}

/// Fits a surface of signal and rate for each branch.
pub(crate) fn surfaces(
    prepared: &Prepared,
    options: &Options,
    degree: Degree,
) -> Result<Fitted, CalibrateError> {
    let mut raw = [Vec::new(), Vec::new()];
    for (series, folds) in prepared.folds() {
        for (i, branch) in branches(series, options, prepared.dead).into_iter().enumerate() {
            let (Some(branch), Some(signal_rate)) = (branch, series.signal_rate[i]) else {
                continue;
            };
            let (signal, target) = (series.signal[i], series.target[i]);
            let (fold, target_rate) = (folds[i], series.target_rate[i]);
            raw[usize::from(branch == Branch::Deflation)].push(Raw {
                fold,
                signal,
                signal_rate,
                target,
                target_rate,
            });
        }
    }
    for (raw, branch) in raw.iter().zip([Branch::Inflation, Branch::Deflation]) {
        let branch = prepared.target.branch_name(branch);
        let (samples, terms) = (raw.len() as u64, degree.terms());
        if samples <= terms as u64 {
            return Err(CalibrateError::Refused(format!(
                "the {branch} branch (one direction of motion) has only {samples} samples for the {terms} terms of the model; add trials that move in \
                 this direction, or fit --model curve or --model linear, which have no branches"
            )));
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
    raw: Vec<Raw>,
) -> Result<(BranchSurface, FitReport), CalibrateError> {
    let name = prepared.target.branch_name(branch);
    let all = |of: fn(&Raw) -> f64| extent(raw.iter().map(of));
    let range = |of: fn(&Raw) -> f64| {
        let column = format!("the rate in the {name} branch");
        pooled_range(&column, options.normalisation, 0.0, all(of))
    };
    let rate_range = range(|raw| raw.signal_rate)?;
    let rate: fn(&Raw) -> f64 = match options.rate_source {
        RateSource::Voltage => |raw| raw.signal_rate,
        RateSource::Strain => |raw| raw.target_rate,
    };
    let fitted_range = range(rate)?;
    let sample = |raw: &Raw| Sample {
        rate: fitted_range.normalise(rate(raw)),
        volts: prepared.signal_range.normalise(raw.signal),
        value: prepared.target_range.normalise(raw.target),
    };
    let [signal_domain, rate_domain] = [all(|raw| raw.signal), all(|raw| raw.signal_rate)];
    let samples: Vec<Folded> = raw.iter().map(|raw| (raw.fold, sample(raw))).collect();
    drop(raw);
    let report = fit(name, Some(branch), &samples, degree, options.robust)?;
    let fitted = BranchSurface {
        rate_range,
        surface: report.surface,
        signal_domain,
        rate_domain,
        fit: report.summary(),
    };
    Ok((fitted, report))
}

/// Triangular factors of the folds (parts of the data for cross-validation).
type Factors = Vec<Factor<f64>>;

/// Fits a polynomial of the given degree to samples.
fn fit(
    name: &'static str,
    branch: Option<Branch>,
    samples: &[Folded],
    degree: Degree,
    robust: Robust,
) -> Result<FitReport, CalibrateError> {
    let failed = |cause| CalibrateError::Fit { branch: name, cause };
    // The order table of a surface compares it with higher degrees. A line has no order table.
    let wide = if branch.is_some() { OrderTable::<f64>::covering(degree) } else { degree };
    let folds = factors(samples, wide).map_err(failed)?;
    let whole = merged(&folds).map_err(failed)?;
    let mut rejected = None;
    let fitted: Fit<f64> = match robust {
        Robust::Off => whole.fit_degree(degree).map_err(failed)?,
        Robust::Bisquare | Robust::Lar => {
            let loss =
                if robust == Robust::Bisquare { Loss::Bisquare } else { Loss::LeastAbsolute };
            let rows = || samples.iter().map(|(_, sample)| *sample);
            let mut memory = vec![0.0; samples.len()];
            let robust = robust_fit(degree, loss, rows, &mut memory).map_err(failed)?;
            rejected = Some(robust.rejected);
            robust.fit
        }
    };
    let step = samples.len().div_ceil(CLOUD).max(1);
    let cloud = samples.iter().step_by(step).map(|(_, s)| [s.rate, s.volts, s.value]).collect();
    Ok(FitReport { rejected, cloud, ..report(name, branch, degree, &folds, &fitted)? })
}

/// Returns the report of a fit, without samples. The `folds` must cover the neighbouring degrees.
fn report(
    name: &'static str,
    branch: Option<Branch>,
    degree: Degree,
    folds: &Factors,
    fitted: &Fit<f64>,
) -> Result<FitReport, CalibrateError> {
    let failed = |cause| CalibrateError::Fit { branch: name, cause };
    let bounds = fitted.confidence(0.95).map_err(failed)?;
    let coefficients = degree
        .exponents()
        .enumerate()
        .filter_map(|(place, (i, j))| {
            let b = bounds.coefficient(place)?;
            Some(Coefficient {
                name: format!("p{i}{j}"),
                rate_power: i,
                signal_power: j,
                estimate: b.estimate,
                lower: b.lower,
                upper: b.upper,
            })
        })
        .collect();
    let (orders, recommended) = match branch {
        Some(_) => {
            let table = OrderTable::new(folds, degree).map_err(failed)?;
            let named = |degree: Degree| degree.to_string();
            (orders(&table, named), table.recommended().map(named))
        }
        None => (Vec::new(), None),
    };
    let model = if branch.is_some() { degree.to_string() } else { "linear".to_owned() };
    Ok(FitReport {
        name: name.to_owned(),
        branch,
        model,
        samples: fitted.samples(),
        sse: fitted.sse(),
        r_squared: fitted.r_squared().unwrap_or(0.0),
        adjusted_r_squared: fitted.adjusted_r_squared().unwrap_or(0.0),
        rmse: fitted.rmse().unwrap_or(0.0),
        condition: fitted.condition(),
        rejected: None,
        coefficients,
        orders,
        recommended,
        cloud: Vec::new(),
        surface: fitted.surface(),
    })
}

/// Greatest number of points in a plot.
const CLOUD: usize = 3000;

/// Returns the triangular factor of each fold, for the given degree.
fn factors(samples: &[Folded], degree: Degree) -> Result<Factors, FitError> {
    let mut sorted: Vec<&Folded> = samples.iter().collect();
    sorted.sort_by_key(|(fold, _)| *fold);
    let factor = |fold: &[&Folded]| {
        let mut sums = SurfaceAccumulator::<f64>::new(degree);
        sums.extend(fold.iter().map(|(_, sample)| *sample))?;
        Ok(sums.factor())
    };
    sorted.chunk_by(|a, b| a.0 == b.0).map(factor).collect()
}

fn merged(folds: &Factors) -> Result<Factor<f64>, FitError> {
    let too_few = FitError::TooFewSamples { needed: 1, got: 0 };
    let (first, rest) = folds.split_first().ok_or(too_few)?;
    let mut whole = *first;
    rest.iter().try_for_each(|fold| whole.merge(fold))?;
    Ok(whole)
}

/// Returns the rows of an order table, with the names of their degrees.
fn orders(table: &OrderTable<f64>, named: impl Fn(Degree) -> String) -> Vec<Order> {
    table
        .rows()
        .map(|(degree, row)| {
            let fitted = row.as_ref().ok();
            let cross_validation = fitted.and_then(|row| row.cross_validation.as_ref().ok());
            Order {
                model: named(*degree),
                terms: degree.terms(),
                r_squared: fitted.and_then(|row| row.r_squared),
                rmse: fitted.and_then(|row| row.rmse),
                cross_validated_rmse: cross_validation.map(|cv| cv.rmse),
                problem: row.as_ref().err().map(ToString::to_string),
            }
        })
        .collect()
}

//! One fit and its report.

use serde::Serialize;
use stretch_core::{Branch, Degree, FitSummary, MAX_TERMS, Model, Surface};
use stretch_fit::{Factor, Fit, FitError, Loss, OrderTable, SurfaceAccumulator, robust_fit};

use crate::{CalibrateError, Robust};

/// A fitted model, a report for each fit, and remarks of one sentence each.
pub(crate) type Fitted = (Model, Vec<FitReport>, Vec<String>);

/// A normalised sample, and the number of the fold that contains it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub fold: usize,
    pub rate: f64,
    pub signal: f64,
    pub target: f64,
}

/// The placeholder for the surface of a model without a surface.
fn no_surface() -> Surface {
    Surface::new(Degree::POLY13, &[0.0; 7]).expect("seven finite coefficients")
}

/// One fitted surface (or line) with its statistics, in normalised units.
#[derive(Debug, Clone, Serialize)]
pub struct FitReport {
    /// Name of the fit: `inflation`, `deflation` or `linear fit`.
    pub name: String,
    /// The branch; `None` for a line.
    #[serde(skip)]
    pub branch: Option<Branch>,
    /// Name of the model, as `poly13` or `linear`.
    pub model: String,
    /// Samples in the fit.
    pub samples: u64,
    /// Sum of squared residuals.
    pub sse: f64,
    /// Coefficient of determination.
    pub r_squared: f64,
    /// Coefficient of determination, adjusted for the number of terms.
    pub adjusted_r_squared: f64,
    /// `sqrt(SSE/(n - p))`, in normalised target.
    pub rmse: f64,
    /// Condition number of the design matrix, with the rows of a ridge where the fit has one. The design matrix of an
    /// observer holds curve, dynamics and time constants.
    pub condition: f64,
    /// Samples that a bisquare fit rejected altogether.
    pub rejected: Option<u64>,
    /// Coefficients with 95 % bounds.
    pub coefficients: Vec<Coefficient>,
    /// Neighbouring orders.
    pub orders: Vec<Order>,
    /// The lowest order that satisfies the acceptance criterion of `stretch_fit::OrderTable`.
    pub recommended: Option<String>,
    /// Samples for a picture, `[rate, signal, target]`, at most a few thousand.
    #[serde(skip)]
    pub cloud: Vec<[f64; 3]>,
    /// The surface, for a picture.
    #[serde(skip)]
    pub surface: Surface,
}

/// A coefficient and its 95 % bounds.
#[derive(Debug, Clone, Serialize)]
pub struct Coefficient {
    /// Name of the coefficient in MATLAB's form: `p12`.
    pub name: String,
    /// Power of the rate.
    pub rate_power: u8,
    /// Power of the signal.
    pub signal_power: u8,
    /// The estimate.
    pub estimate: f64,
    /// Lower bound at 95 %.
    pub lower: f64,
    /// Upper bound at 95 %.
    pub upper: f64,
}

/// One row of the order table.
#[derive(Debug, Clone, Serialize)]
pub struct Order {
    /// Name of the order, as `poly12`.
    pub model: String,
    /// Number of terms.
    pub terms: usize,
    /// Coefficient of determination.
    pub r_squared: Option<f64>,
    /// `sqrt(SSE/(n - p))`.
    pub rmse: Option<f64>,
    /// Root mean square error on data left out of the fit.
    pub cross_validated_rmse: Option<f64>,
    /// Why there are no numbers.
    pub problem: Option<String>,
}

impl Coefficient {
    /// A coefficient that is no power of rate and signal.
    pub(crate) fn named(name: String, estimate: f64, half_width: f64) -> Self {
        let (lower, upper) = (estimate - half_width, estimate + half_width);
        Self { name, rate_power: 0, signal_power: 0, estimate, lower, upper }
    }
}

impl FitReport {
    /// The report of a model that is no surface.
    pub(crate) fn of_model(
        name: String,
        fit: &FitSummary,
        sse: f64,
        condition: f64,
        coefficients: Vec<Coefficient>,
        order: Order,
    ) -> Self {
        let terms = order.terms as f64;
        let dof = (fit.samples as f64 - terms).max(1.0);
        Self {
            model: name.clone(),
            name,
            branch: None,
            samples: fit.samples,
            sse,
            r_squared: fit.r_squared,
            adjusted_r_squared: 1.0 - (1.0 - fit.r_squared) * (fit.samples as f64 - 1.0) / dof,
            rmse: fit.rmse,
            condition,
            rejected: None,
            coefficients,
            recommended: None,
            orders: vec![order],
            cloud: Vec::new(),
            surface: no_surface(),
        }
    }

    pub(crate) fn summary(&self) -> FitSummary {
        FitSummary { samples: self.samples, r_squared: self.r_squared, rmse: self.rmse }
    }

    /// A sentence where cross-validation prefers another order.
    pub(crate) fn note(&self) -> Option<String> {
        let better = self.recommended.as_ref().filter(|r| **r != self.model)?;
        Some(format!(
            "{}: {better} is the order that cross-validation prefers (fitted: {})",
            self.name, self.model
        ))
    }
}

/// The triangular factor of each fold.
pub(crate) type Factors = Vec<Factor<f64, MAX_TERMS>>;

/// The degree that the order table around a surface needs; for a line the degree of the line.
pub(crate) fn widest(branch: Option<Branch>, degree: Degree) -> Degree {
    if branch.is_some() { OrderTable::<f64>::covering(degree) } else { degree }
}

/// Fits `degree` to samples.
pub(crate) fn fit(
    name: &'static str,
    branch: Option<Branch>,
    samples: &[Sample],
    degree: Degree,
    robust: Robust,
) -> Result<(FitReport, Surface), CalibrateError> {
    let failed = |cause| CalibrateError::Fit { branch: name, cause };
    let wide = widest(branch, degree);
    let folds = factors(samples, wide).map_err(failed)?;
    let whole = merged(&folds).map_err(failed)?;
    let mut rejected = None;
    let fitted: Fit<f64, MAX_TERMS> = match robust {
        Robust::Off => whole.fit_degree(degree).map_err(failed)?,
        Robust::Bisquare | Robust::Lar => {
            let loss =
                if robust == Robust::Bisquare { Loss::Bisquare } else { Loss::LeastAbsolute };
            let rows = || samples.iter().map(|s| (s.rate, s.signal, s.target));
            let mut memory = vec![0.0; samples.len()];
            let robust = robust_fit(degree, loss, rows, &mut memory).map_err(failed)?;
            rejected = Some(robust.rejected);
            robust.fit
        }
    };
    let step = samples.len().div_ceil(CLOUD).max(1);
    let cloud = samples.iter().step_by(step).map(|s| [s.rate, s.signal, s.target]).collect();
    report(name, branch, degree, &folds, fitted, Seen { rejected, cloud })
}

/// Parts of a report beside the numbers of the fit.
pub(crate) struct Seen {
    pub rejected: Option<u64>,
    pub cloud: Vec<[f64; 3]>,
}

/// The report of a fit; the `folds` hold the neighbouring orders, too.
pub(crate) fn report(
    name: &'static str,
    branch: Option<Branch>,
    degree: Degree,
    folds: &Factors,
    fitted: Fit<f64, MAX_TERMS>,
    Seen { rejected, cloud }: Seen,
) -> Result<(FitReport, Surface), CalibrateError> {
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
        Some(_) => orders(folds, degree).map_err(failed)?,
        None => (Vec::new(), None),
    };
    let model = if branch.is_some() { degree.to_string() } else { "linear".to_owned() };
    let fit_report = FitReport {
        name: name.to_owned(),
        branch,
        model,
        samples: fitted.samples(),
        sse: fitted.sse(),
        r_squared: fitted.r_squared().unwrap_or(0.0),
        adjusted_r_squared: fitted.adjusted_r_squared().unwrap_or(0.0),
        rmse: fitted.rmse().unwrap_or(0.0),
        condition: fitted.condition(),
        rejected,
        coefficients,
        orders,
        recommended,
        cloud,
        surface: fitted.surface(),
    };
    Ok((fit_report, fitted.surface()))
}

/// Greatest number of points in a picture.
pub(crate) const CLOUD: usize = 3000;

/// The triangular factor of each fold, of the widest degree that the order table needs.
fn factors(samples: &[Sample], degree: Degree) -> Result<Factors, FitError> {
    let folds = samples.iter().map(|s| s.fold).max().map_or(0, |last| last + 1);
    let mut factors = Vec::with_capacity(folds);
    for fold in 0..folds {
        let mut sums = SurfaceAccumulator::<f64, MAX_TERMS, 128>::new(degree)?;
        let rows = samples.iter().filter(|s| s.fold == fold);
        sums.extend(rows.map(|s| (s.rate, s.signal, s.target)))?;
        if sums.samples() > 0 {
            factors.push(sums.factor());
        }
    }
    Ok(factors)
}

pub(crate) fn merged(folds: &Factors) -> Result<Factor<f64, MAX_TERMS>, FitError> {
    let too_few = FitError::TooFewSamples { needed: 1, got: 0 };
    let (first, rest) = folds.split_first().ok_or(too_few)?;
    let mut whole = *first;
    rest.iter().try_for_each(|fold| whole.merge(fold))?;
    Ok(whole)
}

fn orders(folds: &Factors, degree: Degree) -> Result<(Vec<Order>, Option<String>), FitError> {
    let table = OrderTable::new(folds, degree)?;
    let rows = table
        .rows()
        .map(|(degree, row)| Order {
            model: degree.to_string(),
            terms: degree.terms(),
            r_squared: row.as_ref().ok().and_then(|row| row.r_squared),
            rmse: row.as_ref().ok().and_then(|row| row.rmse),
            cross_validated_rmse: row
                .as_ref()
                .ok()
                .and_then(|row| row.cross_validation.as_ref().ok().map(|cv| cv.rmse)),
            problem: row.as_ref().err().map(ToString::to_string),
        })
        .collect();
    Ok((rows, table.recommended().map(|degree| degree.to_string())))
}

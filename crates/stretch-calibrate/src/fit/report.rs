//! The report of a fit.

use serde::Serialize;
use stretch_core::{Branch, Degree, FitSummary, Model, Surface};

/// A fitted model, a report for each fit, and remarks of one sentence each.
pub(crate) type Fitted = (Model, Vec<FitReport>, Vec<String>);

/// A placeholder for models without a surface.
fn no_surface() -> Surface {
    Surface::new(Degree::POLY13, &[0.0; 7]).expect("seven finite coefficients")
}

/// Statistics of one fit, in normalised units.
#[derive(Debug, Clone, Serialize)]
pub struct FitReport {
    /// Name of the fit: the name of the branch, `linear fit`, `curve`, or the name of the model.
    pub name: String,
    /// The branch; `None` if the fit has no branch.
    #[serde(skip)]
    pub branch: Option<Branch>,
    /// Name of the model, such as `poly13` or `linear`.
    pub model: String,
    /// Samples in the fit.
    pub samples: u64,
    /// Sum of squared residuals.
    pub sse: f64,
    /// Coefficient of determination.
    pub r_squared: f64,
    /// Coefficient of determination, adjusted for the number of terms.
    pub adjusted_r_squared: f64,
    /// Standard deviation of the residuals, `sqrt(SSE/(n - p))`, in normalised target. The RMSE of the estimates is
    /// smaller for a short fit, because `p` is not subtracted.
    pub rmse: f64,
    /// Condition number of the design matrix, with the rows of a ridge if the fit has one. The design matrix of an
    /// observer holds curve, dynamics and time constants. The value is 1 for a diagnosed model, because it is not
    /// computed.
    pub condition: f64,
    /// Number of samples with zero weight in a robust fit.
    pub rejected: Option<u64>,
    /// Coefficients with 95 % bounds.
    pub coefficients: Vec<Coefficient>,
    /// Statistics of fits with neighbouring degrees.
    pub orders: Vec<Order>,
    /// The lowest degree that satisfies the acceptance criterion of `stretch_fit::OrderTable`.
    pub recommended: Option<String>,
    /// Samples for a plot, `[rate, signal, target]`, at most a few thousand.
    #[serde(skip)]
    pub cloud: Vec<[f64; 3]>,
    /// The surface, for a plot.
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
    /// Name of the degree, such as `poly12`.
    pub model: String,
    /// Number of terms.
    pub terms: usize,
    /// Coefficient of determination.
    pub r_squared: Option<f64>,
    /// `sqrt(SSE/(n - p))`.
    pub rmse: Option<f64>,
    /// Root mean square error on data left out of the fit.
    pub cross_validated_rmse: Option<f64>,
    /// Reason why there are no numbers.
    pub problem: Option<String>,
}

impl Coefficient {
    /// Returns coefficients of terms that are not powers of rate and signal, with bounds from their standard errors.
    pub(crate) fn named(names: Vec<String>, estimates: &[f64], errors: &[f64]) -> Vec<Self> {
        let all = names.into_iter().zip(estimates).zip(errors);
        all.map(|((name, &estimate), error)| {
            let (lower, upper) = (estimate - 1.96 * error, estimate + 1.96 * error);
            Self { name, rate_power: 0, signal_power: 0, estimate, lower, upper }
        })
        .collect()
    }
}

impl FitReport {
    /// Returns the report of a model that is not a surface.
    pub(crate) fn of_model(
        name: String,
        fit: &FitSummary,
        sse: f64,
        condition: f64,
        coefficients: Vec<Coefficient>,
        terms: usize,
        cross_validated_rmse: Option<f64>,
    ) -> Self {
        let dof = (fit.samples as f64 - terms as f64).max(1.0);
        let order = Order {
            model: name.clone(),
            terms,
            r_squared: Some(fit.r_squared),
            rmse: Some(fit.rmse),
            cross_validated_rmse,
            problem: None,
        };
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

    /// Returns a sentence if cross-validation prefers another degree.
    pub(crate) fn note(&self) -> Option<String> {
        let better = self.recommended.as_ref().filter(|r| **r != self.model)?;
        Some(format!(
            "{}: {better} is the order that cross-validation prefers (fitted: {})",
            self.name, self.model
        ))
    }
}

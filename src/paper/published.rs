//! The figures that the paper prints (its sections 3.1 to 3.4).

use serde::Serialize;

/// A fit as published.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct PublishedFit {
    /// Coefficient of determination.
    pub(crate) r_squared: f64,
    /// RMSE in percent of normalised strain; none for the linear fit.
    pub(crate) rmse_percent: Option<f64>,
}

/// A method's errors as published: average error in percent, RMSE in
/// millimetres (the paper prints them as percent).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct PublishedErrors {
    /// `raw`, `linear` or `non-linear`.
    pub(crate) method: &'static str,
    /// Average error, percent.
    pub(crate) average_error_percent: f64,
    /// RMSE, millimetres.
    pub(crate) rmse_mm: f64,
}

/// Everything that the paper prints and an experiment can be held against.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct PublishedFigures {
    /// The linear fit.
    pub(crate) linear: PublishedFit,
    /// Its slope and intercept.
    pub(crate) line: (f64, f64),
    /// poly13 on inflations: next lower order, chosen, next higher.
    pub(crate) inflation: [PublishedFit; 3],
    /// poly13 on deflations: next lower order, chosen, next higher.
    pub(crate) deflation: [PublishedFit; 3],
    /// Raw, linear and non-linear on arbitrary actuation.
    pub(crate) arbitrary: [PublishedErrors; 3],
    /// Raw, linear and non-linear on pulses.
    pub(crate) pulses: [PublishedErrors; 3],
}

const fn fit(r_squared: f64, rmse_percent: f64) -> PublishedFit {
    PublishedFit { r_squared, rmse_percent: Some(rmse_percent) }
}

const fn errors(method: &'static str, average_error_percent: f64, rmse_mm: f64) -> PublishedErrors {
    PublishedErrors { method, average_error_percent, rmse_mm }
}

/// What the paper prints.
pub(crate) const PUBLISHED: PublishedFigures = PublishedFigures {
    linear: PublishedFit { r_squared: 0.9680, rmse_percent: None },
    line: (0.9744, 0.1757),
    inflation: [fit(0.9806, 4.890), fit(0.9934, 2.851), fit(0.9938, 2.765)],
    deflation: [fit(0.9895, 2.467), fit(0.9943, 1.821), fit(0.9945, 1.798)],
    arbitrary: [
        errors("raw", 14.10, 2.169),
        errors("linear", 18.62, 3.807),
        errors("non-linear", 16.05, 2.777),
    ],
    pulses: [
        errors("raw", 5.180, 0.9266),
        errors("linear", 5.875, 1.845),
        errors("non-linear", 4.863, 1.550),
    ],
};

//! Choice of a signal to calibrate on, by cross-validation.

use serde::Serialize;
use stretch_data::Trial;

use crate::{
    CalibrateError, ModelKind, Options,
    fit::{Calibrated, calibrate},
};

/// A candidate signal and its error on data left out of the fit.
#[derive(Debug, Clone, Serialize)]
pub struct Candidate {
    /// The column.
    pub signal: String,
    /// Root mean square error on data left out, over both branches, in normalised target; `None` where the signal
    /// cannot be calibrated on.
    pub cross_validated_rmse: Option<f64>,
    /// Why the signal cannot be calibrated on.
    pub problem: Option<String>,
}

/// Ranks signals by their cross-validated error with the model of `options`,
/// best first.
///
/// Trials are left out one by one, or tenths of the data when there are fewer
/// than three.
///
/// # Errors
/// [`CalibrateError`] of the first candidate when none can be calibrated on.
pub fn rank_signals(
    trials: &[Trial],
    signals: &[String],
    options: &Options,
) -> Result<Vec<Candidate>, CalibrateError> {
    let mut first_problem = None;
    let mut candidates = Vec::new();
    for signal in signals {
        let surfaces = match options.model {
            ModelKind::Linear => ModelKind::Surface(stretch_core::Degree::LINE),
            surface => surface,
        };
        let with = Options { signal: signal.clone(), model: surfaces, ..options.clone() };
        let (rmse, problem) = match calibrate(trials, &with) {
            Ok(calibrated) => (pooled(&calibrated), None),
            Err(error) => {
                let text = error.to_string();
                first_problem.get_or_insert(error);
                (None, Some(text))
            }
        };
        candidates.push(Candidate { signal: signal.clone(), cross_validated_rmse: rmse, problem });
    }
    let key = |c: &Candidate| c.cross_validated_rmse.unwrap_or(f64::INFINITY);
    candidates.sort_by(|a, b| key(a).total_cmp(&key(b)));
    match (candidates.first().and_then(|c| c.cross_validated_rmse), first_problem) {
        (None, Some(error)) => Err(error),
        _ => Ok(candidates),
    }
}

/// Both branches' cross-validated errors as one, weighted by samples.
fn pooled(calibrated: &Calibrated) -> Option<f64> {
    let mut squares = 0.0;
    let mut samples = 0.0;
    for fit in &calibrated.fits {
        let row = fit.orders.iter().find(|row| row.model == fit.model)?;
        squares += row.cross_validated_rmse?.powi(2) * fit.samples as f64;
        samples += fit.samples as f64;
    }
    Some((squares / samples).sqrt())
}

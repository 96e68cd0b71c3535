//! Fits a calibration to logged trials.

use stretch_core::Calibration;
use stretch_data::Trial;

use crate::{
    CalibrateError, Memory, ModelKind, Options,
    prepare::{Prepared, provenance},
};

use super::{
    diagnosed::{DiagnosedChoice, diagnosed},
    history::{HistoryChoice, history},
    observer::observer,
    observer_model::ObserverChoice,
    report::FitReport,
    surfaces::{curve, linear, surfaces},
};

/// A calibration with the reports and notes of its fit.
#[derive(Debug, Clone)]
pub struct Calibrated {
    /// The calibration.
    pub calibration: Calibration,
    /// The report of the linear fit, or one report for each branch.
    pub fits: Vec<FitReport>,
    /// What may be wrong with the data or the fit, one sentence each.
    pub doubts: Vec<String>,
    /// Changes made to the data before the fit, and remarks on the fit, one sentence each.
    pub notes: Vec<String>,
}

/// Fits a calibration to logged trials.
///
/// The calibration stores the ranges of signal and target over all trials, and the range of the rate for each branch.
/// [`Trial::even`] resamples trials to an even time grid: a few lost samples are interpolated, and long gaps cut a
/// trial. [`Calibrated::notes`] lists the changes.
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

/// Fits a calibration. If `choice` is given, the fit uses it and makes no choices itself. Also returns the choices that
/// were used.
pub(crate) fn calibrate_with(
    trials: &[Trial],
    options: &Options,
    choice: Option<Choice>,
) -> Result<(Calibrated, Option<Choice>), CalibrateError> {
    let mut made = None;
    let prepared = Prepared::new(trials, options)?;
    let (model, fits, mut notes) = match options.model {
        ModelKind::Linear => linear(&prepared, options)?,
        ModelKind::Curve => curve(&prepared, options)?,
        ModelKind::Surface(degree) => surfaces(&prepared, options, degree)?,
        ModelKind::Remembering { kind, rest } => {
            let fit = match kind {
                Memory::History => history,
                Memory::Observer => observer,
                Memory::Diagnosed => diagnosed,
            };
            let (fitted, chosen) = fit(&prepared, rest, choice)?;
            made = Some(chosen);
            fitted
        }
    };
    notes.splice(0..0, prepared.notes.iter().cloned());
    let doubts = prepared.doubts.clone();
    let named = &prepared.options;
    let provenance =
        provenance(&named.date, trials, [&named.signal, &named.reference]).with_time(&named.time);
    let calibration = prepared.calibration(model, provenance)?;
    Ok((Calibrated { calibration, fits, doubts, notes }, made))
}

/// Choices of the fit of a model with memory, such as time constants. A fit to a part of the same data uses the same
/// choices again.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Choice {
    History(HistoryChoice),
    Observer(ObserverChoice),
    Diagnosed(DiagnosedChoice),
}

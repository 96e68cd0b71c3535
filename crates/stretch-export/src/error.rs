//! Errors of an export.

use stretch_calibrate::CalibrateError;
use stretch_receptor::ReceptorError;

/// Why a calibration could not be written in C.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// An integer form was requested, but this model has none.
    #[error("{0}; or export in --form float, which takes the signal instead of a code")]
    NoFixedForm(#[source] CalibrateError),
    /// The codes of the converter represent a signal outside the calibrated range, or the calibration cannot be
    /// serialised.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// A calibration from which no receptor can be created.
    #[error("no receptor can be created from the calibration: {0}")]
    Receptor(#[from] ReceptorError),
    /// A calibration that has no C code in this form. The text says what to do.
    #[error("{0}")]
    Refused(String),
}

impl ExportError {
    /// Returns the error for a model that has no C code.
    pub(crate) fn no_form(model: &str) -> Self {
        Self::Refused(format!(
            "{model} cannot be exported to C; calibrate with --model linear, poly13, curve, observer, observer+rest or diagnosed"
        ))
    }
}

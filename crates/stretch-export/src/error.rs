//! Errors of an export.

use stretch_calibrate::CalibrateError;
use stretch_core::Label;
use stretch_receptor::ReceptorError;

use crate::Form;

/// Why a calibration could not be written in C.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A model that has no C code.
    #[error(
        "{model} cannot be exported to C; calibrate with --model linear, poly13, curve, observer, observer+rest or diagnosed"
    )]
    NoForm {
        /// The model.
        model: String,
    },
    /// An integer form was requested, but this model has none.
    #[error("{0}; or export in --form float, which takes the signal instead of a code")]
    NoFixedForm(#[source] CalibrateError),
    /// The codes of the converter represent a signal outside the calibrated range.
    #[error(transparent)]
    Converter(CalibrateError),
    /// Integers were requested for several gauges.
    #[error(
        "several gauges cannot be exported in integers: leave out --form, or give --form float"
    )]
    FixedArray,
    /// A rate estimator that has C code neither in integers nor in `float`.
    #[error(
        "the rate estimator {rate} cannot be exported to C; calibrate with --rate savgol:WINDOW,DEGREE such as savgol:11,2"
    )]
    Rate {
        /// The estimator.
        rate: String,
    },
    /// A calibration from which no receptor can be created.
    #[error("no receptor can be created from the calibration: {0}")]
    Receptor(#[from] ReceptorError),
    /// In single precision, in which a board computes, the estimate changes by more than a tenth of the fit's error.
    #[error(
        "in 32 bits, as on the board, the estimate of {reference} differs from that in 64 bits by {rms:.3} (root mean square), which is \
         too much because the calibration has an error of only {error:.3}: calibrate the recordings again, because this release expands \
         surfaces about the middle of the signal's range, or subtract the signal's constant offset first"
    )]
    Rounding {
        /// Root mean square difference, in the unit of the reference.
        rms: f64,
        /// Error of the fit, in the unit of the reference.
        error: f64,
        /// Column of the reference.
        reference: Label,
    },
    /// A calibration that cannot be serialised.
    #[error(transparent)]
    NoRecord(CalibrateError),
    /// A converted calibration that does not run on the computer, so that there are no answers to test the C code
    /// against.
    #[error(
        "the calibration in the form {form} does not run on this computer, so that the C code cannot be tested against it"
    )]
    NoAnswers {
        /// The form.
        form: Form,
    },
}

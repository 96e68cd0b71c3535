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
        "{model} has no form in C; those that have are linear, poly13, curve, observer, observer+rest and diagnosed: calibrate with one of them as --model"
    )]
    NoForm {
        /// The model.
        model: String,
    },
    /// An integer form was requested, but this model has none.
    #[error("{0}; or export in --form float, which needs no converter")]
    NoFixedForm(#[source] CalibrateError),
    /// Integers were requested for several gauges.
    #[error("several gauges have no form in integers: leave --form away, or give --form float")]
    FixedArray,
    /// A rate estimator that has no C code in any arithmetic.
    #[error(
        "the rate is {rate}, which has no form in C; calibrate with --rate savgol:WINDOW,DEGREE such as savgol:11,2"
    )]
    Rate {
        /// The estimator.
        rate: String,
    },
    /// A calibration from which no receptor can be created.
    #[error("the calibration gives no receptor: {0}")]
    Receptor(#[from] ReceptorError),
    /// In single precision, in which a board computes, the estimate changes by more than a tenth of the fit's error.
    #[error(
        "in 32 bits, which the board computes in, the estimate of {reference} differs from that in 64 bits by {rms:.3} (root mean square), \
         but the calibration itself is off by {error:.3}: calibrate the recordings again, because this release keeps surfaces about the \
         middle of the signal's range, or subtract the signal's constant offset before"
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
        "the record in the form {form} does not run on the computer; there is nothing to hold the C against"
    )]
    NoAnswers {
        /// The form.
        form: Form,
    },
}

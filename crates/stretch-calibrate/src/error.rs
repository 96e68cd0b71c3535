//! Reasons why there is no calibration.

use stretch_core::{DesignError, Label};
use stretch_filter::FilterError;
use stretch_fit::FitError;
use stretch_receptor::ReceptorError;

use crate::FIXED_STEP;

/// Why trials could not be calibrated on, or a calibration could not be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// No trial at all.
    #[error("there is no trial to calibrate on; name at least one file")]
    NoTrials,
    /// No model can be judged on samples that were left out of its fit.
    #[error(
        "no model can be judged on samples that are left out of its fit: these are too few; record more, or choose one model with --model"
    )]
    TooFewToJudge,
    /// The time stamps give no sample rate.
    #[error("{trial}: {samples} samples are too few to calibrate on; record more")]
    TooShort {
        /// The trial.
        trial: String,
        /// How many samples it has.
        samples: usize,
    },
    /// Trials at different rates cannot share an estimator.
    #[error(
        "{trial} was sampled at {rate_hz:.4} Hz and {first} at {first_hz:.4} Hz; resample one of them, or calibrate them apart"
    )]
    SampleRates {
        /// The trial.
        trial: String,
        /// Sample rate of that trial, Hz.
        rate_hz: f64,
        /// The first trial.
        first: String,
        /// Sample rate of that trial, Hz.
        first_hz: f64,
    },
    /// A channel never changes.
    #[error(
        "{column} is {value} throughout: a constant has no range to normalise by; check the wiring, or name another column"
    )]
    Constant {
        /// The column.
        column: String,
        /// The constant value.
        value: f64,
    },
    /// The trials do not contain one of the directions.
    #[error(
        "the {branch} branch has {samples} samples and the model has {terms} terms; add trials that move that way, or fit --model curve or --model linear, which have no branches"
    )]
    OneBranch {
        /// The branch that is missing.
        branch: &'static str,
        /// How many samples it has.
        samples: u64,
        /// How many terms the model has.
        terms: usize,
    },
    /// The data do not determine a fit.
    #[error("{branch}: {cause}")]
    Fit {
        /// Which fit.
        branch: &'static str,
        /// The error of the fit.
        #[source]
        cause: FitError,
    },
    /// The trials do not determine the numbers of a model.
    #[error(
        "the trials do not determine the {model} model: record trials that move up and down at several speeds, or fit --model linear"
    )]
    Undetermined {
        /// The model.
        model: String,
    },
    /// The diagnosed model was asked for, but no effect was named.
    #[error(
        "no effect of the gauge or its reference was named: diagnose first (stretch diagnose) and give its answer with --from, or fit --model observer"
    )]
    NotDiagnosed,
    /// A cause acts elsewhere, or is unknown.
    #[error("{effect} is no effect of the gauge or its reference; a calibration can use {known}")]
    UnknownCause {
        /// The name that was given.
        effect: String,
        /// The names that are known.
        known: String,
    },
    /// A cause needs a pressure, and a trial has none.
    #[error(
        "{effect} needs the pressure, and {trial} has no column {column}; record it, or leave the effect out"
    )]
    NoPressure {
        /// The cause.
        effect: String,
        /// The trial.
        trial: String,
        /// The column that was looked for.
        column: String,
    },
    /// A signal is an angle that wraps. A calibration reads it sample by sample, and cannot know the turn.
    #[error(
        "{trial}: the signal {column} jumps by {turn} between neighbours: it is an angle that wraps; unwrap it before you calibrate \
         and before you apply, or move its zero so that the motion stays within one turn"
    )]
    WrappedSignal {
        /// The trial.
        trial: String,
        /// The column.
        column: String,
        /// The turn, in the unit of the column.
        turn: f64,
    },
    /// An estimator cannot be designed.
    #[error("the rate estimator cannot be used: {0}")]
    Filter(#[from] FilterError),
    /// The calibration gives no receptor.
    #[error(transparent)]
    Receptor(#[from] ReceptorError),
    /// A number is outside its possible range.
    #[error("the calibration is not possible: {0}")]
    Design(#[from] DesignError),
    /// The model has no form in integers.
    #[error(
        "{model} has no form in integers for a board; those that have are linear, poly13, observer and observer+rest: calibrate with one of them"
    )]
    NoFixedForm {
        /// The model.
        model: String,
    },
    /// The converter has too many bits for arithmetic in integers of 32 bits.
    #[error(
        "a converter of {bits} bits has no form in integers of 32 bits: write it in float (stretch export --c DIR --form float), or \
         give the board the upper 16 bits of each code (--adc 16,ZERO_V,FULL_SCALE_V)"
    )]
    FixedBits {
        /// Bits of the converter.
        bits: u8,
    },
    /// The rate estimator has no form in integers in this program.
    #[error(
        "the rate is {rate}; in integers for a board it can be --rate savgol:WINDOW,DEGREE of degree 1 or 2, window {windows}, without delay"
    )]
    FixedRate {
        /// The estimator.
        rate: String,
        /// The windows that are compiled in.
        windows: String,
    },
    /// An estimate in integers would have steps that are larger than the calibration's error, or coarse for its range.
    #[error(
        "in integers the estimate of {reference} has steps of {FIXED_STEP} in its unit, which are too coarse for a calibration that is off by {error:.2e}: \
         give {reference} in a smaller unit, such as mm in place of m, and calibrate again"
    )]
    FixedStep {
        /// Column of the reference.
        reference: Label,
        /// Error of the fit, in the unit of the reference.
        error: f64,
    },
    /// All of the signal lies outside the converter's range.
    #[error(
        "the signal ran from {min} to {max}, and the converter sees {zero_v} to {full_scale_v}; name the converter that the board has with --adc, in the signal's unit"
    )]
    OutsideConverter {
        /// The least signal of the trials.
        min: f64,
        /// The greatest signal of the trials.
        max: f64,
        /// The signal at code 0.
        zero_v: f64,
        /// The signal at the last code.
        full_scale_v: f64,
    },
    /// Integers over the converter cannot hold the calibration's numbers.
    #[error(
        "the calibration does not fit integers over this converter: {0}; name the converter that the board has with --adc"
    )]
    Fixed(#[source] ReceptorError),
    /// A calibration file does not load.
    #[error("{file}: {problem}")]
    Record {
        /// The file.
        file: String,
        /// The fault of the file, and its place.
        problem: String,
    },
    /// A trial is inconsistent, or lacks a column.
    #[error(transparent)]
    Data(#[from] stretch_data::DataError),
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] stretch_data::files::FileError),
    /// There is nothing to compare, because every sample was withheld.
    #[error("{trial}: no sample has an estimate; {}", why_withheld(*.rate_hz, *.expected_hz))]
    NothingEstimated {
        /// The trial.
        trial: String,
        /// Samples a second of the trial.
        rate_hz: f64,
        /// Samples a second that the calibration is made for.
        expected_hz: f64,
    },
}

/// Share of a calibration's interval by which the usual interval of a log may differ: as much as counts as on time.
pub(crate) const PACE_TOLERANCE: f64 = 0.2;

/// Why no sample of a trial has an estimate. Samples that come more slowly than a calibration expects have lost samples between them, and the
/// rate estimator begins anew at each.
fn why_withheld(rate_hz: f64, expected_hz: f64) -> String {
    if (expected_hz / rate_hz - 1.0).abs() > PACE_TOLERANCE {
        format!(
            "it has {rate_hz:.4} samples a second, and the calibration is made for {expected_hz}: resample it (stretch convert --grid {expected_hz})"
        )
    } else {
        "it is shorter than the warm-up of the rate estimator".to_owned()
    }
}

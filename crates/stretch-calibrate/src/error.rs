//! Errors of calibrations.

use stretch_core::{DesignError, Label};
use stretch_data::{Trial, in_digits};
use stretch_filter::FilterError;
use stretch_fit::FitError;
use stretch_receptor::ReceptorError;

use crate::{FIXED_STEP, PRESSURE, record::GIVE_ADC};

/// Error of a fit to trials, or of the use of a calibration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// There is no trial.
    #[error("there is no trial to calibrate on; name at least one file")]
    NoTrials,
    /// No model can be evaluated on samples that were left out of its fit.
    #[error(
        "{samples} samples are too few to compare models, because parts of them and 2 s on either side of each part are left out of the fit: \
         record a minute of motion, or choose one model with --model"
    )]
    TooFewToJudge {
        /// Number of samples of all trials.
        samples: usize,
    },
    /// The trial has too few samples.
    #[error("{trial}: {samples} samples are too few to calibrate on; record a minute of motion")]
    TooShort {
        /// The trial.
        trial: String,
        /// Number of samples of the trial.
        samples: usize,
    },
    /// Trials at different rates cannot share an estimator.
    #[error(
        "{trial} was sampled at {rate_hz:.4} Hz and {first} at {first_hz:.4} Hz; resample one of them \
         (stretch convert --grid {first_hz:.4}), or calibrate them separately"
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
    /// Signal and reference are the same column.
    #[error(
        "{column} is both the signal and the reference, but a calibration needs two columns: choose another column, or record a reference, such as length_mm, in the same file"
    )]
    SameColumn {
        /// The column.
        column: String,
    },
    /// One of the two branches (directions of motion) has too few samples.
    #[error(
        "the {branch} branch (one direction of motion) has only {samples} samples for the {terms} terms of the model; \
         add trials that move in this direction, or fit --model curve or --model linear, which have no branches"
    )]
    OneBranch {
        /// The branch that is missing.
        branch: &'static str,
        /// Number of samples in the branch.
        samples: u64,
        /// Number of terms of the model.
        terms: usize,
    },
    /// The data do not determine a fit.
    #[error("{branch}: {cause}")]
    Fit {
        /// Name of the fit.
        branch: &'static str,
        /// The error of the fit.
        #[source]
        cause: FitError,
    },
    /// The trials do not determine the numbers of a model.
    #[error(
        "the trials do not determine the {model} model: record trials that move up and down at several speeds{}",
        or_linear(.model)
    )]
    Undetermined {
        /// The model.
        model: String,
    },
    /// The diagnosed model was asked for, but no effect was named.
    #[error(
        "--model diagnosed needs the effects of the gauge or its reference: run stretch diagnose first and give \
         its result with --from, or fit --model observer"
    )]
    NotDiagnosed,
    /// A given cause (an effect that a diagnosis named) is not an effect of the gauge or of its reference.
    #[error(
        "{effect} is not an effect of the gauge or its reference; a calibration can use {known}"
    )]
    UnknownCause {
        /// The name that was given.
        effect: String,
        /// The names that are accepted.
        known: String,
    },
    /// A cause needs a pressure, and a trial has none.
    #[error(
        "{effect} needs the pressure, and {trial} has no column {PRESSURE}; record it, or leave the effect out"
    )]
    NoPressure {
        /// The cause.
        effect: String,
        /// The trial.
        trial: String,
    },
    /// The signal is an angle that wraps. A calibration reads it sample by sample and therefore cannot count its turns.
    #[error(
        "{trial}: the signal {column} jumps by {turn} between neighbouring samples, because it is an angle that wraps; unwrap it before \
         you calibrate and before you apply the calibration, or move its zero so that the motion stays within one turn"
    )]
    WrappedSignal {
        /// The trial.
        trial: String,
        /// The column.
        column: String,
        /// One full turn, in the unit of the column.
        turn: f64,
    },
    /// An estimator cannot be designed.
    #[error("the rate estimator cannot be used: {0}")]
    Filter(#[from] FilterError),
    /// The receptor cannot be built from the calibration.
    #[error(transparent)]
    Receptor(#[from] ReceptorError),
    /// A number is outside its valid range.
    #[error("the calibration is not possible: {}", in_words(.0))]
    Design(#[from] DesignError),
    /// The model has no integer form.
    #[error(
        "{model} has no integer form for a board; calibrate with --model linear, poly13, observer or observer+rest"
    )]
    NoFixedForm {
        /// The model.
        model: String,
    },
    /// The converter has too many bits for 32-bit integer arithmetic.
    #[error(
        "codes of a converter of {bits} bits are too large for 32-bit integers: export in float (stretch export --c DIR --form float), or \
         give the board the upper 16 bits of each code (--adc 16,ZERO,FULL_SCALE)"
    )]
    FixedBits {
        /// Bits of the converter.
        bits: u8,
    },
    /// The rate estimator has no integer form in this program.
    #[error(
        "the rate estimator {rate} has no integer form for a board; calibrate with \
         --rate savgol:WINDOW,DEGREE of degree 1 or 2, window {windows}, without delay"
    )]
    FixedRate {
        /// The estimator.
        rate: String,
        /// The windows that are compiled in.
        windows: String,
    },
    /// The steps of an integer estimate would be too large, compared with the error of the fit or with the range of the
    /// target.
    #[error(
        "in integers the estimate of {reference} has steps of {FIXED_STEP} in its unit, which are too coarse for a \
         calibration with an error of {error:.2e}: convert {reference} to a smaller unit, such as mm instead of m, and calibrate again"
    )]
    FixedStep {
        /// Column of the reference.
        reference: Label,
        /// Error of the fit, in the unit of the reference.
        error: f64,
    },
    /// Thousandths of the reference's unit exceed 32 bits.
    #[error(
        "in integers the estimate of {reference} is in thousandths of its unit, and {} of that unit do not fit 32 bits: convert \
         {reference} to a larger unit, such as kN instead of N, and calibrate again",
        in_digits(*.largest, 4)
    )]
    FixedRange {
        /// Column of the reference.
        reference: Label,
        /// The largest magnitude of the reference.
        largest: f64,
    },
    /// All of the signal lies outside the converter's range, or within a few of its codes.
    #[error(
        "the signal {signal} of the trials is between {} and {}, but the converter measures from {zero_v} to {full_scale_v}{}: this is not \
         the board's converter; {GIVE_ADC}",
        in_digits(*.min, 4),
        in_digits(*.max, 4),
        if *.codes > 0.0 { format!(", in which the signal has only {codes:.1} codes") } else { String::new() }
    )]
    OutsideConverter {
        /// Column of the signal.
        signal: Label,
        /// The least signal of the trials.
        min: f64,
        /// The greatest signal of the trials.
        max: f64,
        /// The signal at code 0.
        zero_v: f64,
        /// The signal at the last code.
        full_scale_v: f64,
        /// The number of codes between the least and the greatest signal; 0 if both lie outside.
        codes: f64,
    },
    /// The numbers of the calibration do not fit integers with this converter.
    #[error(
        "the calibration cannot be converted to integers for this converter: {}; give the converter of the board with --adc",
        without_internal_names(.0)
    )]
    Fixed(#[source] ReceptorError),
    /// A calibration file does not load.
    #[error("{file}: {problem}")]
    Record {
        /// The file.
        file: String,
        /// The fault and its place in the file.
        problem: String,
    },
    /// A trial is inconsistent, or lacks a column.
    #[error(transparent)]
    Data(#[from] stretch_data::DataError),
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] stretch_data::files::FileError),
    /// There are no estimates to compare, because every sample was withheld.
    #[error("{trial}: no sample has an estimate; {}", why_withheld(*.rate_hz, *.expected_hz))]
    NothingEstimated {
        /// The trial.
        trial: String,
        /// Sample rate of the trial, Hz.
        rate_hz: f64,
        /// Sample rate of the calibration, Hz.
        expected_hz: f64,
    },
}

impl CalibrateError {
    /// Returns the error for trials with too few samples to compare models.
    ///
    /// ```
    /// let error = stretch_calibrate::CalibrateError::too_few_to_judge(&[]);
    /// assert!(error.to_string().starts_with("0 samples are too few"));
    /// ```
    pub fn too_few_to_judge(trials: &[Trial]) -> Self {
        Self::TooFewToJudge { samples: trials.iter().map(Trial::len).sum() }
    }
}

/// Describes a fault that follows from the unit of the signal. Any other fault keeps its own text.
fn in_words(error: &DesignError) -> String {
    match error {
        DesignError::OutOfRange { field: "step of observer.curve", value } => format!(
            "the signal changes too little, by {value:e} of its unit between two points of its curve: convert it to a smaller unit, such as \
             uA instead of A, and calibrate again"
        ),
        other => other.to_string(),
    }
}

/// Describes why numbers do not fit integers, without the names of those numbers.
fn without_internal_names(error: &ReceptorError) -> String {
    match error {
        ReceptorError::Calibration(
            DesignError::OutOfRange { field, .. } | DesignError::TooLarge { field, .. },
        ) if field.starts_with("fixed.") => {
            "with its codes a number of the calibration is too large or too coarse for 32 bits"
                .to_owned()
        }
        other => other.to_string(),
    }
}

/// Largest relative difference between the median sample interval of a log and the sample interval of the calibration
/// for which both count as equal.
pub(crate) const PACE_TOLERANCE: f64 = 0.2;

/// Returns the advice to fit a line, except for the models of `stretch-sleeve`, which replace `--model`.
fn or_linear(model: &str) -> &'static str {
    if matches!(model, "array" | "prior") { "" } else { ", or fit --model linear" }
}

/// Explains why no sample of a trial has an estimate. If samples come more slowly than a calibration expects, samples
/// are missing between them, and the rate estimator restarts at each sample.
fn why_withheld(rate_hz: f64, expected_hz: f64) -> String {
    if (expected_hz / rate_hz - 1.0).abs() > PACE_TOLERANCE {
        format!(
            "it has {rate_hz:.4} samples a second, but the calibration needs {expected_hz}: resample it (stretch convert --grid {expected_hz})"
        )
    } else {
        "it is shorter than the warm-up of the rate estimator: use a longer trial".to_owned()
    }
}

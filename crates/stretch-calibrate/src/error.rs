//! Why there is no calibration.

use stretch_core::DesignError;
use stretch_filter::FilterError;
use stretch_fit::FitError;

/// Why trials could not be calibrated on, or a calibration could not be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// No trial at all.
    #[error("there is no trial to calibrate on; name at least one file")]
    NoTrials,
    /// No model can be judged on samples that were left out of its fit.
    #[error(
        "no model can be judged on samples that are left out of its fit: these are too few; record more, or name one with --model"
    )]
    TooFewToJudge,
    /// The time stamps give no sample rate.
    #[error("{trial}: {samples} samples are too few to tell a sample rate from; record more")]
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
        /// Its rate.
        rate_hz: f64,
        /// The first trial.
        first: String,
        /// Its rate.
        first_hz: f64,
    },
    /// A channel that never changes.
    #[error(
        "{column} is {value} throughout: a constant has no range to normalise by; check the wiring, or name another column"
    )]
    Constant {
        /// The column.
        column: String,
        /// Its value.
        value: f64,
    },
    /// A direction that the trials do not contain.
    #[error(
        "the {branch} branch has {samples} samples and the model has {terms} terms; add trials in which the muscle moves that way, or fit --model linear"
    )]
    OneBranch {
        /// The branch that is missing.
        branch: &'static str,
        /// How many samples it has.
        samples: u64,
        /// How many terms the model has.
        terms: usize,
    },
    /// A fit that the data do not determine.
    #[error("{branch}: {cause}")]
    Fit {
        /// Which fit.
        branch: &'static str,
        /// What the fit said.
        #[source]
        cause: FitError,
    },
    /// A model whose numbers the trials do not determine.
    #[error(
        "the trials do not determine the {model} model: record trials that move up and down at several speeds, or fit --model linear"
    )]
    Undetermined {
        /// The model.
        model: String,
    },
    /// A model of what was named, and nothing was.
    #[error(
        "no effect of the gauge or its reference was named: diagnose first (stretch diagnose) and give its answer with --from, or fit --model observer"
    )]
    NotDiagnosed,
    /// A cause that acts elsewhere, or that nobody knows.
    #[error("{effect} is no effect of the gauge or its reference; a calibration can use {known}")]
    UnknownCause {
        /// The name.
        effect: String,
        /// Those that there are.
        known: String,
    },
    /// A cause that needs a pressure, in trials without.
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
    /// An estimator that cannot be designed.
    #[error("the rate estimator cannot be used: {0}")]
    Filter(#[from] FilterError),
    /// A number that is not possible.
    #[error("the calibration is not possible: {0}")]
    Design(#[from] DesignError),
    /// A model that has no form in integers.
    #[error(
        "{model} has no form in integers for a board; those that have are linear, poly13, observer and observer+rest: name one with --model"
    )]
    NoFixedForm {
        /// The model.
        model: String,
    },
    /// A rate that has no form in integers here.
    #[error(
        "the rate is {rate}; in integers for a board it can be --rate savgol:WINDOW,DEGREE of degree 1 or 2, window {windows}, without delay"
    )]
    FixedRate {
        /// The estimator.
        rate: String,
        /// The windows that there are.
        windows: String,
    },
    /// A converter that never sees the signal.
    #[error(
        "the signal ran from {min} to {max}, and the converter sees {zero_v} to {full_scale_v}; name the converter that the board has with --adc, in the signal's unit"
    )]
    OutsideConverter {
        /// The least signal of the trials.
        min: f64,
        /// The greatest.
        max: f64,
        /// The signal at code 0.
        zero_v: f64,
        /// The signal at the last code.
        full_scale_v: f64,
    },
    /// A calibration whose numbers integers over the converter cannot hold.
    #[error(
        "the calibration does not fit integers over this converter: {0}; name the converter that the board has with --adc"
    )]
    Fixed(#[source] DesignError),
    /// A calibration file that does not load.
    #[error("{file}: {problem}")]
    Record {
        /// The file.
        file: String,
        /// What is wrong with it, and where.
        problem: String,
    },
    /// A log that cannot be held as a whole, for a model that needs that.
    #[error(
        "{model} is fitted to a whole log, of at most {most} rows; fit a line or a surface by least squares (--model poly13), or \
         give fewer rows (--grid HZ, a part of the log)"
    )]
    TooLong {
        /// What was to be fitted.
        model: String,
        /// Most rows.
        most: u64,
    },
    /// A trial that does not hold together, or lacks a column.
    #[error(transparent)]
    Data(#[from] stretch_data::DataError),
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] stretch_files::FileError),
    /// A log could not be read.
    #[error(transparent)]
    Log(Box<dyn std::error::Error + Send + Sync>),
    /// Nothing to compare: every sample was withheld.
    #[error(
        "{trial}: no sample has an estimate; it is shorter than the warm-up of the rate estimator"
    )]
    NothingEstimated {
        /// The trial.
        trial: String,
    },
}

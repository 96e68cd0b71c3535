//! Errors of calibrations.

use stretch_core::DesignError;
use stretch_data::Trial;
use stretch_filter::FilterError;
use stretch_fit::FitError;
use stretch_receptor::ReceptorError;

/// Error of a fit to trials, or of the use of a calibration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// There is no trial.
    #[error("there is no trial to calibrate on; name at least one file")]
    NoTrials,
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
    /// The trials, the options or the converter do not permit the requested operation. The text gives advice.
    #[error("{0}")]
    Refused(String),
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
    /// An estimator cannot be designed.
    #[error("the rate estimator cannot be used: {0}")]
    Filter(#[from] FilterError),
    /// The receptor cannot be built from the calibration.
    #[error(transparent)]
    Receptor(#[from] ReceptorError),
    /// A number is outside its valid range.
    #[error("the calibration is not possible: {}", in_words(.0))]
    Design(#[from] DesignError),
    /// The calibration cannot be converted to integers, whatever the converter is.
    #[error("{0}")]
    NoFixedForm(String),
    /// The converter does not measure the signal of the trials.
    #[error("{0}")]
    OutsideConverter(String),
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
}

impl CalibrateError {
    /// Returns the error for trials with too few samples to compare models.
    ///
    /// ```
    /// let error = stretch_calibrate::CalibrateError::too_few_to_judge(&[]);
    /// assert!(error.to_string().starts_with("0 samples are too few"));
    /// ```
    pub fn too_few_to_judge(trials: &[Trial]) -> Self {
        let samples: usize = trials.iter().map(Trial::len).sum();
        Self::Refused(format!(
            "{samples} samples are too few to compare models, because parts of them and 2 s on either side of each part are left out of the fit: \
             record a minute of motion, or choose one model with --model"
        ))
    }

    /// Returns the error for a trial with too few samples.
    ///
    /// ```
    /// let trial = stretch_data::Trial { name: "a.csv".into(), ..Default::default() };
    /// let error = stretch_calibrate::CalibrateError::too_short(&trial);
    /// assert!(error.to_string().starts_with("a.csv: 0 samples are too few"));
    /// ```
    pub fn too_short(trial: &Trial) -> Self {
        let (name, samples) = (&trial.name, trial.len());
        Self::Refused(format!(
            "{name}: {samples} samples are too few to calibrate on; record a minute of motion"
        ))
    }
}

/// Returns the message for an invalid number. If the cause is the unit of the signal, the message says so.
fn in_words(error: &DesignError) -> String {
    match error {
        DesignError::OutOfRange { field: "step of observer.curve", value } => format!(
            "the signal changes too little, by {value:e} of its unit between two points of its curve: convert it to a smaller unit, such as \
             uA instead of A, and calibrate again"
        ),
        other => other.to_string(),
    }
}

/// Returns the message for a calibration that does not fit integers. Names of internal numbers are left out.
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

/// Two sample intervals count as equal up to this relative difference: the median interval of a log and the interval of
/// the calibration.
pub(crate) const PACE_TOLERANCE: f64 = 0.2;

/// Returns the end of an error message, with the advice to fit a line. It is empty for the models of `stretch-sleeve`,
/// because `--model` does not select them.
fn or_linear(model: &str) -> &'static str {
    if matches!(model, "array" | "prior") { "" } else { ", or fit --model linear" }
}

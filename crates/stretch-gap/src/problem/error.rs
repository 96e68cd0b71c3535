//! The reasons for which a diagnosis is refused.

use crate::problem::{checks::DescriptionError, simulator::Simulator};

/// The reason for which a diagnosis was refused, with the relevant values.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GapError {
    /// The simulator's description is invalid.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// A measured channel has fewer finite samples than the trials. A value of 1e100 or more counts
    /// as infinite.
    #[error(
        "{stage}: only the first {found} measured samples are finite and below 1e100, but the trials have {needed} samples; give such a \
         number for each sample"
    )]
    Measured {
        /// The stage.
        stage: String,
        /// Number of finite samples before the first that is not finite.
        found: usize,
        /// Number of samples in all trials.
        needed: usize,
    },
    /// The simulator failed with the requested values, or could not be connected to its
    /// measurements.
    #[error(transparent)]
    Simulator(Box<dyn std::error::Error + Send + Sync>),
    /// There are too few data to fit.
    #[error("{what}: {hint}")]
    TooLittle {
        /// Description of what is missing.
        what: String,
        /// What to do.
        hint: String,
    },
    /// The integration step is so long that halving it changes the output by an amount that is not
    /// small compared with the noise.
    #[error(
        "{stage}: halving the step of integration moves the output by {moved} times its noise, so the step is too long for an accurate \
         result: a number in the rig file makes this stage much faster than a real rig (a volume that is too small, a conductance, \
         friction or time constant in another unit); if the simulator is your own, shorten its step"
    )]
    Solver {
        /// The stage.
        stage: String,
        /// Root mean square change of the output, in multiples of the noise.
        moved: f64,
    },
    /// A simulated output was not finite, or so large that the sum of its squares would overflow.
    #[error(
        "{stage}: the simulation gave {value:e} at {time_s} s of {trial}, which is no output of a machine{}",
        in_parentheses(.asked)
    )]
    NotFinite {
        /// The stage.
        stage: String,
        /// The value.
        value: f64,
        /// Time of the first such value in its trial, s.
        time_s: f64,
        /// Name of the trial.
        trial: String,
        /// The parameter values of the run; empty if they are not known.
        asked: String,
    },
    /// The simulator process ended, or it sends answers without a request, so that later answers
    /// cannot be trusted.
    #[error(transparent)]
    Broken(Box<dyn std::error::Error + Send + Sync>),
    /// The probabilities of the hypotheses are not finite.
    #[error(
        "the probabilities of the hypotheses are not numbers (the error of the re-tuned simulator is {retuned:e} times the noise): check the \
         noise that is stated; if it is right, this is an error of the program"
    )]
    NoProbability {
        /// Gap that remains after re-tuning, in multiples of the noise variance.
        retuned: f64,
    },
    /// The budget of model runs is used up.
    #[error(
        "the budget of {budget} model runs is spent before there is an answer; allow at least {least} runs"
    )]
    Spent {
        /// Number of runs that are allowed.
        budget: usize,
        /// The smallest budget that is sufficient for a diagnosis.
        least: usize,
    },
    /// The caller stopped the diagnosis.
    #[error("stopped")]
    Stopped,
}

/// Returns `None` if a run failed or the budget is used up, for results that a diagnosis can do
/// without.
pub(crate) fn if_possible<T>(found: Result<T, GapError>) -> Result<Option<T>, GapError> {
    match found {
        Err(error) if error.is_of_runs() => Ok(None),
        found => found.map(Some),
    }
}

/// Returns `None` if a run failed, for results that a search can do without.
pub(crate) fn unless_lost<T>(found: Result<T, GapError>) -> Result<Option<T>, GapError> {
    match found {
        Err(error) if error.is_lost() => Ok(None),
        found => found.map(Some),
    }
}

/// Returns a space and the text in parentheses; nothing if the text is empty.
fn in_parentheses(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(" ({text})") }
}

/// An error of the simulator, with the parameter values of the run.
#[derive(Debug)]
struct Asked {
    error: Box<dyn std::error::Error + Send + Sync>,
    asked: String,
}

impl std::fmt::Display for Asked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.error, self.asked)
    }
}

impl std::error::Error for Asked {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.error.source()
    }
}

impl GapError {
    /// Whether a run failed or the budget is used up. The diagnosis may then continue without that
    /// result.
    ///
    /// ```
    /// use stretch_gap::GapError;
    /// assert!(GapError::simulator("the solver did not converge").is_of_runs());
    /// assert!(!GapError::Stopped.is_of_runs());
    /// let (stage, trial) = ("arm".to_owned(), "a.csv".to_owned());
    /// let beyond = GapError::NotFinite { stage, value: 1e160, time_s: 1.5, trial, asked: String::new() };
    /// assert!(beyond.is_of_runs());
    /// assert_eq!(
    ///     beyond.to_string(),
    ///     "arm: the simulation gave 1e160 at 1.5 s of a.csv, which is no output of a machine"
    /// );
    /// ```
    pub fn is_of_runs(&self) -> bool {
        self.is_lost() || matches!(self, Self::Spent { .. })
    }

    /// Whether the simulator failed to simulate the requested values.
    pub(crate) fn is_lost(&self) -> bool {
        matches!(self, Self::Simulator(_) | Self::NotFinite { .. })
    }

    /// Adds the parameter values of the failed run to the error.
    pub(crate) fn asked(self, asked: String) -> Self {
        match self {
            Self::Simulator(error) => Self::Simulator(Box::new(Asked { error, asked })),
            Self::NotFinite { stage, value, time_s, trial, .. } => {
                Self::NotFinite { stage, value, time_s, trial, asked }
            }
            other => other,
        }
    }

    /// Creates the error for an output of a stage that is not finite. `at` is the index of the
    /// sample, counted from the start of the first trial.
    pub fn not_finite(simulator: &dyn Simulator, stage: usize, (at, value): (usize, f64)) -> Self {
        let (mut trial, mut sample) = (String::new(), at);
        for spec in simulator.trials() {
            trial.clone_from(&spec.name);
            if sample < spec.samples {
                break;
            }
            sample -= spec.samples;
        }
        let time_s = sample as f64 * simulator.dt_s();
        let stage = simulator.stages()[stage].name.clone();
        Self::NotFinite { stage, value, time_s, trial, asked: String::new() }
    }

    /// Wraps an error of the simulator itself.
    ///
    /// ```
    /// use stretch_gap::GapError;
    /// let error = GapError::simulator("the solver did not converge");
    /// assert_eq!(error.to_string(), "the solver did not converge");
    /// ```
    pub fn simulator(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Simulator(error.into())
    }
}

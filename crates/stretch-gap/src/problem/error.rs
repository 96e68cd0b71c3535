//! Why a diagnosis was refused.

use crate::problem::{checks::DescriptionError, simulator::Simulator};

/// Why a diagnosis was refused; carries the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GapError {
    /// The simulator's description does not hold together.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// A measured channel does not have as many finite samples as the trials; 1e100 and more is as good as infinite.
    #[error(
        "{stage}: {found} measured samples in a row are finite and below 1e100, the trials hold {needed}; give one such number for each sample"
    )]
    Measured {
        /// The stage.
        stage: String,
        /// Finite samples from the first.
        found: usize,
        /// Samples of all trials.
        needed: usize,
    },
    /// The simulator refused these values, or could not be bound to its measurements.
    #[error(transparent)]
    Simulator(Box<dyn std::error::Error + Send + Sync>),
    /// There is nothing to fit on.
    #[error("{what}: {hint}")]
    TooLittle {
        /// What is missing.
        what: String,
        /// What to do.
        hint: String,
    },
    /// Integration is too coarse for the noise.
    #[error(
        "{stage}: halving the step of integration moves the output by {moved} of its noise, so that what is computed is not yet what its equations say: a number of the rig file makes this stage much faster than a rig is (a volume that is too small, a conductance, friction or time constant in another unit); of a simulator of your own, shorten the step"
    )]
    Solver {
        /// The stage.
        stage: String,
        /// Root mean square change in multiples of the noise.
        moved: f64,
    },
    /// A simulated output was not finite, or so great that sums of its square would not be.
    #[error(
        "{stage}: the simulation gave {value:e} at {time_s} s of trial {trial}, which is no output of a machine{}",
        in_parentheses(.asked)
    )]
    NotFinite {
        /// The stage.
        stage: String,
        /// What it gave.
        value: f64,
        /// Time of that sample in its trial, s.
        time_s: f64,
        /// Name of the trial.
        trial: String,
        /// The values that it was asked for; empty where they are not known.
        asked: String,
    },
    /// The simulator is gone, or gives answers without a question: nothing that it said since can be relied on.
    #[error(transparent)]
    Broken(Box<dyn std::error::Error + Send + Sync>),
    /// Probabilities of the hypotheses are no numbers.
    #[error(
        "the probabilities of the hypotheses are no numbers (the re-tuned simulator leaves {retuned:e} times the noise): check the noise that is stated; if that is right, this is an error of the program"
    )]
    NoProbability {
        /// Gap that the re-tuned simulator leaves, in variances of the noise.
        retuned: f64,
    },
    /// No more runs may be made.
    #[error(
        "the budget of {budget} model runs is spent before there is an answer; give {least} or more, the least that one needs"
    )]
    Spent {
        /// Runs that may be made.
        budget: usize,
        /// The least budget with which there is an answer.
        least: usize,
    },
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
}

/// What an answer can do without: `None` if a run for it failed, or may not be made any more.
pub(crate) fn if_possible<T>(found: Result<T, GapError>) -> Result<Option<T>, GapError> {
    match found {
        Err(error) if error.is_of_runs() => Ok(None),
        found => found.map(Some),
    }
}

/// What a search can do without: `None` if a run for it failed.
pub(crate) fn unless_lost<T>(found: Result<T, GapError>) -> Result<Option<T>, GapError> {
    match found {
        Err(error) if error.is_lost() => Ok(None),
        found => found.map(Some),
    }
}

/// A text in parentheses behind a space; nothing of an empty one.
fn in_parentheses(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(" ({text})") }
}

/// An error of the simulator, with the values that it was asked for.
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
    /// Whether all ends: other errors take the candidate out whose values could not be simulated.
    pub(crate) fn ends_all(&self) -> bool {
        matches!(self, Self::Stopped | Self::Broken(_))
    }

    /// Whether runs failed, or may not be made any more: an answer may go on without what they were for.
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
    ///     "arm: the simulation gave 1e160 at 1.5 s of trial a.csv, which is no output of a machine"
    /// );
    /// ```
    pub fn is_of_runs(&self) -> bool {
        self.is_lost() || matches!(self, Self::Spent { .. })
    }

    /// Whether the simulator could not simulate what it was asked for.
    pub(crate) fn is_lost(&self) -> bool {
        matches!(self, Self::Simulator(_) | Self::NotFinite { .. })
    }

    /// The same error of a run, with the values that were asked for.
    pub(crate) fn asked(self, asked: String) -> Self {
        match self {
            Self::Simulator(error) => Self::Simulator(Box::new(Asked { error, asked })),
            Self::NotFinite { stage, value, time_s, trial, .. } => {
                Self::NotFinite { stage, value, time_s, trial, asked }
            }
            other => other,
        }
    }

    /// That a stage gave a value that is no output, `at` samples after the first of all trials.
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

    /// An error of the simulator itself.
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

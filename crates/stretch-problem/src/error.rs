//! Why a problem was refused.

use stretch_data::DataError;
use stretch_gap::{DescriptionError, GapError};
use stretch_recording::RecordingError;
use stretch_sim::{GridError, SimError};

/// Why a problem was refused; the message says where, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// The problem's file or its recordings could not be read, or the recordings could not be brought onto one grid.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Stages, parameters, effects and trials of the problem contradict one another.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// A name is unknown.
    #[error("{owner}: there is no {what} {name}{meant}; there are {known}")]
    Unknown {
        /// Entry that holds the name.
        owner: String,
        /// Kind of the entry that the name should match.
        what: &'static str,
        /// The name.
        name: String,
        /// A known name that may be meant, in parentheses.
        meant: String,
        /// The known names.
        known: String,
    },
    /// A value is not allowed, or the values of a column are not plausible.
    #[error("{owner}: {found}; {hint}")]
    Value {
        /// Entry or column that holds the value.
        owner: String,
        /// What is wrong.
        found: String,
        /// What to do.
        hint: String,
    },
    /// A simulator could not be started.
    #[error("{0}")]
    Simulator(String),
    /// The rig or an effect was refused.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A rig file was refused.
    #[error("{file}: {cause}")]
    RigFile {
        /// The file.
        file: String,
        /// What is wrong in the file.
        #[source]
        cause: SimError,
    },
    /// There are too few data to fit.
    #[error("{what}: {hint}")]
    TooLittle {
        /// What is missing.
        what: String,
        /// What to do.
        hint: String,
    },
    /// A simulated output was not finite.
    #[error(
        "{stage}: the simulation gave a number that is not finite; a parameter of the rig is too large or too small"
    )]
    NotFinite {
        /// The stage.
        stage: String,
    },
}

/// Refuses a sample rate outside 1e-3 .. 1e7 Hz, because such time stamps are in another unit. The
/// check comes before any time is converted to samples.
pub(crate) fn check_rate(dt_s: f64) -> Result<(), ProblemError> {
    if (1e-7..=1e3).contains(&dt_s) {
        return Ok(());
    }
    let hint = "rates from 0.001 to 10 000 000 Hz are understood; is the time in seconds?";
    Err(ProblemError::value("time_s", format!("a sample every {dt_s} s"), hint))
}

impl From<GridError> for ProblemError {
    fn from(error: GridError) -> Self {
        Self::Sim(error.into())
    }
}

impl ProblemError {
    /// The error for a name that is not among the known ones.
    pub(crate) fn unknown<'a>(
        owner: impl Into<String>,
        what: &'static str,
        name: &str,
        known: impl Iterator<Item = &'a str> + Clone,
    ) -> Self {
        let meant = stretch_data::nearest(name, known.clone());
        Self::Unknown {
            owner: owner.into(),
            what,
            name: name.to_owned(),
            meant: meant.map_or(String::new(), |other| format!(" (did you mean {other}?)")),
            known: known.collect::<Vec<_>>().join(", "),
        }
    }

    pub(crate) fn value(
        owner: impl Into<String>,
        found: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self::Value { owner: owner.into(), found: found.into(), hint: hint.into() }
    }

    /// Returns the error for a column that stays constant.
    pub(crate) fn dead(column: impl Into<String>, found: String) -> Self {
        Self::value(column, found, "the channel is dead: check the sensor and its cable")
    }

    /// Returns the error for too few samples to fit.
    pub(crate) fn few_samples(samples: usize, least: usize) -> Self {
        let what = format!("the trials to fit have {samples} samples");
        Self::too_little(what, format!("at least {least} are needed for a diagnosis"))
    }

    pub(crate) fn too_little(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::TooLittle { what: what.into(), hint: hint.into() }
    }
}

impl From<ProblemError> for GapError {
    fn from(error: ProblemError) -> Self {
        Self::simulator(error)
    }
}

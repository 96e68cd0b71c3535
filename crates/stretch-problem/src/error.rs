//! Why a problem was refused.

use stretch_data::DataError;
use stretch_gap::{DescriptionError, GapError};
use stretch_recording::RecordingError;

/// Why a problem was refused; says where and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// The problem's file or its recordings could not be read, or the recordings not be brought onto one grid.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A recording could not be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// What the problem is made of does not hold together.
    #[error(transparent)]
    Description(#[from] DescriptionError),
    /// A name that stands for nothing.
    #[error("{owner}: there is no {what} {name}{meant}; there are {known}")]
    Unknown {
        /// Entry that names it.
        owner: String,
        /// What is named.
        what: &'static str,
        /// The name.
        name: String,
        /// What may be meant, in parentheses.
        meant: String,
        /// What there is.
        known: String,
    },
    /// A value that does not do.
    #[error("{owner}: {found}; {hint}")]
    Value {
        /// Entry that holds it.
        owner: String,
        /// What is wrong.
        found: String,
        /// What to do.
        hint: String,
    },
    /// A simulator that could not be started.
    #[error("{0}")]
    Simulator(String),
}

impl ProblemError {
    /// A name that is not among those known.
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
}

impl From<ProblemError> for GapError {
    fn from(error: ProblemError) -> Self {
        Self::simulator(error)
    }
}

//! Why a problem was refused.

use std::fmt;

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
    /// The rig or an effect was refused.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// An entry, a column, a rig file or a simulator was refused. The message says where, what is wrong, and what to do.
    #[error("{0}")]
    Refused(String),
}

impl From<GridError> for ProblemError {
    fn from(error: GridError) -> Self {
        Self::Sim(error.into())
    }
}

impl ProblemError {
    /// The error for a name that is not among the known ones.
    pub(crate) fn unknown<'a>(
        owner: impl fmt::Display,
        what: &str,
        name: &str,
        known: impl Iterator<Item = &'a str> + Clone,
    ) -> Self {
        let all: Vec<&str> = known.clone().collect();
        Self::unknown_among(owner, (what, name), known, &all.join(", "))
    }

    /// As [`ProblemError::unknown`], with the known names in other words.
    pub(crate) fn unknown_among<'a>(
        owner: impl fmt::Display,
        (what, name): (&str, &str),
        known: impl Iterator<Item = &'a str>,
        all: &str,
    ) -> Self {
        let meant = stretch_data::nearest(name, known);
        let meant = meant.map_or(String::new(), |other| format!(" (did you mean {other}?)"));
        Self::Refused(format!("{owner}: there is no {what} {name}{meant}; there are {all}"))
    }

    /// The error for a value that is not allowed, or a column whose values are not plausible.
    pub(crate) fn value(
        owner: impl fmt::Display,
        found: impl fmt::Display,
        hint: impl fmt::Display,
    ) -> Self {
        Self::Refused(format!("{owner}: {found}; {hint}"))
    }

    /// Returns the error for a column that stays constant.
    pub(crate) fn dead(column: impl fmt::Display, found: String) -> Self {
        let hint = "the channel is dead: check the sensor and its cable, or take the column out if it is optional";
        Self::value(column, found, hint)
    }

    /// Returns the error for data that do not suffice.
    pub(crate) fn too_little(what: impl fmt::Display, hint: impl fmt::Display) -> Self {
        Self::Refused(format!("{what}: {hint}"))
    }
}

impl From<ProblemError> for GapError {
    fn from(error: ProblemError) -> Self {
        Self::simulator(error)
    }
}

//! Reasons why an FMU cannot be the simulator of a problem.

use std::{fmt::Display, path::Path};

/// Why an FMU cannot be the simulator of a problem: one sentence that names the file or the name, the problem and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FmuError(pub(crate) String);

impl FmuError {
    /// Returns an error of a file.
    pub(crate) fn of(file: &Path, why: impl Display) -> Self {
        Self(format!("{}: {why}", file.display()))
    }
}

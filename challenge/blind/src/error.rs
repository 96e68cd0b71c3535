//! Errors when cases are written, sealed or scored.

use std::path::{Path, PathBuf};

/// Failure of the blind check, with its evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BlindError {
    /// A file or folder could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A JSON file is not what it should be.
    #[error("{path}: {source}")]
    Json {
        /// The file, or the name of the text.
        path: PathBuf,
        /// What the parser said.
        source: serde_json::Error,
    },
    /// The sealed labels are not the ones whose hash was printed.
    #[error("the seal is broken: labels hash to {found}, the seal says {sealed}")]
    SealBroken {
        /// Hash written when the cases were made.
        sealed: String,
        /// Hash of the labels as they are now.
        found: String,
    },
    /// The folder already holds a sealed set of cases.
    #[error("{path} already holds cases: make the new ones in an empty folder")]
    Occupied {
        /// The folder.
        path: PathBuf,
    },
    /// No rig could be drawn whose sleeve stays stretched with the active effect.
    #[error("case {case}: no rig drawn in {tries} tries keeps its sleeve stretched")]
    NoRig {
        /// Number of the case.
        case: usize,
        /// How many rigs were drawn.
        tries: usize,
    },
    /// A diagnosis, a field of a submission or of a family of forms is not what it should be.
    #[error("{field}: {reason}")]
    Field {
        /// The case, or the field with its place: `cases.case-003.probabilities`.
        field: String,
        /// What is wrong with it, and what to do.
        reason: String,
    },
}

impl BlindError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }

    pub(crate) fn field(field: &str, reason: impl Into<String>) -> Self {
        Self::Field { field: field.to_owned(), reason: reason.into() }
    }

    pub(crate) fn json(path: &Path) -> impl FnOnce(serde_json::Error) -> Self + '_ {
        move |source| Self::Json { path: path.to_path_buf(), source }
    }
}

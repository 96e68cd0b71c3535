//! Errors when cases are written, sealed or scored.

use std::path::{Path, PathBuf};

/// Reason why the blind check failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BlindError {
    /// A file or folder could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A JSON file is invalid.
    #[error("{path}: {source}")]
    Json {
        /// Path of the file, or name of the text.
        path: PathBuf,
        /// Error of the parser.
        source: serde_json::Error,
    },
    /// The hash of the labels differs from the one that was printed when they were sealed.
    #[error("the seal is broken: labels hash to {found}, the seal says {sealed}")]
    SealBroken {
        /// Hash written when the cases were made.
        sealed: String,
        /// Present hash of the labels.
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
        /// Number of rigs that were drawn.
        tries: usize,
    },
    /// A diagnosis, a field of a submission or a family of forms is invalid.
    #[error("{field}: {reason}")]
    Field {
        /// The case, or the path of the field, such as `cases.case-003.probabilities`.
        field: String,
        /// What is wrong, and what to do.
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

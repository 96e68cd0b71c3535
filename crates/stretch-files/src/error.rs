//! Why something could not be written.

use std::{fmt, io};

/// Why a file or folder could not be written, or read.
///
/// Each message is one sentence that says where, what, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The system refused to open, read, write, or rename.
    #[error("{path}: cannot {action}: {}", Cause(.cause))]
    Io {
        /// The file or folder.
        path: String,
        /// What was tried: `open it`, `write it`.
        action: &'static str,
        /// What the system said.
        #[source]
        cause: io::Error,
    },
    /// Something that is in the way of a folder.
    #[error("{path}: it exists and is not an empty folder; choose another name")]
    Exists {
        /// What is there.
        path: String,
    },
    /// Stopped by [`interrupt`](crate::interrupt).
    #[error("{path}: interrupted; nothing was written")]
    Interrupted {
        /// What was being written.
        path: String,
    },
}

/// A cause without Rust's `(os error 28)`.
struct Cause<'a>(&'a io::Error);

impl fmt::Display for Cause<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.0.to_string();
        f.write_str(text.split(" (os error").next().unwrap_or(&text))
    }
}

impl FileError {
    /// What the system said when `action` (`open it`, `write it`) was tried.
    pub fn io(path: impl fmt::Display, action: &'static str, cause: io::Error) -> Self {
        Self::Io { path: path.to_string(), action, cause }
    }
}

//! Files and folders that are written completely or not at all.
//!
//! Everything is built under a temporary name in the folder of its target, synced to disk, and then
//! renamed. After an error, a full disk or Ctrl-C the target is unchanged and no temporary file
//! remains. A process that is killed outright may leave a `.stretch-*.tmp` behind, which can be
//! deleted.

mod draft;
mod folder;
mod inputs;
mod outputs;
mod stream;

use std::{
    collections::BTreeMap,
    fmt, fs, io,
    io::Read,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use crate::error::without_numbers;
#[doc(hidden)]
pub use draft::ask_before_disk_calls;
pub use draft::{clean_up_and_exit, without_temporary_names};
pub use inputs::{guard_inputs, is_input, open_input, rewrites};
pub use outputs::{Outputs, write_folder, write_whole};
pub use stream::is_standard_output;

/// Why a file or folder could not be written or read.
///
/// Each message is one sentence that states the place, the problem and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The system refused to open, read, write, or rename.
    #[error("{path}: cannot {action}: {}", without_numbers(&.cause.to_string()))]
    Io {
        /// The file or folder.
        path: String,
        /// The attempted action: `open it`, `write it`.
        action: &'static str,
        /// The system's error.
        #[source]
        cause: io::Error,
    },
    /// A target of a folder that exists and is not an empty folder.
    #[error("{path}: it exists and is not an empty folder; choose another name")]
    Exists {
        /// The path.
        path: String,
    },
}

impl FileError {
    /// Returns an error with the system's `cause`. `action` is `open it` or `write it`.
    pub fn io(path: impl fmt::Display, action: &'static str, cause: io::Error) -> Self {
        Self::Io { path: path.to_string(), action, cause }
    }

    fn exists(path: &Path) -> Self {
        Self::Exists { path: path.display().to_string() }
    }
}

/// Largest file that is read in one piece, bytes. Calibration files, settings and diagnoses have
/// kilobytes.
const LARGEST: u64 = 64 << 20;

/// Bytes from standard input and pipes, kept because a stream can be read only once and may be
/// needed twice.
static STREAMS: Mutex<BTreeMap<PathBuf, Vec<u8>>> = Mutex::new(BTreeMap::new());

/// Reads a file; `-` is standard input. Bytes from standard input are kept, so that a second reader
/// gets the same. In a process that has called [`guard_inputs`], this also holds for pipes
/// (`<(...)` of a shell).
///
/// # Errors
/// Errors of the system; a file or stream larger than 64 MiB; a file that the command is going to
/// overwrite.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// std::fs::write(folder.path().join("a"), "b")?;
/// assert_eq!(stretch_data::files::read_whole(folder.path().join("a"))?, b"b");
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn read_whole(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    let path = path.as_ref();
    let is_stdin = path.as_os_str() == "-";
    let is_pipe = || fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir());
    let comes_once = is_stdin || inputs::are_guarded() && is_pipe();
    if !comes_once {
        return bounded(open_input(path)?);
    }
    let mut streams = STREAMS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(bytes) = streams.get(path) {
        return Ok(bytes.clone());
    }
    let bytes = if is_stdin { bounded(io::stdin().lock()) } else { bounded(open_input(path)?) }?;
    streams.insert(path.to_owned(), bytes.clone());
    Ok(bytes)
}

fn bounded(from: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        let most = LARGEST >> 20;
        return Err(io::Error::other(format!(
            "it is larger than {most} MB, the limit for a file of this kind"
        )));
    }
    Ok(bytes)
}

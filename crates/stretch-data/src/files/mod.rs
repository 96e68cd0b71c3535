//! Files and folders that are written whole or not at all.
//!
//! Everything is built under a temporary name in the folder of its target, reaches the disk, and is then renamed. After an error,
//! a full disk or Ctrl-C the target is as it was and no temporary name stays. A process that is killed outright may leave a
//! `.stretch-*.tmp` behind, which holds nothing that is needed.

mod draft;
mod folder;
mod outputs;
mod stream;

use std::{fmt, fs, io, io::Read, path::Path, sync::OnceLock};

#[doc(hidden)]
pub use draft::ask_before_disk_calls;
pub use draft::{clean_up_and_exit, without_temporary_names};
pub use outputs::{Outputs, write_folder, write_whole};
pub use stream::is_standard_output;

/// Why a file or folder could not be written, or read.
///
/// Each message is one sentence that says where, what, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The system refused to open, read, write, or rename.
    #[error("{path}: cannot {action}: {}", without_number(.cause))]
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
}

impl FileError {
    /// What the system said when `action` (`open it`, `write it`) was tried.
    pub fn io(path: impl fmt::Display, action: &'static str, cause: io::Error) -> Self {
        Self::Io { path: path.to_string(), action, cause }
    }

    fn exists(path: &Path) -> Self {
        Self::Exists { path: path.display().to_string() }
    }
}

/// A cause without Rust's `(os error 28)`.
fn without_number(cause: &io::Error) -> String {
    let text = cause.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_owned()
}

/// The largest file that is read as one piece, bytes: records, settings and diagnoses have kilobytes.
const LARGEST: u64 = 64 << 20;

/// What came on standard input, because it comes only once and may be asked for twice.
static STDIN: OnceLock<Vec<u8>> = OnceLock::new();

/// Reads a file, `-` being standard input. What came there is kept, and a second reader gets the same.
///
/// # Errors
/// What the system says, and a file of more than 64 MiB or a stream that goes on so long.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// std::fs::write(folder.path().join("a"), "b")?;
/// assert_eq!(stretch_data::files::read_whole(folder.path().join("a"))?, b"b");
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn read_whole(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    let path = path.as_ref();
    if path.as_os_str() != "-" {
        return bounded(fs::File::open(path)?);
    }
    if let Some(bytes) = STDIN.get() {
        return Ok(bytes.clone());
    }
    let bytes = bounded(io::stdin().lock())?;
    Ok(STDIN.get_or_init(|| bytes).clone())
}

fn bounded(from: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        let most = LARGEST >> 20;
        return Err(io::Error::other(format!(
            "it is larger than {most} MB, as no file of this kind is"
        )));
    }
    Ok(bytes)
}

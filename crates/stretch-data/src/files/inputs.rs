//! A guard against overwriting the inputs of a command, under whatever name they appear as outputs.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use super::{FileError, draft::real, is_standard_output};

/// The guard of this process. `None` in a process that does not run a single command, such as a
/// Python interpreter: it may read a file now and legitimately replace it an hour later.
static GUARD: Mutex<Option<Guard>> = Mutex::new(None);

fn guard() -> MutexGuard<'static, Option<Guard>> {
    GUARD.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Debug, Default)]
struct Guard {
    outputs: Vec<Output>,
    /// The files that were read, with their paths as given.
    inputs: BTreeMap<Identity, PathBuf>,
}

#[derive(Debug)]
struct Output {
    /// The option with its path.
    shown: String,
    real: PathBuf,
    /// The file that already exists there.
    file: Option<Identity>,
}

/// Identity of a file or folder under all its names: device and inode on Unix, elsewhere the canonical path.
#[cfg(unix)]
type Identity = [u64; 2];
#[cfg(not(unix))]
type Identity = PathBuf;

#[cfg(unix)]
pub(super) fn identity(_: &Path, meta: &fs::Metadata) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    Some([meta.dev(), meta.ino()])
}

#[cfg(not(unix))]
pub(super) fn identity(path: &Path, _: &fs::Metadata) -> Option<Identity> {
    fs::canonicalize(path).ok()
}

/// Returns `None` for anything that is not a regular file: pipes, devices, folders, missing files.
fn identity_of_file(path: &Path) -> Option<Identity> {
    let meta = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    identity(path, &meta)
}

/// Prevents the process from overwriting its own inputs. After this call, [`open_input`] refuses a file that one of
/// these outputs would replace, and every function that writes refuses a file that was read.
///
/// A program calls this function once, with the options that name outputs, before its command
/// starts. Without this call nothing is refused.
///
/// # Errors
/// Two outputs that are the same file, or of which one lies in the other; an output that is also
/// standard input.
pub fn guard_inputs(outputs: impl IntoIterator<Item = (String, PathBuf)>) -> Result<(), FileError> {
    let mut guarded = Guard::default();
    let stdin = identity_of_file(Path::new("/dev/stdin"));
    for (option, path) in outputs {
        let is_stream = fs::metadata(&path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir());
        if is_stream || is_standard_output(&path) {
            continue;
        }
        let shown = format!("{option} {}", path.display());
        let (real, file) = (real(&path), identity_of_file(&path));
        let is_same = |other: &&Output| {
            file.is_some() && file == other.file
                || real.starts_with(&other.real)
                || other.real.starts_with(&real)
        };
        let problem = if let Some(Output { shown: other, .. }) =
            guarded.outputs.iter().find(is_same)
        {
            format!(
                "{other} is the same file, or one lies in the other; choose another path for one of them"
            )
        } else if file.is_some() && file == stdin {
            "it is also standard input; choose another file".to_owned()
        } else {
            guarded.outputs.push(Output { shown, real, file });
            continue;
        };
        return Err(FileError::io(shown, "write it", io::Error::other(problem)));
    }
    *guard() = Some(guarded);
    Ok(())
}

/// Whether [`guard_inputs`] was called.
pub(super) fn are_guarded() -> bool {
    guard().is_some()
}

/// Opens a file for reading. Every input of a command is opened here, or registered with
/// [`is_input`].
///
/// # Errors
/// Errors of the system; a file that the command is going to overwrite ([`guard_inputs`]).
///
/// ```
/// use stretch_data::files::{guard_inputs, open_input, write_whole};
/// let folder = tempfile::tempdir()?;
/// let [trial, link] = ["a.csv", "link.csv"].map(|name| folder.path().join(name));
/// std::fs::write(&trial, "time_s\n0\n")?;
/// std::fs::hard_link(&trial, &link)?;
/// guard_inputs([("--out".to_owned(), link.clone())])?;
/// let refused = open_input(&trial).unwrap_err().to_string();
/// assert!(refused.contains("--out") && refused.contains("link.csv"), "{refused}");
/// // what no option names is refused where it is written
/// guard_inputs([])?;
/// open_input(&trial)?;
/// let refused = write_whole(&link, |_| Ok(())).unwrap_err().to_string();
/// assert!(refused.contains("a.csv"), "{refused}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn open_input(path: impl AsRef<Path>) -> io::Result<File> {
    is_input(&path)?;
    File::open(path)
}

/// Registers a file that is read without [`open_input`], for example by another program such as a
/// simulator.
///
/// # Errors
/// A file that the command is going to overwrite.
pub fn is_input(path: impl AsRef<Path>) -> io::Result<()> {
    let path = path.as_ref();
    let mut guard = guard();
    let (Some(guard), Some(own)) = (guard.as_mut(), identity_of_file(path)) else { return Ok(()) };
    let output = guard.outputs.iter().find(|output| output.file.as_ref() == Some(&own));
    let refused = output.map(|Output { shown, .. }| {
        format!("{shown} would overwrite it, and the command reads it; choose another output file")
    });
    // Also registered if it is refused, so that a caller who ignores the error still cannot
    // overwrite the file.
    guard.inputs.insert(own, path.to_owned());
    refused.map_or(Ok(()), |why| Err(io::Error::other(why)))
}

/// Permits overwriting a file that was read, for a command that updates the file in place.
pub fn rewrites(path: impl AsRef<Path>) {
    if let (Some(guard), Some(own)) = (guard().as_mut(), identity_of_file(path.as_ref())) {
        guard.inputs.remove(&own);
    }
}

/// Refuses to write a file that was read.
pub(super) fn check_output(path: &Path) -> io::Result<()> {
    let guard = guard();
    let input = || guard.as_ref()?.inputs.get(&identity_of_file(path)?);
    match input() {
        Some(input) => Err(io::Error::other(format!(
            "this command reads {}; choose another output",
            input.display()
        ))),
        None => Ok(()),
    }
}

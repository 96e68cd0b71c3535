//! A file that is written whole or not at all.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use tempfile::{Builder, NamedTempFile};

use crate::{
    DataError,
    interrupt::{Open, check, interrupted},
};

/// Writes a file whole or not at all.
///
/// `fill` writes into a temporary file beside the target, which takes the target's name
/// only when everything has reached the disk. On any error (a full disk, a folder that may
/// not be written to, [`interrupt`](crate::interrupt), an error of `fill`) the temporary file
/// goes and what stood under the target's name still stands. A symbolic link stays one: the
/// file that it points to is replaced. Devices and pipes (`/dev/stdout`) are written to
/// directly. Output is buffered. The path `-` is standard output.
///
/// # Errors
/// [`DataError::Io`] with path and cause, or [`DataError::Interrupted`].
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("cal.json");
/// stretch_data::write_whole(&path, |out| out.write_all(b"{}"))?;
/// assert!(stretch_data::write_whole(&path, |_| Err(std::io::Error::other("no"))).is_err());
/// assert_eq!(std::fs::read(&path)?, b"{}", "still the old one");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_whole(
    path: impl AsRef<Path>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), DataError> {
    let path = path.as_ref();
    let shown = path.display();
    let _open = Open::new(&shown)?;
    if path.as_os_str() == "-" {
        let mut out = BufWriter::new(Stoppable(io::stdout().lock()));
        let written = fill(&mut out).and_then(|()| out.flush());
        return written.map_err(|cause| DataError::io("standard output", "write it", cause));
    }
    let result = match target(path)? {
        Target::Direct => write_direct(path, fill),
        Target::Replace(real) => replace(&real, fill),
    };
    result.map_err(|cause| {
        // A writer that was stopped fails with some error; the reason is the interrupt.
        match check(&shown) {
            Err(interrupted) => interrupted,
            Ok(()) => DataError::io(shown, "write it", cause),
        }
    })
}

enum Target {
    Direct,
    Replace(PathBuf),
}

/// What stands at the path, and which file is behind it.
fn target(path: &Path) -> Result<Target, DataError> {
    let fail = |cause| DataError::io(path.display(), "write it", cause);
    let meta = match fs::metadata(path) {
        Ok(meta) => meta,
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            return Ok(Target::Replace(path.to_owned()));
        }
        Err(e) => return Err(fail(e)),
    };
    if meta.is_dir() {
        return Err(fail(io::Error::other("it is a folder")));
    }
    if !meta.is_file() || path.starts_with("/dev") || path.starts_with("/proc") {
        return Ok(Target::Direct);
    }
    if meta.permissions().readonly() {
        return Err(fail(io::Error::other("it is read-only")));
    }
    fs::canonicalize(path).map(Target::Replace).map_err(fail)
}

fn write_direct(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let file = OpenOptions::new().write(true).open(path)?;
    let mut out = BufWriter::new(Stoppable(file));
    fill(&mut out)?;
    out.flush()
}

fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let folder = folder_of(path);
    let temporary = temporary_file(folder)?;
    let mut out = BufWriter::with_capacity(1 << 16, Stoppable(temporary));
    fill(&mut out)?;
    out.flush()?;
    let Stoppable(temporary) = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    if let Ok(meta) = fs::metadata(path) {
        temporary.as_file().set_permissions(meta.permissions())?;
    }
    temporary.as_file().sync_all()?;
    if interrupted() {
        return Err(io::Error::other("interrupted"));
    }
    temporary.persist(path).map_err(|e| e.error)?;
    sync_folder(folder);
    Ok(())
}

fn temporary_file(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".stretch-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Narrowed by the umask, as for any new file.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder).map_err(without_path)
}

/// The cause alone: the name of a temporary file would only puzzle.
pub(crate) fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.rsplit_once(" at path ") {
        Some((cause, _)) => io::Error::new(error.kind(), cause.to_owned()),
        None => error,
    }
}

/// The folder that a path stands in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Makes a rename durable, where the system can.
pub(crate) fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        // Not every file system syncs folders; the rename itself has happened.
        let _ = folder.sync_all();
    }
}

/// Fails once [`interrupt`](crate::interrupt) was called.
struct Stoppable<W>(W);

impl<W: Write> Write for Stoppable<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if interrupted() {
            return Err(io::Error::other("interrupted"));
        }
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

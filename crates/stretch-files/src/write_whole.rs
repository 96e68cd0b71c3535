//! A file that is written whole or not at all.

use std::{
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use tempfile::{Builder, NamedTempFile};

use crate::{
    FileError,
    disk::{self, DiskCall, ask},
    interrupt::{Open, check, interrupted},
    stream,
    temporary::without_path,
};

/// Writes a file whole or not at all.
///
/// `fill` writes into a temporary file beside the target, which takes the target's name
/// only when everything has reached the disk. On any error (a full disk, a folder that may
/// not be written to, [`interrupt`](crate::interrupt), an error of `fill`) the temporary file
/// goes and what stood under the target's name still stands. A symbolic link stays one: the
/// file that it points to is replaced. Output is buffered.
///
/// The path `-` is standard output, and so is `/dev/stdout`. Pipes and devices are written to as
/// the bytes come; a pipe that nobody reads is refused after two seconds, and so are standard
/// input and disks. Several files that belong together: [`Outputs`](crate::Outputs).
///
/// # Errors
/// [`FileError::Io`] with path and cause, or [`FileError::Interrupted`].
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("cal.json");
/// stretch_files::write_whole(&path, |out| out.write_all(b"{}"))?;
/// assert!(stretch_files::write_whole(&path, |_| Err(std::io::Error::other("no"))).is_err());
/// assert_eq!(std::fs::read(&path)?, b"{}", "still the old one");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_whole(
    path: impl AsRef<Path>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    let path = path.as_ref();
    match target(path)? {
        Target::Stream(stream) => write_stream(path, stream, fill),
        Target::File(real) => {
            let _open = Open::new(&path.display())?;
            let whole = stage(&real, fill).and_then(|file| replace(file, &real));
            whole.map_err(|cause| cannot_write(path, cause))
        }
    }
}

/// What stands at a path, and which file is behind it.
pub(crate) enum Target {
    Stream(Box<dyn Write>),
    File(PathBuf),
}

pub(crate) fn target(path: &Path) -> Result<Target, FileError> {
    check(&path.display())?;
    let fail = |cause| FileError::io(path.display(), "write it", cause);
    let meta = match fs::metadata(path) {
        Ok(meta) if meta.is_dir() => return Err(fail(io::Error::other("it is a folder"))),
        Ok(meta) => Some(meta),
        Err(e) if e.kind() == io::ErrorKind::NotFound => None,
        Err(e) => return Err(fail(e)),
    };
    if let Some(stream) = stream::open(path, meta.as_ref()).map_err(fail)? {
        return Ok(Target::Stream(stream));
    }
    let Some(meta) = meta else { return Ok(Target::File(path.to_owned())) };
    if meta.permissions().readonly() {
        return Err(fail(io::Error::other("it is read-only")));
    }
    fs::canonicalize(path).map(Target::File).map_err(fail)
}

/// What `fill` writes, as it comes: nothing has to be cleaned up, so Ctrl-C need not wait.
pub(crate) fn write_stream(
    path: &Path,
    stream: Box<dyn Write>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    let mut out = BufWriter::new(Stoppable(stream));
    let written = fill(&mut out).and_then(|()| out.flush());
    // what nobody took is not tried again
    let _ = out.into_parts();
    let is_stdout = stream::is_standard_output(path);
    written.map_err(|cause| match is_stdout {
        true => FileError::io("standard output", "write it", cause),
        false => cannot_write(path, cause),
    })
}

/// A file beside the target that holds everything, on the disk.
pub(crate) fn stage(
    real: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<NamedTempFile> {
    let mut out = BufWriter::with_capacity(1 << 16, Stoppable(temporary_file(folder_of(real))?));
    fill(&mut out)?;
    out.flush()?;
    let Stoppable(temporary) = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    if let Ok(meta) = fs::metadata(real) {
        temporary.as_file().set_permissions(meta.permissions())?;
    }
    disk::sync(temporary.as_file())?;
    Ok(temporary)
}

/// Gives a staged file its name.
fn replace(file: NamedTempFile, real: &Path) -> io::Result<()> {
    if interrupted() {
        return Err(io::Error::other("interrupted"));
    }
    ask(DiskCall::Rename)?;
    file.persist(real).map_err(|e| e.error)?;
    disk::sync_folder(folder_of(real));
    Ok(())
}

/// A writer that was stopped fails with some error; the reason is the interrupt.
pub(crate) fn cannot_write(path: &Path, cause: io::Error) -> FileError {
    match check(&path.display()) {
        Err(interrupted) => interrupted,
        Ok(()) => FileError::io(path.display(), "write it", cause),
    }
}

fn temporary_file(folder: &Path) -> io::Result<NamedTempFile> {
    ask(DiskCall::Create)?;
    let mut builder = Builder::new();
    builder.prefix(".stretch-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Narrowed by the umask, as for any new file.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(without_path)?;
    // Held until the file has its name or its writer is gone, so that whoever clears up can tell the two; where files cannot
    // be locked, nobody clears up.
    let _ = file.as_file().try_lock();
    Ok(file)
}

/// The folder that a path stands in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Fails once [`interrupt`](crate::interrupt) was called.
struct Stoppable<W>(W);

impl<W: Write> Write for Stoppable<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if interrupted() {
            return Err(io::Error::other("interrupted"));
        }
        ask(DiskCall::Write)?;
        self.0.write(bytes).map_err(without_path)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush().map_err(without_path)
    }
}

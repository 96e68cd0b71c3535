//! Output of one file, one folder, or several that belong together.

use std::{
    fs::{self, Metadata},
    io::{self, BufWriter, Write},
    path::Path,
};

use super::{
    FileError,
    draft::{Draft, ask, sync},
    folder::{check, complete, lock},
    inputs::check_output,
    is_standard_output,
    stream::open_stream,
};

/// Writes a file completely or not at all.
///
/// `fill` writes into a temporary file next to the target. The file is renamed to the target only
/// after everything has reached the disk. After any error (a full disk, a folder without write
/// permission, an error of `fill`) the old file is unchanged. If the target is a symbolic link, the
/// file that it points to is replaced. Output is buffered.
///
/// The path `-` is standard output, and so is `/dev/stdout`. Pipes and devices are written to directly. A pipe without
/// a reader is refused after two seconds. Standard input and disks are refused as targets. If the reader of a pipe or
/// of standard output closes it early, this is not an error.
///
/// A file that this process has read as an input is not overwritten
/// ([`guard_inputs`](super::guard_inputs)).
///
/// # Errors
/// [`FileError::Io`] with path and cause.
///
/// ```
/// use stretch_data::files::write_whole;
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("cal.json");
/// write_whole(&path, |out| out.write_all(b"{}"))?;
/// assert!(write_whole(&path, |_| Err(std::io::Error::other("no"))).is_err());
/// assert_eq!(std::fs::read(&path)?, b"{}", "still the old one");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_whole(
    path: impl AsRef<Path>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    let mut outputs = Outputs::default();
    outputs.file(path, fill)?;
    outputs.keep()
}

/// Writes a folder completely or not at all.
///
/// `fill` writes into an empty folder next to the target. Then the folder is synced to disk and
/// renamed to the target. After any error the target is unchanged.
///
/// A target that is not an empty folder is refused unless `force` is set. With `force`, files of
/// the same name are replaced. If the new folder is a data set, trials listed in the old
/// `dataset.toml` with a matching digest are removed. All other files in the old folder are the
/// user's and are kept. On Linux and macOS the two folders swap their names in one step, so a kill
/// leaves either the old folder or the new one. On other systems the old folder is moved aside
/// first.
///
/// # Errors
/// [`FileError::Exists`], [`FileError::Io`], or an error of `fill`.
///
/// ```
/// use stretch_data::files::{FileError, write_folder, write_whole};
/// let parent = tempfile::tempdir()?;
/// let out = parent.path().join("bench-07");
/// let fill = |folder: &std::path::Path| {
///     write_whole(folder.join("a.csv"), |file| file.write_all(b"time_s\n0\n"))
/// };
/// write_folder(&out, false, fill)?;
/// let again = write_folder(&out, false, fill);
/// assert!(matches!(again, Err(FileError::Exists { .. })));
/// std::fs::write(out.join("notes.txt"), "mine")?;
/// write_folder(&out, true, fill)?;
/// assert!(out.join("a.csv").is_file() && out.join("notes.txt").is_file());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_folder<E: From<FileError>>(
    path: impl AsRef<Path>,
    force: bool,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let mut outputs = Outputs::default();
    outputs.folder(path, force, fill)?;
    Ok(outputs.keep()?)
}

/// The outputs of one command. All of them are on the disk under temporary names before any of them
/// is renamed to its target.
///
/// If one output cannot be written, no target is changed. A kill between two renames leaves each target complete, with
/// either its old or its new content.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let [record, report] = ["cal.json", "none/cal.html"].map(|name| folder.path().join(name));
/// let mut outputs = stretch_data::files::Outputs::default();
/// outputs.file(&record, |out| out.write_all(b"{}"))?;
/// assert!(outputs.file(&report, |out| out.write_all(b"<html>")).is_err(), "there is no folder");
/// drop(outputs);
/// assert!(!record.exists(), "nor is there a record without its report");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct Outputs(Vec<Draft>);

impl Outputs {
    /// Writes a file next to its target. Output to standard output or a pipe is written
    /// immediately.
    ///
    /// # Errors
    /// The errors of [`write_whole`], and an error if two files have the same name.
    pub fn file(
        &mut self,
        path: impl AsRef<Path>,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), FileError> {
        let path = path.as_ref();
        self.stage(path, fill).map_err(|cause| match is_standard_output(path) {
            true => FileError::io("standard output", "write it", cause),
            false => FileError::io(path.display(), "write it", cause),
        })
    }

    fn stage(
        &mut self,
        path: &Path,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<()> {
        let meta = fs::metadata(path).ok();
        if meta.as_ref().is_some_and(Metadata::is_dir) {
            return Err(io::Error::other("it is a folder; name a file"));
        }
        if let Some(stream) = open_stream(path, meta.as_ref())? {
            let mut out = BufWriter::new(stream);
            let written = fill(&mut out).and_then(|()| out.flush());
            // Discards bytes that could not be written; dropping the writer would try to write them again.
            let _ = out.into_parts();
            return written;
        }
        if let Some(meta) = &meta {
            check_output(path)?;
            if meta.permissions().readonly() {
                return Err(io::Error::other("it is read-only"));
            }
        }
        let draft = Draft::new(path, false)?;
        if self.0.iter().any(|other| other.real == draft.real) {
            return Err(io::Error::other(
                "this command writes two files with that name; choose another name for one of them",
            ));
        }
        let Some(file) = &draft.file else { return Ok(()) };
        let mut out = BufWriter::with_capacity(1 << 16, file);
        fill(&mut out)?;
        ask("write")?;
        out.flush()?;
        drop(out);
        if let Some(meta) = meta {
            file.set_permissions(meta.permissions())?;
        }
        sync(file)?;
        self.0.push(draft);
        Ok(())
    }

    /// Writes a folder next to its target, as [`write_folder`] does.
    ///
    /// # Errors
    /// The errors of [`write_folder`], and those that `fill` returns.
    pub fn folder<E: From<FileError>>(
        &mut self,
        path: impl AsRef<Path>,
        force: bool,
        fill: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(), E> {
        let path = path.as_ref();
        let fail = |cause| FileError::io(path.display(), "write it", cause);
        check(path, force)?;
        let mut draft = Draft::new(path, true).map_err(fail)?;
        draft.force = force;
        fill(&draft.temporary)?;
        draft.replaced = lock(&draft.real);
        complete(&draft.temporary, &draft.real).map_err(fail)?;
        self.0.push(draft);
        Ok(())
    }

    /// Renames all files and folders to their targets.
    ///
    /// # Errors
    /// [`FileError::Io`] with path and cause, [`FileError::Exists`].
    pub fn keep(mut self) -> Result<(), FileError> {
        Draft::rename(&mut self.0)
    }
}

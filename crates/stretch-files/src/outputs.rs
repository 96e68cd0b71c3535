//! Several files that belong together.

use std::{
    fmt, fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use tempfile::TempPath;

use crate::{
    FileError, disk,
    interrupt::Open,
    write_folder::Draft,
    write_whole::{Target, cannot_write, folder_of, stage, target, write_stream},
};

/// What one command writes: all of it stands beside its targets before any of it gets its name.
///
/// When a part cannot be written nothing is. When a part cannot be given its name, those that have
/// theirs already are taken back, where the system can swap two names. A kill in between leaves each
/// file whole, the old one or the new one. What goes to standard output or into a pipe
/// is kept in memory and goes there last.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let [record, report] = ["cal.json", "none/cal.html"].map(|name| folder.path().join(name));
/// let mut outputs = stretch_files::Outputs::default();
/// outputs.file(&record, |out| out.write_all(b"{}"))?;
/// assert!(outputs.file(&report, |out| out.write_all(b"<html>")).is_err(), "there is no folder");
/// drop(outputs);
/// assert!(!record.exists(), "nor is there a record without its report");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct Outputs {
    files: Vec<Staged>,
    folders: Vec<Draft>,
    streams: Vec<Streamed>,
}

/// What goes somewhere once all files have their names.
struct Streamed {
    path: PathBuf,
    stream: Box<dyn Write>,
    bytes: Vec<u8>,
}

impl fmt::Debug for Streamed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Streamed").field("path", &self.path).finish_non_exhaustive()
    }
}

#[derive(Debug)]
struct Staged {
    /// As the user called it.
    path: PathBuf,
    real: PathBuf,
    temporary: TempPath,
}

impl Outputs {
    /// Writes a file beside its target.
    ///
    /// # Errors
    /// As [`write_whole`](crate::write_whole()); two files of one name.
    pub fn file(
        &mut self,
        path: impl AsRef<Path>,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), FileError> {
        let path = path.as_ref();
        match target(path)? {
            Target::Stream(stream) => {
                let mut bytes = Vec::new();
                fill(&mut bytes).map_err(|cause| cannot_write(path, cause))?;
                self.streams.push(Streamed { path: path.to_owned(), stream, bytes });
            }
            Target::File(real) => {
                if self.files.iter().any(|file| file.real == real) {
                    let twice = io::Error::other("two files of this command have that name");
                    return Err(cannot_write(path, twice));
                }
                let _open = Open::new(&path.display())?;
                let staged = stage(&real, fill).map_err(|cause| cannot_write(path, cause))?;
                let temporary = staged.into_temp_path();
                self.files.push(Staged { path: path.to_owned(), real, temporary });
            }
        }
        Ok(())
    }

    /// Writes a folder beside its target, as [`write_folder`](crate::write_folder()).
    ///
    /// # Errors
    /// As [`write_folder`](crate::write_folder()), or what `fill` says.
    pub fn folder<E: From<FileError>>(
        &mut self,
        path: impl AsRef<Path>,
        force: bool,
        fill: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(), E> {
        let draft = Draft::begin(path.as_ref(), force)?;
        fill(&draft.folder())?;
        self.folders.push(draft);
        Ok(())
    }

    /// Gives everything its name.
    ///
    /// # Errors
    /// [`FileError::Io`] with path and cause, or [`FileError::Interrupted`].
    pub fn keep(self) -> Result<(), FileError> {
        let Self { files, folders, streams } = self;
        let mut named: Vec<Named> = Vec::new();
        let is_alone = files.len() + folders.len() < 2;
        for file in &files {
            let _open = Open::new(&file.path.display())?;
            let undo = file.name(is_alone).map_err(|cause| cannot_write(&file.path, cause));
            named.push(Named { undo: undo?, is_kept: false });
        }
        // a folder that replaces another is the one thing that cannot be taken back: last
        folders.into_iter().try_for_each(Draft::keep)?;
        named.iter_mut().for_each(|one| one.is_kept = true);
        for Streamed { path, stream, bytes } in streams {
            write_stream(&path, stream, |out| out.write_all(&bytes))?;
        }
        Ok(())
    }
}

/// A file that has its name, and how to take that back.
struct Named {
    undo: Undo,
    is_kept: bool,
}

enum Undo {
    Nothing,
    Exchange(PathBuf, PathBuf),
    Rename(PathBuf, PathBuf),
}

impl Drop for Named {
    fn drop(&mut self) {
        // Nothing better can be done where even this fails.
        let _ = match &self.undo {
            _ if self.is_kept => Ok(()),
            Undo::Nothing => Ok(()),
            Undo::Exchange(one, other) => disk::exchange(one, other),
            Undo::Rename(from, to) => disk::rename(from, to),
        };
    }
}

impl Staged {
    fn name(&self, is_alone: bool) -> io::Result<Undo> {
        let (temporary, real) = (self.temporary.to_path_buf(), self.real.clone());
        let replaces = fs::symlink_metadata(&real).is_ok();
        let undo = match replaces && !is_alone {
            true => match disk::exchange(&temporary, &real) {
                Ok(()) => Undo::Exchange(temporary, real),
                Err(e) if e.kind() == io::ErrorKind::Unsupported => {
                    disk::rename(&temporary, &real)?;
                    Undo::Nothing
                }
                Err(e) => return Err(e),
            },
            false => {
                disk::rename(&temporary, &real)?;
                if replaces { Undo::Nothing } else { Undo::Rename(real, temporary) }
            }
        };
        disk::sync_folder(folder_of(&self.real));
        Ok(undo)
    }
}

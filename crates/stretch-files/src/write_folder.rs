//! A folder that is written whole or not at all.

use std::{
    env,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use crate::{
    FileError,
    carry::carry,
    disk,
    interrupt::{Open, check},
    temporary::{NEW, OLD, Temporary, identity, left_behind},
    write_whole::folder_of,
};

/// Writes a folder whole or not at all.
///
/// `fill` gets an empty folder beside the target and writes into it; when it is done all of it is
/// synced and takes the target's name. On any error the new folder goes and the target is as it
/// was.
///
/// A target that holds something is refused unless `force` is set. With `force` it is replaced in one
/// step: every other program sees the old folder or the new one. Files of the same name are
/// replaced, and so are the trials that a data set was written with; all else in it is the
/// user's, and comes along. Where the system cannot swap two folders in one step (it
/// can on Linux and macOS) the old one is moved aside first, and [`recover`] puts right what a kill in
/// between left.
///
/// # Errors
/// [`FileError::Exists`], [`FileError::Io`], [`FileError::Interrupted`], or what `fill` says.
///
/// ```
/// use stretch_files::{FileError, write_folder, write_whole};
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
    let draft = Draft::begin(path.as_ref(), force)?;
    fill(&draft.folder())?;
    Ok(draft.keep()?)
}

/// A folder that is being written and has not its name yet.
#[derive(Debug)]
pub(crate) struct Draft {
    /// As the user called it.
    path: PathBuf,
    /// What it is, without links and dots.
    real: PathBuf,
    replaces: bool,
    /// None once it has its name.
    temporary: Option<Temporary>,
    /// Parents that were made, the innermost first.
    made: Vec<PathBuf>,
}

impl Draft {
    pub(crate) fn begin(path: &Path, force: bool) -> Result<Self, FileError> {
        let shown = path.display();
        check(&shown)?;
        let fail = |cause| FileError::io(&shown, "write it", cause);
        if path.as_os_str() == "-" {
            return Err(fail(io::Error::other("a folder cannot go to standard output; name one")));
        }
        recover(path).map_err(fail)?;
        let replaces = match fs::symlink_metadata(path) {
            Ok(_) if path.is_dir() => true,
            Ok(_) if !force => return Err(FileError::Exists { path: shown.to_string() }),
            Ok(_) => return Err(fail(io::Error::other("it exists and is not a folder"))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => false,
            Err(e) => return Err(fail(e)),
        };
        if replaces {
            let holds = fs::read_dir(path).map_err(fail)?.next().is_some();
            if holds && !force {
                return Err(FileError::Exists { path: shown.to_string() });
            }
        }
        let mut draft = Self {
            path: path.to_owned(),
            real: PathBuf::new(),
            replaces,
            temporary: None,
            made: Vec::new(),
        };
        if !replaces {
            draft.made = make_parents(folder_of(path)).map_err(fail)?;
        }
        draft.real = real(path).map_err(fail)?;
        if replaces && env::current_dir().is_ok_and(|here| here.starts_with(&draft.real)) {
            return Err(fail(io::Error::other(
                "the folder in which a program is run cannot be replaced; name another, or run it from outside",
            )));
        }
        draft.temporary = Some(Temporary::beside(&draft.real, path).map_err(fail)?);
        Ok(draft)
    }

    /// Where to write.
    pub(crate) fn folder(&self) -> PathBuf {
        self.temporary.as_ref().map_or(PathBuf::new(), Temporary::new_folder)
    }

    /// Gives it its name.
    pub(crate) fn keep(mut self) -> Result<(), FileError> {
        let shown = self.path.display().to_string();
        let _open = Open::new(&shown)?;
        let Some(mut temporary) = self.temporary.take() else { return Ok(()) };
        let fail = |cause| FileError::io(&shown, "write it", cause);
        let new = temporary.new_folder();
        sync_tree(&new, true).map_err(fail)?;
        if !self.replaces {
            match disk::rename_new(&new, &self.real) {
                Ok(()) => {}
                // somebody was faster
                Err(e) if is_taken(&e) => return Err(FileError::Exists { path: shown }),
                Err(e) => return Err(fail(e)),
            }
            self.made.clear();
            disk::sync_folder(folder_of(&self.real));
            return Ok(());
        }
        carry(&self.real, &new, disk::link).map_err(fail)?;
        sync_tree(&new, false).map_err(fail)?;
        let permissions = fs::metadata(&self.real).map_err(fail)?.permissions();
        fs::set_permissions(&new, permissions).map_err(fail)?;
        temporary.mark(&self.real).map_err(fail)?;
        let old = match disk::exchange(&new, &self.real) {
            Ok(()) => new,
            Err(e) if e.kind() == io::ErrorKind::Unsupported => {
                let old = temporary.old_folder();
                disk::rename(&self.real, &old).map_err(fail)?;
                if let Err(why) = disk::rename(&new, &self.real) {
                    if disk::rename(&old, &self.real).is_err() {
                        let left = temporary.leave();
                        let left = format!(
                            "{why}; what was there is in {}, and the next run that writes there goes on",
                            left.display()
                        );
                        return Err(fail(io::Error::other(left)));
                    }
                    return Err(fail(why));
                }
                old
            }
            Err(e) => return Err(fail(e)),
        };
        disk::sync_folder(folder_of(&self.real));
        // what came into the old folder in the meantime
        if let Err(why) = carry(&old, &self.real, disk::rename) {
            let left = temporary.leave();
            let message = format!(
                "all is written, but not all of the folder that was there came along: {why}; the rest is in {}",
                left.display()
            );
            return Err(fail(io::Error::other(message)));
        }
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        drop(self.temporary.take());
        // Only folders that are empty, and that were made here, go.
        self.made.iter().for_each(|folder| drop(fs::remove_dir(folder)));
    }
}

fn is_taken(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::AlreadyExists
            | io::ErrorKind::DirectoryNotEmpty
            | io::ErrorKind::NotADirectory
    )
}

/// The path without links and dots; what is not there yet by its folder's.
fn real(path: &Path) -> io::Result<PathBuf> {
    if let Ok(real) = fs::canonicalize(path) {
        return Ok(real);
    }
    let name = path.file_name().ok_or_else(|| io::Error::other("it has no name"))?;
    Ok(fs::canonicalize(folder_of(path))?.join(name))
}

/// Finishes or takes back what a run that was killed left of a folder that it replaced.
///
/// [`write_folder`] calls this function first. The answer is a sentence on the changes, or `None` where there was nothing to
/// correct.
///
/// # Errors
/// What the system says.
///
/// ```
/// let parent = tempfile::tempdir()?;
/// assert_eq!(stretch_files::recover(parent.path().join("bench"))?, None);
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn recover(path: impl AsRef<Path>) -> io::Result<Option<String>> {
    let path = path.as_ref();
    let Ok(real) = real(path) else { return Ok(None) };
    let (mut message, shown) = (None, path.display());
    for left in left_behind(&real) {
        let [new, old] = [NEW, OLD].map(|name| left.folder.join(name));
        let is_there = fs::symlink_metadata(&real).is_ok();
        let is_swapped =
            left.whole.is_some_and(|whole| identity(&real).is_ok_and(|id| id == whole));
        if old.is_dir() && !is_there {
            let (from, what) = match new.is_dir() {
                true => (&new, "finished"),
                false => (&old, "taken back"),
            };
            disk::rename(from, &real)?;
            message = Some(format!(
                "{shown}: an earlier run was stopped while it replaced this folder; that is {what} now"
            ));
        }
        if old.is_dir() {
            carry(&old, &real, disk::rename)?;
        } else if is_swapped && new.is_dir() {
            carry(&new, &real, disk::rename)?;
        }
        let _ = fs::remove_dir_all(&left.folder);
    }
    Ok(message)
}

/// Makes the folders that are missing; those that it made, innermost first.
fn make_parents(parent: &Path) -> io::Result<Vec<PathBuf>> {
    let missing: Vec<PathBuf> = parent
        .ancestors()
        .take_while(|p| !p.as_os_str().is_empty() && !p.exists())
        .map(Path::to_owned)
        .collect();
    fs::create_dir_all(parent)?;
    Ok(missing)
}

/// All names below a folder, on the disk; all files, too, where they are asked for.
fn sync_tree(folder: &Path, with_files: bool) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let kind = entry.file_type()?;
        if kind.is_dir() {
            sync_tree(&entry.path(), with_files)?;
        } else if kind.is_file() && with_files {
            // Windows flushes only what was opened to be written
            let file = File::options().read(true).write(cfg!(windows)).open(entry.path())?;
            disk::sync(&file)?;
        }
    }
    disk::sync_folder(folder);
    Ok(())
}

//! A file or folder under a temporary name, and the lock that protects making, renaming and
//! removing such names.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
    thread,
    time::Duration,
};

use tempfile::Builder;

use super::{FileError, folder::replace};

/// Temporary names of this process, with the paths that they will replace. Temporary names of folders stay in the list
/// after the rename, because messages may contain them.
///
/// The lock is held while a temporary name is made or renamed to its target. The handler of Ctrl-C takes the lock and
/// never releases it. Therefore targets that were renamed before Ctrl-C stay, and no target is renamed after it.
static NAMES: Mutex<Vec<(PathBuf, PathBuf)>> = Mutex::new(Vec::new());

fn names() -> MutexGuard<'static, Vec<(PathBuf, PathBuf)>> {
    NAMES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes everything unfinished and exits. A handler of Ctrl-C calls this function:
///
/// ```no_run
/// // ctrlc::set_handler(...):
/// stretch_data::files::clean_up_and_exit(130);
/// ```
pub fn clean_up_and_exit(status: u8) -> ! {
    let names = names();
    for (temporary, _) in names.iter() {
        // Another thread may be writing into the folder while it is removed.
        for _ in 0..100 {
            if remove(temporary).is_ok() || fs::symlink_metadata(temporary).is_err() {
                break;
            }
            thread::sleep(Duration::from_millis(1));
        }
    }
    std::process::exit(status.into())
}

fn remove(path: &Path) -> io::Result<()> {
    fs::remove_file(path).or_else(|_| fs::remove_dir_all(path))
}

/// Replaces temporary names of folders in a message by the names of their targets.
///
/// ```
/// # use stretch_data::files::{FileError, without_temporary_names, write_folder};
/// # let parent = tempfile::tempdir()?;
/// let out = parent.path().join("bench");
/// let mut message = String::new();
/// let _ = write_folder(&out, false, |folder| {
///     message = format!("{}: cannot be read", folder.join("a.csv").display());
///     Err(FileError::Exists { path: message.clone() })
/// });
/// let shown = without_temporary_names(&message);
/// assert_eq!(shown, format!("{}: cannot be read", out.join("a.csv").display()));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn without_temporary_names(text: &str) -> String {
    names().iter().fold(text.to_owned(), |shown, (temporary, target)| {
        shown.replace(&*temporary.to_string_lossy(), &target.to_string_lossy())
    })
}

/// A file or folder that is built under a temporary name. It is removed if it is dropped before it
/// was renamed.
#[derive(Debug)]
pub(super) struct Draft {
    /// The target as given by the user.
    path: PathBuf,
    /// The target without links and dots.
    pub(super) real: PathBuf,
    pub(super) temporary: PathBuf,
    /// Open file, locked while this value exists, so that a cleanup can distinguish it from the
    /// remains of a killed program. `None` for a folder.
    pub(super) file: Option<File>,
    /// Whether a folder may replace one that is not empty.
    pub(super) force: bool,
    /// The folder that is replaced, locked.
    pub(super) replaced: Option<File>,
}

impl Draft {
    /// Makes a temporary file or folder in the folder of its target. If that does not exist, a temporary folder is made in
    /// the nearest folder above it.
    pub(super) fn new(path: &Path, is_folder: bool) -> io::Result<Self> {
        let real = real(path);
        let exists = |folder: &&Path| is_folder && folder.exists();
        let parent = real.ancestors().skip(1).find(exists).unwrap_or(folder_of(&real));
        let mut names = names();
        ask("create")?;
        let make = |temporary: &Path| match is_folder {
            true => fs::create_dir(temporary).map(|()| None),
            false => File::create_new(temporary).map(Some),
        };
        let made = Builder::new().prefix(".stretch-").suffix(".tmp").make_in(parent, make)?;
        let (file, temporary) = made.keep().map_err(|kept| kept.error)?;
        // A failed lock is ignored: on a system that cannot lock files, no process removes the remains of another one.
        let _ = file.as_ref().map(File::try_lock);
        names.push((temporary.clone(), path.to_owned()));
        Ok(Self { path: path.to_owned(), real, temporary, file, force: false, replaced: None })
    }

    /// Renames all drafts to their targets. The handler of Ctrl-C waits until all of them are renamed.
    pub(super) fn rename(drafts: &mut [Self]) -> Result<(), FileError> {
        use io::ErrorKind::{AlreadyExists, DirectoryNotEmpty, NotADirectory};
        let _names = names();
        for draft in drafts {
            let is_folder = draft.file.is_none();
            draft.place().map_err(|cause| match cause.kind() {
                // Another process has created the target in the meantime.
                AlreadyExists | DirectoryNotEmpty | NotADirectory if is_folder => {
                    FileError::exists(&draft.path)
                }
                _ => FileError::io(draft.path.display(), "write it", cause),
            })?;
            sync_folder(folder_of(&draft.real));
        }
        Ok(())
    }

    fn place(&mut self) -> io::Result<()> {
        if self.file.is_none() {
            fs::create_dir_all(folder_of(&self.real))?;
            if self.force && self.real.is_dir() {
                return replace(self);
            }
            if cfg!(windows) {
                // An empty target is removed first, because on Windows renaming a folder does not replace it, as it
                // does on other systems.
                let _ = fs::remove_dir(&self.real);
            }
        }
        rename(&self.temporary, &self.real)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        let mut names = names();
        if self.file.is_some() {
            names.retain(|(temporary, _)| *temporary != self.temporary);
        }
        if ask("remove").is_ok() {
            let _ = remove(&self.temporary);
        }
    }
}

/// Returns a path without links and dots, even if it does not exist yet.
pub(super) fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| match path.file_name() {
        Some(name) => real(folder_of(path)).join(name),
        None => path.to_owned(),
    })
}

/// Returns the folder that contains a path.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

pub(super) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    ask("rename")?;
    fs::rename(from, to)
}

pub(super) fn sync(file: &File) -> io::Result<()> {
    ask("sync")?;
    file.sync_all()
}

/// Syncs a folder to disk, so that its names are durable. Errors are ignored, because not every
/// system can sync folders.
pub(super) fn sync_folder(folder: &Path) {
    let synced = ask("sync_folder").and_then(|()| File::open(folder)?.sync_all());
    drop(synced);
}

type Hook = Box<dyn Fn(&'static str) -> io::Result<()> + Send + Sync>;

static HOOK: OnceLock<Hook> = OnceLock::new();

/// For tests: installs a hook that is called before each file-system call of a writer, once in the
/// life of a process. If the hook returns an error, the call is not made and returns that error.
#[doc(hidden)]
pub fn ask_before_disk_calls(
    hook: impl Fn(&'static str) -> io::Result<()> + Send + Sync + 'static,
) -> bool {
    HOOK.set(Box::new(hook)).is_ok()
}

/// Calls the hook, if there is one, and returns its answer.
pub(super) fn ask(call: &'static str) -> io::Result<()> {
    HOOK.get().map_or(Ok(()), |hook| hook(call))
}

//! A file or folder under a temporary name, and the lock under which such names are made, renamed and removed.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
    thread,
    time::Duration,
};

use tempfile::Builder;

use super::{
    FileError,
    folder::{lock, replace},
};

/// Temporary names of this process with the paths that they will replace. Those of folders stay here because messages may name them.
///
/// The lock is held while a temporary name is made or becomes a target's name. Ctrl-C takes it and never gives it back: what has
/// its name by then keeps it, and nothing gets one afterwards.
static NAMES: Mutex<Vec<(PathBuf, PathBuf)>> = Mutex::new(Vec::new());

fn names() -> MutexGuard<'static, Vec<(PathBuf, PathBuf)>> {
    NAMES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes everything unfinished and leaves the process. A handler of Ctrl-C calls it:
///
/// ```no_run
/// // ctrlc::set_handler(...):
/// stretch_data::files::clean_up_and_exit(130);
/// ```
pub fn clean_up_and_exit(status: u8) -> ! {
    let names = names();
    for (temporary, _) in names.iter() {
        // another thread may be writing into the folder while it is removed
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

/// A message in which a folder that is being built has the name that it will have.
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

/// What is built under a temporary name, and removed if it is dropped before it has its name.
#[derive(Debug)]
pub(super) struct Draft {
    /// The target as the user called it.
    path: PathBuf,
    /// The target without links and dots.
    pub(super) real: PathBuf,
    pub(super) temporary: PathBuf,
    /// Locked while this exists, so that a cleaning program can distinguish it from what a killed program left; none for a folder.
    pub(super) file: Option<File>,
    /// Whether a folder replaces one that holds something.
    force: bool,
    /// The folder that is replaced, locked.
    replaced: Option<File>,
    /// Removed after the draft, if it is still empty.
    _parents: Option<Parents>,
}

impl Draft {
    pub(super) fn file(path: &Path) -> io::Result<Self> {
        Self::new(path, false, None)
    }

    /// Makes the parents of the folder, too.
    pub(super) fn folder(path: &Path, force: bool) -> io::Result<Self> {
        Self::new(path, force, Some(Parents::make(folder_of(path))?))
    }

    /// A folder if it has parents, else a file.
    fn new(path: &Path, force: bool, parents: Option<Parents>) -> io::Result<Self> {
        let real = real(path);
        let mut builder = Builder::new();
        builder.prefix(".stretch-").suffix(".tmp");
        #[cfg(unix)]
        {
            // narrowed by the umask, as for any new file or folder
            let mode = if parents.is_some() { 0o777 } else { 0o666 };
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
        }
        let mut names = names();
        ask("create")?;
        let (temporary, file) = if parents.is_some() {
            (builder.tempdir_in(folder_of(&real)).map_err(without_path)?.keep(), None)
        } else {
            let made = builder.tempfile_in(folder_of(&real)).map_err(without_path)?;
            let (file, temporary) = made.keep()?;
            // if files cannot be locked, no process cleans up
            let _ = file.try_lock();
            (temporary, Some(file))
        };
        let path = path.to_owned();
        names.push((temporary.clone(), path.clone()));
        Ok(Self { path, real, temporary, file, force, replaced: None, _parents: parents })
    }

    /// Waits until no other writer replaces the same folder, and keeps others waiting until this is dropped.
    pub(super) fn lock(&mut self) {
        self.replaced = self.replaced.take().or_else(|| lock(&self.real));
    }

    /// Gives everything its name; Ctrl-C waits for all of them.
    pub(super) fn rename(drafts: &mut [Self]) -> Result<(), FileError> {
        use io::ErrorKind::{AlreadyExists, DirectoryNotEmpty, NotADirectory};
        let _names = names();
        for draft in drafts {
            let is_folder = draft.file.is_none();
            if is_folder && cfg!(windows) {
                // elsewhere a folder that is renamed replaces an empty one
                let _ = fs::remove_dir(&draft.real);
            }
            let renamed = match draft.force && draft.real.is_dir() {
                true => replace(draft),
                false => rename(&draft.temporary, &draft.real),
            };
            renamed.map_err(|cause| match cause.kind() {
                // another writer was faster
                AlreadyExists | DirectoryNotEmpty | NotADirectory if is_folder => {
                    FileError::exists(&draft.path)
                }
                _ => FileError::io(draft.path.display(), "write it", cause),
            })?;
            sync_folder(folder_of(&draft.real));
        }
        Ok(())
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

/// Folders that were made for a target, the innermost first: those that are empty go when this is dropped.
#[derive(Debug)]
struct Parents(Vec<PathBuf>);

impl Parents {
    fn make(parent: &Path) -> io::Result<Self> {
        let missing = parent.ancestors().take_while(|path| !path.exists());
        let missing = Self(missing.map(Path::to_owned).collect());
        fs::create_dir_all(parent)?;
        Ok(missing)
    }
}

impl Drop for Parents {
    fn drop(&mut self) {
        self.0.iter().for_each(|folder| drop(fs::remove_dir(folder)));
    }
}

/// The cause alone, because the name of a temporary file would only puzzle.
fn without_path(error: io::Error) -> io::Error {
    match error.to_string().rsplit_once(" at path ") {
        Some((cause, _)) => io::Error::new(error.kind(), cause.to_owned()),
        None => error,
    }
}

/// A path without links and dots, also where nothing is there yet.
pub(super) fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| match path.file_name() {
        Some(name) => real(folder_of(path)).join(name),
        None => path.to_owned(),
    })
}

/// The folder that a path is in.
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

/// Makes names durable, where the system can: not every one syncs folders.
pub(super) fn sync_folder(folder: &Path) {
    let synced = ask("sync_folder").and_then(|()| File::open(folder)?.sync_all());
    drop(synced);
}

type Hook = Box<dyn Fn(&'static str) -> io::Result<()> + Send + Sync>;

static HOOK: OnceLock<Hook> = OnceLock::new();

/// For tests: from now on `hook` is asked before each call of a writer on the file system, once in the life of a process. An
/// error is the call's answer, and the call is not made.
#[doc(hidden)]
pub fn ask_before_disk_calls(
    hook: impl Fn(&'static str) -> io::Result<()> + Send + Sync + 'static,
) -> bool {
    HOOK.set(Box::new(hook)).is_ok()
}

/// Whether the call may be made.
pub(super) fn ask(call: &'static str) -> io::Result<()> {
    HOOK.get().map_or(Ok(()), |hook| hook(call))
}

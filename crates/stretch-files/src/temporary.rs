//! Folders that are built under a temporary name beside their target.

use std::{
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, SystemTime},
};

use tempfile::{Builder, TempDir};

use crate::disk::{DiskCall, ask, sync};

/// A temporary folder, what it is for, and whether it is still there.
struct Known {
    temporary: PathBuf,
    target: PathBuf,
    is_there: bool,
}

static KNOWN: Mutex<Vec<Known>> = Mutex::new(Vec::new());

fn known() -> MutexGuard<'static, Vec<Known>> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A message in which a folder that is being built has the name that it will have.
///
/// ```
/// # use stretch_files::{FileError, write_folder};
/// # let parent = tempfile::tempdir()?;
/// let out = parent.path().join("bench");
/// let mut said = String::new();
/// let _ = write_folder(&out, false, |folder| {
///     said = format!("{}: cannot be read", folder.join("a.csv").display());
///     Err(FileError::Exists { path: said.clone() })
/// });
/// let shown = stretch_files::without_temporary_names(&said);
/// assert_eq!(shown, format!("{}: cannot be read", out.join("a.csv").display()));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn without_temporary_names(text: &str) -> String {
    let mut shown = text.to_owned();
    for Known { temporary, target, .. } in known().iter() {
        shown =
            shown.replace(&*temporary.join(NEW).to_string_lossy(), &target.display().to_string());
    }
    shown
}

/// Takes all unfinished folders away: somebody leaves the process.
pub(crate) fn remove_unfinished() {
    for Known { temporary, is_there, .. } in known().iter_mut() {
        if std::mem::take(is_there) {
            let _ = fs::remove_dir_all(temporary);
        }
    }
}

/// Where the new folder is built, and where an old one waits.
pub(crate) const NEW: &str = "new";
pub(crate) const OLD: &str = "old";
/// Locked for as long as somebody builds; once all is there it says whose place is taken.
const MARK: &str = "mark";

/// A temporary folder that goes when this does.
#[derive(Debug)]
pub(crate) struct Temporary {
    dir: Option<TempDir>,
    mark: File,
}

impl Temporary {
    /// A folder beside `real`, which messages call `target`.
    pub(crate) fn beside(real: &Path, target: &Path) -> io::Result<Self> {
        ask(DiskCall::Create)?;
        let parent = real.parent().unwrap_or(Path::new("."));
        let mut builder = Builder::new();
        let dir = builder.prefix(&prefix(real)).suffix(SUFFIX).tempdir_in(parent);
        let dir = dir.map_err(without_path)?;
        let mark = File::create_new(dir.path().join(MARK))?;
        // Where files cannot be locked, nobody clears up after a program that was killed.
        let _ = mark.lock();
        fs::create_dir(dir.path().join(NEW))?;
        let (temporary, target) = (dir.path().to_owned(), target.to_owned());
        known().push(Known { temporary, target, is_there: true });
        Ok(Self { dir: Some(dir), mark })
    }

    fn path(&self) -> &Path {
        self.dir.as_ref().map_or(Path::new(""), TempDir::path)
    }

    pub(crate) fn new_folder(&self) -> PathBuf {
        self.path().join(NEW)
    }

    pub(crate) fn old_folder(&self) -> PathBuf {
        self.path().join(OLD)
    }

    /// Says for whoever comes after a program that was killed that the new folder is whole.
    pub(crate) fn mark(&mut self, real: &Path) -> io::Result<()> {
        let mark = format!("{}\n{}\n", identity(&self.new_folder())?, name(real));
        ask(DiskCall::Write)?;
        self.mark.write_all(mark.as_bytes())?;
        sync(&self.mark)
    }

    /// Leaves the folder where it is: something of the user's is in it.
    pub(crate) fn leave(mut self) -> PathBuf {
        let path = self.dir.take().map_or(PathBuf::new(), TempDir::keep);
        forget(&path);
        path
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(dir) = self.dir.take() {
            forget(dir.path());
            if ask(DiskCall::Remove).is_err() {
                let _ = dir.keep();
            }
        }
    }
}

fn forget(path: &Path) {
    if let Some(known) = known().iter_mut().find(|known| known.temporary == path) {
        known.is_there = false;
    }
}

/// What another run left when it was killed.
pub(crate) struct Left {
    pub(crate) folder: PathBuf,
    /// Which folder was to take the target's place; none where it was not whole yet.
    pub(crate) whole: Option<String>,
    /// Held for as long as this is.
    _mark: Option<File>,
}

/// Temporary folders for a target that nobody works on any more.
pub(crate) fn left_behind(real: &Path) -> Vec<Left> {
    let parent = real.parent().unwrap_or(Path::new("."));
    let entries = fs::read_dir(parent).into_iter().flatten().flatten();
    let is_ours = |entry: &fs::DirEntry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        name.starts_with(&prefix(real)) && name.ends_with(SUFFIX)
    };
    entries.filter(is_ours).filter_map(|entry| left(entry.path(), real)).collect()
}

fn left(folder: PathBuf, real: &Path) -> Option<Left> {
    let is_old = || {
        let changed = fs::metadata(&folder).and_then(|meta| meta.modified()).ok()?;
        SystemTime::now().duration_since(changed).ok().filter(|age| *age > UNMARKED)
    };
    let Ok(mark) = File::options().read(true).write(true).open(folder.join(MARK)) else {
        // between its making and its mark, or killed there
        return is_old().map(|_| Left { folder, whole: None, _mark: None });
    };
    mark.try_lock().ok()?;
    let text = fs::read_to_string(folder.join(MARK)).ok()?;
    match text.split_once('\n') {
        Some((whole, of)) if of.strip_suffix('\n') == Some(&name(real)) => {
            Some(Left { whole: Some(whole.to_owned()), folder, _mark: Some(mark) })
        }
        // of another name that is as long
        Some((_, of)) if of.ends_with('\n') => None,
        _ => is_old().map(|_| Left { folder, whole: None, _mark: Some(mark) }),
    }
}

/// How long a folder without a mark may be somebody's who just begins.
const UNMARKED: Duration = Duration::from_secs(60);

const SUFFIX: &str = ".tmp";

/// How temporary folders of a target begin: a name may be as long as the system allows, so only a part of it.
fn prefix(real: &Path) -> String {
    format!(".stretch-{}-", name(real).chars().take(40).collect::<String>())
}

fn name(real: &Path) -> String {
    real.file_name().unwrap_or_default().to_string_lossy().replace('\n', " ")
}

/// What stays the same when a folder is renamed.
pub(crate) fn identity(folder: &Path) -> io::Result<String> {
    let meta = fs::metadata(folder)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        Ok(format!("{}", meta.ino()))
    }
    #[cfg(not(unix))]
    {
        // there folders are not exchanged, and where an old one waits says all
        drop(meta);
        Ok("-".to_owned())
    }
}

/// The cause alone: the name of a temporary file would only puzzle.
pub(crate) fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.rsplit_once(" at path ") {
        Some((cause, _)) => io::Error::new(error.kind(), cause.to_owned()),
        None => error,
    }
}

//! The calls on the file system that writers make, all at one place: a test can fail each of them.

use std::{
    fs::{self, File},
    io,
    path::Path,
    sync::OnceLock,
};

/// A call of a writer on the file system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DiskCall {
    /// Makes a temporary file or folder.
    Create,
    /// Writes bytes.
    Write,
    /// Waits until a file is on the disk.
    Sync,
    /// Waits until the names in a folder are.
    SyncFolder,
    /// Gives a file or folder another name.
    Rename,
    /// Swaps the names of two folders or files.
    Exchange,
    /// Gives a file a second name, or copies it.
    Link,
    /// Removes what was replaced.
    Remove,
}

type Hook = Box<dyn Fn(DiskCall) -> io::Result<()> + Send + Sync>;

static HOOK: OnceLock<Hook> = OnceLock::new();

/// For tests: from now on `hook` is asked before each call of a writer, once in the life of a
/// process; an error is the call's answer, and the call is not made.
#[doc(hidden)]
pub fn ask_before_disk_calls(
    hook: impl Fn(DiskCall) -> io::Result<()> + Send + Sync + 'static,
) -> bool {
    HOOK.set(Box::new(hook)).is_ok()
}

/// Whether the call may be made.
pub(crate) fn ask(call: DiskCall) -> io::Result<()> {
    HOOK.get().map_or(Ok(()), |hook| hook(call))
}

pub(crate) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    ask(DiskCall::Rename)?;
    fs::rename(from, to)
}

/// Renames a folder to a name that nothing has.
pub(crate) fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    ask(DiskCall::Rename)?;
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::{fs, io::Errno};
        match fs::renameat_with(fs::CWD, from, fs::CWD, to, fs::RenameFlags::NOREPLACE) {
            Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP) => {}
            result => return Ok(result?),
        }
    }
    if fs::symlink_metadata(to).is_ok() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    fs::rename(from, to)
}

/// Swaps two names in one step; [`io::ErrorKind::Unsupported`] where the system cannot.
pub(crate) fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    ask(DiskCall::Exchange)?;
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::{fs, io::Errno};
        match fs::renameat_with(fs::CWD, one, fs::CWD, other, fs::RenameFlags::EXCHANGE) {
            Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP) => {
                Err(io::ErrorKind::Unsupported.into())
            }
            result => Ok(result?),
        }
    }
    #[cfg(not(any(target_os = "linux", target_os = "macos")))]
    {
        let _ = (one, other);
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// A second name for a file; a copy where the file system has no such thing.
pub(crate) fn link(from: &Path, to: &Path) -> io::Result<()> {
    ask(DiskCall::Link)?;
    fs::hard_link(from, to).or_else(|error| match fs::symlink_metadata(from) {
        Ok(meta) if meta.is_file() => fs::copy(from, to).map(drop),
        _ => Err(error),
    })
}

pub(crate) fn sync(file: &File) -> io::Result<()> {
    ask(DiskCall::Sync)?;
    file.sync_all()
}

/// Makes names durable, where the system can: not every one syncs folders.
pub(crate) fn sync_folder(folder: &Path) {
    if ask(DiskCall::SyncFolder).is_ok()
        && let Ok(folder) = File::open(folder)
    {
        let _ = folder.sync_all();
    }
}

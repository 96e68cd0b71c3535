//! Replacement of folders: which folders may be replaced, and which files of the old one are kept.

use std::{
    collections::BTreeSet,
    env,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use super::{
    FileError,
    draft::{Draft, ask, rename, sync, sync_folder},
    inputs::{check_output, identity},
};
use crate::data_set::unchanged_trials;

/// Refuses a folder that cannot be written, or that is not empty unless `force` is set.
pub(super) fn check(path: &Path, force: bool) -> Result<(), FileError> {
    let is_free = match fs::read_dir(path) {
        Ok(mut entries) => entries.next().is_none(),
        Err(_) => fs::symlink_metadata(path).is_err(),
    };
    if !(is_free || force && path.is_dir()) {
        return Err(FileError::exists(path));
    }
    let is_inside = |here: PathBuf| fs::canonicalize(path).is_ok_and(|path| here.starts_with(path));
    let problem = if path.as_os_str() == "-" {
        "a folder cannot be written to standard output; name a folder"
    } else if env::current_dir().is_ok_and(is_inside) {
        "the folder in which a program is run cannot be replaced; name another, or run it from outside"
    } else {
        return Ok(());
    };
    Err(FileError::io(path.display(), "write it", io::Error::other(problem)))
}

/// Locks a folder that is to be replaced, so that several writers of the same folder wait for each
/// other.
///
/// Returns `None` if the folder does not exist or cannot be locked.
pub(super) fn lock(folder: &Path) -> Option<File> {
    loop {
        let locked = File::open(folder).ok()?;
        locked.lock().ok()?;
        // The previous writer may have replaced the folder that is now locked.
        let here = identity(folder, &fs::metadata(folder).ok()?);
        if here == identity(folder, &locked.metadata().ok()?) {
            return Some(locked);
        }
    }
}

/// Links the user's own files in the old folder into the new one, and syncs the new folder to disk.
pub(super) fn complete(new: &Path, old: &Path) -> io::Result<()> {
    if let Ok(meta) = fs::metadata(old) {
        carry(old, new, &mut BTreeSet::new(), check_output)?;
        fs::set_permissions(new, meta.permissions())?;
    }
    sync_tree(new)
}

/// Syncs all files and folders below a folder to disk.
fn sync_tree(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let kind = entry.file_type()?;
        if kind.is_dir() {
            sync_tree(&entry.path())?;
        } else if kind.is_file() {
            // Windows flushes only files that were opened for writing.
            sync(&File::options().read(true).write(cfg!(windows)).open(entry.path())?)?;
        }
    }
    sync_folder(folder);
    Ok(())
}

/// Renames a complete folder to its target, which exists.
pub(super) fn replace(draft: &mut Draft) -> io::Result<()> {
    let (new, real) = (&draft.temporary, &draft.real);
    let _locked = draft.replaced.take().or_else(|| lock(real));
    exchange(new, real)?;
    // Carries over files that were added to the old folder in the meantime.
    carry(new, real, &mut BTreeSet::new(), |_| Ok(())).map_err(|why| {
        // The old folder is not removed, because it contains files of the user.
        let left = std::mem::take(&mut draft.temporary);
        io::Error::other(format!(
            "everything is written, but {why}; the old folder is kept as {}",
            left.display()
        ))
    })
}

/// Swaps the names of two folders: in one step where the system can, otherwise in three.
fn exchange(new: &Path, real: &Path) -> io::Result<()> {
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        if ask("exchange").is_ok()
            && renameat_with(CWD, new, CWD, real, RenameFlags::EXCHANGE).is_ok()
        {
            return Ok(());
        }
    }
    let aside = new.with_extension("old");
    rename(real, &aside)?;
    rename(new, real).inspect_err(|_| drop(rename(&aside, real)))?;
    rename(&aside, new)
}

/// Carries every file of `old` whose name is not in `new` over to `new`, as a hard link or, if
/// links are impossible, as a copy.
///
/// If `new` is a data set, unchanged trials of the old data set (`replaced`) are not carried over.
/// `check` is called for every file that is not carried over.
fn carry(
    old: &Path,
    new: &Path,
    replaced: &mut BTreeSet<PathBuf>,
    check: fn(&Path) -> io::Result<()>,
) -> io::Result<()> {
    if new.join("dataset.toml").is_file() {
        replaced.extend(unchanged_trials(old));
    }
    for entry in fs::read_dir(old)? {
        let entry = entry?;
        let (from, to) = (entry.path(), new.join(entry.file_name()));
        let is_folder = entry.file_type()?.is_dir();
        match fs::symlink_metadata(&to) {
            Ok(meta) if meta.is_dir() != is_folder => {
                let kind = if is_folder { "folder" } else { "file" };
                let name = from.display();
                return Err(io::Error::other(format!(
                    "{name} is a {kind}, but its new version is not"
                )));
            }
            Ok(_) => check(&from)?,
            Err(_) if is_folder => {
                fs::create_dir(&to)?;
                fs::set_permissions(&to, entry.metadata()?.permissions())?;
            }
            Err(_) if replaced.contains(&from) => check(&from)?,
            Err(_) => {
                ask("link")?;
                match fs::hard_link(&from, &to) {
                    // A copy to another name of the same file would empty it.
                    Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                    linked => linked.or_else(|_| fs::copy(&from, &to).map(drop))?,
                }
            }
        }
        if is_folder {
            carry(&from, &to, replaced, check)?;
        }
    }
    Ok(())
}

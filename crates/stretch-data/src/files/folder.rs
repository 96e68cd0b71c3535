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
    inputs::check_output,
};
use crate::data_set::unchanged_trials;

/// Refuses a folder that cannot be written, or that is not empty unless `force` is set.
pub(super) fn check(path: &Path, force: bool) -> Result<(), FileError> {
    let fail = |cause| Err(FileError::io(path.display(), "write it", cause));
    if path.as_os_str() == "-" {
        return fail(io::Error::other(
            "a folder cannot be written to standard output; name a folder",
        ));
    }
    let holds = match fs::symlink_metadata(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(()),
        Ok(_) if path.is_dir() => fs::read_dir(path).map(|mut entries| entries.next().is_some()),
        Ok(_) if force => {
            Err(io::Error::other("it exists and is not a folder; choose another name"))
        }
        Ok(_) => Ok(true),
        Err(e) => Err(e),
    };
    match holds {
        Err(cause) => fail(cause),
        Ok(true) if !force => Err(FileError::exists(path)),
        Ok(_) if env::current_dir().is_ok_and(|here| is_inside(&here, path)) => {
            fail(io::Error::other(
                "the folder in which a program is run cannot be replaced; name another, or run it from outside",
            ))
        }
        Ok(_) => Ok(()),
    }
}

fn is_inside(here: &Path, folder: &Path) -> bool {
    fs::canonicalize(folder).is_ok_and(|folder| here.starts_with(folder))
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
        if is_still(folder, &locked) {
            return Some(locked);
        }
    }
}

#[cfg(unix)]
fn is_still(folder: &Path, locked: &File) -> bool {
    use super::inputs::numbers;
    let (here, own) = (fs::metadata(folder), locked.metadata());
    here.is_ok_and(|here| own.is_ok_and(|own| numbers(&here) == numbers(&own)))
}

#[cfg(not(unix))]
fn is_still(_: &Path, _: &File) -> bool {
    true
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
    draft.lock();
    let (new, real) = (&draft.temporary, &draft.real);
    exchange(new, real)?;
    // Carries over files that were added to the old folder in the meantime.
    carry(new, real, &mut BTreeSet::new(), |_, _| Ok(())).map_err(|why| {
        // The old folder is not removed, because it contains files of the user.
        let left = std::mem::take(&mut draft.temporary);
        io::Error::other(format!(
            "everything is written, but {why}; the old folder is kept as {}",
            left.display()
        ))
    })
}

/// Swaps the names of two folders.
fn exchange(new: &Path, real: &Path) -> io::Result<()> {
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::{
            fs::{CWD, RenameFlags, renameat_with},
            io::Errno,
        };
        let in_one_step = || match renameat_with(CWD, new, CWD, real, RenameFlags::EXCHANGE) {
            Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP) => {
                Err(io::ErrorKind::Unsupported.into())
            }
            exchanged => Ok(exchanged?),
        };
        match ask("exchange").and_then(|()| in_one_step()) {
            Err(e) if e.kind() == io::ErrorKind::Unsupported => {}
            exchanged => return exchanged,
        }
    }
    // In three steps, on systems that cannot swap names in one.
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
    check: fn(&Path, &fs::Metadata) -> io::Result<()>,
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
            Ok(_) => check(&from, &entry.metadata()?)?,
            Err(_) if is_folder => {
                fs::create_dir(&to)?;
                fs::set_permissions(&to, entry.metadata()?.permissions())?;
            }
            Err(_) if replaced.contains(&from) => check(&from, &entry.metadata()?)?,
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

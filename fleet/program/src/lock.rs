//! Locks a folder, so that only one command at a time writes into it, and removes leftovers of
//! killed commands.

use std::{
    fs::{self, File, TryLockError},
    io::ErrorKind,
    path::Path,
};

use anyhow::Context;

use crate::{lake::below, show::warn};

/// The locked file. It is empty and is not removed.
const FILE: &str = ".stretch-lock";

/// Depth of calibration files below their folder: site, rig, sensor.
pub(crate) const RECORDS_DEPTH: usize = 3;

/// A folder into which no other command of the fleet writes while this value exists.
///
/// The operating system holds the lock and releases it when the process ends, however it ends.
/// Therefore a lock never outlives its owner.
#[derive(Debug)]
pub(crate) struct Lock {
    _file: File,
}

impl Lock {
    /// Waits until no other command writes into an existing folder, and removes temporary files of
    /// killed commands at most `depth` folders below it.
    ///
    /// # Errors
    /// A folder without write permission, a file system without locks.
    pub(crate) fn of(folder: &Path, depth: usize) -> anyhow::Result<Self> {
        let path = folder.join(FILE);
        let told = || format!("{}: the file cannot be locked", path.display());
        let mut options = File::options();
        let file = options.read(true).write(true).create(true).truncate(false).open(&path);
        let file = file.with_context(told)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::Error(e)) => return Err(e).with_context(told),
            Err(TryLockError::WouldBlock) => {
                warn(format!(
                    "{}: another command is writing into this folder; this command continues when it has ended",
                    folder.display()
                ));
                file.lock().with_context(told)?;
            }
        }
        remove_abandoned(folder, depth)?;
        Ok(Self { _file: file })
    }
}

/// Removes temporary files of processes that have ended. A running writer holds a lock on its
/// temporary file.
///
/// # Errors
/// A folder that cannot be read, a file that cannot be removed.
pub(crate) fn remove_abandoned(folder: &Path, depth: usize) -> anyhow::Result<()> {
    let all = below(folder, depth)?;
    for path in all.iter().filter(|path| is_temporary(path)) {
        let is_dead = File::open(path).is_ok_and(|file| file.try_lock().is_ok());
        if is_dead {
            match fs::remove_file(path) {
                // Another process has removed it in the meantime.
                Err(e) if e.kind() == ErrorKind::NotFound => {}
                removed => removed.with_context(|| path.display().to_string())?,
            }
        }
    }
    Ok(())
}

/// Whether a path has a temporary name of `stretch_data::files`: `.stretch-`, six letters or
/// digits, `.tmp`.
fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let letters = name.strip_prefix(".stretch-").and_then(|rest| rest.strip_suffix(".tmp"));
    letters.is_some_and(|text| text.len() == 6 && text.bytes().all(|b| b.is_ascii_alphanumeric()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_whose_writers_are_gone_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("deep")).unwrap();
        let names = [".stretch-AbCd12.tmp", "deep/.stretch-zzzzzz.tmp"];
        let others = [".stretch-notes.txt", "AbCd12.tmp", ".stretch-lake-AbCd12.tmp"];
        names.iter().chain(&others).for_each(|name| fs::write(at(name), "").unwrap());
        let alive = at(".stretch-alive1.tmp");
        let writer = File::create(&alive).unwrap();
        writer.lock().unwrap();
        drop(Lock::of(folder.path(), 0).unwrap());
        assert!(!at(names[0]).exists() && at(names[1]).exists() && alive.exists());
        drop((writer, Lock::of(folder.path(), 1).unwrap()));
        assert!(!at(names[1]).exists());
        assert!(others.iter().all(|name| at(name).exists()));
    }
}

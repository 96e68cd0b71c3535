//! A folder that is written whole or not at all.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use tempfile::{Builder, TempDir};

use crate::{
    DataError,
    interrupt::{Open, check},
    write_whole::{folder_of, sync_folder, without_path},
};

/// Writes a folder whole or not at all.
///
/// `fill` gets an empty folder beside the target and writes into it; when it is done the
/// folder takes the target's name. On any error the new folder goes and the target is as it
/// was.
///
/// A target that exists is refused unless `force` is set. With `force` the new files move
/// into it: a file of the same name is replaced, nothing else is touched, and when one of
/// the moves fails the earlier ones are taken back.
///
/// # Errors
/// [`DataError::Exists`], [`DataError::Io`], [`DataError::Interrupted`], or what `fill` says.
///
/// ```
/// use stretch_data::{DataError, write_folder, write_whole};
/// let parent = tempfile::tempdir()?;
/// let out = parent.path().join("bench-07");
/// let fill = |folder: &std::path::Path| {
///     write_whole(folder.join("a.csv"), |file| file.write_all(b"time_s\n0\n"))
/// };
/// write_folder(&out, false, fill)?;
/// assert!(out.join("a.csv").is_file());
/// let again = write_folder(&out, false, fill);
/// assert!(matches!(again, Err(DataError::Exists { .. })));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_folder<E: From<DataError>>(
    path: impl AsRef<Path>,
    force: bool,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let path = path.as_ref();
    let shown = path.display();
    let _open = Open::new(&shown)?;
    let fail = |cause| E::from(DataError::io(&shown, "write it", cause));
    if path.as_os_str() == "-" {
        return Err(fail(io::Error::other("a folder cannot go to standard output; name one")));
    }
    let exists = match fs::symlink_metadata(path) {
        Ok(_) if !force => return Err(DataError::Exists { path: shown.to_string() }.into()),
        Ok(_) if !path.is_dir() => {
            return Err(fail(io::Error::other("it exists and is not a folder")));
        }
        Ok(_) => true,
        Err(e) if e.kind() == io::ErrorKind::NotFound => false,
        Err(e) => return Err(fail(e)),
    };
    let parent = folder_of(path);
    let made = make_parents(parent).map_err(fail)?;
    let result = build(path, parent, exists, fill);
    if result.is_err() {
        // Only folders that are empty, and that were made here, go.
        made.iter().for_each(|folder| drop(fs::remove_dir(folder)));
    }
    result
}

fn build<E: From<DataError>>(
    path: &Path,
    parent: &Path,
    exists: bool,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let shown = path.display();
    let fail = |cause| E::from(DataError::io(&shown, "write it", cause));
    let temporary = temporary_folder(parent).map_err(fail)?;
    let fresh = temporary.path().join("new");
    fs::create_dir(&fresh).map_err(fail)?;
    fill(&fresh)?;
    check(&shown)?;
    if exists {
        move_into(&fresh, path, &temporary.path().join("old")).map_err(fail)?;
    } else {
        fs::rename(&fresh, path).map_err(fail)?;
    }
    sync_folder(parent);
    Ok(())
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

fn temporary_folder(parent: &Path) -> io::Result<TempDir> {
    Builder::new().prefix(".stretch-").suffix(".tmp").tempdir_in(parent).map_err(without_path)
}

/// Moves every file under `from` to the same place under `to`; what it replaces waits under
/// `old`, and goes back when a later move fails.
fn move_into(from: &Path, to: &Path, old: &Path) -> io::Result<()> {
    let mut files = Vec::new();
    list(from, Path::new(""), &mut files)?;
    let mut undo: Vec<(PathBuf, PathBuf)> = Vec::new();
    let mut step = |source: PathBuf, target: PathBuf| -> io::Result<()> {
        if let Some(folder) = target.parent() {
            fs::create_dir_all(folder)?;
        }
        fs::rename(&source, &target)?;
        undo.push((target, source));
        Ok(())
    };
    let mut all = || -> io::Result<()> {
        for file in &files {
            let target = to.join(file);
            match fs::symlink_metadata(&target) {
                Ok(meta) if meta.is_dir() => {
                    let name = file.display();
                    return Err(io::Error::other(format!("{name} is a folder there")));
                }
                Ok(_) => step(target.clone(), old.join(file))?,
                Err(_) => {}
            }
            step(from.join(file), target)?;
        }
        Ok(())
    };
    let result = all();
    if result.is_err() {
        for (now, before) in undo.into_iter().rev() {
            // Nothing better can be done where even this fails.
            let _ = fs::rename(now, before);
        }
    }
    result
}

fn list(root: &Path, below: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut entries = fs::read_dir(root.join(below))?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = below.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            list(root, &path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

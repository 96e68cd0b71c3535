//! What stands in a folder that is replaced, and is the user's, comes along.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use crate::digest::written_trials;

/// Brings every file of `old` that `new` has none of by that name into `new`: by `bring(from, to)`.
///
/// Trials that the old data set was written with, and that nobody changed since, stay where a new
/// data set takes its place.
pub(crate) fn carry(
    old: &Path,
    new: &Path,
    bring: fn(&Path, &Path) -> io::Result<()>,
) -> io::Result<()> {
    walk(old, new, Path::new(""), bring)
}

fn walk(
    old: &Path,
    new: &Path,
    below: &Path,
    bring: fn(&Path, &Path) -> io::Result<()>,
) -> io::Result<()> {
    let is_data_set = new.join(below).join("dataset.toml").is_file();
    let written = if is_data_set { written_trials(&old.join(below)) } else { Default::default() };
    let written: Vec<PathBuf> = written.into_iter().map(|file| below.join(file)).collect();
    // a trial may stand deeper, where the walk meets it again
    let mut folders = vec![below.to_owned()];
    while let Some(folder) = folders.pop() {
        let mut entries =
            fs::read_dir(old.join(&folder))?.collect::<io::Result<Vec<fs::DirEntry>>>()?;
        entries.sort_by_key(fs::DirEntry::file_name);
        for entry in entries {
            let path = folder.join(entry.file_name());
            let (from, to) = (entry.path(), new.join(&path));
            let is_folder = entry.file_type()?.is_dir();
            let taken = fs::symlink_metadata(&to).ok().map(|meta| meta.is_dir());
            let shown = path.display();
            match (is_folder, taken) {
                (false, None) if written.contains(&path) => {}
                (false, None) => bring(&from, &to)?,
                (true, None) => {
                    fs::create_dir(&to)?;
                    fs::set_permissions(&to, fs::metadata(&from)?.permissions())?;
                    folders.push(path);
                }
                (true, Some(true)) if from.join("dataset.toml").is_file() => {
                    walk(old, new, &path, bring)?;
                }
                (true, Some(true)) => folders.push(path),
                (true, Some(false)) => {
                    return Err(io::Error::other(format!("{shown} is a folder there")));
                }
                (false, Some(true)) => {
                    return Err(io::Error::other(format!("{shown} is a file there")));
                }
                (false, Some(false)) => {}
            }
        }
    }
    Ok(())
}

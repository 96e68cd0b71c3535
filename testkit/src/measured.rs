//! Recordings of others: the project carries none, but its tests and examples use them where they are.

use std::{
    env,
    path::{Path, PathBuf},
};

/// The folder that holds measured data sets: `STRETCH_DATA`, else `../shared/data` beside the workspace.
pub fn root() -> PathBuf {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    env::var_os("STRETCH_DATA").map_or_else(beside, PathBuf::from)
}

/// The folder of one data set; none, and a line that says so, where it is not there.
///
/// ```
/// assert_eq!(testkit::measured::folder("nobody_recorded_this"), None);
/// ```
pub fn folder(name: &str) -> Option<PathBuf> {
    folder_in(&root(), name)
}

/// The same below another folder than [`root`].
pub fn folder_in(root: &Path, name: &str) -> Option<PathBuf> {
    let folder = root.join(name);
    let found = folder.is_dir();
    if !found {
        println!(
            "SKIPPED: there is no folder {}; STRETCH_DATA names the one that holds {name}",
            folder.display()
        );
    }
    found.then_some(folder)
}

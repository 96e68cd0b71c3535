//! Finds measured data sets of other authors. The repository does not contain them, but its tests
//! and examples use them if they are available.

use std::{
    env,
    path::{Path, PathBuf},
};

/// Returns the folder with measured data sets: the value of the environment variable
/// `STRETCH_DATA`, or else `../shared/data` relative to the workspace.
pub fn root() -> PathBuf {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    env::var_os("STRETCH_DATA").map_or_else(beside, PathBuf::from)
}

/// Returns the folder of one data set. A test that calls this is `#[ignore]`d; `./ci.sh` runs it if
/// the data are available.
///
/// # Panics
/// If the folder does not exist. The message says where to get the data.
///
/// ```should_panic
/// testkit::measured::folder("nobody_recorded_this");
/// ```
pub fn folder(name: &str) -> PathBuf {
    let folder = folder_in(&root(), name);
    folder.unwrap_or_else(|| panic!("no {name}: STRETCH_DATA names the folder that holds it"))
}

/// Returns the folder of one data set below `root`. If it does not exist, prints a line and returns
/// `None`.
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

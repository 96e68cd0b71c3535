//! Recordings of others: the project carries none, but its tests and examples use them where they are.

use std::{
    env,
    path::{Path, PathBuf},
};

/// The folder that holds measured data sets: `STRETCH_DATA`, else `../shared/data` next to the workspace.
pub fn root() -> PathBuf {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    env::var_os("STRETCH_DATA").map_or_else(beside, PathBuf::from)
}

/// The folder of one data set. A test that asks for it is `#[ignore]`d: `./ci.sh` runs it where the data are.
///
/// # Panics
/// Where it is not there, with what to do.
///
/// ```should_panic
/// testkit::measured::folder("nobody_recorded_this");
/// ```
pub fn folder(name: &str) -> PathBuf {
    let folder = folder_in(&root(), name);
    folder.unwrap_or_else(|| panic!("no {name}: STRETCH_DATA names the folder that holds it"))
}

/// The folder of one data set below another folder than [`root`]; none, and a line that says so, where it is not there.
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

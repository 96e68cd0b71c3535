//! Folders of small files, each with the line that must come of it.

use std::{fs, path::Path};

use snapbox::{Assert, Data, assert::DEFAULT_ACTION_ENV};

/// Compares what `told` makes of every file of a folder with its line in `sentences.txt` there. `SNAPSHOTS=overwrite` writes that
/// file anew: then look at what git says has changed.
///
/// # Panics
///
/// Where a line differs or has no file, showing both; where the folder has no file.
pub fn is_as_it_should(folder: &Path, told: impl Fn(&str) -> String) {
    let entries = fs::read_dir(folder).expect("a folder of the corpus");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name != "sentences.txt")
        .collect();
    names.sort();
    assert!(!names.is_empty(), "{}: no file", folder.display());
    let all: String = names.iter().map(|name| told(name) + "\n").collect();
    let expected = Data::read_from(&folder.join("sentences.txt"), None).raw();
    Assert::new().action_env(DEFAULT_ACTION_ENV).eq(all, expected);
}

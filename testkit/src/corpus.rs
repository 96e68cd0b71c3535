//! Folders of small files, each with the line that must come of it.

use std::{fs, path::Path};

/// Compares what `told` makes of every file of a folder with its line in `sentences.txt` there.
///
/// # Panics
///
/// Where a line differs or has no file, naming the folder and all that differ; where the folder has no file.
pub fn is_as_it_should(folder: &Path, told: impl Fn(&str) -> String) {
    let entries = fs::read_dir(folder).expect("a folder of the corpus");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name != "sentences.txt")
        .collect();
    names.sort();
    assert!(!names.is_empty(), "{}: no file", folder.display());
    let expected = fs::read_to_string(folder.join("sentences.txt")).unwrap_or_default();
    let all: String = names.iter().map(|name| told(name) + "\n").collect();
    let differ: Vec<_> = all.lines().filter(|line| !expected.lines().any(|e| e == *line)).collect();
    assert!(all == expected, "{}: these differ:\n{}", folder.display(), differ.join("\n"));
}

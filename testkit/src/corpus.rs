//! Compares the program's output with files: one expected line for each small file in a folder, or
//! a whole text.

use std::{fs, path::Path};

/// For every file in a folder, compares `told(name)` with the line for this file in `sentences.txt`
/// in the same folder. If the environment variable `SNAPSHOTS` is `overwrite`, `sentences.txt` is
/// written anew; then review the changes in git.
///
/// # Panics
///
/// If a line differs (the message shows both lines), if a line has no file, or if the folder has no
/// file.
pub fn is_as_it_should(folder: &Path, told: impl Fn(&str) -> String) {
    let entries = fs::read_dir(folder).expect("a folder of the corpus");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name != "sentences.txt")
        .collect();
    names.sort();
    assert!(!names.is_empty(), "{}: no file", folder.display());
    let all: String = names.iter().map(|name| told(name) + "\n").collect();
    is_in_file(&folder.join("sentences.txt"), &all);
}

/// Compares a text with a file, line by line. If the environment variable `SNAPSHOTS` is
/// `overwrite`, the file is written anew; then review the changes in git.
///
/// # Panics
///
/// If text and file differ (the message shows the lines that differ), or if the file cannot be read
/// or written.
#[track_caller]
pub fn is_in_file(file: &Path, text: &str) {
    if std::env::var("SNAPSHOTS").is_ok_and(|what| what == "overwrite") {
        return fs::write(file, text).expect("a file that can be written");
    }
    let expected = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let without = |lines: &str, others: &str, sign: char| -> String {
        let missing = lines.lines().filter(|line| !others.lines().any(|other| other == *line));
        missing.map(|line| format!("{sign} {line}\n")).collect()
    };
    let gone = without(&expected, text, '-');
    let new = without(text, &expected, '+');
    assert!(
        expected == text,
        "{} has other lines, or the same in another order (SNAPSHOTS=overwrite writes it anew):\n{gone}{new}",
        file.display()
    );
}

//! Reads reference vectors: CSV files written by other tools, stored under `reference/`.

use std::{collections::HashMap, fs, path::PathBuf};

/// Returns the columns of `reference/<name>` by header, as numbers.
///
/// # Panics
/// If the file is missing or a field is not a number, because a reference that cannot be read must
/// fail the test.
pub fn columns(name: &str) -> HashMap<String, Vec<f64>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../reference").join(name);
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("a header line").split(',').collect();
    let mut columns: HashMap<String, Vec<f64>> =
        header.iter().map(|name| (name.to_string(), Vec::new())).collect();
    for (row, line) in lines.enumerate() {
        for (name, field) in header.iter().zip(line.split(',')) {
            let value = field.parse().unwrap_or_else(|_| panic!("row {row}, {name}: {field:?}"));
            columns.get_mut(*name).expect("known column").push(value);
        }
    }
    columns
}

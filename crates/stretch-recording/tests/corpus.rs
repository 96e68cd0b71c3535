//! Small invalid and unusual files, one folder per reader, each with the expected note or error (`sentences.txt`).

use std::{fs, path::Path};

use stretch_recording::{ReadOptions, Recording};
use testkit::corpus::is_as_it_should;

/// Returns the result of reading a file, in one line.
fn told(folder: &Path, name: &str) -> String {
    let mut options = ReadOptions::new();
    if name.starts_with("serial") {
        options = options.columns(["time_s", "bridge_v"]);
    }
    let bytes = fs::read(folder.join(name)).expect("a file of the corpus");
    match Recording::from_reader(&bytes[..], name, &options) {
        Err(error) => error.to_string(),
        Ok(Recording { trial, notes }) => {
            trial.check().expect("what is read can be written");
            let names: Vec<&str> = trial.channels.iter().map(|c| c.name.as_str()).collect();
            let last = trial.channels.iter().map(|c| c.values[c.values.len() - 1].to_string());
            let (rows, end_s) = (trial.len(), trial.time_s[trial.len() - 1]);
            let last: Vec<String> = last.collect();
            let read = format!("{name}: {rows} rows to {end_s} s of {}", names.join(", "));
            let ends = format!("{read}, the last {}", last.join(", "));
            std::iter::once(ends).chain(notes).collect::<Vec<_>>().join(" | ")
        }
    }
}

/// Defines one test per folder.
macro_rules! readers {
    ($($reader:ident)*) => {$(
        #[test]
        fn $reader() {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
            let folder = folder.join(stringify!($reader));
            is_as_it_should(&folder, |name| told(&folder, name));
        }
    )*};
}

readers!(text npz foreign);
#[cfg(feature = "parquet")]
readers!(parquet);

/// A file that is cut off anywhere is either refused or read, without a panic.
#[test]
fn whatever_breaks_off_is_told() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reference/recordings");
    let mut seen = 0;
    for entry in fs::read_dir(folder).expect("the reference recordings") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() || [".py", ".txt"].iter().any(|end| name.ends_with(end)) {
            continue;
        }
        let bytes = fs::read(&path).expect("a recording");
        for cut in (0..bytes.len()).step_by(bytes.len() / 97 + 1) {
            let options = ReadOptions::new();
            match Recording::from_reader(&bytes[..cut], &name, &options) {
                Ok(Recording { trial, .. }) => trial.check().expect("what is read is sound"),
                Err(error) => assert!(error.to_string().starts_with(&name), "{error}"),
            }
            seen += 1;
        }
    }
    assert!(seen > 900, "{seen} cuts");
}

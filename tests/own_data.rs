//! The project contains no recordings of other authors.

use std::{
    collections::HashSet,
    fs,
    hash::{DefaultHasher, Hash, Hasher},
    path::{Path, PathBuf},
    process::Command,
};

/// Number of consecutive values that two recordings do not share by chance.
const RUN: usize = 8;
/// Smallest number of different values among them, because a run of zeros identifies no recording.
const DIFFERENT: usize = 5;
/// Smallest number of fields, without the time, for a row to be searched for.
const FIELDS: usize = 3;

/// Hashes of the rows and columns of recordings.
#[derive(Default)]
struct Recordings {
    rows: HashSet<u64>,
    runs: HashSet<u64>,
}

fn hash(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

/// Returns the hashes of runs of values that identify a recording.
fn runs<'a>(values: &'a [&str]) -> impl Iterator<Item = u64> + 'a {
    let telling = |run: &&[&str]| {
        let long = run.iter().filter(|value| value.len() >= 4);
        long.collect::<HashSet<_>>().len() >= DIFFERENT
    };
    values.windows(RUN).filter(telling).map(hash)
}

/// Returns the hash of a row without its time, if the row contains enough to identify a recording.
fn row(line: &str) -> Option<u64> {
    let fields: Vec<&str> = line.split([',', ';', '\t']).map(str::trim).skip(1).collect();
    let long = fields.iter().filter(|f| f.len() >= 4 && f.parse::<f64>().is_ok());
    (long.collect::<HashSet<_>>().len() >= FIELDS).then(|| hash(&fields))
}

impl Recordings {
    fn add(&mut self, text: &str) {
        self.rows.extend(text.lines().skip(1).filter_map(row));
        let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|l| l.split(',').collect()).collect();
        // The time column is skipped, because all recordings share it.
        for column in 1..rows.first().map_or(0, Vec::len) {
            let values: Vec<&str> = rows.iter().filter_map(|r| r.get(column).copied()).collect();
            self.runs.extend(runs(&values));
        }
    }

    /// Counts rows and runs of values of the recordings in a text, with any separators.
    fn found_in(&self, text: &str) -> usize {
        let rows = text.lines().filter_map(row).filter(|r| self.rows.contains(r)).count();
        let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+' | 'e' | 'E');
        let numbers: Vec<&str> =
            text.split(|c| !is_number(c)).filter(|n| n.parse::<f64>().is_ok()).collect();
        let columns: Vec<Vec<&str>> = text.lines().map(|l| l.split(',').collect()).collect();
        let widest = columns.iter().map(Vec::len).max().unwrap_or(0).min(64);
        let in_columns = (0..widest).map(|i| {
            let values: Vec<&str> = columns.iter().filter_map(|r| r.get(i).copied()).collect();
            runs(&values).filter(|r| self.runs.contains(r)).count()
        });
        rows + runs(&numbers).filter(|r| self.runs.contains(r)).count() + in_columns.sum::<usize>()
    }
}

/// Returns every CSV file below a folder.
fn csv_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    entries
        .flat_map(|entry| match entry.path() {
            path if path.is_dir() => csv_files(&path),
            path if path.extension().is_some_and(|e| e == "csv") => vec![path],
            _ => Vec::new(),
        })
        .collect()
}

#[test]
fn a_copied_row_and_a_copied_column_are_found() {
    let line = |i: u32| {
        let x = f64::from(i);
        format!("{:.2},{:.4},{:.5},{:.5}", 0.01 * x, x * x, 7.0 / x, 1.25 + x)
    };
    let theirs: String = (1..40).map(|i| line(i) + "\n").collect();
    let mut recordings = Recordings::default();
    recordings.add(&format!("time_s,a,b,c\n{theirs}"));
    assert!(recordings.found_in(&theirs) > 30);
    assert!(recordings.found_in(&format!("1999.0{}\n", &line(7)[4..])) > 0, "another time");
    let column: Vec<String> = (3..12).map(|i| format!("{:.5}", 7.0 / f64::from(i))).collect();
    assert!(recordings.found_in(&format!("const B: [f64; 9] = [{}];", column.join(", "))) > 0);
    assert_eq!(recordings.found_in("time_s,a\n0.01,1.0000\n0.02,4.0000\n"), 0);
}

#[test]
#[ignore = "needs measured data: ../shared/data, or what STRETCH_DATA names; ./ci.sh runs it"]
fn with_data_no_committed_file_holds_a_recording_of_others() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let data = testkit::measured::root();
    let files = csv_files(&data);
    assert!(!files.is_empty(), "there are no recordings in {} to look for", data.display());
    let listed = Command::new("git").arg("-C").arg(root).args(["ls-files", "-z"]).output();
    let listed = listed.ok().filter(|l| l.status.success()).expect("git lists the files");
    let mut recordings = Recordings::default();
    for file in files {
        recordings.add(&fs::read_to_string(file).unwrap());
    }
    let listed = String::from_utf8(listed.stdout).unwrap();
    for name in listed.split('\0').filter(|name| !name.is_empty()) {
        // A file that was just removed is listed until the removal is committed. A binary file is
        // not text.
        let Ok(text) = fs::read_to_string(root.join(name)) else { continue };
        assert_eq!(recordings.found_in(&text), 0, "{name} holds rows or columns of a recording");
    }
}

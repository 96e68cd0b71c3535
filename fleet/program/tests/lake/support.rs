//! Helpers of the tests: they make trials and lakes, and run the program.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::Arc,
};

use datafusion::{
    arrow::array::{ArrayRef, RecordBatch},
    parquet::{
        arrow::{ArrowWriter, arrow_reader::ParquetRecordBatchReaderBuilder},
        file::{metadata::KeyValue, properties::WriterProperties},
    },
};
use stretch_data::{Channel, Trial};

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_stretch-fleet");

/// Runs the program; the words of `line` are its arguments, with {} replaced by the paths.
pub(crate) fn fleet(line: &str, paths: &[&Path]) -> Output {
    let mut paths = paths.iter();
    let words = line.split_whitespace().map(|word| match word {
        "{}" => paths.next().expect("a path").display().to_string(),
        word => word.to_owned(),
    });
    Command::new(PROGRAM).args(words.collect::<Vec<_>>()).output().expect("the program runs")
}

/// Runs the program, which must succeed, and returns its output and messages.
pub(crate) fn said(line: &str, paths: &[&Path]) -> String {
    let output = fleet(line, paths);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {told}");
    format!("{}{told}", String::from_utf8_lossy(&output.stdout))
}

/// Runs the program, which must fail, and returns its error message.
pub(crate) fn refused(line: &str, paths: &[&Path]) -> String {
    let output = fleet(line, paths);
    assert!(!output.status.success(), "{line} did not fail");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs the program, which must end with status 1 because it refuses some files, and returns its
/// output and messages.
pub(crate) fn warned(line: &str, paths: &[&Path]) -> String {
    let output = fleet(line, paths);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{line}: {told}");
    format!("{}{told}", String::from_utf8_lossy(&output.stdout))
}

/// Runs a query. Returns whether it succeeded, and its output with messages.
pub(crate) fn asked(lake: &Path, query: &str, more: &[&str]) -> (bool, String) {
    let output = Command::new(PROGRAM)
        .args(["sql", "--lake", &lake.display().to_string(), query])
        .args(more)
        .output()
        .expect("the program runs");
    let [said, told] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    (output.status.success(), said + &told)
}

/// Returns the bytes of every file below a folder by relative path, except the empty lock file.
pub(crate) fn tree(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let below = |path: PathBuf| path.strip_prefix(folder).unwrap().display().to_string();
    let all = bytes(folder).into_iter().map(|(path, bytes)| (below(path), bytes));
    all.filter(|(name, _)| !name.ends_with(".stretch-lock")).collect()
}

/// Returns a temporary folder, in memory if possible, because syncing takes no time there.
pub(crate) fn scratch() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.expect("a folder can be made")
}

/// Runs a query and returns its result as rows of CSV fields.
pub(crate) fn rows(lake: &Path, query: &str) -> Vec<Vec<String>> {
    let output = Command::new(PROGRAM)
        .args(["sql", "--csv", "--lake", &lake.display().to_string(), query])
        .output()
        .expect("the program runs");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{query}: {told}");
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// A trial of a sleeve that is stretched and released, with noise of 1 mV. `phase` makes different
/// trials.
pub(crate) fn trial(name: &str, phase: f64) -> Trial {
    let time_s: Vec<f64> = (0..600).map(|n| f64::from(n) * 0.01).collect();
    let shape = |t: f64| 0.08 - 0.06 * (2.1 * t + phase).cos() - 0.015 * (5.3 * t + phase).cos();
    let noise = |n: usize| 1e-3 * ((n * n * 7919 % 1009) as f64 / 504.5 - 1.0);
    let length = time_s.iter().map(|&t| 180.0 * (1.0 - shape(t))).collect();
    let bridge = time_s.iter().enumerate();
    let bridge = bridge.map(|(n, &t)| 1.24 + 6.0 * shape(t - 0.04) + noise(n)).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("length_mm", length), channel("bridge_v", bridge)];
    Trial { name: name.into(), time_s, channels }
}

/// Writes a trial as CSV and returns its path.
pub(crate) fn file(folder: &Path, trial: &Trial) -> PathBuf {
    let path = folder.join(&trial.name);
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder can be made");
    trial.write(&path).expect("a trial can be written");
    path
}

/// Returns every file below a folder with its bytes.
pub(crate) fn bytes(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let (mut found, mut folders) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            match entry.path() {
                path if path.is_dir() => folders.push(path),
                path => found.push((path.clone(), fs::read(path).expect("it can be read"))),
            }
        }
    }
    found.sort();
    found
}

/// Returns the first Parquet file found below a folder.
pub(crate) fn only(folder: &Path) -> PathBuf {
    let all = bytes(folder);
    let mut all = all.into_iter().map(|(path, _)| path);
    let found = all.find(|path| path.extension().is_some_and(|ending| ending == "parquet"));
    found.expect("a file of the lake")
}

/// Reads a Parquet file: its rows, and the metadata in its footer.
pub(crate) fn parquet(path: &Path) -> (RecordBatch, Vec<KeyValue>) {
    let file = fs::File::open(path).expect("it can be opened");
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).expect("it is Parquet");
    let about = builder.metadata().file_metadata().key_value_metadata().cloned();
    let about = about.unwrap_or_default().into_iter().filter(|pair| pair.key != "ARROW:schema");
    let about = about.collect();
    let mut batches = builder.with_batch_size(1 << 20).build().expect("it can be read");
    (batches.next().expect("a row").expect("rows"), about)
}

/// Rewrites a file of a lake with one column changed or removed.
pub(crate) fn altered(
    path: &Path,
    column: &str,
    with: Option<ArrayRef>,
    about: &dyn Fn(String) -> String,
) {
    let (batch, pairs) = parquet(path);
    let schema = batch.schema();
    let kept = schema.fields().iter().zip(batch.columns());
    let kept = kept.filter_map(|(field, array)| match (field.name() == column, &with) {
        (false, _) => Some((field.name().clone(), array.clone())),
        (true, Some(with)) => Some((column.to_owned(), with.clone())),
        (true, None) => None,
    });
    let batch = RecordBatch::try_from_iter(kept).expect("columns of one length");
    let pairs =
        pairs.into_iter().map(|pair| KeyValue::new(pair.key, pair.value.map(about))).collect();
    let properties = WriterProperties::builder().set_key_value_metadata(Some(pairs)).build();
    let file = fs::File::create(path).expect("it can be written");
    let mut writer = ArrowWriter::try_new(file, batch.schema(), Some(properties)).expect("Parquet");
    writer.write(&batch).expect("rows");
    writer.close().expect("a footer");
}

/// Returns numbers as a column.
pub(crate) fn numbers(values: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(values.into_iter().collect::<datafusion::arrow::array::Float64Array>())
}

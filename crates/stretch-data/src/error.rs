//! What can be wrong with a file, with the evidence.

use std::{fmt, fs, io, path::Path};

/// Where in a file something stands.
///
/// Rows count from 1 and include the header, as an editor shows them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// File, as it was given, or the name of a stream.
    pub file: String,
    /// Row as an editor counts it: the header is row 1.
    pub row: u64,
    /// Name of the column, or its number, the first being 1, where it has no name.
    pub column: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, row {}, column {}", self.file, self.row, self.column)
    }
}

/// Why something could not be read or written.
///
/// Each variant carries the evidence, and each message is one sentence that
/// says where, what, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// The system refused to open, read, write, or rename.
    #[error("{path}: cannot {action}: {}", Cause(.cause))]
    Io {
        /// The file or folder.
        path: String,
        /// What was tried: `open it`, `write it`.
        action: &'static str,
        /// What the system said.
        #[source]
        cause: io::Error,
    },
    /// A folder that is no data set.
    #[error("{folder}: there is no dataset.toml in it; {hint}")]
    NoDataSet {
        /// The folder.
        folder: String,
        /// What to do, by what is in it.
        hint: String,
    },
    /// A file without a byte, or with blank lines only.
    #[error(
        "{file}: the file is empty; it needs a header line with the names of its columns, then a row a sample"
    )]
    Empty {
        /// The file.
        file: String,
    },
    /// A header and nothing below it.
    #[error(
        "{file}: there is a header line and no sample below it; record the trial again or leave the file out"
    )]
    HeaderOnly {
        /// The file.
        file: String,
    },
    /// The first line holds numbers where names should stand.
    #[error(
        "{file}: the first line (\"{first}\") holds numbers and no names; put a header line above it, such as time_s,length_mm,bridge_v, or name the columns with --columns"
    )]
    NoHeader {
        /// The file.
        file: String,
        /// The first line, shortened.
        first: String,
    },
    /// A column that is needed is not there.
    #[error("{file}: there is no column {column}{}; the columns are {}", Nearest(.nearest), .present.join(", "))]
    MissingColumn {
        /// The file.
        file: String,
        /// The column that is needed.
        column: String,
        /// The columns that are there.
        present: Vec<String>,
        /// The one whose name is nearest.
        nearest: Option<String>,
    },
    /// Two columns of one name.
    #[error("{file}: the header names column {column} twice; rename or remove one of them")]
    DuplicateColumn {
        /// The file.
        file: String,
        /// The name.
        column: String,
    },
    /// A name that a line end or another control character stands in.
    #[error(
        "{at}: the name \"{value}\" holds a control character; if the lines end in CR alone, save the file with LF"
    )]
    ControlCharacter {
        /// Where.
        at: Place,
        /// The name, shortened.
        value: String,
    },
    /// Text where a number should stand.
    #[error("{at}: \"{value}\" is not a number; correct it or remove that row")]
    NotANumber {
        /// Where.
        at: Place,
        /// The field, shortened.
        value: String,
    },
    /// A field without a character.
    #[error("{at}: the field is empty; fill it in or remove that row")]
    EmptyField {
        /// Where.
        at: Place,
    },
    /// A decimal comma.
    #[error("{at}: \"{value}\" has a decimal comma; export the file again with decimal points")]
    DecimalComma {
        /// Where.
        at: Place,
        /// The field.
        value: String,
    },
    /// NaN, an infinity, or a number too large for 64 bits.
    #[error("{at}: \"{value}\" is not a finite number; correct it or remove that row")]
    NotFinite {
        /// Where.
        at: Place,
        /// The field.
        value: String,
    },
    /// Bytes that are no UTF-8 text.
    #[error("{at}: \"{value}\" is not UTF-8 text; save the file with the encoding UTF-8")]
    NotUtf8 {
        /// Where.
        at: Place,
        /// The bytes, the foreign ones escaped.
        value: String,
    },
    /// A row with more or fewer fields than the header.
    #[error(
        "{file}, row {row}: there are {found} fields where the header has {expected}; complete or remove that row"
    )]
    Ragged {
        /// The file.
        file: String,
        /// The row.
        row: u64,
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A quotation mark that is not closed in its line, or text after it.
    #[error("{at}: the quotation marks do not pair up within the line; remove or double them")]
    Quote {
        /// Where.
        at: Place,
    },
    /// A decimal point where the numbers so far had decimal commas.
    #[error(
        "{at}: \"{value}\" has a decimal point where the rows above have decimal commas; export the file again with one of them"
    )]
    DecimalPoint {
        /// Where.
        at: Place,
        /// The field.
        value: String,
    },
    /// A date or a time of day that is none.
    #[error("{at}: \"{value}\" is not a time stamp that is understood{}", if cfg!(feature = "iso-time") { "; write it as 2024-05-01T12:00:00.250Z, or as seconds" } else { ": this program was built without the feature iso-time; write the time as seconds" })]
    TimeStamp {
        /// Where.
        at: Place,
        /// The field.
        value: String,
    },
    /// Other columns than there are names for them.
    #[error(
        "{file}, row {row}: there are {found} numbers where {given} columns were named; name as many"
    )]
    Named {
        /// The file.
        file: String,
        /// The row.
        row: u64,
        /// Numbers in the row.
        found: usize,
        /// Names given.
        given: usize,
    },
    /// A rate at which nobody records.
    #[error(
        "{file}, column {column}: {rate_hz:.3e} samples a second, which is not between 1e-3 and 1e7; say what its numbers count with --time-unit s, ms, us or ns"
    )]
    Rate {
        /// The file.
        file: String,
        /// The time.
        column: String,
        /// The rate as it was read.
        rate_hz: f64,
    },
    /// Whole numbers in a column of seconds that count something shorter.
    #[error("{file}, column {column}: its times are whole numbers, {step} from sample to sample: that is {rate_hz} samples a second if they are seconds and {} if they are milliseconds; say which with --time-unit s or ms, or rename it {column_ms}", 1e3 * .rate_hz)]
    WholeSeconds {
        /// The file.
        file: String,
        /// The time.
        column: String,
        /// From sample to sample.
        step: f64,
        /// The rate if they are seconds.
        rate_hz: f64,
        /// What the column should be called if they are milliseconds.
        column_ms: String,
    },
    /// A recording without any time.
    #[error("{file}: there is no time; {}", .hint)]
    NoTime {
        /// The file.
        file: String,
        /// What to do.
        hint: String,
    },
    /// Channels that were never recorded at the same time.
    #[error(
        "{file}: {first} and {second} have no time in common ({first_s} s and {second_s} s); they cannot be brought to one grid: leave one of them out"
    )]
    NoOverlap {
        /// The file.
        file: String,
        /// One clock.
        first: String,
        /// Its span, `from .. to`.
        first_s: String,
        /// The other.
        second: String,
        /// Its span.
        second_s: String,
    },
    /// A format that this program was built without.
    #[error(
        "{file}: this is {format}, which this program was built without; build it with --features {feature}, or export the recording as CSV"
    )]
    Feature {
        /// The file.
        file: String,
        /// What it is.
        format: &'static str,
        /// The feature that reads it.
        feature: &'static str,
    },
    /// Something in a file that is no text, where a reader could not go on.
    #[error("{file}: this {format} file cannot be read: {problem}")]
    Format {
        /// The file.
        file: String,
        /// What it is.
        format: &'static str,
        /// Where, what, and what to do.
        problem: String,
    },
    /// A line longer than the reader accepts.
    #[error(
        "{file}, row {row}: the line is longer than {limit} bytes; this is not a table of samples with a line each"
    )]
    LineTooLong {
        /// The file.
        file: String,
        /// The row.
        row: u64,
        /// The longest line that is accepted.
        limit: usize,
    },
    /// Time that stands still or goes back.
    #[error("{at}: time {} from {previous_s} to {time_s}; time must rise from row to row: sort the rows or split the recordings", if .time_s == .previous_s { "stands still" } else { "goes back" })]
    TimeNotRising {
        /// Where.
        at: Place,
        /// Seconds in this row.
        time_s: f64,
        /// Seconds in the row before.
        previous_s: f64,
    },
    /// Channels of a trial in memory that do not go with its time.
    #[error("{trial}, column {column}: it has {found} values where time_s has {expected}")]
    Lengths {
        /// The trial.
        trial: String,
        /// The column.
        column: String,
        /// Its values.
        found: usize,
        /// Time stamps.
        expected: usize,
    },
    /// A trial of another sample rate than the rest of its session.
    #[error(
        "{trial}, column time_s: {rate_hz:.2} samples a second where {usual_hz:.2} are usual; resample it to that rate or leave it out"
    )]
    OtherRate {
        /// The trial.
        trial: String,
        /// Its rate.
        rate_hz: f64,
        /// The rate asked for: that of the session's first trial.
        usual_hz: f64,
    },
    /// A session in which no trial has two samples.
    #[error("no trial has two samples; give at least one recording")]
    NoSamples,
    /// TOML that cannot be parsed at all.
    #[error("{file}, row {row}: this is not TOML: {message}")]
    NotToml {
        /// The file.
        file: String,
        /// The row.
        row: u64,
        /// What the parser said.
        message: String,
    },
    /// A key that is missing or has an impossible value.
    #[error("{file}, {table}, key {key}: {problem}")]
    Key {
        /// The file.
        file: String,
        /// The table, in words: `[[trial]] 3`.
        table: String,
        /// The key.
        key: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// Something in memory that has no place in a file.
    #[error("{name} cannot be written: {problem}")]
    Unwritable {
        /// The trial or data set.
        name: String,
        /// What is wrong.
        problem: String,
    },
    /// Something that is in the way of a folder.
    #[error("{path}: it exists and is not an empty folder; choose another name")]
    Exists {
        /// What is there.
        path: String,
    },
    /// Stopped by [`interrupt`](crate::interrupt).
    #[error("{path}: interrupted; nothing was written")]
    Interrupted {
        /// What was being written.
        path: String,
    },
}

/// A cause without Rust's `(os error 28)`.
struct Cause<'a>(&'a io::Error);

impl fmt::Display for Cause<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.0.to_string();
        f.write_str(text.split(" (os error").next().unwrap_or(&text))
    }
}

struct Nearest<'a>(&'a Option<String>);

impl fmt::Display for Nearest<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(name) => write!(f, " (did you mean {name}?)"),
            None => Ok(()),
        }
    }
}

impl DataError {
    /// Whether the system refused something, such as a missing file or a full disk.
    pub fn is_io(&self) -> bool {
        matches!(self, Self::Io { .. })
    }

    /// Whether the file or folder is not there.
    pub fn is_not_found(&self) -> bool {
        match self {
            Self::Io { cause, .. } => cause.kind() == io::ErrorKind::NotFound,
            Self::NoDataSet { .. } => true,
            _ => false,
        }
    }

    /// Whether whoever read the output has gone: a pipe into `head`, say.
    pub fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::Io { cause, .. } if cause.kind() == io::ErrorKind::BrokenPipe)
    }

    /// Whether a column that is needed is not there.
    pub fn is_missing_column(&self) -> bool {
        matches!(self, Self::MissingColumn { .. })
    }

    /// Whether time stood still or went back.
    pub fn is_time(&self) -> bool {
        matches!(self, Self::TimeNotRising { .. })
    }

    /// Whether one row is at fault, so that a stream may go on with the next.
    pub fn is_row(&self) -> bool {
        matches!(
            self,
            Self::NotANumber { .. }
                | Self::EmptyField { .. }
                | Self::DecimalComma { .. }
                | Self::DecimalPoint { .. }
                | Self::TimeStamp { .. }
                | Self::NotFinite { .. }
                | Self::NotUtf8 { .. }
                | Self::Ragged { .. }
                | Self::Quote { .. }
                | Self::LineTooLong { .. }
                | Self::TimeNotRising { .. }
        )
    }

    /// Whether [`interrupt`](crate::interrupt) stopped it.
    pub fn is_interrupted(&self) -> bool {
        matches!(self, Self::Interrupted { .. })
    }

    /// What a folder without a `dataset.toml` may be meant for.
    pub(crate) fn no_data_set(folder: &Path) -> Self {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let is_table = |name: &String| name.ends_with(".csv") || name.ends_with(".csv.gz");
        let mut tables: Vec<String> = entries
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(is_table)
            .collect();
        tables.sort();
        let shown = folder.display();
        let hint = match tables.first() {
            None => "name a data set, or recordings one by one".to_owned(),
            Some(first) => {
                let held = match tables.len() {
                    1 => first.clone(),
                    many => format!("{many} CSV files"),
                };
                format!(
                    "it holds {held}: name recordings one by one ({shown}/{first}; {shown}/*.csv where several may be \
                     named), or write a dataset.toml that says which are fitted and which test"
                )
            }
        };
        Self::NoDataSet { folder: shown.to_string(), hint }
    }

    pub(crate) fn io(path: impl fmt::Display, action: &'static str, cause: io::Error) -> Self {
        Self::Io { path: path.to_string(), action, cause }
    }
}

//! Errors for wrong files, and helpers for messages: shortened fields, lists of names, and the
//! nearest known name.

use std::{error::Error, fmt, fs, io, path::Path};

use crate::{
    column::unit,
    digits::{in_digits, resampling},
    files::FileError,
};

/// A place in a file.
///
/// Rows count from 1 and include the header, as an editor shows them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Path of the file as it was given, or the name of a stream.
    pub file: String,
    /// Row as an editor counts it: the header is row 1.
    pub row: u64,
    /// Name of the column, or its number (from 1) if it has no name.
    pub column: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, row {}, column {}", self.file, self.row, self.column)
    }
}

/// Why something could not be read or written.
///
/// Each message is one sentence that states the place, the problem with the offending value, and
/// the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// A file or folder that could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A folder without a `dataset.toml`.
    #[error("{folder}: there is no dataset.toml in it; {hint}")]
    NoDataSet {
        /// The folder.
        folder: String,
        /// What to do, depending on the folder's contents.
        hint: String,
    },
    /// A required column that is missing.
    #[error("{file}: there is no column {column}{}; the columns are {}", Nearest(.nearest, .column, .present), .present.join(", "))]
    MissingColumn {
        /// The file.
        file: String,
        /// The required column.
        column: String,
        /// The existing columns.
        present: Vec<String>,
        /// The existing column with the most similar name, if there is one.
        nearest: Option<String>,
    },
    /// NaN, an infinity, or a number too large for 64 bits.
    #[error("{at}: \"{value}\" is not a finite number; correct it or remove that row")]
    NotFinite {
        /// Where.
        at: Place,
        /// The text of the field.
        value: String,
    },
    /// A time stamp that is equal to or smaller than the one before.
    #[error("{at}: time {} from {previous_s} to {time_s}; time must rise from row to row: leave that row out, or split the recording there", if .time_s == .previous_s { "stays the same" } else { "goes back" })]
    TimeNotRising {
        /// Where.
        at: Place,
        /// Seconds in this row.
        time_s: f64,
        /// Seconds in the row before.
        previous_s: f64,
    },
    /// A channel of a trial in memory whose length differs from that of the time column.
    #[error("{trial}, column {column}: it has {found} values where time_s has {expected}")]
    Lengths {
        /// The trial.
        trial: String,
        /// The column.
        column: String,
        /// Number of its values.
        found: usize,
        /// Number of time stamps.
        expected: usize,
    },
    /// A trial whose sample rate differs from that of the rest of its session.
    #[error(
        "{trial}, column time_s: it has {} samples per second, but the session has {}; resample it ({}) or leave it out",
        in_digits(*rate_hz, 6), in_digits(*usual_hz, 6), resampling(*usual_hz)
    )]
    OtherRate {
        /// The trial.
        trial: String,
        /// Its rate.
        rate_hz: f64,
        /// The required rate: that of the session's first trial.
        usual_hz: f64,
    },
    /// A test trial with the same samples as a trial that may be fitted.
    #[error(
        "{test} is a test trial, and it has the same samples as {fit}, which is fitted; a fitted trial cannot be a test: record another trial, or leave one of them out"
    )]
    FittedAndTested {
        /// The trial that may be fitted.
        fit: String,
        /// The test trial.
        test: String,
    },
    /// More rows than a command holds in memory.
    #[error(
        "the trials have {rows} rows in total, and at most {most} can be processed; resample them to a lower rate \
         (stretch convert OLD --grid HZ --out NEW.csv), or give a part of the recording"
    )]
    TooLong {
        /// Number of rows of all trials.
        rows: usize,
        /// The largest permitted number of rows.
        most: usize,
    },
    /// A session in which no trial has two or more samples.
    #[error("no recording has two or more rows; give a recording that has")]
    NoSamples,
    /// TOML that cannot be parsed at all.
    #[error("{file}, row {row}: this is not TOML: {message}")]
    NotToml {
        /// The file.
        file: String,
        /// The row.
        row: u64,
        /// The parser's message.
        message: String,
    },
    /// A key that is missing or has an impossible value.
    #[error("{file}{}, key {key}: {problem}", .row.map_or(String::new(), |row| format!(", row {row}")))]
    Key {
        /// The file.
        file: String,
        /// The row, if it is known.
        row: Option<u64>,
        /// The key with its tables: `trial[2].file`.
        key: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// Data in memory that the file format cannot represent.
    #[error("{name} cannot be written: {problem}")]
    Unwritable {
        /// The trial or data set.
        name: String,
        /// What is wrong.
        problem: String,
    },
}

struct Nearest<'a>(&'a Option<String>, &'a str, &'a [String]);

impl fmt::Display for Nearest<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            // A time column is renamed when it is read.
            _ if self.1 == "time_s" && self.2.iter().any(|name| name == "time_s") => {
                f.write_str(" for a signal or a reference, because it holds the times")
            }
            _ if matches!(unit(self.1), Some("s" | "ms" | "us" | "ns"))
                && self.2.iter().any(|name| name == "time_s") =>
            {
                f.write_str(" (the time of a recording is named time_s after reading)")
            }
            Some(name) => write!(f, " (did you mean {name}?)"),
            None => Ok(()),
        }
    }
}

impl DataError {
    /// Returns the error for a folder without a `dataset.toml`, with advice that depends on the CSV
    /// files in it.
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
                    "it contains {held}: give one of them ({shown}/{first}), or {shown}/*.csv to a command that takes several, or write a \
                     dataset.toml that states which are fitted and which are tests"
                )
            }
        };
        Self::NoDataSet { folder: shown.to_string(), hint }
    }

    pub(crate) fn io(path: impl fmt::Display, action: &'static str, cause: io::Error) -> Self {
        FileError::io(path, action, cause).into()
    }

    /// Returns the error for a missing column, with the existing columns and the one with the most
    /// similar name.
    pub fn missing_column<'a>(
        file: &str,
        column: &str,
        present: impl Iterator<Item = &'a str>,
    ) -> Self {
        let present: Vec<String> =
            present.filter(|name| !name.is_empty()).map(|name| shown(name.as_bytes())).collect();
        let nearest = nearest(column, present.iter().map(String::as_str)).map(str::to_owned);
        Self::MissingColumn { file: file.to_owned(), column: column.to_owned(), present, nearest }
    }
}

/// Prepares a field for a message: shortens it to 40 characters and replaces control characters.
pub fn shown(content: &[u8]) -> String {
    const LONGEST: usize = 40;
    let mut text = String::new();
    for chunk in content[..content.len().min(4 * LONGEST)].utf8_chunks() {
        text.extend(chunk.valid().chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }));
        for byte in chunk.invalid() {
            text.push_str(&format!("\\x{byte:02x}"));
        }
    }
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

/// Returns the candidate nearest to `name` by edit distance, ignoring case, if it is near enough to
/// be meant: at most two edits and fewer than half the length of `name`. Names are also compared
/// without the unit of the candidate (`_mm`).
///
/// ```
/// let names = ["time_s", "length_mm", "bridge_v"];
/// assert_eq!(stretch_data::nearest("lenght_mm", names), Some("length_mm"));
/// assert_eq!(stretch_data::nearest("lenght", names), Some("length_mm"));
/// assert_eq!(stretch_data::nearest("pressure_kpa", names), None);
/// ```
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Names are cut to 64 characters because the time for an edit distance is proportional to the
    // product of the lengths.
    let short = |text: &str| text.to_lowercase().chars().take(64).collect::<String>();
    let name = short(name);
    let edits = |one: &str| {
        let units = one.match_indices('_').map(|(i, _)| &one[..i]);
        units.chain([one]).map(|stem| strsim::levenshtein(&name, stem)).min().unwrap_or_default()
    };
    let near = candidates.into_iter().map(|one| (edits(&short(one)), one));
    near.filter(|(edits, _)| *edits <= 2 && 2 * edits < name.chars().count().max(1))
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, one)| one)
}

/// Replaces the options of the program in a message, because another interface has its own names for them. Each pair in
/// `names` has the option without its dashes, and the replacement. If a replacement ends in `=`, the value follows
/// directly. Other options stay, and so do the options of a whole command, such as `stretch convert --grid 100`.
///
/// ```
/// use stretch_data::rename_options;
/// let text = "give --time COL:ms, or run stretch convert --time COL:ms";
/// let renamed = rename_options(text, &[("time", "time=")]);
/// assert_eq!(renamed, "give time=COL:ms, or run stretch convert --time COL:ms");
/// ```
pub fn rename_options(text: &str, names: &[(&str, &str)]) -> String {
    let mut parts = text.split("--");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(part.len());
        let command = out.rfind("stretch ").map_or("; ", |at| &out[at..]);
        let is_command = !command.contains([';', ',', '(', ':']) && !command.contains(" and ");
        match names.iter().find(|(option, _)| *option == &part[..end]) {
            Some((_, name)) if !is_command && (out.is_empty() || out.ends_with([' ', '('])) => {
                out += name;
                out += if name.ends_with('=') { part[end..].trim_start() } else { &part[end..] };
            }
            _ => out += &format!("--{part}"),
        }
    }
    out
}

/// Joins an error and its causes to one sentence, without Rust's numbers of system errors and without names of temporary
/// files. A cause that the sentence already contains is left out.
///
/// ```
/// let error = std::io::Error::other("the disk is full (os error 28)");
/// assert_eq!(stretch_data::error_sentence(&error), "the disk is full");
/// ```
pub fn error_sentence(error: &dyn Error) -> String {
    let mut text = without_numbers(&error.to_string());
    let causes = std::iter::successors(error.source(), |cause| (*cause).source());
    for cause in causes.map(|cause| without_numbers(&cause.to_string())) {
        if cause.starts_with(&format!("{text}:")) {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    crate::files::without_temporary_names(&text)
}

/// Removes Rust's `(os error 28)` from a text, because it repeats the text before it.
pub(crate) fn without_numbers(text: &str) -> String {
    let mut parts = text.split(" (os error ");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text += part.split_once(')').map_or(part, |(_, rest)| rest);
    }
    text
}

/// Joins names into a phrase: `a, b and c`, or `nothing` for an empty list.
///
/// ```
/// assert_eq!(stretch_data::listed(&["a", "b", "c"]), "a, b and c");
/// assert_eq!(stretch_data::listed::<&str>(&[]), "nothing");
/// ```
pub fn listed<S: AsRef<str>>(names: &[S]) -> String {
    let [all @ .., last] = names else { return "nothing".to_owned() };
    let all: Vec<&str> = all.iter().map(AsRef::as_ref).collect();
    match all[..] {
        [] => last.as_ref().to_owned(),
        _ => format!("{} and {}", all.join(", "), last.as_ref()),
    }
}

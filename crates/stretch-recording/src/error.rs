//! Errors of reading a recording.

use std::{fmt, io, path::Path};

use stretch_data::files::FileError;
use stretch_data::{DataError, Place};

use crate::read::STDIN;

/// Why a recording could not be read.
///
/// Each variant contains the evidence. Each message is one sentence: where the problem is, what it
/// is, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file that could not be read, a missing column, or invalid samples.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A file that is empty or contains only blank lines.
    #[error(
        "{file}: the file is empty; it needs a header line with the names of its columns, then one row per sample"
    )]
    Empty {
        /// The file.
        file: String,
    },
    /// A header line without samples below it.
    #[error(
        "{file}: there is a header line and no sample below it; record the trial again or leave the file out"
    )]
    HeaderOnly {
        /// The file.
        file: String,
    },
    /// Lines of text without a row of numbers.
    #[error(
        "{file}: {} a row of numbers (the first is \"{first}\"); {}", none_of(*.lines), how_to_write(*.is_one_column)
    )]
    NoNumbers {
        /// The file.
        file: String,
        /// Lines that were searched.
        lines: usize,
        /// The first line, shortened.
        first: String,
        /// Whether any of these lines is a single number.
        is_one_column: bool,
    },
    /// Rows of numbers without names above them.
    #[error(
        "{file}: {rows} of {numbers} numbers from line {row} on, and {above}; name the columns with --columns, or put a header line above them, such as time_s,length_mm,bridge_v"
    )]
    NoHeader {
        /// The file.
        file: String,
        /// How many rows, such as `2 rows`.
        rows: String,
        /// Numbers in each row.
        numbers: usize,
        /// The first row.
        row: u64,
        /// Description of the line above the rows.
        above: String,
    },
    /// A row that cannot be read and may not be left out.
    #[error("{first} ({reason})")]
    Refused {
        /// What is wrong with the row.
        first: Box<Self>,
        /// Why it is not left out.
        reason: String,
    },
    /// Two columns with the same requested name.
    #[error(
        "{file}: the header names column {column} twice; ask for {column}.0 or {column}.1, the first and the second of them"
    )]
    DuplicateColumn {
        /// The file.
        file: String,
        /// The name.
        column: String,
    },
    /// A name that contains a line end or another control character.
    #[error(
        "{at}: the name \"{value}\" holds a control character; if the lines end in CR alone, save the file with LF"
    )]
    ControlCharacter {
        /// Where.
        at: Place,
        /// The name, shortened.
        value: String,
    },
    /// Text where a number should be.
    #[error("{at}: \"{value}\" is not a number; correct it or remove that row")]
    NotANumber {
        /// Where.
        at: Place,
        /// The field, shortened.
        value: String,
    },
    /// An empty field.
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
    /// Text in UTF-16, which is not decoded.
    #[error("{file}: the text is UTF-16; save the file with the encoding UTF-8")]
    Utf16 {
        /// The file.
        file: String,
    },
    /// A row with more or fewer fields than the header.
    #[error(
        "{file}, row {row}: the header has {expected} fields and this row has {found}; complete or remove that row"
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
    /// A quotation mark that is not closed in its line, or text between a closing quotation mark
    /// and the next separator.
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
    /// A time stamp that is not a valid date or time of day.
    #[error(
        "{at}: \"{value}\" is not a time stamp that is understood; write it as 2024-05-01T12:00:00.250Z, or as seconds"
    )]
    TimeStamp {
        /// Where.
        at: Place,
        /// The field.
        value: String,
    },
    /// A date in which it is unclear which number is the day and which the month.
    #[error(
        "{at}: it is unclear which number of \"{value}\" is the day; give the order with --time {}:dmy or {}:mdy", .at.column, .at.column
    )]
    DayOrMonth {
        /// Where.
        at: Place,
        /// The field.
        value: String,
    },
    /// A number of columns that differs from the number of given names.
    #[error(
        "{file}, row {row}: the row has {found} numbers, but --columns names {given}; give {found} names"
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
    /// A sample rate outside the accepted range.
    #[error(
        "{file}, column {column}: its time stamps give {rate_hz:.3e} samples per second, which is not between {least_hz:e} and {most_hz:e}; \
         give their unit with --time {column}:s, :ms, :us, :ns, :min, :h or :d, or replace them by a rate with --sample-rate HZ"
    )]
    Rate {
        /// The file.
        file: String,
        /// The time column.
        column: String,
        /// The rate that the time stamps give.
        rate_hz: f64,
        /// The lowest accepted rate.
        least_hz: f64,
        /// The highest accepted rate.
        most_hz: f64,
    },
    /// A time column with invalid time stamps.
    #[error("{at}: {problem}; to replace the time column by a rate, give --sample-rate HZ")]
    Stamps {
        /// Where.
        at: Place,
        /// What is wrong with its stamps.
        problem: String,
    },
    /// A resampling grid with many more instants than were recorded.
    #[error(
        "{file}: a grid of {rate_hz} Hz has {:.1e} instants in its {span_s} s, many times what was recorded; give a lower rate with --grid, or split the recording at the gap in its time", .rate_hz * .span_s
    )]
    Grid {
        /// The file.
        file: String,
        /// The grid's rate.
        rate_hz: f64,
        /// Duration of the recording, s.
        span_s: f64,
    },
    /// A time column that was taken for seconds and may be in milliseconds.
    #[error("{file}, column {column}: its times go up by {step} from sample to sample: that is {rate_hz} samples a second if they are seconds and {} if they are milliseconds; say which with --time {column}:s or {column}:ms, or rename it {column_ms}", 1e3 * .rate_hz)]
    SlowSeconds {
        /// The file.
        file: String,
        /// The time column.
        column: String,
        /// Step of the time from sample to sample.
        step: f64,
        /// Sample rate if the times are seconds.
        rate_hz: f64,
        /// Name that the column should have if the times are milliseconds.
        column_ms: String,
    },
    /// A missing time column.
    #[error(
        "{missing}; say which column is the time with --time COLUMN, or --time 100hz if there is none"
    )]
    MissingTime {
        /// The missing column, and the columns that are present.
        missing: DataError,
    },
    /// A recording that contains only a time.
    #[error("{file}: it holds no column of numbers besides the time{}", if notes.is_empty() { String::new() } else { format!(" ({notes})") })]
    NoChannels {
        /// The file.
        file: String,
        /// What was left out.
        notes: String,
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
        /// Name of one clock.
        first: String,
        /// Time that this clock covers, `from .. to`.
        first_s: String,
        /// Name of the other clock.
        second: String,
        /// Time that the other clock covers.
        second_s: String,
    },
    /// A format that only the Python package reads.
    #[error(
        "{file}: this is {format}, which is not read here; convert it with `python -m stretch_gap convert {command}` (pip install \"stretch-gap[{extra}]\")"
    )]
    Convert {
        /// The file.
        file: String,
        /// Name of the format.
        format: &'static str,
        /// Arguments of the command: input file and output file.
        command: String,
        /// Extra of the Python package that installs the required library.
        extra: &'static str,
    },
    /// A file that cannot be read in its format.
    #[error("{file}: this {format} file cannot be read: {problem}")]
    Format {
        /// The file.
        file: String,
        /// Name of the format.
        format: &'static str,
        /// Where the problem is, what it is, and what to do.
        problem: String,
    },
    /// A line longer than the reader accepts.
    #[error(
        "{file}, row {row}: the line is longer than {limit} bytes; write a table with one line per sample"
    )]
    LineTooLong {
        /// The file.
        file: String,
        /// The row.
        row: u64,
        /// The longest line that is accepted.
        limit: usize,
    },
}

/// Says that none of the first lines of a text is something.
fn none_of(lines: usize) -> String {
    match lines {
        1 => "its first line is not".to_owned(),
        lines => format!("none of its first {lines} lines is"),
    }
}

/// Says how to write a recording.
fn how_to_write(is_one_column: bool) -> &'static str {
    match is_one_column {
        true => {
            "each line has one number only: name the column and give the rate, such as --columns gauge_mv --time 100hz, or record the time as well"
        }
        false => "write one line per sample, with a separator between its numbers",
    }
}

impl RecordingError {
    pub(crate) fn io(path: impl fmt::Display, action: &'static str, cause: io::Error) -> Self {
        DataError::from(FileError::io(path, action, cause)).into()
    }

    /// Returns the error for column names without a time.
    pub(crate) fn missing_time(file: &str, column: &str, names: &[String]) -> Self {
        let present = names.iter().map(String::as_str);
        Self::MissingTime { missing: DataError::missing_column(file, column, present) }
    }

    /// Returns the error of a row that may not be left out for this `reason`.
    pub(crate) fn refused(self, reason: String) -> Self {
        Self::Refused { first: Box::new(self), reason }
    }

    /// Returns whether the decimal notation is ambiguous, in this row and in others.
    pub(crate) fn is_about_notation(&self) -> bool {
        matches!(self, Self::DecimalComma { .. } | Self::DecimalPoint { .. })
    }

    /// Whether a field is blank, or a number that is not finite.
    pub(crate) fn is_blank(&self) -> bool {
        matches!(self, Self::EmptyField { .. } | Self::Data(DataError::NotFinite { .. }))
    }

    /// Returns the row at fault, if the error is about one row that can be left out.
    pub(crate) fn row(&self) -> Option<u64> {
        match self {
            Self::NotANumber { at, .. }
            | Self::EmptyField { at }
            | Self::TimeStamp { at, .. }
            | Self::Quote { at }
            | Self::Data(DataError::NotFinite { at, .. }) => Some(at.row),
            Self::Ragged { row, .. } => Some(*row),
            _ => None,
        }
    }

    /// Returns the error for a file that the Python package converts, with the command.
    pub(crate) fn convert(file: &str, format: &'static str, extra: &'static str) -> Self {
        let quoted = |path: &str| {
            let is_plain = path.chars().all(|c| c.is_alphanumeric() || "._-/+:\\".contains(c));
            if is_plain { path.to_owned() } else { format!("\"{path}\"") }
        };
        let path = if file == STDIN { "FILE" } else { file };
        let out = Path::new(path).with_extension("npz");
        let command = format!("{} {}", quoted(path), quoted(&out.to_string_lossy()));
        Self::Convert { file: file.to_owned(), format, command, extra }
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
                | Self::Ragged { .. }
                | Self::Quote { .. }
                | Self::LineTooLong { .. }
                | Self::Data(DataError::NotFinite { .. } | DataError::TimeNotRising { .. })
        )
    }
}

//! What can be wrong with a recording, with the evidence.

use std::{fmt, io};

use stretch_data::{DataError, Place};
use stretch_files::FileError;

/// Why a recording could not be read.
///
/// Each variant carries the evidence, and each message is one sentence that
/// says where, what, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file that could not be read, or samples that are none.
    #[error(transparent)]
    Data(#[from] DataError),
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
    /// A grid that has many more instants than were recorded.
    #[error(
        "{file}: a grid of {rate_hz} Hz has {:.1e} instants in its {span_s} s, many times what was recorded; give a lower rate with --grid, or split the recording at the gap in its time", .rate_hz * .span_s
    )]
    Grid {
        /// The file.
        file: String,
        /// The grid's rate.
        rate_hz: f64,
        /// How long the recording lasts.
        span_s: f64,
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
}

impl RecordingError {
    pub(crate) fn io(path: impl fmt::Display, action: &'static str, cause: io::Error) -> Self {
        DataError::from(FileError::io(path, action, cause)).into()
    }

    pub(crate) fn missing_column<'a>(
        file: &str,
        column: &str,
        present: impl Iterator<Item = &'a str>,
    ) -> Self {
        DataError::missing_column(file, column, present).into()
    }

    /// Whether time stood still or went back.
    pub fn is_time(&self) -> bool {
        matches!(self, Self::Data(DataError::TimeNotRising { .. }))
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
                | Self::NotUtf8 { .. }
                | Self::Ragged { .. }
                | Self::Quote { .. }
                | Self::LineTooLong { .. }
                | Self::Data(DataError::NotFinite { .. } | DataError::TimeNotRising { .. })
        )
    }
}

//! Errors of reading a recording.

use std::{fmt, io, path::Path};

use stretch_data::files::FileError;
use stretch_data::{DataError, Place};

use crate::read::STDIN;

/// Why a recording could not be read.
///
/// Each message is one sentence: where the problem is, what it is, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file that could not be read, a missing column, or invalid samples.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A missing time column.
    #[error(
        "{missing}; say which column is the time with --time COLUMN, or --time 100hz if there is none"
    )]
    MissingTime {
        /// The missing column, and the columns that are present.
        missing: DataError,
    },
    /// A field that cannot be read.
    #[error("{at}: {}", fault.sentence(value, &at.column))]
    Field {
        /// Where.
        at: Place,
        /// The field, shortened.
        value: String,
        /// What is wrong with it.
        fault: FieldFault,
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
    /// A row that cannot be read and may not be left out.
    #[error("{first} ({reason})")]
    Refused {
        /// What is wrong with the row.
        first: Box<Self>,
        /// Why it is not left out.
        reason: String,
    },
    /// A file that is no recording, or one that cannot be used as it is.
    #[error("{at}: {problem}")]
    Unusable {
        /// Where: the file, and the row and column if the problem is there.
        at: String,
        /// What is wrong, and what to do.
        problem: String,
    },
}

/// What is wrong with a field of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FieldFault {
    /// Text where a number should be.
    NotANumber,
    /// Nothing.
    Empty,
    /// A number that is not finite, or a word for a missing one.
    NotFinite,
    /// A decimal comma.
    DecimalComma,
    /// A decimal point where the numbers so far had decimal commas.
    DecimalPoint,
    /// A quotation mark that is not closed in its line, or text between a closing quotation mark
    /// and the next separator.
    Quote,
    /// A time stamp that is not a valid date or time of day.
    Stamp,
    /// A date in which it is unclear which number is the day and which the month.
    DayOrMonth,
}

impl FieldFault {
    /// Returns what is wrong with a field and what to do.
    fn sentence(self, value: &str, column: &str) -> String {
        let of_value = match self {
            Self::NotANumber => "is not a number; correct it or remove that row",
            Self::NotFinite => "is not a finite number; correct it or remove that row",
            Self::DecimalComma => "has a decimal comma; export the file again with decimal points",
            Self::DecimalPoint => {
                "has a decimal point where the rows above have decimal commas; export the file again with one of them"
            }
            Self::Stamp => {
                "is not a time stamp that is understood; write it as 2024-05-01T12:00:00.250Z, or as seconds"
            }
            Self::Empty => return "the field is empty; fill it in or remove that row".to_owned(),
            Self::Quote => {
                return "the quotation marks do not pair up within the line; remove or double them"
                    .to_owned();
            }
            Self::DayOrMonth => {
                return format!(
                    "it is unclear which number of \"{value}\" is the day; give the order with --time {column}:dmy or {column}:mdy"
                );
            }
        };
        format!("\"{value}\" {of_value}")
    }

    /// Whether the decimal notation is ambiguous, in this row and in others.
    fn is_about_notation(self) -> bool {
        matches!(self, Self::DecimalComma | Self::DecimalPoint)
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

    /// Returns the error for a row that may not be left out. `reason` says why.
    pub(crate) fn refused(self, reason: String) -> Self {
        Self::Refused { first: Box::new(self), reason }
    }

    /// Returns the error for a file that cannot be used. `at` is the file or a place in it.
    pub(crate) fn unusable(at: impl fmt::Display, problem: impl Into<String>) -> Self {
        Self::Unusable { at: at.to_string(), problem: problem.into() }
    }

    /// Returns the error of a table without a sample.
    pub(crate) fn header_only(file: &str) -> Self {
        let problem = "there is a header line and no sample below it; record the trial again or leave the file out";
        Self::unusable(file, problem)
    }

    /// Returns the error of a file that cannot be read in its `format`.
    pub(crate) fn format(file: &str, format: &str, problem: impl fmt::Display) -> Self {
        Self::unusable(file, format!("this {format} file cannot be read: {problem}"))
    }

    /// Returns whether the decimal notation is ambiguous, in this row and in others.
    pub(crate) fn is_about_notation(&self) -> bool {
        matches!(self, Self::Field { fault, .. } if fault.is_about_notation())
    }

    /// Whether a field is blank, or a number that is not finite.
    pub(crate) fn is_blank(&self) -> bool {
        matches!(self, Self::Field { fault: FieldFault::Empty | FieldFault::NotFinite, .. })
    }

    /// Returns the row at fault, if the error is about one row that can be left out.
    pub(crate) fn row(&self) -> Option<u64> {
        match self {
            Self::Field { at, fault, .. } if !fault.is_about_notation() => Some(at.row),
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
        let (path, out) = (quoted(path), quoted(&out.to_string_lossy()));
        Self::unusable(
            file,
            format!(
                "this is {format}, which is not read here; convert it with `python -m stretch_gap convert {path} {out}` (pip install \"stretch-gap[{extra}]\")"
            ),
        )
    }

    /// Whether the error is about a single row. A reader of a stream can then continue with the next row.
    pub fn is_row(&self) -> bool {
        match self {
            Self::Field { fault, .. } => *fault != FieldFault::DayOrMonth,
            Self::Ragged { .. } | Self::LineTooLong { .. } => true,
            Self::Data(error) => {
                matches!(error, DataError::NotFinite { .. } | DataError::TimeNotRising { .. })
            }
            _ => false,
        }
    }
}

//! Rows of a live stream, each as soon as its line is there.

use std::io::Read;

use stretch_data::{DataError, Place};

use crate::{
    ReadOptions, RecordingError,
    text::columns::located,
    text::dialect::Dialect,
    text::header::Header,
    text::lines::Lines,
    text::live::{header, is_units, separator_of},
    text::row::Role,
};

/// Reads a stream a row at a time, and goes on after a malformed row.
///
/// The header comes first, as in a file; then each line is answered as soon as it is
/// complete, however slowly the stream comes. Only the time and the required columns are
/// looked at: whatever else stands in a row cannot spoil it. Memory is bounded: a line that
/// is too long is an error for that line and is skipped.
///
/// A row whose time stands still or goes back is an error, too, but the clock goes on from
/// there: a logger that was restarted is lost for one row, not for good. Whoever keeps a
/// memory over the rows should reset it when [`RecordingError::is_time`] holds.
///
/// ```
/// use stretch_recording::{ReadOptions, RowReader};
/// let stream = "bridge_v,time_s\n1.5,0\noops,0.01\n1.75,0.02\n";
/// let options = ReadOptions::new().require("bridge_v");
/// let mut rows = RowReader::new(stream.as_bytes(), "standard input", &options)?;
/// assert_eq!(rows.next_row().expect("a row")?.values, [1.5]);
/// let error = rows.next_row().expect("a row").expect_err("oops is no number");
/// assert_eq!(
///     error.to_string(),
///     "standard input, row 3, column bridge_v: \"oops\" is not a number; \
///      correct it or remove that row"
/// );
/// let row = rows.next_row().expect("a row")?;
/// assert_eq!((row.row, row.time_s, row.values), (4, 0.02, &[1.75][..]));
/// assert!(rows.next_row().is_none());
/// # Ok::<(), stretch_recording::RecordingError>(())
/// ```
pub struct RowReader<R> {
    lines: Lines<R>,
    name: String,
    header: Header,
    roles: Vec<Role>,
    fields: Vec<f64>,
    dialect: Option<Dialect>,
    is_begun: bool,
    time: usize,
    divisor: f64,
    previous_s: Option<f64>,
    wanted: Vec<usize>,
    values: Vec<f64>,
    failed: bool,
}

/// One row of a [`RowReader`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<'a> {
    /// Row as an editor counts it: the header is row 1.
    pub row: u64,
    /// Seconds.
    pub time_s: f64,
    /// The required columns, in the order in which they were required; finite.
    pub values: &'a [f64],
}

impl<R: Read> RowReader<R> {
    /// Waits for the header line and finds the time and the required columns in it.
    ///
    /// # Errors
    /// [`RecordingError`] when there is no header or a column is missing.
    pub fn new(reader: R, name: &str, options: &ReadOptions) -> Result<Self, RecordingError> {
        let mut lines = Lines::new(reader, name, options.max_line_bytes);
        let (header, time) = header(&mut lines, name, options)?;
        // The separator of a stream without a header line is told by its first row.
        let known = options.columns.is_none();
        let dialect = known.then(|| Dialect::new(header.delimiter, Some(time)));
        let wanted = options
            .required()
            .iter()
            .map(|column| header.position(name, column))
            .collect::<Result<Vec<_>, _>>()?;
        let needed = |i| i == time || wanted.contains(&i);
        let role = |i| if needed(i) { Role::Needed } else { Role::Skipped };
        Ok(Self {
            lines,
            name: name.to_owned(),
            roles: (0..header.names.len()).map(role).collect(),
            fields: vec![f64::NAN; header.names.len()],
            dialect,
            is_begun: false,
            time,
            divisor: options.divisor(&header.names[time]),
            previous_s: None,
            values: vec![f64::NAN; wanted.len()],
            wanted,
            header,
            failed: false,
        })
    }

    /// Names of all columns, in the order of the stream.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.header.names.iter().map(String::as_str)
    }

    /// The next row; `None` at the end of the stream. Blank lines are passed over.
    ///
    /// An error for which [`RecordingError::is_row`] holds is about that row alone. After any
    /// other (the stream itself failed) the stream has ended.
    pub fn next_row(&mut self) -> Option<Result<Row<'_>, RecordingError>> {
        if self.failed {
            return None;
        }
        let row = match self.read_row() {
            Ok(Some(row)) => row,
            Ok(None) => return None,
            Err(error) => {
                self.failed = !error.is_row();
                return Some(Err(error));
            }
        };
        let has_stamps = self.dialect.as_ref().is_some_and(Dialect::has_stamps);
        let divisor = if has_stamps { 1.0 } else { self.divisor };
        let time_s = self.fields[self.time] / divisor;
        if let Some(previous_s) = self.previous_s.replace(time_s)
            && time_s <= previous_s
        {
            let column = self.header.label(self.time);
            let at = Place { file: self.name.clone(), row, column };
            return Some(Err(DataError::TimeNotRising { at, time_s, previous_s }.into()));
        }
        for (value, &i) in self.values.iter_mut().zip(&self.wanted) {
            *value = self.fields[i];
        }
        Some(Ok(Row { row, time_s, values: &self.values }))
    }

    /// Fills `fields` from the next line that is not blank; its row.
    fn read_row(&mut self) -> Result<Option<u64>, RecordingError> {
        while let Some((row, line)) = self.lines.next()? {
            let is_first = !std::mem::replace(&mut self.is_begun, true);
            if self.dialect.is_none() {
                let found = separator_of(line, self.roles.len());
                self.dialect = found.map(|d| Dialect::new(d, Some(self.time)));
            }
            // What comes before the first whole row of a stream without a header is the end of another.
            let Some(dialect) = &mut self.dialect else { continue };
            if is_first && is_units(line, dialect.delimiter) {
                continue;
            }
            match dialect.parse(line, &self.roles, &mut self.fields) {
                Ok(true) => return Ok(Some(row)),
                Ok(false) => {}
                Err(fault) => return Err(located(&self.name, row, &self.header, fault)),
            }
        }
        Ok(None)
    }
}

impl<R> std::fmt::Debug for RowReader<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RowReader")
            .field("name", &self.name)
            .field("columns", &self.header.names)
            .finish_non_exhaustive()
    }
}

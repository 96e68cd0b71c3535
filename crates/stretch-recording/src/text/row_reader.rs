//! Reads the rows of a live stream, each as soon as its line is complete.

use std::{io::Read, vec};

use stretch_data::{DataError, Place};

use crate::{
    ReadOptions, RecordingError,
    clock::live::{LiveClock, NotRising},
    text::columns::located,
    text::dialect::Dialect,
    text::header::Header,
    text::lines::Lines,
    text::row::{Role, RowFault},
    text::top::Top,
};

/// A reader of the rows of a stream, which continues after a malformed row.
///
/// The header is found as in a file: it is above the first row of numbers. After that, each line is returned as soon as
/// it is complete, however slow the stream is. Only the time and the required columns are read, so other fields cannot
/// make a row invalid. Memory is bounded: a line that is too long is an error for that line and is skipped.
///
/// If a stream has no time and the options give a sample rate, the time is counted in samples. Malformed rows are
/// included in the count.
///
/// A row whose time goes back is also an error, but the clock continues from there, so that only one row is lost when a
/// logger restarts. If several rows have the same time, their samples are spaced evenly over one clock step, or by the
/// period of the expected sample rate. A repeated time is an error only if neither is known. A caller that keeps a
/// state from row to row should reset it after an error of the time column.
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
    dialect: Dialect,
    ahead: vec::IntoIter<(u64, Vec<u8>)>,
    notes: Vec<String>,
    is_strict: bool,
    /// The column of the time, unless samples are counted.
    time: Option<usize>,
    clock: LiveClock,
    wanted: Vec<usize>,
    values: Vec<f64>,
    failed: bool,
}

/// One row of a [`RowReader`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<'a> {
    /// Line number in the stream, counted from 1.
    pub row: u64,
    /// Seconds.
    pub time_s: f64,
    /// Values of the required columns, in the order in which they were required. All are finite.
    pub values: &'a [f64],
}

impl<R: Read> RowReader<R> {
    /// Waits for the first row of numbers, and finds the time and the required columns in the header above it.
    ///
    /// # Errors
    /// [`RecordingError`] when there is no header or a column is missing.
    pub fn new(reader: R, name: &str, options: &ReadOptions) -> Result<Self, RecordingError> {
        let mut lines = Lines::new(reader, name, options.max_line_bytes);
        let Top { header, ahead, mut notes, stated_hz } =
            Top::read(&mut lines, name, options, true)?;
        let (time, rate_hz) = header.time(name, stated_hz, options, &mut notes)?;
        let time = time.filter(|_| rate_hz.is_none());
        let wanted = options
            .required()
            .iter()
            .map(|column| header.position(name, column))
            .collect::<Result<Vec<_>, _>>()?;
        let needed = |i| Some(i) == time || wanted.contains(&i);
        let role = |i| if needed(i) { Role::Needed } else { Role::Skipped };
        Ok(Self {
            lines,
            name: name.to_owned(),
            roles: (0..header.names.len()).map(role).collect(),
            fields: vec![f64::NAN; header.names.len()],
            dialect: Dialect::new(&header, time, options.date_order, &ahead),
            ahead: ahead.into_iter(),
            notes,
            is_strict: options.strict,
            time,
            clock: LiveClock::new(time.map(|i| &*header.names[i]), rate_hz, options),
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

    /// Returns the notes on what was guessed, renamed or repaired since the last call.
    pub fn take_notes(&mut self) -> Vec<String> {
        let mut notes = std::mem::take(&mut self.notes);
        notes.append(&mut self.clock.notes);
        notes
    }

    /// The next row; `None` at the end of the stream. Blank lines are passed over.
    ///
    /// If [`RecordingError::is_row`] returns true for an error, it is about that row alone. After any other error the
    /// stream has ended.
    pub fn next_row(&mut self) -> Option<Result<Row<'_>, RecordingError>> {
        if self.failed {
            return None;
        }
        let row = match self.read_row() {
            Ok(Some(row)) => row,
            Ok(None) => return None,
            Err(error) => {
                self.clock.skip();
                self.failed = self.is_strict || !error.is_row();
                let reason = || "--strict leaves no row out".to_owned();
                return Some(Err(if self.is_strict { error.refused(reason()) } else { error }));
            }
        };
        let count = self.time.map_or(0.0, |i| self.fields[i]);
        let origin = self.dialect.first_count().map_or(0.0, |count| count as f64);
        if self.dialect.first_stamp().is_some() {
            self.clock.count_seconds();
        }
        let at = || {
            let column = self.header.label(self.time.unwrap_or_default());
            Place { file: self.name.clone(), row, column }
        };
        let time_s = match self.clock.take(row, count, origin) {
            Ok(time_s) if time_s.is_finite() => time_s,
            Ok(time_s) => {
                let value = time_s.to_string();
                return Some(Err(DataError::NotFinite { at: at(), value }.into()));
            }
            Err(NotRising { time_s, previous_s }) => {
                return Some(Err(DataError::TimeNotRising { at: at(), time_s, previous_s }.into()));
            }
        };
        for (value, &i) in self.values.iter_mut().zip(&self.wanted) {
            *value = self.fields[i];
        }
        Some(Ok(Row { row, time_s, values: &self.values }))
    }

    /// Fills `fields` from the next row, and returns its line number.
    fn read_row(&mut self) -> Result<Option<u64>, RecordingError> {
        loop {
            let ahead = self.ahead.next();
            let (row, line) = match &ahead {
                Some((row, line)) => (*row, &line[..]),
                None => match self.lines.next()? {
                    Some(read) => read,
                    None => return Ok(None),
                },
            };
            match self.dialect.parse(line, &self.roles, &mut self.fields) {
                Ok(true) => match self.dialect.take_spoilt().and_then(|mut all| all.pop()) {
                    None => return Ok(Some(row)),
                    Some((column, fault)) => {
                        let fault = RowFault::Field { column, fault };
                        return Err(located(&self.name, row, &self.header, fault));
                    }
                },
                Ok(false) => {}
                Err(fault) => return Err(located(&self.name, row, &self.header, fault)),
            }
        }
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

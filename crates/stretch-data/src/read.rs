//! A trial from a file or a stream, in one pass.

use std::{fs::File, io::Read, path::Path};

use crate::{
    Channel, DataError, ReadOptions, Trial,
    error::Place,
    header::Header,
    lines::{Line, Lines},
    row::{Fault, Role, RowFault, numbers},
};

/// The channels that every trial file of the format knows by name.
pub(crate) const KNOWN: [&str; 5] = ["inlet", "outlet", "pressure_kpa", "length_mm", "bridge_v"];

impl Trial {
    /// Reads a trial from a file.
    ///
    /// One pass, columns by name in any order. `time_s` is required and must rise from row
    /// to row. Columns that `options` requires, and those that the format knows (`inlet`,
    /// `outlet`, `pressure_kpa`, `length_mm`, `bridge_v`), must hold finite numbers
    /// throughout. Any other column is kept where all its fields are finite numbers and
    /// left out otherwise: it is never an error. A byte-order mark, CRLF, quoted fields,
    /// blank lines, and `;` or tabs between fields are understood; a quoted field cannot
    /// hold a line end.
    ///
    /// # Errors
    /// [`DataError`] with file, row, column and value of the first fault.
    pub fn read(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Self, DataError> {
        let path = path.as_ref();
        let file = path.display().to_string();
        let reader = File::open(path).map_err(|e| DataError::io(&file, "open it", e))?;
        let mut trial = Self::from_reader(reader, &file, options)?;
        if let Some(name) = path.file_name() {
            trial.name = name.to_string_lossy().into_owned();
        }
        Ok(trial)
    }

    /// Reads a trial from any stream, such as standard input; `name` stands for the file.
    /// It reads large pieces: the stream needs no buffer of its own.
    ///
    /// # Errors
    /// As [`Trial::read`].
    pub fn from_reader(
        reader: impl Read,
        name: &str,
        options: &ReadOptions,
    ) -> Result<Self, DataError> {
        let mut lines = Lines::new(reader, options.line_limit());
        let header = read_header(&mut lines, name)?;
        let mut columns = Columns::new(name, &header, options)?;
        let mut values = vec![f64::NAN; header.names.len()];
        loop {
            let row = lines.row() + 1;
            let limit = lines.limit();
            match lines.next().map_err(|e| DataError::io(name, "read it", e))? {
                Line::End => break,
                Line::TooLong => {
                    return Err(DataError::LineTooLong { file: name.to_owned(), row, limit });
                }
                Line::Text(line) if line.trim_ascii().is_empty() => {}
                Line::Text(line) => {
                    numbers(line, header.delimiter, &columns.roles, &mut values)
                        .map_err(|fault| located(name, row, &header, fault))?;
                    columns.push(name, row, &values)?;
                }
            }
        }
        columns.into_trial(name, &header)
    }
}

/// Columns that grow by a row at a time.
pub(crate) struct Columns {
    pub(crate) roles: Vec<Role>,
    time: usize,
    time_column: String,
    divisor: f64,
    /// What the time column counts from.
    origin: f64,
    /// The last time of what was cut off.
    previous_s: Option<f64>,
    time_s: Vec<f64>,
    kept: Vec<(usize, Vec<f64>)>,
}

impl Columns {
    pub(crate) fn new(
        file: &str,
        header: &Header,
        options: &ReadOptions,
    ) -> Result<Self, DataError> {
        let time = header.position(file, options.time_column())?;
        for name in options.required() {
            header.position(file, name)?;
        }
        let role = |(i, name): (usize, &String)| match name.as_str() {
            "" => Role::Skipped,
            name if i == time || KNOWN.contains(&name) => Role::Needed,
            _ if options.required().contains(name) => Role::Needed,
            _ => Role::Welcome,
        };
        let roles: Vec<Role> = header.names.iter().enumerate().map(role).collect();
        let kept = (0..roles.len())
            .filter(|&i| i != time && roles[i] != Role::Skipped)
            .map(|i| (i, Vec::new()))
            .collect();
        Ok(Self {
            roles,
            time,
            time_column: options.time_column().to_owned(),
            divisor: options.time_divisor(),
            origin: 0.0,
            previous_s: None,
            time_s: Vec::new(),
            kept,
        })
    }

    /// Counts the time from `origin`, in the column's own unit, and so many counts make a second.
    pub(crate) fn count_from(&mut self, origin: f64, divisor: f64) {
        (self.origin, self.divisor) = (origin, divisor);
    }

    /// How many rows there are.
    pub(crate) fn len(&self) -> usize {
        self.time_s.len()
    }

    #[inline]
    pub(crate) fn push(&mut self, file: &str, row: u64, values: &[f64]) -> Result<(), DataError> {
        let time_s = (values[self.time] - self.origin) / self.divisor;
        if let Some(previous_s) = self.time_s.last().copied().or(self.previous_s)
            && time_s <= previous_s
        {
            let at = Place { file: file.to_owned(), row, column: self.time_column.clone() };
            return Err(DataError::TimeNotRising { at, time_s, previous_s });
        }
        self.time_s.push(time_s);
        let mut spoilt = false;
        for (i, column) in &mut self.kept {
            let value = values[*i];
            spoilt |= value.is_nan();
            column.push(value);
        }
        if spoilt {
            self.drop_spoilt(values);
        }
        Ok(())
    }

    /// Leaves out the columns whose newest field was no number.
    #[cold]
    fn drop_spoilt(&mut self, values: &[f64]) {
        self.kept.retain(|&(i, _)| !values[i].is_nan());
        for (role, value) in self.roles.iter_mut().zip(values) {
            if value.is_nan() {
                *role = Role::Skipped;
            }
        }
    }

    /// What there is so far; rows go on behind it.
    pub(crate) fn cut(&mut self, file: &str, header: &Header) -> Trial {
        self.previous_s = self.time_s.last().copied().or(self.previous_s);
        let kept = self.kept.iter_mut().map(|(i, values)| (*i, std::mem::take(values)));
        let channel = |(i, values): (usize, _)| Channel { name: header.names[i].clone(), values };
        let channels = kept.map(channel).collect();
        Trial { name: file.to_owned(), time_s: std::mem::take(&mut self.time_s), channels }
    }

    pub(crate) fn into_trial(mut self, file: &str, header: &Header) -> Result<Trial, DataError> {
        if self.time_s.is_empty() {
            return Err(DataError::HeaderOnly { file: file.to_owned() });
        }
        Ok(self.cut(file, header))
    }
}

/// The first line that is not blank, as a header.
pub(crate) fn read_header<R: Read>(lines: &mut Lines<R>, file: &str) -> Result<Header, DataError> {
    loop {
        let row = lines.row() + 1;
        let limit = lines.limit();
        match lines.next().map_err(|e| DataError::io(file, "read it", e))? {
            Line::End => return Err(DataError::Empty { file: file.to_owned() }),
            Line::TooLong => {
                return Err(DataError::LineTooLong { file: file.to_owned(), row, limit });
            }
            Line::Text(line) => {
                let text = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
                if !text.trim_ascii().is_empty() {
                    return Header::parse(file, row, text);
                }
            }
        }
    }
}

/// The error for a fault, with its place.
#[cold]
pub(crate) fn located(file: &str, row: u64, header: &Header, fault: RowFault) -> DataError {
    let file = file.to_owned();
    match fault {
        RowFault::Ragged { found, expected } => DataError::Ragged { file, row, found, expected },
        RowFault::Field { column, fault } => {
            let at = Place { file, row, column: header.label(column) };
            match fault {
                Fault::NotANumber(value) => DataError::NotANumber { at, value },
                Fault::Empty => DataError::EmptyField { at },
                Fault::DecimalComma(value) => DataError::DecimalComma { at, value },
                Fault::NotFinite(value) => DataError::NotFinite { at, value },
                Fault::NotUtf8(value) => DataError::NotUtf8 { at, value },
                Fault::Quote => DataError::Quote { at },
                Fault::DecimalPoint(value) => DataError::DecimalPoint { at, value },
                Fault::Stamp(value) => DataError::TimeStamp { at, value },
            }
        }
    }
}

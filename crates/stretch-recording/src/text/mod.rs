//! A table of text in whatever dialect, in one pass.

pub(crate) mod columns;
mod dialect;
mod header;
mod lines;
mod live;
mod row;
pub(crate) mod row_reader;
mod top;

use std::io::Read;

use stretch_data::Trial;

use crate::{
    ReadOptions, Recording, RecordingError,
    clock::{EPOCH_S, time_among, told_epoch},
    options::TIME,
    room::{Packed, Room},
    text::columns::{Columns, located},
    text::dialect::{BLANKS, Dialect},
    text::header::Header,
    text::lines::Lines,
    text::top::Top,
};

/// Reads a table; the recording's time column beside it.
pub(crate) fn read(
    reader: impl Read,
    file: &str,
    options: &ReadOptions,
    packed: Option<&Packed>,
) -> Result<(Recording, String), RecordingError> {
    let mut lines = Lines::new(reader, file, options.max_line_bytes);
    let mut table = Table::begun(&mut lines, file, options)?;
    while let Some((row, line)) = lines.next()? {
        table.take(row, line)?;
        // text takes at most four times its length as numbers; what is packed has no such measure
        if let Some(packed) = packed.filter(|_| table.columns.len() % 4096 == 0) {
            let numbers = table.columns.len().saturating_mul(table.header.names.len());
            Room::beside(packed.get()).take_numbers(numbers).map_err(|problem| {
                RecordingError::Format { file: file.to_owned(), format: "gzip", problem }
            })?;
        }
    }
    table.finish()
}

/// The same, every `most` rows given away with the name of the time column; what is left, and the notes of all, come back.
pub(crate) fn read_blocks<E: From<RecordingError>>(
    reader: impl Read,
    file: &str,
    options: &ReadOptions,
    most: usize,
    give: &mut dyn FnMut(Trial, &str) -> Result<(), E>,
) -> Result<(Recording, String), E> {
    let mut lines = Lines::new(reader, file, options.max_line_bytes);
    let mut table = Table::begun(&mut lines, file, options)?;
    while let Some((row, line)) = lines.next()? {
        table.take(row, line)?;
        if table.columns.len() >= most {
            table.given += table.columns.len();
            give(table.columns.cut(file, &table.header), &table.header.names[table.time])?;
        }
    }
    Ok(table.finish()?)
}

/// Columns that grow, and how their rows are written.
struct Table<'a> {
    file: &'a str,
    header: Header,
    dialect: Dialect,
    columns: Columns,
    /// Rows that were given away.
    given: usize,
    values: Vec<f64>,
    /// Fields of a row: all columns but a time that is counted.
    fields: usize,
    time: usize,
    divisor: f64,
    /// Samples a second where there is no time and somebody said so.
    counted_hz: Option<f64>,
    comments: usize,
    notes: Vec<String>,
}

impl<'a> Table<'a> {
    /// The table that some lines begin, with the rows that were read ahead.
    fn begun(
        lines: &mut Lines<impl Read>,
        file: &'a str,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let mut top = Top::read(lines, file, options)?;
        top.tidy(options);
        let ahead = std::mem::take(&mut top.ahead);
        let mut table = Self::new(file, top, options)?;
        for (row, line) in ahead {
            table.take(row, &line)?;
        }
        Ok(table)
    }

    fn new(file: &'a str, top: Top, options: &ReadOptions) -> Result<Self, RecordingError> {
        let Top { mut header, mut notes, .. } = top;
        let fields = header.names.len();
        let found = time_among(&header.names, options);
        let counted_hz = options.sample_rate_hz.filter(|_| found.is_none());
        let time = match (found, counted_hz) {
            (Some(time), _) => time,
            (None, Some(rate_hz)) => {
                header.names.push(TIME.to_owned());
                notes.push(format!("there is no time: {rate_hz} samples a second, as was said"));
                fields
            }
            (None, None) => {
                let names = header.names.iter().map(String::as_str);
                return Err(RecordingError::missing_column(file, &options.time, names));
            }
        };
        let name = header.names[time].clone();
        if name != options.time && counted_hz.is_none() {
            notes.push(format!("the time is column {name}"));
        }
        let divisor = options.divisor(&name);
        let columns = Columns::new(file, &header, &options.clone().time(name))?;
        let dialect = Dialect::new(header.delimiter, counted_hz.is_none().then_some(time));
        let values = vec![f64::NAN; header.names.len()];
        Ok(Self {
            file,
            header,
            dialect,
            columns,
            given: 0,
            values,
            fields,
            time,
            divisor,
            counted_hz,
            comments: 0,
            notes,
        })
    }

    #[inline]
    fn take(&mut self, row: u64, line: &[u8]) -> Result<(), RecordingError> {
        let (roles, values) = (&self.columns.roles[..self.fields], &mut self.values);
        match self.dialect.parse(line, roles, &mut values[..self.fields]) {
            Ok(true) => {}
            Ok(false) => {
                self.comments += 1;
                return Ok(());
            }
            Err(fault) => return Err(located(self.file, row, &self.header, fault)),
        }
        if let Some(rate_hz) = self.counted_hz {
            self.values[self.time] =
                (self.given + self.columns.len()) as f64 / rate_hz * self.divisor;
        }
        if self.given + self.columns.len() == 0 {
            self.begin();
        }
        self.columns.push(self.file, row, &self.values)
    }

    /// What the first row says of the time.
    #[cold]
    fn begin(&mut self) {
        let first = self.values[self.time];
        if self.dialect.has_stamps() {
            self.columns.count_from(0.0, 1.0);
        } else if let Some(count) = self.dialect.first_count() {
            self.notes.push(told_epoch(count as f64 / self.divisor));
        } else if (first / self.divisor).abs() >= EPOCH_S {
            self.columns.count_from(first, self.divisor);
            self.notes.push(told_epoch(first / self.divisor));
        }
    }

    fn finish(mut self) -> Result<(Recording, String), RecordingError> {
        if let Some(ns) = self.dialect.first_stamp() {
            self.notes.push(told_epoch(ns as f64 / 1e9));
        }
        if self.dialect.has_commas() {
            self.notes.push("numbers have decimal commas".to_owned());
        }
        if self.header.delimiter == BLANKS {
            self.notes.push("columns are set apart by blanks".to_owned());
        }
        match self.comments {
            0 => {}
            1 => self.notes.push("a comment between the rows is passed over".to_owned()),
            n => self.notes.push(format!("{n} comments between the rows are passed over")),
        }
        let trial = match self.given {
            0 => self.columns.into_trial(self.file, &self.header)?,
            _ => self.columns.cut(self.file, &self.header),
        };
        let missing = self.header.names.iter().enumerate().filter(|(i, name)| {
            *i != self.time && !name.is_empty() && trial.channel(name).is_none()
        });
        let missing: Vec<&str> = missing.map(|(_, name)| name.as_str()).collect();
        if !missing.is_empty() {
            let names = missing.join(", ");
            self.notes.push(format!("left out, not all of their fields are numbers: {names}"));
        }
        let time = self.header.names[self.time].clone();
        Ok((Recording { trial, notes: self.notes }, time))
    }
}

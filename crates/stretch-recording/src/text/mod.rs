//! Reads a table of text in any dialect, in one pass.

pub(crate) mod bad_rows;
pub(crate) mod columns;
mod dialect;
mod header;
mod lines;
mod rate;
mod row;
pub(crate) mod row_reader;
mod top;

use std::io::Read;

use crate::{
    ReadOptions, Recording, RecordingError,
    clock::Stamps,
    grid::joined,
    options::TIME,
    room::{Packed, Room},
    text::bad_rows::BadRows,
    text::columns::{Columns, located},
    text::dialect::{BLANKS, Dialect, cells},
    text::header::Header,
    text::lines::Lines,
    text::row::RowFault,
    text::top::Top,
};

/// Reads a table.
pub(crate) fn read(
    reader: impl Read,
    file: &str,
    options: &ReadOptions,
    packed: Option<&Packed>,
) -> Result<Recording, RecordingError> {
    let mut lines = Lines::new(reader, file, options.max_line_bytes);
    let mut table = Table::begun(&mut lines, file, options)?;
    while let Some((row, line)) = lines.next()? {
        table.take(row, line)?;
        if table.columns.len() % 4096 == 0 {
            let numbers = table.columns.len().saturating_mul(table.header.names.len());
            // The numbers in a text take at most four times as much memory as the text. A packed
            // text can need any multiple of its size.
            let (mut room, format) = match packed {
                Some(packed) => (Room::beside(packed.get()), "gzip"),
                None => (Room::of_text(), "text"),
            };
            let taken = room.take_numbers(numbers);
            taken.map_err(|problem| RecordingError::format(file, format, problem))?;
        }
    }
    let options = options.named_as(table.header.names.iter().map(String::as_str));
    table.finish(&options)
}

/// A table while it is read.
struct Table<'a> {
    file: &'a str,
    header: Header,
    dialect: Dialect,
    columns: Columns,
    values: Vec<f64>,
    time: Option<usize>,
    /// Samples a second, if samples are counted.
    rate_hz: Option<f64>,
    comments: usize,
    bad: BadRows,
    /// Number of bad rows with a wrong value. Each of them is a sample, so a time that is computed
    /// from the number of samples counts them too.
    lost: usize,
    notes: Vec<String>,
}

impl<'a> Table<'a> {
    /// Finds the table at the beginning of the lines, and takes the rows that were read ahead.
    fn begun(
        lines: &mut Lines<impl Read>,
        file: &'a str,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let mut top = Top::read(lines, file, options, false)?;
        let ahead = std::mem::take(&mut top.ahead);
        let mut table = Self::new(file, top, &ahead, options)?;
        for (row, line) in ahead {
            table.take(row, &line)?;
        }
        Ok(table)
    }

    fn new(
        file: &'a str,
        top: Top,
        rows: &[(u64, Vec<u8>)],
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let Top { header, mut notes, stated_hz, .. } = top;
        let (time, rate_hz) = header.time(file, stated_hz, options, &mut notes)?;
        let options = &options.named_as(header.names.iter().map(String::as_str));
        let read = time.filter(|_| rate_hz.is_none());
        if let Some(name) = read.map(|i| &header.names[i]).filter(|name| **name != options.time) {
            notes.push(format!("the time is column {name}"));
        }
        notes.extend(without_name(&header, time, rows));
        let columns = Columns::new(file, &header, time, rate_hz.is_some(), options)?;
        let dialect = Dialect::new(&header, read, options.date_order, rows);
        let values = vec![f64::NAN; header.names.len()];
        Ok(Self {
            file,
            header,
            dialect,
            columns,
            values,
            time,
            rate_hz,
            comments: 0,
            bad: BadRows::new(options.strict),
            lost: 0,
            notes,
        })
    }

    #[inline]
    fn take(&mut self, row: u64, line: &[u8]) -> Result<(), RecordingError> {
        match self.dialect.parse(line, &self.columns.roles, &mut self.values) {
            Ok(true) => {}
            Ok(false) => {
                self.comments += 1;
                return Ok(());
            }
            Err(fault) => {
                self.lost += usize::from(matches!(fault, RowFault::Field { .. }));
                let error = located(self.file, row, &self.header, fault);
                return self.bad.take(row, self.columns.len(), error);
            }
        }
        let count = match self.time.filter(|_| self.rate_hz.is_none()) {
            Some(time) => self.values[time],
            None => (self.columns.len() + self.lost) as f64,
        };
        self.columns.push(row, count, &self.values);
        if let Some(spoilt) = self.dialect.take_spoilt() {
            let error = |(column, fault)| {
                (column, located(self.file, row, &self.header, RowFault::Field { column, fault }))
            };
            self.columns.spoil(spoilt.into_iter().map(error));
        }
        Ok(())
    }

    /// Returns what the table shows of the time: its name, origin and unit.
    fn stamps(&self) -> Stamps {
        let name = self.time.map_or(TIME, |i| &self.header.names[i]).to_owned();
        let origin = self.dialect.first_count().map_or(0.0, |count| count as f64);
        match (self.rate_hz, self.dialect.first_stamp()) {
            (Some(rate_hz), _) => {
                Stamps { name: TIME.to_owned(), per_second: Some(rate_hz), ..Stamps::default() }
            }
            (_, Some(ns)) => {
                Stamps { name, origin: ns as f64 / 1e9, per_second: Some(1.0), ..Stamps::default() }
            }
            _ => Stamps { name, origin, ..Stamps::default() },
        }
    }

    fn finish(mut self, options: &ReadOptions) -> Result<Recording, RecordingError> {
        if self.dialect.has_commas() {
            self.notes.push("numbers have decimal commas".to_owned());
        }
        if self.header.delimiter == BLANKS {
            self.notes.push("columns are separated by blanks".to_owned());
        }
        match self.comments {
            0 => {}
            1 => self.notes.push("a comment between the rows is skipped".to_owned()),
            n => self.notes.push(format!("{n} comments between the rows are skipped")),
        }
        let (stamps, file) = (self.stamps(), self.file);
        let (mut notes, mut bad) = (self.notes, self.bad);
        let good = self.columns.len();
        let tracks =
            self.columns.into_tracks(&self.header, stamps, options, &mut bad, &mut notes)?;
        let good = tracks.iter().map(|t| t.stamps.counts.len()).max().unwrap_or(good);
        notes.extend(bad.finish(file, good)?);
        if good == 0 {
            return Err(RecordingError::header_only(file));
        }
        let is_kept = |name: &str| tracks.iter().flat_map(|t| &t.channels).any(|c| c.name == name);
        let names = self.header.names.iter().enumerate();
        let missing =
            names.filter(|(i, name)| Some(*i) != self.time && !name.is_empty() && !is_kept(name));
        let missing: Vec<&str> = missing.map(|(_, name)| name.as_str()).collect();
        if !missing.is_empty() {
            let names = missing.join(", ");
            notes.push(format!(
                "columns left out because not all of their fields are numbers: {names}"
            ));
        }
        joined(file, tracks, notes, options)
    }
}

/// Returns a note on the columns without a name, such as the index that pandas writes, if the first rows fill them.
fn without_name(header: &Header, time: Option<usize>, rows: &[(u64, Vec<u8>)]) -> Option<String> {
    let rows: Vec<_> = rows.iter().filter_map(|(_, row)| cells(row, header.delimiter)).collect();
    let is_filled = |i: usize| rows.iter().any(|row| row.get(i).is_some_and(|c| !c.is_empty()));
    let names = header.names.iter().enumerate();
    let dropped = names.filter(|(i, name)| name.is_empty() && Some(*i) != time && is_filled(*i));
    let dropped: Vec<String> = dropped.map(|(i, _)| format!("column {}", i + 1)).collect();
    let names = dropped.join(", ");
    (!dropped.is_empty()).then(|| format!("columns left out because they have no name: {names}"))
}

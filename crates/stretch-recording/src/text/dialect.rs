//! Parses one row of a table in any dialect: comments, separators, decimal commas, time stamps.

use std::borrow::Cow;

use stretch_data::shown;

use crate::{
    DateOrder, FieldFault,
    stamps::{looks_like_stamp, nanoseconds, order_of},
    text::header::Header,
    text::row::{Fault, Field, Role, RowFault, field, is_finite, number, numbers},
};

/// Number of characters of the longest integer time that is read as a floating-point number. The times that the project
/// writes are not longer, but the times of nanosecond clocks are longer.
const EXACT_DIGITS: usize = 17;
/// Separator that represents runs of blanks and tabs.
pub(crate) const BLANKS: u8 = b' ';

/// Decimal separator of the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mark {
    /// No number had a fraction yet.
    Open,
    Point,
    Comma,
}

/// Notation of the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Clock {
    /// No time has been read yet.
    Open,
    Number,
    /// Dates or times of day. The value is the first of them, in ns.
    Stamps(Option<i128>),
    /// Integers that an `f64` cannot represent exactly. The value is the first of them.
    Counts(Option<i128>),
}

/// Notation of the rows of a table, as far as the rows read so far show it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Dialect {
    pub(crate) delimiter: u8,
    /// How many columns each row has.
    recorded: usize,
    time: Option<usize>,
    date_order: Option<DateOrder>,
    mark: Mark,
    clock: Clock,
    is_plain: bool,
    /// Faults in fields of the newest row that were accepted as NaN.
    spoilt: Vec<(usize, Fault)>,
}

impl Dialect {
    /// Creates the dialect of the rows below a header. `time` is the index of the time column. The first rows, in
    /// `rows`, may show the order of day and month.
    pub(crate) fn new(
        header: &Header,
        time: Option<usize>,
        date_order: Option<DateOrder>,
        rows: &[(u64, Vec<u8>)],
    ) -> Self {
        let (delimiter, recorded) = (header.delimiter, header.recorded);
        // If commas separate columns, they are not decimal commas.
        let mark = if delimiter == b',' { Mark::Point } else { Mark::Open };
        let shown = |(_, line): &(u64, Vec<u8>)| {
            let time = cells(line, delimiter)?.into_iter().nth(time?)?;
            // Most times are numbers, and parsing each of them as two dates would be slow.
            if is_finite(&time) { None } else { order_of(&text(&time)) }
        };
        let date_order = date_order.or_else(|| rows.iter().find_map(shown));
        let (clock, spoilt) = (Clock::Open, Vec::new());
        Self { delimiter, recorded, time, date_order, mark, clock, is_plain: false, spoilt }
    }

    /// Returns the faults in fields of the newest row that were accepted as NaN, and clears them.
    #[inline]
    pub(crate) fn take_spoilt(&mut self) -> Option<Vec<(usize, Fault)>> {
        (!self.spoilt.is_empty()).then(|| std::mem::take(&mut self.spoilt))
    }

    /// The first stamp, ns.
    pub(crate) fn first_stamp(&self) -> Option<i128> {
        if let Clock::Stamps(first) = self.clock { first } else { None }
    }

    /// Returns the first time if times are integers that an `f64` cannot represent exactly. All times are counted from
    /// it.
    pub(crate) fn first_count(&self) -> Option<i128> {
        if let Clock::Counts(first) = self.clock { first } else { None }
    }

    /// Whether numbers have decimal commas.
    pub(crate) fn has_commas(&self) -> bool {
        self.mark == Mark::Comma
    }

    /// Reads a row into `out`. Returns false if the line is a comment.
    #[inline]
    pub(crate) fn parse(
        &mut self,
        line: &[u8],
        roles: &[Role],
        out: &mut [f64],
    ) -> Result<bool, RowFault> {
        if is_comment(line) {
            return Ok(false);
        }
        let recorded = self.recorded;
        if self.is_plain && numbers(line, self.delimiter, &roles[..recorded], &mut out[..recorded])
        {
            return Ok(true);
        }
        if !self.is_plain {
            self.learn(line);
            self.is_plain =
                self.delimiter != BLANKS && self.mark == Mark::Point && self.clock == Clock::Number;
        }
        self.parse_loosely(line, roles, out).map(|()| true)
    }

    /// Learns the notation of times and numbers from this row, if no row before it has shown it.
    fn learn(&mut self, line: &[u8]) {
        let Some(cells) = cells(line, self.delimiter) else { return };
        if self.clock == Clock::Open {
            let cell = self.time.and_then(|i| cells.get(i)).map(|cell| text(cell));
            let is_stamp = cell.is_some_and(|cell| looks_like_stamp(&cell));
            let is_number = |cell: &[u8]| number(&with_point(cell)).is_ok();
            self.clock = match self.time.and_then(|i| cells.get(i)) {
                Some(cell) if is_stamp && !is_number(cell) => Clock::Stamps(None),
                Some(cell) if cell.len() > EXACT_DIGITS && whole(cell).is_some() => {
                    Clock::Counts(None)
                }
                Some(cell) if !is_number(cell) => Clock::Open,
                _ => Clock::Number,
            };
        }
        if self.mark == Mark::Open {
            let marked = cells.iter().find_map(|cell| match number(cell) {
                Ok(_) => cell.contains(&b'.').then_some(Mark::Point),
                Err((FieldFault::DecimalComma, _)) => Some(Mark::Comma),
                Err(_) => None,
            });
            self.mark = marked.unwrap_or(Mark::Open);
        }
    }

    fn parse_loosely(
        &mut self,
        line: &[u8],
        roles: &[Role],
        out: &mut [f64],
    ) -> Result<(), RowFault> {
        let cells = cells(line, self.delimiter).ok_or_else(|| broken(line, self.delimiter))?;
        // A separator may follow the last field.
        let is_trailed = cells.last().is_some_and(|cell| cell.is_empty());
        let most = roles.len() + usize::from(is_trailed);
        if !(self.recorded..=most).contains(&cells.len()) {
            return Err(RowFault::Ragged { found: cells.len(), expected: roles.len() });
        }
        self.spoilt.clear();
        for (column, (cell, &role)) in cells.iter().zip(roles).enumerate() {
            let value = match (role, self.clock) {
                (Role::Skipped, _) => Ok(f64::NAN),
                (_, Clock::Stamps(first)) if Some(column) == self.time => self.stamp(cell, first),
                (_, Clock::Counts(first)) if Some(column) == self.time => self.count(cell, first),
                _ => self.number(cell),
            };
            out[column] = match value {
                Ok(value) => value,
                // Refuse a row with the other notation, because it is unclear which numbers of the file use which.
                Err(fault @ (FieldFault::DecimalPoint, _)) => {
                    return Err(RowFault::Field { column, fault });
                }
                Err(fault) if role == Role::Welcome || self.may_be_blank(&fault, column) => {
                    self.spoilt.push((column, fault));
                    f64::NAN
                }
                Err(fault) => return Err(RowFault::Field { column, fault }),
            };
        }
        Ok(())
    }

    /// Returns whether a needed column may lack a value in this row. Only the time must have a value in each row,
    /// because any other column may have a separate clock.
    fn may_be_blank(&self, (fault, _): &Fault, column: usize) -> bool {
        matches!(fault, FieldFault::Empty | FieldFault::NotFinite) && Some(column) != self.time
    }

    fn stamp(&mut self, cell: &[u8], first: Option<i128>) -> Result<f64, Fault> {
        let ns = nanoseconds(&text(cell), self.date_order);
        let ns = ns.map_err(|fault| (fault, shown(cell)))?;
        let first = first.unwrap_or(ns);
        self.clock = Clock::Stamps(Some(first));
        Ok((ns - first) as f64 / 1e9)
    }

    fn count(&mut self, cell: &[u8], first: Option<i128>) -> Result<f64, Fault> {
        let count = whole(cell).ok_or_else(|| (FieldFault::NotANumber, shown(cell)))?;
        let first = first.unwrap_or(count);
        self.clock = Clock::Counts(Some(first));
        Ok((count - first) as f64)
    }

    fn number(&self, cell: &[u8]) -> Result<f64, Fault> {
        match self.mark {
            Mark::Comma if cell.contains(&b'.') && number(cell).is_ok() => {
                Err((FieldFault::DecimalPoint, shown(cell)))
            }
            Mark::Comma if cell.contains(&b',') => {
                number(&with_point(cell)).map_err(|_| (FieldFault::NotANumber, shown(cell)))
            }
            _ => number(cell),
        }
    }
}

/// Returns whether a line is a comment.
pub(crate) fn is_comment(line: &[u8]) -> bool {
    // Nearly every line begins with a digit or a sign.
    match line.first() {
        Some(b'0'..=b'9' | b'-' | b'+' | b'.') | None => false,
        Some(_) => {
            let line = line.trim_ascii_start();
            line.starts_with(b"#") || line.starts_with(b"%") || line.starts_with(b"//")
        }
    }
}

/// Returns a comment without its comment mark.
pub(crate) fn uncommented(line: &[u8]) -> &[u8] {
    let is_mark = |b: &u8| matches!(b, b'#' | b'%' | b'/' | b' ' | b'\t');
    &line[line.iter().take_while(|b| is_mark(b)).count()..]
}

/// The cells of a line; `None` if its quotation marks do not pair up.
pub(crate) fn cells(line: &[u8], delimiter: u8) -> Option<Vec<Cow<'_, [u8]>>> {
    let (mut cells, mut at) = (Vec::new(), 0);
    let blank = |b: &&u8| matches!(b, b' ' | b'\t');
    loop {
        if delimiter == BLANKS {
            at += line[at..].iter().take_while(blank).count();
            if at == line.len() {
                return Some(cells);
            }
            let is_quoted = line[at] == b'"';
            let length = match is_quoted {
                true => 2 + memchr::memchr(b'"', &line[at + 1..])?,
                false => line[at..].iter().take_while(|b| !blank(b)).count(),
            };
            let cell = &line[at..at + length];
            let content = if is_quoted { cell[1..length - 1].trim_ascii() } else { cell };
            cells.push(Cow::Borrowed(content));
            at += length;
            continue;
        }
        let end = match field(line, at, delimiter) {
            Field::Plain(content, end) => {
                cells.push(Cow::Borrowed(content));
                end
            }
            Field::Quoted(content, end) => {
                cells.push(Cow::Owned(content.trim_ascii().to_vec()));
                end
            }
            Field::Broken => return None,
        };
        if end >= line.len() {
            return Some(cells);
        }
        at = end + 1;
    }
}

/// Returns the fault of the first cell whose quotation marks do not pair up.
fn broken(line: &[u8], delimiter: u8) -> RowFault {
    let (mut column, mut at) = (0, 0);
    while let Field::Plain(_, end) | Field::Quoted(_, end) = field(line, at, delimiter) {
        if end >= line.len() {
            break;
        }
        (column, at) = (column + 1, end + 1);
    }
    RowFault::Field { column, fault: (FieldFault::Quote, String::new()) }
}

/// Whether a cell is a number in either notation, or a time stamp.
pub(crate) fn is_value(cell: &[u8], delimiter: u8) -> bool {
    let with_commas = || delimiter != b',' && is_finite(&with_point(cell));
    is_finite(cell) || with_commas() || looks_like_stamp(&text(cell))
}

/// Parses an integer that may be long. Its size is limited so that the difference of two such integers does not
/// overflow.
fn whole(cell: &[u8]) -> Option<i128> {
    text(cell).parse().ok().filter(|n: &i128| n.unsigned_abs() < 1 << 100)
}

fn with_point(cell: &[u8]) -> Cow<'_, [u8]> {
    match memchr::memchr(b',', cell) {
        None => Cow::Borrowed(cell),
        Some(at) => {
            let mut pointed = cell.to_vec();
            pointed[at] = b'.';
            Cow::Owned(pointed)
        }
    }
}

fn text(cell: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(cell)
}

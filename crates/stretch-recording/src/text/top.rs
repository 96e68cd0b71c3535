//! The top of a table: what stands above the first row of numbers, and what it says of the columns.

use std::io::Read;

use stretch_data::shown;

use crate::{
    ReadOptions, RecordingError,
    names::{are_units, tidy, time_rank},
    options::TIME,
    text::dialect::{BLANKS, cells, is_comment, is_value},
    text::header::Header,
    text::lines::Lines,
};

/// Lines that are looked at for the first row of numbers.
const MOST_AHEAD: usize = 64;
/// Separators, the surest first.
const SEPARATORS: [u8; 4] = [b';', b'\t', b',', BLANKS];

/// What a table begins with.
pub(crate) struct Top {
    /// Names and separator.
    pub(crate) header: Header,
    /// What a row of units says of each column; empty where there is none.
    units: Vec<String>,
    /// Rows that were read already, with their numbers.
    pub(crate) ahead: Vec<(u64, Vec<u8>)>,
    pub(crate) notes: Vec<String>,
}

type Row = (u64, Vec<u8>);

impl Top {
    /// Reads as far as the first row of numbers.
    pub(crate) fn read<R: Read>(
        lines: &mut Lines<R>,
        file: &str,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let (mut rows, mut comment): (Vec<Row>, Option<Row>) = (Vec::new(), None);
        let mut first = None;
        while first.is_none() && rows.len() < MOST_AHEAD {
            let Some((row, line)) = lines.next()? else { break };
            if is_comment(line) {
                comment = Some((row, line.to_vec()));
                continue;
            }
            rows.push((row, line.to_vec()));
            first = separator(line).filter(|&(_, count)| {
                options.columns.as_ref().is_none_or(|names| names.len() == count)
            });
            // Columns may be called by numbers; the time of this project's own form is not.
            first = first.filter(|_| !line.starts_with(TIME.as_bytes()));
            // What comes before the first whole row of a stream is the end of another.
            first = first.filter(|&(delimiter, count)| {
                options.columns.is_none() || is_whole(line, delimiter, count)
            });
        }
        match (&options.columns, first) {
            (Some(names), first) => Self::given(file, rows, names, first),
            (None, _) if rows.is_empty() => Err(RecordingError::Empty { file: file.to_owned() }),
            (None, None) => Self::from_line(file, rows, 0),
            (None, Some(first)) => Self::found(file, rows, comment, first, options),
        }
    }

    /// A table without a header line, whose columns somebody named.
    fn given(
        file: &str,
        mut rows: Vec<Row>,
        names: &[String],
        first: Option<(u8, usize)>,
    ) -> Result<Self, RecordingError> {
        let Some((delimiter, _)) = first else {
            let counted = rows.iter().find_map(|(row, line)| Some((*row, separator(line)?.1)));
            return match counted {
                None => Err(RecordingError::Empty { file: file.to_owned() }),
                Some((row, found)) => Err(RecordingError::Named {
                    file: file.to_owned(),
                    row,
                    found,
                    given: names.len(),
                }),
            };
        };
        let data = rows.len() - 1;
        let ahead = rows.split_off(data);
        let cells = names.iter().map(|name| name.clone().into_bytes()).collect();
        let header = Header { names: Header::named(file, 0, cells)?, delimiter };
        Ok(Self { header, units: Vec::new(), ahead, notes: passed_over(data) })
    }

    /// The header is line `at`, read as this project writes it.
    fn from_line(file: &str, mut rows: Vec<Row>, at: usize) -> Result<Self, RecordingError> {
        let ahead = rows.split_off(at + 1);
        let header = Header::parse(file, rows[at].0, &rows[at].1)?;
        Ok(Self { header, units: Vec::new(), ahead, notes: passed_over(at) })
    }

    /// The last of `rows` is the first row of numbers.
    fn found(
        file: &str,
        mut rows: Vec<Row>,
        comment: Option<Row>,
        (delimiter, count): (u8, usize),
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let data = rows.len() - 1;
        let is_trailed = rows[data].1.trim_ascii_end().ends_with(&[delimiter]);
        let split = |line: &[u8]| name_cells(line, delimiter, count, is_trailed);
        if data == 0 {
            let named = comment.and_then(|(row, line)| Some((row, split(uncommented(&line))?)));
            let Some((row, names)) = named else {
                let first = shown(&rows[0].1);
                return Err(RecordingError::NoHeader { file: file.to_owned(), first });
            };
            let header = Header { names: Header::named(file, row, names)?, delimiter };
            let notes = vec![format!("the names of the columns stand in a comment, row {row}")];
            return Ok(Self { header, units: Vec::new(), ahead: rows, notes });
        }
        let names: Vec<Option<Vec<Vec<u8>>>> =
            rows[..data].iter().map(|(_, line)| split(line)).collect();
        let units_at = |row: usize| {
            names[row]
                .as_ref()
                .map(|cells| texts(cells))
                .filter(|cells| are_units(cells.iter().map(String::as_str)))
        };
        let has_time = |row: &usize| {
            names[*row]
                .as_ref()
                .is_some_and(|cells| texts(cells).iter().any(|name| is_time(name, &options.time)))
        };
        let at = match (0..data).find(has_time) {
            Some(at) => at,
            None if data >= 2 && units_at(data - 1).is_some() && names[data - 2].is_some() => {
                data - 2
            }
            None => data - 1,
        };
        let Some(cells) = names[at].clone() else { return Self::from_line(file, rows, 0) };
        let units = if at + 2 == data { units_at(at + 1) } else { None };
        let header = Header { names: Header::named(file, rows[at].0, cells)?, delimiter };
        let ahead = rows.split_off(if units.is_some() { data } else { at + 1 });
        Ok(Self { header, units: units.unwrap_or_default(), ahead, notes: passed_over(at) })
    }

    /// Gives columns names with units in this project's way, and says which; names that are asked for stay.
    pub(crate) fn tidy(&mut self, options: &ReadOptions) {
        let raw = self.header.names.clone();
        let is_asked = |name: &String| options.required().contains(name) || *name == options.time;
        let mut told = Vec::new();
        for (i, name) in raw.iter().enumerate() {
            let unit = self.units.get(i).map(String::as_str);
            let Some(tidied) = tidy(name, unit).filter(|_| !is_asked(name)) else { continue };
            if tidied != *name && !self.header.names.contains(&tidied) {
                told.push(format!("{} -> {tidied}", shown(name.as_bytes())));
                self.header.names[i] = tidied;
            }
        }
        if !told.is_empty() {
            self.notes.push(format!("columns named with their units: {}", told.join(", ")));
        }
    }
}

/// Whether a column may be the time that is asked for.
fn is_time(name: &str, wanted: &str) -> bool {
    let tidied = tidy(name, None);
    let name = tidied.as_deref().unwrap_or(name);
    name == wanted || (wanted == TIME && time_rank(name).is_some())
}

fn passed_over(count: usize) -> Vec<String> {
    match count {
        0 => Vec::new(),
        1 => vec!["the first line is no part of the table and is passed over".to_owned()],
        _ => vec![format!("the first {count} lines are no part of the table and are passed over")],
    }
}

pub(crate) fn uncommented(line: &[u8]) -> &[u8] {
    let is_mark = |b: &u8| matches!(b, b'#' | b'%' | b'/' | b' ' | b'\t');
    &line[line.iter().take_while(|b| is_mark(b)).count()..]
}

fn texts(cells: &[Vec<u8>]) -> Vec<String> {
    cells.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect()
}

/// Whether each of so many cells has a number or a stamp in it.
pub(crate) fn is_whole(line: &[u8], delimiter: u8, count: usize) -> bool {
    let cells = cells(line, delimiter).unwrap_or_default();
    cells.len() == count && cells.iter().all(|cell| is_value(cell, delimiter))
}

/// The separator of a row of numbers and how many cells it then has; none where most cells are no numbers.
pub(crate) fn separator(line: &[u8]) -> Option<(u8, usize)> {
    let share = |delimiter: u8| {
        let cells = cells(line, delimiter)?;
        let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
        let values = cells.iter().filter(|cell| is_value(cell, delimiter)).count();
        // `Sample rate,100` above a table is no row of it.
        let begins = cells.first().is_some_and(|cell| is_value(cell, delimiter));
        let is_row = cells.len() > 1 && (2 * values > filled || (begins && 2 * values >= filled));
        is_row.then_some((delimiter, cells.len(), values as f64 / filled as f64))
    };
    let better = |best: (u8, usize, f64), next: (u8, usize, f64)| {
        if next.2 > best.2 { next } else { best }
    };
    let found = SEPARATORS.into_iter().filter_map(share).reduce(better)?;
    Some((found.0, found.1))
}

/// The cells of a line of names above `count` columns of numbers, the last one empty where their rows are trailed by a
/// separator; none where it has others.
pub(crate) fn name_cells(
    line: &[u8],
    delimiter: u8,
    count: usize,
    is_trailed: bool,
) -> Option<Vec<Vec<u8>>> {
    let owned = |cells: Vec<std::borrow::Cow<'_, [u8]>>| -> Vec<Vec<u8>> {
        cells.into_iter().map(std::borrow::Cow::into_owned).collect()
    };
    let mut found = owned(cells(line, delimiter)?);
    if delimiter == BLANKS && found.len() > count {
        // `Pos (mm)` is one name.
        let mut joined: Vec<Vec<u8>> = Vec::new();
        for cell in found {
            match joined.last_mut() {
                Some(last) if cell.starts_with(b"(") || cell.starts_with(b"[") => {
                    last.push(b' ');
                    last.extend(cell);
                }
                _ => joined.push(cell),
            }
        }
        found = joined;
    }
    // A separator behind the last name, or behind the last number.
    if found.len() == count + 1 && found.last().is_some_and(Vec::is_empty) {
        found.pop();
    } else if is_trailed && found.len() + 1 == count {
        found.push(Vec::new());
    }
    (found.len() == count).then_some(found)
}

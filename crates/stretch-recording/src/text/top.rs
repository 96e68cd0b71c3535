//! Finds where the table begins in a text, and the names of its columns.

use std::{borrow::Cow, cmp::Reverse, io::Read};

use stretch_data::shown;

use crate::{
    ReadOptions, RecordingError,
    clock::time_among,
    names::{are_units, tidy},
    options::TIME,
    text::columns::KNOWN,
    text::dialect::{BLANKS, cells, is_comment, is_value, uncommented},
    text::header::Header,
    text::lines::{Lines, windows_1252},
    text::rate::stated_rate_hz,
};

/// Largest number of lines that are searched for the table.
const MOST_AHEAD: usize = 256;
/// If a line of names with a time is followed by this number of rows of numbers, no other table is searched for.
const SURE: usize = 64;
/// Number of rows of a live stream after which the search for names with a time ends.
const LIVE_ROWS: usize = 8;
/// Largest number of rows of numbers between a [`Block`] and the line of its names.
const ROWS_BETWEEN: usize = 3;
/// Largest number of names without a column at the end of a header line.
const MOST_OPTIONAL: usize = 4;
/// Separators, the most certain first.
const SEPARATORS: [u8; 5] = [b';', b'\t', b'|', b',', BLANKS];

/// The beginning of a table.
pub(crate) struct Top {
    /// Names and separator.
    pub(crate) header: Header,
    /// Lines that were read already, from the table's first row on.
    pub(crate) ahead: Vec<(u64, Vec<u8>)>,
    /// Sample rate that a field above the table states, and the name of that field.
    pub(crate) stated_hz: Option<(f64, String)>,
    pub(crate) notes: Vec<String>,
}

impl Top {
    /// Reads up to the first row of the table, and further while a better table may follow. A live stream is read no
    /// further than necessary.
    pub(crate) fn read<R: Read>(
        lines: &mut Lines<R>,
        file: &str,
        options: &ReadOptions,
        is_live: bool,
    ) -> Result<Self, RecordingError> {
        let mut finder = Finder { options, lines: Vec::new(), blocks: Vec::new() };
        let mut is_whole = false;
        while !is_whole && finder.lines.len() < MOST_AHEAD && !finder.is_done(is_live) {
            match lines.next()? {
                Some((row, line)) => finder.take(file, row, line)?,
                None => is_whole = true,
            }
        }
        finder.top(file, is_whole)
    }
}

/// Rewrites names with units in the project's notation, such as `pos_mm` for `Pos (mm)`, and adds a note. Requested
/// names stay, unless their unit is in the row below, because it would be lost.
fn tidy_names(
    names: &[String],
    units: &[String],
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> Vec<String> {
    let mut renamed = Vec::new();
    let tidied = names.iter().enumerate().map(|(i, name)| {
        let is_other = |tidied: &String| tidied == name || names.contains(tidied);
        let below = units.get(i).map(String::as_str).filter(|unit| !unit.is_empty());
        let stays = below.is_none() && options.asked().contains(&name);
        let tidied = tidy(name, below).filter(|t| !is_other(t));
        let Some(tidied) = tidied.filter(|_| !stays) else {
            return name.clone();
        };
        renamed.push(format!("{} -> {tidied}", shown(name.as_bytes())));
        tidied
    });
    let tidied = tidied.collect();
    if !renamed.is_empty() {
        notes.push(format!("columns named with their units: {}", renamed.join(", ")));
    }
    tidied
}

/// A line at the beginning of a text.
struct Line {
    row: u64,
    text: Vec<u8>,
    is_comment: bool,
    /// Whether the line was not UTF-8 and was decoded as Windows-1252.
    is_decoded: bool,
    is_row: bool,
}

/// Rows of numbers with the same separator and number of cells.
struct Block {
    delimiter: u8,
    /// Number of cells in a row.
    cells: usize,
    /// Number of cells in the first row, without empty cells at its end.
    filled: usize,
    /// Index of the line of the first row.
    start: usize,
    rows: usize,
    /// Whether the first row begins with a number. A line such as `X0,0,0` does not.
    is_begun: bool,
    names: Option<Names>,
    /// Whether a later line of names has begun another table.
    is_closed: bool,
}

/// A line of names above a block.
struct Names {
    line: usize,
    cells: Vec<String>,
    units: Option<usize>,
    has_time: bool,
}

/// The lines so far, and the blocks of rows in them.
struct Finder<'a> {
    options: &'a ReadOptions,
    lines: Vec<Line>,
    blocks: Vec<Block>,
}

impl Finder<'_> {
    fn is_done(&self, is_live: bool) -> bool {
        let enough = if is_live { 1 } else { SURE };
        let options = self.options;
        // For a live stream without a time, names that include the required columns are enough.
        let is_counted = is_live && options.counted(false, None).is_some();
        let is_asked = |names: &Names| {
            is_counted && options.required().iter().all(|name| names.cells.contains(name))
        };
        let is_timed = |block: &Block| {
            options.columns.is_some()
                || (is_live && options.sample_rate_hz.is_some())
                || block.names.as_ref().is_some_and(|names| names.has_time || is_asked(names))
        };
        self.blocks.iter().any(|block| {
            (is_timed(block) && block.is_begun && block.rows >= enough)
                || (is_live && block.rows >= LIVE_ROWS)
        })
    }

    fn take(&mut self, file: &str, row: u64, line: &[u8]) -> Result<(), RecordingError> {
        if line.starts_with(b"\xff\xfe") || line.starts_with(b"\xfe\xff") {
            let problem = "the text is UTF-16; save the file with the encoding UTF-8";
            return Err(RecordingError::unusable(file, problem));
        }
        let is_decoded = std::str::from_utf8(line).is_err();
        let text = if is_decoded { windows_1252(line).into_bytes() } else { line.to_vec() };
        let is_comment = is_comment(line);
        let shape = if is_comment { None } else { self.shape(&text) };
        let is_row = shape.is_some();
        self.lines.push(Line { row, text, is_comment, is_decoded, is_row });
        match shape {
            Some(shape) => self.add_row(shape),
            None if !is_comment => self.close(),
            None => {}
        }
        Ok(())
    }

    /// Returns the separator and the number of cells of a line, if it is a row of numbers.
    fn shape(&self, line: &[u8]) -> Option<(u8, usize)> {
        let Some(names) = &self.options.columns else {
            let found = self.separator(line, |_| true)?;
            // Columns may have numbers as names. The time may not, and its name shows that the line is a header.
            let is_header = cells(line, found.0)?.iter().any(|cell| self.is_time(cell));
            return (!is_header).then_some(found);
        };
        let (time, asked) = (time_among(names, self.options), self.options.asked());
        let fits = |cells: &[Cow<'_, [u8]>]| {
            let count = cells.len() - usize::from(cells.last().is_some_and(|c| c.is_empty()));
            let is_field = |(i, cell): (usize, &Cow<'_, [u8]>)| {
                let is_needed = time == Some(i) || asked.contains(&&names[i]);
                let is_text = |cell: &[u8]| !is_needed && cell.iter().any(u8::is_ascii_alphabetic);
                is_number(cell) || is_text(cell) || (cell.is_empty() && time != Some(i))
            };
            (cells.len() == names.len() || count == names.len())
                && cells[..names.len()].iter().enumerate().all(is_field)
        };
        self.separator(line, fits)
    }

    /// Returns whether a cell is the requested or the default name of the time.
    fn is_time(&self, cell: &[u8]) -> bool {
        cell == self.options.time.as_bytes() || cell == TIME.as_bytes()
    }

    /// Returns the separator of a row of numbers, and its number of cells. Returns `None` if most cells are not
    /// numbers.
    fn separator(
        &self,
        line: &[u8],
        fits: impl Fn(&[Cow<'_, [u8]>]) -> bool,
    ) -> Option<(u8, usize)> {
        let share = |delimiter: u8| {
            let cells = cells(line, delimiter).filter(|cells| cells.len() > 1 && fits(cells))?;
            let is_number = |cell: &[u8]| {
                is_value(cell, delimiter) || fast_float2::parse::<f64, _>(cell).is_ok()
            };
            let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
            let values = cells.iter().filter(|cell| is_number(cell)).count();
            // If only half of the cells are numbers, the first must be one: `Sample rate,100` above a table is not a
            // row.
            let begins = cells.first().is_some_and(|cell| is_number(cell));
            let is_row = 2 * values > filled || (begins && 2 * values >= filled);
            is_row.then_some((delimiter, cells.len(), values as f64 / filled as f64))
        };
        let better = |best: (u8, usize, f64), next: (u8, usize, f64)| {
            // These separators never occur in a number.
            let is_sure = matches!(best.0, b';' | b'\t' | b'|');
            if next.2 > best.2 && !is_sure { next } else { best }
        };
        let is_here = |delimiter: &u8| *delimiter == BLANKS || line.contains(delimiter);
        let found = SEPARATORS.into_iter().filter(is_here).filter_map(share).reduce(better);
        // If samples are counted, a line with a single number is a row of one column.
        let is_bare = || {
            let cell = line.trim_ascii();
            let is_counted = self.options.counted(false, None).is_some();
            is_counted && fits(&[Cow::Borrowed(cell)]) && is_number(cell)
        };
        found.map(|found| (found.0, found.1)).or_else(|| is_bare().then_some((b';', 1)))
    }

    fn add_row(&mut self, (delimiter, count): (u8, usize)) {
        let open = self.blocks.iter_mut().rfind(|block| {
            !block.is_closed && (block.delimiter, block.cells) == (delimiter, count)
        });
        if let Some(block) = open {
            block.rows += 1;
            return;
        }
        let start = self.lines.len() - 1;
        let row = cells(&self.lines[start].text, delimiter).unwrap_or_default();
        let is_begun =
            self.options.columns.is_some() || row.first().is_some_and(|cell| is_number(cell));
        let filled = row.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
        let mut block = Block {
            delimiter,
            cells: count,
            filled,
            start,
            rows: 1,
            is_begun,
            names: None,
            is_closed: false,
        };
        block.names = self.names_above(&block);
        self.blocks.push(block);
    }

    /// Closes every block for which the newest line is a line of new names. That line begins another table, so it does
    /// not count as a bad row of the block.
    fn close(&mut self) {
        let Some((line, above)) = self.lines.split_last() else { return };
        for block in self.blocks.iter_mut().filter(|block| !block.is_closed) {
            let is_again = above[..block.start].iter().any(|other| other.text == line.text);
            let names = name_cells(&line.text, block).filter(|_| !is_again);
            block.is_closed = names.is_some_and(|n| !n.iter().any(|c| is_number(c.as_bytes())));
        }
    }

    /// Returns the nearest line of names above a block that contains a time, or else the nearest line of names. A line
    /// of units, if there is one, is returned with it.
    fn names_above(&self, block: &Block) -> Option<Names> {
        let (mut nearest, mut units, mut rows) = (None, None, 0);
        for (at, line) in self.lines[..block.start].iter().enumerate().rev() {
            rows += usize::from(line.is_row);
            if rows > ROWS_BETWEEN {
                break;
            }
            let text = if line.is_comment { uncommented(&line.text) } else { &line.text };
            let Some(mut cells) = name_cells(text, block).filter(|_| !line.is_row) else {
                continue;
            };
            // Requested and known columns are recorded, so they cannot be surplus names without a column.
            let is_asked = |cell: &String| {
                self.options.asked().contains(&cell) || KNOWN.contains(&cell.as_str())
            };
            if cells.len() > block.cells && cells[block.filled..].iter().any(is_asked) {
                continue;
            }
            let numbers = cells.iter().filter(|cell| is_number(cell.as_bytes())).count();
            let filled = cells.iter().filter(|cell| !cell.is_empty()).count();
            if 2 * numbers >= filled && !cells.iter().any(|cell| self.is_time(cell.as_bytes())) {
                continue;
            }
            match label(&cells[0]).filter(|_| nearest.is_none()) {
                Some("unit") => units = Some(at),
                Some("title" | "name") => cells[0] = TIME.to_owned(),
                Some(_) => continue,
                None => {}
            }
            let shown = cells.iter().take(block.filled).map(String::as_str);
            if units.is_none() && nearest.is_none() && are_units(shown) {
                units = Some(at);
            }
            if units == Some(at) {
                continue;
            }
            let tidied = |name: &String| tidy(name, None).unwrap_or_else(|| name.clone());
            let tidied: Vec<String> = cells.iter().map(tidied).collect();
            let has_time = time_among(&tidied, self.options).is_some()
                || time_among(&cells, self.options).is_some();
            let names = Names { line: at, cells, units, has_time };
            if has_time {
                return Some(names);
            }
            // A comment is the header only if it names the time or the sample rate is given.
            if nearest.is_none() && (!line.is_comment || self.options.sample_rate_hz.is_some()) {
                nearest = Some(names);
            }
        }
        // If there are no other names, units may be the names of the columns.
        let by_units = || {
            let line = units?;
            let cells = name_cells(&self.lines[line].text, block)?;
            let has_time = time_among(&cells, self.options).is_some();
            Some(Names { line, cells, units: None, has_time })
        };
        nearest.or_else(by_units)
    }

    /// Chooses the table. A block with a time is preferred to one without, then a block that begins with a number, then
    /// the longest block.
    fn top(mut self, file: &str, is_whole: bool) -> Result<Top, RecordingError> {
        let rank = |(i, block): &(usize, &Block)| {
            let has_time = block.names.as_ref().is_some_and(|names| names.has_time);
            (has_time, block.is_begun, block.rows, Reverse(*i))
        };
        let best = self.blocks.iter().enumerate().max_by_key(rank).map(|(i, _)| i);
        let mut block = match best {
            Some(best) => self.blocks.swap_remove(best),
            None => self.without_rows().ok_or_else(|| self.no_table(file))?,
        };
        let mut notes = Vec::new();
        let names = block.names.take();
        let lines = &self.lines;
        let (row, cells, units) = match (&self.options.columns, &names) {
            (Some(given), _) => (0, given.clone(), None),
            (None, Some(names)) => {
                (lines[names.line].row, names.cells.clone(), names.units.map(|at| &lines[at]))
            }
            (None, None) => match self.options.required() {
                // If each row is one number and one column is required, the numbers are the values of that column.
                [only] if block.cells == 1 => (0, vec![only.clone()], None),
                _ => return Err(self.no_header(file, &block, is_whole)),
            },
        };
        // Bad rows may come before the first row of the block.
        if let Some(names) = names.as_ref().filter(|_| self.options.columns.is_none()) {
            let below = names.units.map_or(names.line, |units| units.max(names.line)) + 1;
            let first = lines[below..block.start].iter().position(|line| line.is_row);
            block.start = first.map_or(block.start, |first| below + first);
        }
        let header_line = names.filter(|_| self.options.columns.is_none()).map(|n| &lines[n.line]);
        let is_part = |line: &&Line| {
            line.is_comment || [header_line, units].iter().flatten().any(|l| l.row == line.row)
        };
        notes.extend(passed_over(lines[..block.start].iter().filter(|l| !is_part(l)).count()));
        if let Some(line) = header_line.filter(|line| line.is_comment) {
            notes.push(format!("the names of the columns are in a comment, row {}", line.row));
        }
        if [header_line, units].iter().flatten().any(|line| line.is_decoded) {
            notes.push("the column names are not UTF-8 and are read as Windows-1252".to_owned());
        }
        let units = units.and_then(|line| name_cells(&line.text, &block)).unwrap_or_default();
        let cells = tidy_names(&cells, &units, self.options, &mut notes);
        let mut names = Header::named(file, row, &cells, self.options, &mut notes)?;
        // There may be more names than cells, or several separators after the last number.
        let named = names.len();
        let recorded = if named > block.cells { block.filled } else { named };
        names.resize(named.max(block.cells.saturating_sub(1)), String::new());
        let header = Header { names, delimiter: block.delimiter, recorded };
        let above: Vec<&[u8]> = lines[..block.start].iter().map(|line| &line.text[..]).collect();
        let stated_hz = stated_rate_hz(&above, block.delimiter);
        let ahead = self.lines.split_off(block.start);
        let ahead = ahead.into_iter().map(|line| (line.row, line.text)).collect();
        Ok(Top { header, ahead, stated_hz, notes })
    }

    /// Returns a table without any readable row, if there is a line of names with a time.
    fn without_rows(&self) -> Option<Block> {
        let named = |(start, line): (usize, &Line)| {
            let by = |delimiter| {
                let cells: Vec<String> =
                    cells(&line.text, delimiter)?.iter().map(|cell| text(cell)).collect();
                time_among(&cells, self.options)?;
                Some((delimiter, cells))
            };
            let (delimiter, cells) =
                SEPARATORS.into_iter().filter_map(by).max_by_key(|(_, cells)| cells.len())?;
            let (count, units) = (cells.len(), None);
            Some(Block {
                delimiter,
                cells: count,
                filled: count,
                start: start + 1,
                rows: 0,
                is_begun: false,
                names: Some(Names { line: start, cells, units, has_time: true }),
                is_closed: false,
            })
        };
        let is_text = |(_, line): &(usize, &Line)| !line.is_comment;
        let own_names = self.options.columns.is_none();
        self.lines.iter().enumerate().filter(is_text).find_map(named).filter(|_| own_names)
    }

    /// The error for lines without a table.
    fn no_table(&self, file: &str) -> RecordingError {
        let Some(first) = self.lines.first() else {
            return RecordingError::unusable(
                file,
                "the file is empty; it needs a header line with the names of its columns, then one row per sample",
            );
        };
        let counted = self.lines.iter().find_map(|line| {
            let (delimiter, _) =
                self.separator(&line.text, |_| true).filter(|_| !line.is_comment)?;
            let mut cells = cells(&line.text, delimiter)?;
            cells.pop_if(|last| last.is_empty());
            Some((line.row, cells.len()))
        });
        if let (Some(names), Some((row, found))) = (&self.options.columns, counted)
            && found != names.len()
        {
            let given = names.len();
            let problem = format!(
                "the row has {found} numbers, but --columns names {given}; give {found} names"
            );
            return RecordingError::unusable(format!("{file}, row {row}"), problem);
        }
        let none = match self.lines.len() {
            1 => "its first line is not".to_owned(),
            lines => format!("none of its first {lines} lines is"),
        };
        let how = match self.lines.iter().any(|line| is_number(line.text.trim_ascii())) {
            true => {
                "each line has one number only: name the column and give the rate, such as --columns gauge_mv --time 100hz, or record the time as well"
            }
            false => "write one line per sample, with a separator between its numbers",
        };
        let first = shown(&first.text);
        let problem = format!("{none} a row of numbers (the first is \"{first}\"); {how}");
        RecordingError::unusable(file, problem)
    }

    /// The error for rows of numbers without names.
    fn no_header(&self, file: &str, block: &Block, is_whole: bool) -> RecordingError {
        let above = self.lines[..block.start].iter().rfind(|l| !l.is_comment && !l.is_row);
        let above = above.map_or("no names above them".to_owned(), |line| {
            let shown = shown(&line.text);
            let commas = if block.delimiter == b',' {
                "; if its commas are decimal commas, separate the columns with semicolons"
            } else {
                ""
            };
            format!("no names for them in the line above (\"{shown}\"{commas})")
        });
        let rows = match block.rows {
            1 => "1 row".to_owned(),
            rows => format!("{}{rows} rows", if is_whole { "" } else { "at least " }),
        };
        let (numbers, row) = (block.filled, self.lines[block.start].row);
        let problem = format!(
            "{rows} of {numbers} numbers from line {row} on, and {above}; name the columns with --columns, or put a header line above them, such as time_s,length_mm,bridge_v"
        );
        RecordingError::unusable(file, problem)
    }
}

fn passed_over(count: usize) -> Option<String> {
    match count {
        0 => None,
        1 => Some("the first line is not part of the table and is skipped".to_owned()),
        _ => Some(format!("the first {count} lines are not part of the table and are skipped")),
    }
}

fn text(cell: &[u8]) -> String {
    String::from_utf8_lossy(cell).into_owned()
}

/// Returns the meaning of a line whose first cell is a label, such as `ChannelTitle=` or `Unit:`. The result is empty
/// for another label.
fn label(cell: &str) -> Option<&'static str> {
    let label = cell.trim_end().strip_suffix(['=', ':'])?.to_lowercase();
    let known = ["unit", "title", "name"].into_iter().find(|what| label.contains(what));
    known.or(cell.contains('=').then_some(""))
}

/// Returns whether a cell is a number, finite or not, or a time stamp.
fn is_number(cell: &[u8]) -> bool {
    is_value(cell, BLANKS) || fast_float2::parse::<f64, _>(cell).is_ok()
}

/// Splits a line into names for a block. The line must have at least as many names as the first row has filled cells.
/// It may have up to `MOST_OPTIONAL` names more than a row has cells, unless blanks separate the columns. Returns
/// `None` for any other number.
fn name_cells(line: &[u8], block: &Block) -> Option<Vec<String>> {
    let split = cells(line, block.delimiter)?;
    let mut names: Vec<String> = Vec::new();
    let is_split = block.delimiter == BLANKS && split.len() > block.cells;
    for cell in split.iter().map(|cell| text(cell)) {
        match names.last_mut() {
            // `Pos (mm)` is one name.
            Some(last) if is_split && cell.starts_with(['(', '[']) => {
                last.push(' ');
                last.push_str(&cell);
            }
            _ => names.push(cell),
        }
    }
    while names.pop_if(|name| name.is_empty()).is_some() {}
    let optional = if block.delimiter == BLANKS { 0 } else { MOST_OPTIONAL };
    let fits = (block.filled..=block.cells + optional).contains(&names.len());
    fits.then_some(names)
}

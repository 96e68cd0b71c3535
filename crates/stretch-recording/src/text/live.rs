//! The header of a live stream: nothing is read ahead, since the next line may be a minute away.

use std::io::Read;

use crate::{
    ReadOptions, RecordingError,
    clock::time_among,
    names::{are_units, tidy},
    text::dialect::{BLANKS, cells, is_comment},
    text::header::Header,
    text::lines::Lines,
    text::top::{is_whole, name_cells, separator, uncommented},
};

/// Names of a stream's columns, where the time stands among them, and whether the separator is known already.
pub(crate) fn header<R: Read>(
    lines: &mut Lines<R>,
    file: &str,
    options: &ReadOptions,
) -> Result<(Header, usize), RecordingError> {
    let mut header = match &options.columns {
        Some(names) => {
            let cells = names.iter().map(|name| name.clone().into_bytes()).collect();
            Header { names: Header::named(file, 0, cells)?, delimiter: b',' }
        }
        None => named(lines, file, options)?,
    };
    for i in 0..header.names.len() {
        let name = &header.names[i];
        let is_asked = options.required().contains(name) || *name == options.time;
        if let Some(tidied) = tidy(name, None).filter(|t| !is_asked && !header.names.contains(t)) {
            header.names[i] = tidied;
        }
    }
    let time = time_among(&header.names, options).ok_or_else(|| {
        RecordingError::missing_column(file, &options.time, header.names.iter().map(String::as_str))
    })?;
    Ok((header, time))
}

fn named<R: Read>(
    lines: &mut Lines<R>,
    file: &str,
    options: &ReadOptions,
) -> Result<Header, RecordingError> {
    while let Some((row, line)) = lines.next()? {
        // A comment is the header where it names the time.
        let parsed = if is_comment(line) {
            let parsed = of_line(file, row, uncommented(line)).ok();
            parsed.filter(|h| h.names.len() > 1 && time_among(&h.names, options).is_some())
        } else {
            Some(of_line(file, row, line)?)
        };
        if let Some(header) = parsed {
            return Ok(header);
        }
    }
    Err(RecordingError::Empty { file: file.to_owned() })
}

/// A header line, by blanks where no other separator parts it.
fn of_line(file: &str, row: u64, line: &[u8]) -> Result<Header, RecordingError> {
    let header = Header::parse(file, row, line);
    if header.as_ref().is_ok_and(|header| header.names.len() > 1) {
        return header;
    }
    // Whatever stands in brackets behind a blank is a unit.
    let in_brackets = |cell: &[u8]| cell.starts_with(b"(") || cell.starts_with(b"[");
    let split = cells(line, BLANKS).unwrap_or_default();
    let count = split.iter().filter(|cell| !in_brackets(cell)).count();
    match name_cells(line, BLANKS, count, false) {
        Some(cells) if count > 1 => {
            Ok(Header { names: Header::named(file, row, cells)?, delimiter: BLANKS })
        }
        _ => header,
    }
}

/// The separator of a row, where it has as many numbers as there are columns.
pub(crate) fn separator_of(line: &[u8], columns: usize) -> Option<u8> {
    let found = separator(line).filter(|(delimiter, _)| is_whole(line, *delimiter, columns));
    found.map(|(delimiter, _)| delimiter)
}

/// Whether a line below the header says units.
pub(crate) fn is_units(line: &[u8], delimiter: u8) -> bool {
    let cells = cells(line, delimiter).unwrap_or_default();
    let texts: Vec<_> = cells.iter().map(|cell| String::from_utf8_lossy(cell)).collect();
    are_units(texts.iter().map(AsRef::as_ref))
}

//! The header line: its delimiter and the names of the columns.

use std::collections::HashSet;

use stretch_data::{Place, shown};

use crate::{
    RecordingError,
    text::row::{Field, field, number},
};

/// Names of columns in the file's order; an empty name is a column without one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    pub(crate) names: Vec<String>,
    pub(crate) delimiter: u8,
}

impl Header {
    /// Reads a header line that is not blank.
    pub(crate) fn parse(file: &str, row: u64, line: &[u8]) -> Result<Self, RecordingError> {
        let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line);
        let place = |column: String| Place { file: file.to_owned(), row, column };
        if line.starts_with(b"\xff\xfe") || line.starts_with(b"\xfe\xff") {
            return Err(RecordingError::NotUtf8 { at: place("1".into()), value: shown(line) });
        }
        let delimiter = delimiter(line);
        let (mut cells, mut at) = (Vec::new(), 0);
        loop {
            let (content, end) = match field(line, at, delimiter) {
                Field::Plain(content, end) => (content.to_vec(), end),
                Field::Quoted(content, end) => (content, end),
                Field::Broken => {
                    return Err(RecordingError::Quote { at: place((cells.len() + 1).to_string()) });
                }
            };
            cells.push(content);
            if end >= line.len() {
                break;
            }
            at = end + 1;
        }
        let names = Self::named(file, row, cells)?;
        if names.iter().all(|name| number(name.as_bytes()).is_ok()) {
            return Err(RecordingError::NoHeader { file: file.to_owned(), first: shown(line) });
        }
        Ok(Self { names, delimiter })
    }

    /// Names from the cells of a header line.
    pub(crate) fn named(
        file: &str,
        row: u64,
        cells: Vec<Vec<u8>>,
    ) -> Result<Vec<String>, RecordingError> {
        let place =
            |column: usize| Place { file: file.to_owned(), row, column: (column + 1).to_string() };
        let (mut names, mut seen): (Vec<String>, _) = (Vec::new(), HashSet::new());
        for (column, content) in cells.into_iter().enumerate() {
            let name = String::from_utf8(content).map_err(|e| RecordingError::NotUtf8 {
                at: place(column),
                value: shown(e.as_bytes()),
            })?;
            if name.contains(char::is_control) {
                let value = shown(name.as_bytes());
                return Err(RecordingError::ControlCharacter { at: place(column), value });
            }
            if !name.is_empty() && !seen.insert(name.clone()) {
                return Err(RecordingError::DuplicateColumn {
                    file: file.to_owned(),
                    column: name,
                });
            }
            names.push(name);
        }
        Ok(names)
    }

    /// Where column `name` stands.
    pub(crate) fn position(&self, file: &str, name: &str) -> Result<usize, RecordingError> {
        self.names.iter().position(|n| n == name).ok_or_else(|| {
            RecordingError::missing_column(file, name, self.names.iter().map(String::as_str))
        })
    }

    /// What to call the column at `position` in a message.
    pub(crate) fn label(&self, position: usize) -> String {
        match self.names.get(position) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => (position + 1).to_string(),
        }
    }
}

/// `;` or a tab where the header has one and no comma outside quotation marks; else `,`.
fn delimiter(line: &[u8]) -> u8 {
    let mut quoted = false;
    let mut found = b',';
    for &byte in line {
        match byte {
            b'"' => quoted = !quoted,
            b',' if !quoted => return b',',
            b';' | b'\t' if !quoted && found == b',' => found = byte,
            _ => {}
        }
    }
    found
}

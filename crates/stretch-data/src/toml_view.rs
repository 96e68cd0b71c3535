//! A TOML table seen through errors that name file, table and key.

use std::{
    fs,
    io::{self, Read},
    path::Path,
};

use toml::{Table, Value};

use crate::{DataError, nearest::nearest, read_whole};

/// Largest TOML file that is read: these files are written by people.
const LARGEST_BYTES: u64 = 4 << 20;

/// Reads a file, `-` being standard input, and parses it.
pub(crate) fn read_table(path: &Path) -> Result<(String, Table), DataError> {
    let is_stdin = path.as_os_str() == "-";
    let file = if is_stdin { "standard input".into() } else { path.display().to_string() };
    let opened: Box<dyn Read> = if is_stdin {
        let bytes = read_whole(path).map_err(|e| DataError::io(&file, "read it", e))?;
        Box::new(io::Cursor::new(bytes))
    } else {
        Box::new(fs::File::open(path).map_err(|e| DataError::io(&file, "open it", e))?)
    };
    let mut bytes = Vec::new();
    opened
        .take(LARGEST_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| DataError::io(&file, "read it", e))?;
    if bytes.len() as u64 > LARGEST_BYTES {
        let cause = io::Error::other(format!("it is larger than {LARGEST_BYTES} bytes"));
        return Err(DataError::io(&file, "read it", cause));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let upto = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        not_toml(&file, upto, "it is not UTF-8 text")
    })?;
    let table = parse_table(&file, &text)?;
    Ok((file, table))
}

/// Parses a text; `file` stands for it in messages.
pub(crate) fn parse_table(file: &str, text: &str) -> Result<Table, DataError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.parse().map_err(|e: toml::de::Error| {
        let upto = e.span().map_or(0, |span| span.start.min(text.len()));
        not_toml(file, &text.as_bytes()[..upto], e.message())
    })
}

fn not_toml(file: &str, upto: &[u8], message: &str) -> DataError {
    let row = 1 + upto.iter().filter(|&&b| b == b'\n').count() as u64;
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    DataError::NotToml { file: file.to_owned(), row, message }
}

/// One table, and what to call it.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) file: &'a str,
    pub(crate) name: &'a str,
    pub(crate) table: &'a Table,
}

impl<'a> View<'a> {
    pub(crate) fn fail<T>(&self, key: &str, problem: impl Into<String>) -> Result<T, DataError> {
        Err(DataError::Key {
            file: self.file.to_owned(),
            table: self.name.to_owned(),
            key: key.to_owned(),
            problem: problem.into(),
        })
    }

    /// The value of a key that must be there.
    pub(crate) fn value(&self, key: &str) -> Result<&'a Value, DataError> {
        match self.table.get(key) {
            Some(value) => Ok(value),
            None => match nearest(key, self.table.keys().map(String::as_str)) {
                Some(other) => self.fail(key, format!("it is missing (is {other} meant?)")),
                None => self.fail(key, "it is missing"),
            },
        }
    }

    pub(crate) fn text(&self, key: &str) -> Result<&'a str, DataError> {
        match self.value(key)? {
            Value::String(text) => Ok(text),
            other => self.fail(key, format!("{other} is not a text in quotation marks")),
        }
    }

    pub(crate) fn optional_text(&self, key: &str) -> Result<Option<&'a str>, DataError> {
        self.table.get(key).map(|_| self.text(key)).transpose()
    }

    /// A finite number, whole or not.
    pub(crate) fn number(&self, key: &str) -> Result<f64, DataError> {
        match self.value(key)? {
            Value::Float(x) if x.is_finite() => Ok(*x),
            Value::Integer(n) => Ok(*n as f64),
            other => self.fail(key, format!("{other} is not a finite number")),
        }
    }

    pub(crate) fn optional_number(&self, key: &str) -> Result<Option<f64>, DataError> {
        self.table.get(key).map(|_| self.number(key)).transpose()
    }

    /// The tables of an array of tables; none when the key is absent.
    pub(crate) fn tables(&self, key: &str) -> Result<Vec<&'a Table>, DataError> {
        let tables = match self.table.get(key) {
            None => Some(Vec::new()),
            Some(Value::Array(items)) => items.iter().map(Value::as_table).collect(),
            Some(_) => None,
        };
        match tables {
            Some(tables) => Ok(tables),
            None => self.fail(key, format!("write a [[{key}]] table for each")),
        }
    }
}

/// A key as TOML spells it.
pub(crate) fn key_text(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(bare) {
        key.to_owned()
    } else {
        Value::String(key.to_owned()).to_string()
    }
}

/// A number as TOML spells it, with the fewest digits that read back to the same bits.
pub(crate) fn number_text(value: f64) -> String {
    Value::Float(value).to_string()
}

/// A text as TOML spells it.
pub(crate) fn string_text(text: &str) -> String {
    Value::String(text.to_owned()).to_string()
}

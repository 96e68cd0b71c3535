//! A TOML table seen through errors that name file, table, key and value, and that knows its keys.

use toml::{Table, Value};

use crate::error::ProblemError;

/// One table, and what to call it.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) file: &'a str,
    pub(super) name: &'a str,
    pub(super) table: &'a Table,
}

impl<'a> View<'a> {
    pub(super) fn fail<T>(&self, key: &str, problem: impl Into<String>) -> Result<T, ProblemError> {
        Err(ProblemError::Key {
            file: self.file.to_owned(),
            table: self.name.to_owned(),
            key: key.to_owned(),
            problem: problem.into(),
        })
    }

    /// Refuses keys that nothing reads: a mistyped one would silently be no tolerance.
    pub(super) fn only(&self, known: &[&str]) -> Result<(), ProblemError> {
        let Some(key) = self.table.keys().find(|key| !known.contains(&key.as_str())) else {
            return Ok(());
        };
        let meant = stretch_data::nearest(key, known.iter().copied());
        let meant = meant.map_or(String::new(), |other| format!(" (did you mean {other}?)"));
        self.fail(key, format!("nothing reads it{meant}; known are {}", known.join(", ")))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    fn value(&self, key: &str) -> Result<&'a Value, ProblemError> {
        match self.table.get(key) {
            Some(value) => Ok(value),
            None => self.fail(key, "it is missing; write it"),
        }
    }

    pub(super) fn text(&self, key: &str) -> Result<String, ProblemError> {
        match self.value(key)? {
            Value::String(text) => Ok(text.clone()),
            other => self.fail(key, format!("{other} is not a text in quotation marks")),
        }
    }

    pub(super) fn text_or(&self, key: &str, other: &str) -> Result<String, ProblemError> {
        if self.has(key) { self.text(key) } else { Ok(other.to_owned()) }
    }

    pub(super) fn optional_text(&self, key: &str) -> Result<Option<String>, ProblemError> {
        self.has(key).then(|| self.text(key)).transpose()
    }

    /// A finite number, whole or not.
    pub(super) fn number(&self, key: &str) -> Result<f64, ProblemError> {
        match self.value(key)? {
            Value::Float(x) if x.is_finite() => Ok(*x),
            Value::Integer(n) => Ok(*n as f64),
            other => self.fail(key, format!("{other} is not a finite number")),
        }
    }

    pub(super) fn optional_number(&self, key: &str) -> Result<Option<f64>, ProblemError> {
        self.has(key).then(|| self.number(key)).transpose()
    }

    /// A number above 0.
    pub(super) fn above_zero(&self, key: &str, other: f64) -> Result<f64, ProblemError> {
        match self.optional_number(key)?.unwrap_or(other) {
            x if x > 0.0 => Ok(x),
            x => self.fail(key, format!("{x} is not above 0")),
        }
    }

    /// A whole number from 1 on.
    pub(super) fn optional_count(&self, key: &str) -> Result<Option<usize>, ProblemError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(Value::Integer(n)) if *n >= 1 => {
                Ok(Some(usize::try_from(*n).unwrap_or(usize::MAX)))
            }
            Some(other) => self.fail(key, format!("{other} is not a whole number from 1 on")),
        }
    }

    pub(super) fn flag(&self, key: &str) -> Result<bool, ProblemError> {
        match self.table.get(key) {
            None => Ok(false),
            Some(Value::Boolean(flag)) => Ok(*flag),
            Some(other) => self.fail(key, format!("{other} is neither true nor false")),
        }
    }

    /// A text or a list of texts; none where the key is absent.
    pub(super) fn texts(&self, key: &str) -> Result<Vec<String>, ProblemError> {
        match self.table.get(key) {
            None => Ok(Vec::new()),
            Some(Value::String(one)) => Ok(vec![one.clone()]),
            Some(Value::Array(items)) => {
                let texts: Option<Vec<String>> =
                    items.iter().map(|i| i.as_str().map(str::to_owned)).collect();
                texts.map_or_else(|| self.fail(key, "write a list of texts in quotation marks"), Ok)
            }
            Some(other) => self.fail(key, format!("{other} is no list of texts")),
        }
    }

    /// Least and greatest value.
    pub(super) fn range(&self, key: &str) -> Result<[f64; 2], ProblemError> {
        let number = |value: &Value| match value {
            Value::Float(x) => Some(*x),
            Value::Integer(n) => Some(*n as f64),
            _ => None,
        };
        let value = self.value(key)?;
        let ends: Option<Vec<f64>> =
            value.as_array().and_then(|items| items.iter().map(number).collect());
        match ends.as_deref() {
            Some([low, high]) if low < high => Ok([*low, *high]),
            Some([low, high]) => {
                self.fail(key, format!("{low} to {high} is empty; give the least value first"))
            }
            _ => self.fail(key, format!("{value} is not a range; write [least, greatest]")),
        }
    }

    /// The table behind a key.
    pub(super) fn table(&self, key: &str) -> Result<Option<&'a Table>, ProblemError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(Value::Table(table)) => Ok(Some(table)),
            Some(other) => self.fail(key, format!("{other} is no table; write [{key}]")),
        }
    }

    /// The tables of an array of tables; none when the key is absent.
    pub(super) fn tables(&self, key: &str) -> Result<Vec<&'a Table>, ProblemError> {
        let tables = match self.table.get(key) {
            None => Some(Vec::new()),
            Some(Value::Array(items)) => items.iter().map(Value::as_table).collect(),
            Some(_) => None,
        };
        tables.map_or_else(|| self.fail(key, format!("write a [[{key}]] table for each")), Ok)
    }
}

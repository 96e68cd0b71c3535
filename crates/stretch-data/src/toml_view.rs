//! A TOML table seen through errors that name file, table, key and value, and that knows its keys.

use toml::{Table, Value};

use crate::{DataError, nearest::nearest};

/// A table of a [`TomlFile`](crate::TomlFile), and what to call it. Every method fails with [`DataError::Key`].
///
/// ```
/// use stretch_data::TomlFile;
/// let file = TomlFile::parse("servo.toml", "[[parameter]]\nname = 'gain'\nvalue = 10\ntolerence = 1\n")?;
/// let gain = &file.top().tables("parameter")?[0];
/// assert_eq!((gain.text("name")?, gain.optional_number("value")?), ("gain", Some(10.0)));
/// assert_eq!(
///     gain.only(&["name", "value", "tolerance"]).unwrap_err().to_string(),
///     "servo.toml, [[parameter]] 1, key tolerence: nothing reads it (did you mean tolerance?); known are name, value, tolerance"
/// );
/// # Ok::<(), stretch_data::DataError>(())
/// ```
#[derive(Debug, Clone)]
pub struct TomlView<'a> {
    file: &'a str,
    name: String,
    table: &'a Table,
}

impl<'a> TomlView<'a> {
    pub(crate) fn new(file: &'a str, name: String, table: &'a Table) -> Self {
        Self { file, name, table }
    }

    /// The same table under another name.
    pub fn called(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// What the table is called: `[[trial]] 3`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its keys.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> {
        self.table.keys().map(String::as_str)
    }

    /// Whether a key is there.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Whether a list stands behind a key.
    pub fn is_list(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(Value::is_array)
    }

    /// Refuses the value of a key.
    ///
    /// # Errors
    /// What is wrong, always.
    pub fn fail<T>(&self, key: &str, problem: impl Into<String>) -> Result<T, DataError> {
        Err(DataError::Key {
            file: self.file.to_owned(),
            table: self.name.clone(),
            key: key.to_owned(),
            problem: problem.into(),
        })
    }

    /// Refuses keys that nothing reads: a mistyped one would silently be none.
    ///
    /// # Errors
    /// The first key that is not known, and which one may be meant.
    pub fn only(&self, known: &[&str]) -> Result<(), DataError> {
        let Some(key) = self.keys().find(|key| !known.contains(key)) else {
            return Ok(());
        };
        let meant = nearest(key, known.iter().copied());
        let meant = meant.map_or(String::new(), |other| format!(" (did you mean {other}?)"));
        self.fail(key, format!("nothing reads it{meant}; known are {}", known.join(", ")))
    }

    /// The value of a key that must be there.
    pub(crate) fn value(&self, key: &str) -> Result<&'a Value, DataError> {
        match self.table.get(key) {
            Some(value) => Ok(value),
            None => match nearest(key, self.keys()) {
                Some(other) => self.fail(key, format!("it is missing (is {other} meant?)")),
                None => self.fail(key, "it is missing; write it"),
            },
        }
    }

    /// A text.
    ///
    /// # Errors
    /// A key that is missing, or holds something else.
    pub fn text(&self, key: &str) -> Result<&'a str, DataError> {
        match self.value(key)? {
            Value::String(text) => Ok(text),
            other => self.fail(key, format!("{other} is not a text in quotation marks")),
        }
    }

    /// A text; none where the key is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn optional_text(&self, key: &str) -> Result<Option<&'a str>, DataError> {
        self.has(key).then(|| self.text(key)).transpose()
    }

    /// A finite number, whole or not.
    ///
    /// # Errors
    /// A key that is missing, or holds something else.
    pub fn number(&self, key: &str) -> Result<f64, DataError> {
        match self.value(key)? {
            Value::Float(x) if x.is_finite() => Ok(*x),
            Value::Integer(n) => Ok(*n as f64),
            other => self.fail(key, format!("{other} is not a finite number")),
        }
    }

    /// A finite number; none where the key is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn optional_number(&self, key: &str) -> Result<Option<f64>, DataError> {
        self.has(key).then(|| self.number(key)).transpose()
    }

    /// A number above 0; none where the key is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn above_zero(&self, key: &str) -> Result<Option<f64>, DataError> {
        match self.optional_number(key)? {
            Some(x) if x <= 0.0 => self.fail(key, format!("{x} is not above 0")),
            other => Ok(other),
        }
    }

    /// A whole number from 1 on; none where the key is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn optional_count(&self, key: &str) -> Result<Option<usize>, DataError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(Value::Integer(n)) if *n >= 1 => {
                Ok(Some(usize::try_from(*n).unwrap_or(usize::MAX)))
            }
            Some(other) => self.fail(key, format!("{other} is not a whole number from 1 on")),
        }
    }

    /// Whether a key is set to true; false where it is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn flag(&self, key: &str) -> Result<bool, DataError> {
        match self.table.get(key) {
            None => Ok(false),
            Some(Value::Boolean(flag)) => Ok(*flag),
            Some(other) => self.fail(key, format!("{other} is neither true nor false")),
        }
    }

    /// A text or a list of texts; none where the key is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn texts(&self, key: &str) -> Result<Vec<String>, DataError> {
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
    ///
    /// # Errors
    /// A key that is missing, or holds something else than two numbers that rise.
    pub fn range(&self, key: &str) -> Result<[f64; 2], DataError> {
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

    /// The table behind a key, called `[key]`; none where the key is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn table(&self, key: &str) -> Result<Option<TomlView<'a>>, DataError> {
        match self.table.get(key) {
            None => Ok(None),
            Some(Value::Table(table)) => {
                Ok(Some(TomlView { name: format!("[{key}]"), table, ..*self }))
            }
            Some(other) => self.fail(key, format!("{other} is no table; write [{key}]")),
        }
    }

    /// The tables of an array of tables, called `[[key]] 1` and so on; none where the key is absent.
    ///
    /// # Errors
    /// A key that holds something else.
    pub fn tables(&self, key: &str) -> Result<Vec<TomlView<'a>>, DataError> {
        let tables: Option<Vec<&Table>> = match self.table.get(key) {
            None => Some(Vec::new()),
            Some(Value::Array(items)) => items.iter().map(Value::as_table).collect(),
            Some(_) => None,
        };
        let Some(tables) = tables else {
            return self.fail(key, format!("write a [[{key}]] table for each"));
        };
        let one = |(i, table)| TomlView { name: format!("[[{key}]] {}", i + 1), table, ..*self };
        Ok(tables.into_iter().enumerate().map(one).collect())
    }
}

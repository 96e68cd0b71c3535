//! A TOML file that people write, read through serde: errors name the file, the row, the key and the value.

use std::{
    fs,
    io::{self, Read},
    path::Path,
};

use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::{
    DataError,
    files::read_whole,
    nearest::nearest,
    toml_node::{Node, Refusal},
};

/// Largest TOML file that is read: these files are written by people.
const LARGEST_BYTES: u64 = 4 << 20;

/// The text of a TOML file, and what to call it in messages.
///
/// ```
/// use serde::Deserialize;
/// use stretch_data::TomlFile;
/// #[derive(Debug, Deserialize)]
/// #[serde(deny_unknown_fields)]
/// struct Servo {
///     gain: f64,
///     #[serde(default)]
///     columns: Vec<String>,
/// }
/// let servo: Servo = TomlFile::new("servo.toml", "gain = 10\ncolumns = 'angle'\n").parse()?;
/// assert_eq!((servo.gain, &servo.columns[..]), (10.0, &["angle".to_owned()][..]));
/// let fails = |text: &str| TomlFile::new("servo.toml", text).parse::<Servo>().unwrap_err().to_string();
/// assert_eq!(fails("gain = 'ten'"), "servo.toml, row 1, key gain: \"ten\" is not a number");
/// assert_eq!(
///     fails("gain = 10\ncolumms = []"),
///     "servo.toml, row 2, key columms: nothing reads it (did you mean columns?); known are gain, columns"
/// );
/// assert!(fails("gain = 10\ntau_s = = 0.2").starts_with("servo.toml, row 2: this is not TOML"));
/// # Ok::<(), stretch_data::DataError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TomlFile {
    file: String,
    text: String,
}

impl TomlFile {
    /// A text; `file` stands for it in messages. A byte-order mark is passed over.
    pub fn new(file: &str, text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self { file: file.to_owned(), text: text.to_owned() }
    }

    /// Reads a file, `-` being standard input.
    ///
    /// # Errors
    /// [`DataError::File`], also for what is larger than 4 MiB, and [`DataError::NotToml`] for what is not UTF-8.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, DataError> {
        let path = path.as_ref();
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
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self::new(&file, &text)),
            Err(error) => {
                let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
                let message = "it is not UTF-8 text".to_owned();
                Err(DataError::NotToml { file, row: row_after(valid), message })
            }
        }
    }

    /// The value that the text holds. A single text stands for a list of one text, and numbers are finite.
    ///
    /// # Errors
    /// [`DataError::NotToml`], or [`DataError::Key`] for what `T` does not accept.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, DataError> {
        let top = self.top()?;
        serde_path_to_error::deserialize(Node(&top)).map_err(|error| {
            let path = error.path().clone();
            let key = match path.iter().next() {
                Some(_) => path.to_string(),
                None => String::new(),
            };
            let Refusal { missing, problem } = error.into_inner();
            let Some(missing) = missing else { return self.error(&key, problem) };
            let near = match find(&top, path.iter().map(part)).1 {
                DeValue::Table(table) => nearest(missing, table.keys().map(|k| &**k.get_ref())),
                _ => None,
            };
            let near = near.map_or("; write it".to_owned(), |near| format!(" (is {near} meant?)"));
            let key = if key.is_empty() { missing.to_owned() } else { format!("{key}.{missing}") };
            self.error(&key, problem + &near)
        })
    }

    /// The error that something is wrong with the value at a key, such as `trial[0].file`.
    pub fn error(&self, key: &str, problem: impl Into<String>) -> DataError {
        let parts = key.split(['.', '[', ']']).filter(|part| !part.is_empty());
        let start = self.top().ok().and_then(|top| find(&top, parts.map(str::to_owned)).0);
        DataError::Key {
            file: self.file.clone(),
            row: start.map(|start| row_after(&self.text.as_bytes()[..start])),
            key: key.to_owned(),
            problem: problem.into(),
        }
    }

    fn top(&self) -> Result<DeValue<'_>, DataError> {
        let table = DeTable::parse(&self.text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start.min(self.text.len()));
            let message = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
            let row = row_after(&self.text.as_bytes()[..start]);
            DataError::NotToml { file: self.file.clone(), row, message }
        })?;
        Ok(DeValue::Table(table.into_inner()))
    }
}

/// The row in which the text behind some bytes begins.
fn row_after(bytes: &[u8]) -> u64 {
    1 + bytes.iter().filter(|&&b| b == b'\n').count() as u64
}

fn part(segment: &Segment) -> String {
    match segment {
        Segment::Seq { index } => index.to_string(),
        Segment::Map { key } => key.clone(),
        Segment::Enum { .. } | Segment::Unknown => String::new(),
    }
}

/// The innermost value along a path that is there, and where it begins; the top begins nowhere.
fn find<'a, 'i>(
    top: &'a DeValue<'i>,
    path: impl Iterator<Item = String>,
) -> (Option<usize>, &'a DeValue<'i>) {
    let begin = |value: &Spanned<DeValue<'_>>| value.span().start;
    let mut found = (None, top);
    for part in path {
        let inner = match found.1 {
            DeValue::Table(table) => table.get(part.as_str()),
            DeValue::Array(items) => part.parse().ok().and_then(|index: usize| items.get(index)),
            _ => None,
        };
        let Some(inner) = inner else { break };
        found = (Some(begin(inner)), inner.get_ref());
    }
    found
}

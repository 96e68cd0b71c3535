//! TOML files written by people, read through serde. Errors name the file, the row, the key and the
//! value.

use std::{fmt::Display, io, path::Path};

use serde::{
    Deserializer,
    de::{
        DeserializeOwned, Error, Expected, IntoDeserializer, Unexpected, Visitor,
        value::{MapDeserializer, SeqDeserializer},
    },
    forward_to_deserialize_any,
};
use serde_path_to_error::Segment;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::{DataError, files::read_whole, nearest};

/// Largest TOML file that is read, bytes. People write these files, so they are small.
const LARGEST_BYTES: usize = 4 << 20;

/// The text of a TOML file, and its name in messages.
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
///     "servo.toml, row 2, key columms: unknown (did you mean columns?); known are gain, columns"
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
    /// Wraps a text that messages call `file`. A byte-order mark is ignored.
    pub fn new(file: &str, text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self { file: file.to_owned(), text: text.to_owned() }
    }

    /// Reads a file; `-` is standard input.
    ///
    /// # Errors
    /// [`DataError::File`], also for a file of more than 4 MiB; [`DataError::NotToml`] for text
    /// that is not UTF-8.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, DataError> {
        let path = path.as_ref();
        let is_stdin = path.as_os_str() == "-";
        let file = if is_stdin { "standard input".into() } else { path.display().to_string() };
        let action = if is_stdin { "read it" } else { "open it" };
        let bytes = read_whole(path).map_err(|e| DataError::io(&file, action, e))?;
        if bytes.len() > LARGEST_BYTES {
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

    /// Deserializes the text. A single string is accepted as a list of one string, and numbers must
    /// be finite.
    ///
    /// # Errors
    /// [`DataError::NotToml`], or [`DataError::Key`] for a value that `T` does not accept.
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

    /// Returns an error about the value at a key, such as `trial[0].file`.
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

/// Returns the row that contains the position after these bytes.
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

/// Returns the innermost existing value along a path, and its position. The top-level table has no
/// position.
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

/// A TOML value as a deserializer. A single string is accepted as a list of one string, and every
/// number must be finite.
#[derive(Clone, Copy)]
struct Node<'de>(&'de DeValue<'de>);

impl<'de> IntoDeserializer<'de, Refusal> for Node<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Node<'de> {
    type Error = Refusal;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::String(text) => visitor.visit_borrowed_str(text),
            DeValue::Integer(n) => match i64::from_str_radix(n.as_str(), n.radix()) {
                Ok(n) => visitor.visit_i64(n),
                Err(_) => Err(Refusal::custom(format!("{n} has too many digits"))),
            },
            DeValue::Float(x) => match x.as_str().parse::<f64>() {
                Ok(x) if x.is_finite() => visitor.visit_f64(x),
                _ => Err(Refusal::custom(format!("{x} is not a finite number"))),
            },
            DeValue::Boolean(flag) => visitor.visit_bool(*flag),
            DeValue::Datetime(date) => {
                Err(Refusal::custom(format!("{date} is not {}", words(&visitor))))
            }
            DeValue::Array(items) => visitor
                .visit_seq(SeqDeserializer::new(items.iter().map(|item| Node(item.get_ref())))),
            DeValue::Table(table) => {
                let entries =
                    table.iter().map(|(key, value)| (&**key.get_ref(), Node(value.get_ref())));
                visitor.visit_map(MapDeserializer::new(entries))
            }
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        visitor.visit_newtype_struct(self)
    }

    /// Refuses lists: a struct with derived deserialization would accept a list of its fields in order.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::Array(_) => Err(Refusal::invalid_type(Unexpected::Seq, &visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::String(_) => visitor.visit_seq(SeqDeserializer::new([self].into_iter())),
            DeValue::Table(_) => Err(Refusal::custom(
                "this is a single table; write one table in double brackets per entry",
            )),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refusal> {
        match self.0 {
            DeValue::String(text) => visitor.visit_enum((&**text).into_deserializer()),
            _ => Err(Refusal::custom(format!("write one of {}", names.join(", ")))),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct tuple tuple_struct map identifier ignored_any
    }
}

/// The error of `Node`: why serde refuses a value.
#[derive(Debug)]
struct Refusal {
    /// The missing key, if that is the reason.
    missing: Option<&'static str>,
    problem: String,
}

impl Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.problem)
    }
}

impl std::error::Error for Refusal {}

impl Error for Refusal {
    fn custom<T: Display>(problem: T) -> Self {
        Self { missing: None, problem: problem.to_string() }
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        let found = match found {
            Unexpected::Str(text) => format!("{text:?}"),
            Unexpected::Float(x) => format!("{x:?}"),
            Unexpected::Signed(n) => n.to_string(),
            Unexpected::Bool(flag) => flag.to_string(),
            Unexpected::Seq => "a list".to_owned(),
            Unexpected::Map => "a table".to_owned(),
            other => other.to_string(),
        };
        // The expectation may contain a template for the value: write { value = ... }.
        Self::custom(format!("{found} is not {}", words(expected).replace("...", &found)))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn missing_field(field: &'static str) -> Self {
        Self { missing: Some(field), problem: "it is missing".to_owned() }
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        Self::custom(format!("unknown{}; known are {}", meant(field, known), known.join(", ")))
    }

    fn unknown_variant(variant: &str, known: &'static [&'static str]) -> Self {
        let known_names = known.join(", ");
        Self::custom(format!("{variant:?} is none of {known_names}{}", meant(variant, known)))
    }
}

fn meant(given: &str, known: &[&str]) -> String {
    nearest(given, known.iter().copied())
        .map_or(String::new(), |one| format!(" (did you mean {one}?)"))
}

/// Translates serde's description of an expected value into plain words.
fn words(expected: &dyn Expected) -> String {
    let expected = expected.to_string();
    match expected.as_str() {
        "f64" => "a number",
        "usize" => "a whole number from 0 on",
        "a nonzero usize" => "a whole number from 1 on",
        "a boolean" => "true or false",
        "a string" | "path string" => "a text in quotation marks",
        "a sequence" => "a list in brackets, or tables under headers in double brackets",
        "a map" => "a table",
        table if table.starts_with("struct ") => "a table",
        other => other,
    }
    .to_owned()
}

//! A TOML file that people write: read, parsed, and refused with the row in which it is none.

use std::{
    fs,
    io::{self, Read},
    path::Path,
};

use toml::Table;

use stretch_files::read_whole;

use crate::{DataError, toml_view::TomlView};

/// Largest TOML file that is read: these files are written by people.
const LARGEST_BYTES: u64 = 4 << 20;

/// A TOML file, and what to call it in messages.
///
/// ```
/// use stretch_data::TomlFile;
/// let file = TomlFile::parse("servo.toml", "gain = 10\n[motor]\ntau_s = 0.2\n")?;
/// let top = file.top();
/// assert_eq!(top.number("gain")?, 10.0);
/// let motor = top.table("motor")?.expect("there is one");
/// assert_eq!(motor.text("tau_s").unwrap_err().to_string(), "servo.toml, [motor], key tau_s: 0.2 is not a text in quotation marks");
/// let error = TomlFile::parse("servo.toml", "gain = 10\ntau_s = = 0.2").unwrap_err();
/// assert!(error.to_string().starts_with("servo.toml, row 2: this is not TOML"));
/// # Ok::<(), stretch_data::DataError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TomlFile {
    file: String,
    table: Table,
}

impl TomlFile {
    /// Reads a file, `-` being standard input, and parses it.
    ///
    /// # Errors
    /// [`DataError::File`], also for what is larger than 4 MiB, and [`DataError::NotToml`].
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
        let text = String::from_utf8(bytes).map_err(|e| {
            let upto = &e.as_bytes()[..e.utf8_error().valid_up_to()];
            not_toml(&file, upto, "it is not UTF-8 text")
        })?;
        Self::parse(&file, &text)
    }

    /// Parses a text; `file` stands for it in messages. A byte-order mark is passed over.
    ///
    /// # Errors
    /// [`DataError::NotToml`].
    pub fn parse(file: &str, text: &str) -> Result<Self, DataError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let table = text.parse().map_err(|e: toml::de::Error| {
            let upto = e.span().map_or(0, |span| span.start.min(text.len()));
            not_toml(file, &text.as_bytes()[..upto], e.message())
        })?;
        Ok(Self { file: file.to_owned(), table })
    }

    /// The keys outside of any table.
    pub fn top(&self) -> TomlView<'_> {
        TomlView::new(&self.file, "the top of the file".into(), &self.table)
    }
}

fn not_toml(file: &str, upto: &[u8], message: &str) -> DataError {
    let row = 1 + upto.iter().filter(|&&b| b == b'\n').count() as u64;
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    DataError::NotToml { file: file.to_owned(), row, message }
}

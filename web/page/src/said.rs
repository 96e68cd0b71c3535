//! Errors with the same sentences as in the program, and JSON.

use std::{error::Error, fmt};

use serde::{Serialize, de::DeserializeOwned};
use stretch_data::{error_sentence, rename_options};

/// Options of the program, and the fields of the page with the same meaning.
const FIELDS: [(&str, &str); 7] = [
    ("adc", "“Bits, signal at code 0, signal at the last code”"),
    ("columns", "“Column names”"),
    ("model", "“Model”"),
    ("reference", "“Reference”"),
    ("sample-rate", "“Samples per second”"),
    ("signal", "“Signal”"),
    ("time", "“Time column”"),
];

/// Writes options of the program as fields of the page: `--time COLUMN:ms` becomes `“Time column” COLUMN:ms`. The text
/// marks the command `stretch convert` as one of the program, because the page does not have it.
pub(crate) fn in_page(text: &str) -> String {
    rename_options(text, &FIELDS).replace("stretch convert", "the program: stretch convert")
}

/// An error as one sentence that states the problem, its place, and the remedy.
#[derive(Debug)]
pub(crate) struct Said(pub(crate) String);

impl fmt::Display for Said {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl From<Said> for wasm_bindgen::JsError {
    fn from(said: Said) -> Self {
        Self::new(&in_page(&said.0))
    }
}

impl<E: Error> From<E> for Said {
    fn from(error: E) -> Self {
        Self(error_sentence(&error))
    }
}

pub(crate) fn to_json(value: &impl Serialize) -> Result<String, Said> {
    Ok(serde_json::to_string(value)?)
}

pub(crate) fn from_json<T: DeserializeOwned>(text: &str) -> Result<T, Said> {
    Ok(serde_json::from_str(text)?)
}

//! Errors as Python exceptions, with the sentence that the program prints.

use std::fmt::Display;

use pyo3::{create_exception, exceptions::PyValueError, prelude::*};

create_exception!(
    stretch_gap,
    StretchError,
    PyValueError,
    "Error in the data or in the arguments.

The message is one sentence that names the wrong value and says what to do."
);

/// Returns an exception with the error's sentence.
pub(crate) fn said(error: impl Display) -> PyErr {
    StretchError::new_err(in_python(&error.to_string()))
}

/// Options of the program, and the arguments in Python with the same meaning.
const ARGUMENTS: [(&str, &str); 6] = [
    ("from", "diagnosis"),
    ("grid", "grid_hz"),
    ("model", "model"),
    ("rate", "rate"),
    ("sample-rate", "rate_hz"),
    ("time", "time"),
];

/// Writes options of the program as arguments in Python: `--time COLUMN:ms` becomes `time=COLUMN:ms`. Options without
/// an argument in Python stay, and those of a whole command, such as `stretch convert --grid 100`.
pub(crate) fn in_python(text: &str) -> String {
    let mut parts = text.split("--");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(part.len());
        let command = out.rfind("stretch ").map_or("; ", |at| &out[at..]);
        let is_command = !command.contains([';', ',', '(', ':']) && !command.contains(" and ");
        match ARGUMENTS.iter().find(|(option, _)| *option == &part[..end]) {
            Some((_, argument)) if !is_command && (out.is_empty() || out.ends_with([' ', '('])) => {
                out += &format!("{argument}={}", part[end..].trim_start());
            }
            _ => out += &format!("--{part}"),
        }
    }
    out
}

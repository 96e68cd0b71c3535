//! Errors as Python exceptions, with the sentence that the program prints.

use std::fmt::Display;

use pyo3::{create_exception, exceptions::PyValueError, prelude::*};
use stretch_data::rename_options;

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
    ("from", "diagnosis="),
    ("grid", "grid_hz="),
    ("model", "model="),
    ("rate", "rate="),
    ("sample-rate", "rate_hz="),
    ("time", "time="),
];

/// Writes options of the program as arguments in Python: `--time COLUMN:ms` becomes `time=COLUMN:ms`.
pub(crate) fn in_python(text: &str) -> String {
    rename_options(text, &ARGUMENTS)
}

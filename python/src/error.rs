//! Errors as Python exceptions, with the same sentence that the program prints.

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
    StretchError::new_err(error.to_string())
}

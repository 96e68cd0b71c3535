//! Errors as Python sees them: the sentence that the program would say.

use std::fmt::Display;

use pyo3::{create_exception, exceptions::PyValueError, prelude::*};

create_exception!(
    stretch_gap,
    StretchError,
    PyValueError,
    "What is wrong with the data or the question, and what to do about it, in a sentence."
);

/// The sentence as an exception.
pub(crate) fn said(error: impl Display) -> PyErr {
    StretchError::new_err(error.to_string())
}

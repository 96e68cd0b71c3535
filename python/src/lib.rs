//! The native part of the Python package `stretch`.
//!
//! What Rust does is here: calibrations and diagnoses. What Python does better is in `package/stretch`: taking whatever
//! holds numbers apart, and showing results.

mod calibration;
mod error;
mod problem;
mod receptor;
mod recording;
mod source;
mod watched;

use pyo3::prelude::*;

/// Native part of the package: use `stretch`.
#[pymodule]
mod _stretch {
    #[pymodule_export]
    use crate::calibration::{Record, calibrate, evaluate};
    #[pymodule_export]
    use crate::error::StretchError;
    #[pymodule_export]
    use crate::problem::{Entries, wrapper};
    #[pymodule_export]
    use crate::receptor::{Reading, Receptor};
    #[pymodule_export]
    use crate::source::Refused;

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

//! The native part of the Python package `stretch_gap`.
//!
//! Calibrations and diagnoses are computed here, in Rust. The Python code in `package/stretch_gap`
//! accepts recordings in various forms and shows results.

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
    use crate::calibration::{CalibrationRecord, calibrate, evaluate};
    #[pymodule_export]
    use crate::error::StretchError;
    #[pymodule_export]
    use crate::problem::{Entries, FixedEntries, comment, identifier, wrappers};
    #[pymodule_export]
    use crate::receptor::{Reading, Receptor};
    #[pymodule_export]
    use crate::recording::{read_arrays, read_file, tidy_column, unit_of};
    #[pymodule_export]
    use crate::source::Refused;

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        stretch_gap::cap_threads();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

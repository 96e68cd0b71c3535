//! Makes the functions of `stretch-fleet` available in `datafusion-python`, as capsules of
//! `datafusion-ffi`.

use std::{ffi::CStr, sync::Arc};

use datafusion::logical_expr::{AggregateUDF, ScalarUDF};
use datafusion_ffi::{udaf::FFI_AggregateUDF, udf::FFI_ScalarUDF};
use pyo3::{
    prelude::*,
    types::{PyCapsule, PyList},
};

/// Names that `datafusion-python` looks for.
const AGGREGATE: &CStr = c"datafusion_aggregate_udf";
const SCALAR: &CStr = c"datafusion_scalar_udf";

/// An aggregate function, which `datafusion.udaf` accepts.
#[pyclass(frozen, module = "stretch_datafusion")]
#[derive(Debug)]
struct Aggregate(Arc<AggregateUDF>);

#[pymethods]
impl Aggregate {
    /// Its name in SQL.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    fn __repr__(&self) -> String {
        format!("Aggregate({})", self.0.name())
    }

    fn __datafusion_aggregate_udf__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        PyCapsule::new_with_value(py, FFI_AggregateUDF::from(self.0.clone()), AGGREGATE)
    }
}

/// A scalar function, which `datafusion.udf` accepts.
#[pyclass(frozen, module = "stretch_datafusion")]
#[derive(Debug)]
struct Scalar(Arc<ScalarUDF>);

#[pymethods]
impl Scalar {
    /// Its name in SQL.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    fn __repr__(&self) -> String {
        format!("Scalar({})", self.0.name())
    }

    fn __datafusion_scalar_udf__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        PyCapsule::new_with_value(py, FFI_ScalarUDF::from(self.0.clone()), SCALAR)
    }
}

/// Returns all aggregate functions.
#[pyfunction]
fn aggregates(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    PyList::new(py, stretch_fleet::aggregates().into_iter().map(Aggregate).collect::<Vec<_>>())
}

/// Returns all scalar functions.
#[pyfunction]
fn scalars(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    PyList::new(py, stretch_fleet::scalars().into_iter().map(Scalar).collect::<Vec<_>>())
}

/// Adds all functions to a `datafusion.SessionContext`, so that its SQL knows them.
#[pyfunction]
fn register(context: &Bound<'_, PyAny>) -> PyResult<()> {
    let datafusion = context.py().import("datafusion")?;
    for aggregate in aggregates(context.py())? {
        context.call_method1("register_udaf", (datafusion.call_method1("udaf", (aggregate,))?,))?;
    }
    for scalar in scalars(context.py())? {
        context.call_method1("register_udf", (datafusion.call_method1("udf", (scalar,))?,))?;
    }
    Ok(())
}

/// Calibrations of stretch sensors as functions of SQL, for a `datafusion` package with the same
/// major version.
#[pymodule]
fn stretch_datafusion(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<Aggregate>()?;
    module.add_class::<Scalar>()?;
    module.add_function(wrap_pyfunction!(aggregates, module)?)?;
    module.add_function(wrap_pyfunction!(scalars, module)?)?;
    module.add_function(wrap_pyfunction!(register, module)?)
}

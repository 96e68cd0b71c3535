//! A calibration that runs live.

use pyo3::{prelude::*, types::PyDict};
use stretch_calibrate::LiveReceptor;
use stretch_core::Target;

/// What a receptor answers for one sample.
#[pyclass(frozen, module = "stretch_gap", get_all)]
#[derive(Debug, Clone)]
pub(crate) struct Reading {
    /// The estimate, in the reference's unit.
    estimate: f64,
    /// Its rate, in that unit per second; NaN of a line or a curve while the rate estimator warms up.
    rate: f64,
    /// Which way it moves: `rising` or `falling`.
    branch: &'static str,
    /// Whether the sample lay where the calibration was fitted: `inside`, else what was clamped.
    domain: String,
    /// Standard deviation of the estimate, where the model knows it.
    sd: Option<f64>,
}

#[pymethods]
impl Reading {
    fn __repr__(&self) -> String {
        let Self { estimate, rate, branch, domain, .. } = self;
        format!("Reading(estimate={estimate}, rate={rate}, branch='{branch}', domain='{domain}')")
    }
}

/// A calibration that takes one sample after the other and minds their time stamps.
#[pyclass(module = "stretch_gap")]
#[derive(Debug)]
pub(crate) struct Receptor {
    pub(crate) live: LiveReceptor,
}

#[pymethods]
impl Receptor {
    /// The reading of the next sample; None while the rate estimator warms up, and where a sample is not a number.
    ///
    /// Missing ticks count as missing samples: a few are bridged, a longer gap warms up again.
    fn step(&mut self, time_s: f64, signal: f64) -> Option<Reading> {
        let reading = self.live.step(time_s, signal).ok()?;
        Some(Reading {
            estimate: reading.estimate,
            rate: reading.rate,
            branch: Target::Direct.branch_name(reading.branch),
            domain: reading.domain.to_string(),
            sd: reading.sd,
        })
    }

    /// The pressure of the samples to come, for a calibration that needs it.
    fn set_pressure(&mut self, pressure: f64) {
        self.live.set_pressure(pressure);
    }

    /// What was wrong with the time stamps so far: samples missing, jittered, and running backwards.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let faults = self.live.faults();
        let dict = PyDict::new(py);
        dict.set_item("missing", faults.missing)?;
        dict.set_item("jittered", faults.jittered)?;
        dict.set_item("backwards", faults.backwards)?;
        Ok(dict)
    }
}

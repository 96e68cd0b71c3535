//! A calibration that runs live.

use pyo3::{
    prelude::*,
    types::{IntoPyDict, PyDict},
};
use stretch_calibrate::{Faults, LiveReceptor};
use stretch_core::{Seconds, Target};

/// Estimate for one sample, as returned by `Receptor.step`.
#[pyclass(frozen, module = "stretch_gap", get_all)]
#[derive(Debug, Clone)]
pub(crate) struct Reading {
    /// Estimate, float, in the unit of the reference.
    estimate: f64,
    /// Rate of change of the estimate, float, in the unit of the reference per second.
    ///
    /// The rate is NaN while the rate estimator of a line or of a curve still warms up, because these two models give estimates
    /// without a rate.
    rate: f64,
    /// Direction in which the reference moves, `"rising"` or `"falling"`.
    branch: &'static str,
    /// Position of the sample relative to the fitted range.
    ///
    /// The value is `"inside"`, `"signal_clamped"`, `"rate_clamped"`, `"both_clamped"` or `"estimate_clamped"`. A signal or a
    /// rate outside the fitted range is clamped to the end of the range, because a calibration is never extrapolated.
    /// `"estimate_clamped"` means that only the estimate was limited to the fitted range.
    domain: String,
    /// Standard deviation of the estimate in the unit of the reference, or None if the model does not estimate it.
    sd: Option<f64>,
}

#[pymethods]
impl Reading {
    fn __repr__(&self) -> String {
        let Self { estimate, rate, branch, domain, .. } = self;
        format!("Reading(estimate={estimate}, rate={rate}, branch='{branch}', domain='{domain}')")
    }
}

/// Calibration that runs live, one sample at a time.
///
/// `Calibration.receptor` creates a receptor. The receptor checks the time stamps of the samples and counts their faults.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import stretch_gap
/// >>> time_s = np.arange(0, 20, 0.01)
/// >>> angle_deg = 45 - 45 * np.cos(1.5 * time_s)
/// >>> gauge_v = 0.002 * angle_deg + 1e-4 * np.random.default_rng(0).normal(size=time_s.size)
/// >>> calibration = stretch_gap.calibrate(gauge_v, angle_deg, 100.0, model="linear", reference_name="angle_deg")
/// >>> receptor = calibration.receptor()
#[pyclass(module = "stretch_gap")]
#[derive(Debug)]
pub(crate) struct Receptor {
    pub(crate) live: LiveReceptor,
    pub(crate) target: Target,
}

#[pymethods]
impl Receptor {
    /// Process the next sample.
    ///
    /// Parameters
    /// ----------
    /// time_s : float
    ///     Time of the sample in seconds. Time stamps must increase. If samples are missing, a short gap is bridged, and a longer
    ///     gap restarts the warm-up.
    /// signal : float
    ///     Value of the signal, in the unit of the signal that was calibrated.
    ///
    /// Returns
    /// -------
    /// Reading or None
    ///     Estimate for the sample. None if there is no estimate, because the rate estimator still warms up or because the
    ///     sample is not a number.
    ///
    /// Examples
    /// --------
    /// >>> readings = [receptor.step(time_s, volt) for time_s, volt in zip(time_s[:100], gauge_v)]
    /// >>> assert abs(readings[-1].estimate - angle_deg[99]) < 1.0
    fn step(&mut self, time_s: f64, signal: f64) -> Option<Reading> {
        let reading = self.live.step(Seconds(time_s), signal).ok()?;
        Some(Reading {
            estimate: reading.estimate,
            rate: reading.rate,
            branch: self.target.branch_name(reading.branch),
            domain: reading.domain.to_string(),
            sd: reading.sd,
        })
    }

    /// Set the pressure of the following samples.
    ///
    /// A calibration needs the pressure only if its gauge depends on the pressure.
    ///
    /// Parameters
    /// ----------
    /// pressure : float
    ///     Pressure in kPa.
    ///
    /// Examples
    /// --------
    /// >>> receptor.set_pressure(101.3)
    fn set_pressure(&mut self, pressure: f64) {
        self.live.set_pressure(pressure);
    }

    /// Number of faulty time stamps so far, by kind.
    ///
    /// `missing` counts samples that did not arrive, `jittered` samples that were early or late by more than a fifth of the
    /// sample interval, and `backwards` time stamps that were repeated or ran backwards.
    #[getter]
    fn faults<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Faults { missing, jittered, backwards } = self.live.faults();
        [("missing", missing), ("jittered", jittered), ("backwards", backwards)].into_py_dict(py)
    }
}

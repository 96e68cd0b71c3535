//! Python bindings for making, applying and evaluating calibrations.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::{prelude::*, types::PyDict};
use serde::Serialize;
use stretch_calibrate::{
    CalibrateError, Doubt, FitReport, LiveReceptor, ModelKind, ModelRow, Options, Robust,
    SpellingError, choose_model, evaluation_doubts, explains_little, explains_nothing, parse_rate,
    pressure_column, without_clipped,
};
use stretch_core::{Calibration, Target};
use stretch_data::{Channel, Trial};
use stretch_gap::Diagnosis;
use stretch_problem::causes;
use stretch_sleeve::{GaugeCalibration, calibrate_gauge};

use crate::{
    error::said,
    receptor::Receptor,
    recording::{Recording, trials},
    watched::watched,
};

/// A calibration.
#[pyclass(frozen, module = "stretch_gap")]
#[derive(Debug)]
pub(crate) struct CalibrationRecord {
    gauge: GaugeCalibration,
}

impl CalibrationRecord {
    fn calibration(&self) -> &Calibration {
        self.gauge.calibration()
    }
}

/// Options of a calibration, under the names used in the Python package.
#[derive(Debug, FromPyObject)]
pub(crate) struct Choices {
    #[pyo3(item)]
    model: String,
    #[pyo3(item)]
    signal: String,
    #[pyo3(item)]
    reference: String,
    #[pyo3(item)]
    paper: bool,
    #[pyo3(item)]
    rate: Option<String>,
    #[pyo3(item)]
    robust: Option<String>,
    #[pyo3(item)]
    signal_zero: Option<f64>,
    #[pyo3(item)]
    rest_length: Option<f64>,
    #[pyo3(item)]
    dead_band: Option<f64>,
    #[pyo3(item)]
    date: String,
    #[pyo3(item)]
    diagnosis: Option<String>,
}

impl Choices {
    /// Converts the options to those of the Rust crates. The model is `None` if it is to be chosen
    /// automatically.
    fn options(&self) -> PyResult<(Options, Option<ModelKind>)> {
        let base = if self.paper { Options::paper() } else { Options::default() };
        let model = match self.model.as_str() {
            "auto" => None,
            name => Some(name.parse::<ModelKind>().map_err(said)?),
        };
        let robust = match self.robust.as_deref() {
            None => Robust::Off,
            Some("bisquare") => Robust::Bisquare,
            Some("lar") => Robust::Lar,
            Some(other) => {
                return Err(said(SpellingError::new(other, "bisquare, lar or None")));
            }
        };
        let found = match &self.diagnosis {
            Some(json) => causes(&serde_json::from_str::<Diagnosis>(json).map_err(said)?),
            None => Vec::new(),
        };
        let options = Options {
            signal: self.signal.clone(),
            reference: self.reference.clone(),
            model: model.unwrap_or(base.model),
            rate: self.rate.as_deref().map_or(Ok(base.rate), parse_rate).map_err(said)?,
            robust,
            signal_zero: self.signal_zero,
            rest_length: self.rest_length,
            dead_band: self.dead_band.or(base.dead_band),
            date: self.date.clone(),
            causes: found,
            ..base
        };
        Ok((options, model))
    }
}

/// Fits, compared models and notes of a new calibration.
#[derive(Serialize)]
struct Made<'a> {
    model: String,
    fits: &'a [FitReport],
    models: &'a [ModelRow],
    notes: Vec<&'a String>,
}

/// Fits a calibration. Returns it, and the fits, the compared models and notes as JSON.
#[pyfunction]
pub(crate) fn calibrate(
    py: Python<'_>,
    recordings: Vec<Recording<'_>>,
    choices: Choices,
) -> PyResult<(CalibrationRecord, String)> {
    let trials = trials(&recordings);
    let (mut options, model) = choices.options()?;
    let work = move || -> Result<_, CalibrateError> {
        let columns = [options.signal.as_str(), options.reference.as_str()];
        let (trials, left_out) = without_clipped(trials, columns);
        let choice = match model {
            None => Some(choose_model(&trials, &options)?),
            Some(_) => None,
        };
        if let Some(choice) = &choice {
            options.model = choice.model;
        }
        let mut made = stretch_calibrate::calibrate(&trials, &options)?;
        made.doubts.extend(left_out);
        made.doubts.extend(explains_nothing(&made.fits).or_else(|| explains_little(&made.fits)));
        made.notes.extend(choice.iter().flat_map(|choice| choice.notes.clone()));
        let said = serde_json::to_string(&Made {
            model: options.model.to_string(),
            fits: &made.fits,
            models: choice.as_ref().map_or(&[], |choice| &choice.rows),
            notes: made.doubts.iter().chain(&made.notes).collect(),
        });
        Ok((calibrate_gauge(made.calibration, &trials, &options)?, said))
    };
    let (gauge, made) = watched(py, work)?.map_err(said)?;
    Ok((CalibrationRecord { gauge }, made.map_err(said)?))
}

/// Evaluates calibrations and the raw signal. Returns the result as JSON, and the code and sentence of each doubt.
#[pyfunction]
pub(crate) fn evaluate(
    py: Python<'_>,
    calibrations: Vec<(String, PyRef<'_, CalibrationRecord>)>,
    recordings: Vec<Recording<'_>>,
) -> PyResult<(String, Vec<(&'static str, String)>)> {
    let trials = trials(&recordings);
    let calibrations: Vec<(String, Calibration)> =
        calibrations.iter().map(|(name, r)| (name.clone(), r.calibration().clone())).collect();
    let work = move || {
        let named: Vec<_> = calibrations.iter().map(|(name, c)| (name.as_str(), c)).collect();
        let evaluation = stretch_calibrate::evaluate(&named, &trials)?;
        let doubts = evaluation_doubts(&named, &trials, &evaluation);
        Ok::<_, CalibrateError>((evaluation, doubts))
    };
    let (evaluation, doubts) = watched(py, work)?.map_err(said)?;
    Ok((serde_json::to_string(&evaluation).map_err(said)?, pairs(doubts)))
}

/// Converts doubts to pairs of code and sentence.
fn pairs(doubts: Vec<Doubt>) -> Vec<(&'static str, String)> {
    doubts.into_iter().map(|doubt| (doubt.code, doubt.text)).collect()
}

#[pymethods]
impl CalibrationRecord {
    /// Reads the JSON that `stretch calibrate` writes.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        Ok(Self { gauge: GaugeCalibration::from_json(text, "the text").map_err(said)? })
    }

    /// Reads a file in postcard format if its name ends in `.postcard`, and in JSON otherwise.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        Ok(Self { gauge: GaugeCalibration::read(&path).map_err(said)? })
    }

    /// Writes a file completely, or not at all if an error occurs.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        self.gauge.write(&path).map_err(said)
    }

    /// The calibration as the JSON that the program reads.
    fn to_json(&self) -> PyResult<String> {
        self.gauge.to_json().map_err(said)
    }

    /// Column of the signal.
    #[getter]
    fn signal(&self) -> &str {
        self.calibration().spec().signal.as_str()
    }

    /// Column of the reference.
    #[getter]
    fn reference(&self) -> &str {
        self.calibration().spec().reference.as_str()
    }

    /// Unit of the estimate.
    #[getter]
    fn unit(&self) -> &str {
        self.calibration().spec().reference.unit()
    }

    /// Sample rate of the calibration, Hz.
    #[getter]
    fn rate_hz(&self) -> f64 {
        self.calibration().spec().sample_rate_hz.hz()
    }

    /// Smallest and largest estimate of the recordings that were fitted.
    #[getter]
    fn range(&self) -> (f64, f64) {
        let range = &self.calibration().spec().target_range;
        match self.calibration().spec().target {
            Target::Contraction { rest_length } => {
                (rest_length * (1.0 - range.max()), rest_length * (1.0 - range.min()))
            }
            Target::Direct => (range.min(), range.max()),
        }
    }

    /// Whether the calibration needs the pressure in addition to the signal.
    #[getter]
    fn needs_pressure(&self) -> bool {
        pressure_column(self.calibration()).is_some()
    }

    /// A receptor that runs the calibration live.
    fn receptor(&self) -> PyResult<Receptor> {
        let target = self.calibration().spec().target;
        LiveReceptor::new(self.calibration()).map(|live| Receptor { live, target }).map_err(said)
    }

    /// Estimates of a whole recording, equal to those of a live receptor, with NaN for samples without an estimate.
    fn apply<'py>(
        &self,
        py: Python<'py>,
        time_s: PyReadonlyArray1<'py, f64>,
        signal: PyReadonlyArray1<'py, f64>,
        pressure: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let channel = |name: &str, values: &PyReadonlyArray1<'_, f64>| Channel {
            name: name.to_owned(),
            values: values.as_array().to_vec(),
        };
        let mut channels = vec![channel(self.signal(), &signal)];
        let column = pressure_column(self.calibration());
        channels.extend(column.zip(pressure.as_ref()).map(|(name, p)| channel(name, p)));
        let time_s = time_s.as_array().to_vec();
        let trial = Trial { name: "the recording".into(), time_s, channels };
        let calibration = self.calibration().clone();
        let work = move || {
            let applied = stretch_calibrate::apply(&calibration, &trial)?;
            let (_, doubts) = applied.seen(&calibration, &trial);
            Ok::<_, CalibrateError>((applied, doubts))
        };
        let (applied, doubts) = watched(py, work)?.map_err(said)?;
        let column = |of: &dyn Fn(&stretch_receptor::Reading) -> f64| {
            let values = applied.readings.iter().map(|r| r.as_ref().map_or(f64::NAN, of));
            PyArray1::from_iter(py, values)
        };
        let answer = PyDict::new(py);
        answer.set_item("estimate", column(&|r| r.estimate))?;
        answer.set_item("rate", column(&|r| r.rate))?;
        answer.set_item("sd", column(&|r| r.sd.unwrap_or(f64::NAN)))?;
        let inside = applied
            .readings
            .iter()
            .map(|r| r.as_ref().is_ok_and(|r| r.domain == stretch_receptor::Domain::Inside));
        answer.set_item("inside", PyArray1::from_iter(py, inside))?;
        answer.set_item("missing", applied.faults.missing)?;
        answer.set_item("jittered", applied.faults.jittered)?;
        answer.set_item("backwards", applied.faults.backwards)?;
        answer.set_item("doubts", pairs(doubts))?;
        Ok(answer)
    }
}

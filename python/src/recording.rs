//! Recordings passed from Python, or read from files.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use stretch_data::{Channel, Trial};
use stretch_recording::{Array, Clock, ReadOptions, Recording as FileRecording, TimeColumn};

use crate::{
    error::{in_python, said},
    watched::watched,
};

/// A name, time stamps in seconds, and named channels of the same length. The Python package has
/// checked them.
#[derive(Debug, FromPyObject)]
pub(crate) struct Recording<'py> {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    time_s: PyReadonlyArray1<'py, f64>,
    #[pyo3(item)]
    channels: Vec<(String, PyReadonlyArray1<'py, f64>)>,
}

impl Recording<'_> {
    /// Copies the recording, so that Python code cannot change it during the work.
    pub(crate) fn trial(&self) -> Trial {
        let channel = |(name, values): &(String, PyReadonlyArray1<'_, f64>)| Channel {
            name: name.clone(),
            values: values.as_array().to_vec(),
        };
        Trial {
            name: self.name.clone(),
            time_s: self.time_s.as_array().to_vec(),
            channels: self.channels.iter().map(channel).collect(),
        }
    }
}

/// Copies all recordings.
pub(crate) fn trials(recordings: &[Recording<'_>]) -> Vec<Trial> {
    recordings.iter().map(Recording::trial).collect()
}

/// Reading options, under the names used in the Python package.
#[derive(Debug, FromPyObject)]
pub(crate) struct Asked {
    #[pyo3(item)]
    columns: Vec<String>,
    #[pyo3(item)]
    time: String,
    #[pyo3(item)]
    rate_hz: Option<f64>,
    #[pyo3(item)]
    grid_hz: Option<f64>,
}

impl Asked {
    fn options(self) -> PyResult<ReadOptions> {
        let time: TimeColumn = self.time.parse().map_err(said)?;
        let options = self.columns.into_iter().fold(time.options(), ReadOptions::require);
        let options = match self.rate_hz {
            Some(rate_hz) => options.sample_rate_hz(rate_hz),
            None => options,
        };
        Ok(match self.grid_hz {
            Some(rate_hz) => options.grid_hz(rate_hz),
            None => options,
        })
    }
}

/// Columns by name, including the time.
pub(crate) type Columns<'py> = Vec<(String, Bound<'py, PyArray1<f64>>)>;
/// The columns of each clock, by its name.
type Clocks<'py> = Vec<(String, Columns<'py>)>;

/// Converts a time and channels to arrays.
pub(crate) fn columns(py: Python<'_>, time_s: Vec<f64>, channels: Vec<Channel>) -> Columns<'_> {
    let time = ("time_s".to_owned(), PyArray1::from_vec(py, time_s));
    let channels = channels.into_iter().map(|c| (c.name, PyArray1::from_vec(py, c.values)));
    std::iter::once(time).chain(channels).collect()
}

/// Reads a file in a format that needs no Python library, and returns its columns and notes.
#[pyfunction]
pub(crate) fn read_file<'py>(
    py: Python<'py>,
    path: PathBuf,
    asked: Asked,
) -> PyResult<(Columns<'py>, Vec<String>)> {
    let options = asked.options()?;
    let read = watched(py, move || FileRecording::read(path, &options))?;
    let FileRecording { trial, notes } = read.map_err(said)?;
    Ok((columns(py, trial.time_s, trial.channels), notes.iter().map(|n| in_python(n)).collect()))
}

/// Reads named arrays like those of an NPZ file. Returns their columns on one clock, the columns of each clock, and
/// notes.
#[pyfunction]
pub(crate) fn read_arrays<'py>(
    py: Python<'py>,
    name: String,
    arrays: Vec<(String, Vec<usize>, PyReadonlyArray1<'py, f64>)>,
    notes: Vec<String>,
    asked: Asked,
) -> PyResult<(Columns<'py>, Clocks<'py>, Vec<String>)> {
    let array = |(name, shape, values): (String, _, PyReadonlyArray1<'_, f64>)| Array {
        name,
        shape,
        values: values.as_array().to_vec(),
    };
    let arrays = arrays.into_iter().map(array).collect();
    let options = asked.options()?;
    let read = watched(py, move || FileRecording::from_arrays(&name, arrays, notes, &options))?;
    let (FileRecording { trial, notes }, clocks) = read.map_err(said)?;
    let clocks = clocks
        .into_iter()
        .map(|Clock { name, time_s, channels }| (name, columns(py, time_s, channels)))
        .collect();
    let notes = notes.iter().map(|n| in_python(n)).collect();
    Ok((columns(py, trial.time_s, trial.channels), clocks, notes))
}

/// Converts a column's name to the project's convention, with the unit at its end.
#[pyfunction]
pub(crate) fn tidy_column(name: &str) -> String {
    stretch_recording::tidy_column(name)
}

/// Returns the unit in a column's name as it is written, or an empty text if the name has no unit.
#[pyfunction]
pub(crate) fn unit_of(column: &str) -> String {
    stretch_data::unit_of(column)
}

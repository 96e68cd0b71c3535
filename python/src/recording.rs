//! Recordings as Python hands them over.

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use stretch_data::{Channel, Trial};

/// A name, time stamps in seconds, and named channels of the same length; checked by the package.
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
    /// A copy of the recording in Rust's memory, which Python code cannot change meanwhile.
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

/// Copies of all recordings.
pub(crate) fn trials(recordings: &[Recording<'_>]) -> Vec<Trial> {
    recordings.iter().map(Recording::trial).collect()
}

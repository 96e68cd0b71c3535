//! Options and results of calibrations of one or several gauges.

use crate::SleeveCalibration;

/// Options of a session, and of a calibration of one or several gauges.
///
/// ```
/// use stretch_sleeve::SleeveOptions;
/// let options = SleeveOptions::new(["s1", "s2"], "angle_deg").of("left/anna");
/// assert_eq!(options.path, ["left", "anna"]);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SleeveOptions {
    /// Columns of the signals, in the order of the channels; with a prior, empty for the names in the prior.
    pub signals: Vec<String>,
    /// Column of the reference; with a prior, empty for the name in the prior.
    pub reference: String,
    /// Path of the session, from the coarsest to the finest step: the sensor, the wearer, the activity. Empty if the
    /// path is unknown.
    pub path: Vec<String>,
    /// Resting length, as [`Options::rest_length`](stretch_calibrate::Options::rest_length); not used with a prior.
    pub rest_length: Option<f64>,
    /// Date of the calibration as free text, which is stored with it.
    pub date: String,
    /// Time column of the trials, which is stored with the calibration, such as `stamp:ms`; empty for a usual one.
    pub time: String,
}

impl SleeveOptions {
    /// Creates options of a session whose sensor and wearer are unknown.
    pub fn new<S: Into<String>>(signals: impl IntoIterator<Item = S>, reference: &str) -> Self {
        let signals = signals.into_iter().map(Into::into).collect();
        Self { signals, reference: reference.to_owned(), ..Self::default() }
    }

    /// Sets the path of the session, such as `left/anna`, with as many steps as are known.
    #[must_use]
    pub fn of(self, path: &str) -> Self {
        let steps = path.split('/').map(str::trim).filter(|step| !step.is_empty());
        Self { path: steps.map(str::to_owned).collect(), ..self }
    }
}

/// A calibration of one or several gauges, with a summary of how it was made.
#[derive(Debug, Clone)]
pub struct SleeveFit<S> {
    /// The calibration.
    pub calibration: SleeveCalibration,
    /// Errors of the calibration, or the assumptions on which it is based.
    pub summary: S,
    /// Notes on the data, and on what the prior knows.
    pub notes: Vec<String>,
}

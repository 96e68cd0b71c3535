//! What a diagnosis named, as a calibration takes it.

/// An effect of the gauge or of its reference, with the values that were found.
///
/// Names are those of the catalogue (`stretch effects`). Strains, lengths and voltages are in shares of the reference's range over the
/// calibrated trials, times in seconds; they are where a fit begins.
///
/// ```
/// use stretch_calibrate::Cause;
/// let cause = Cause::new("gauge_relaxation", &[("c", 0.2), ("tau", 0.4)]);
/// assert_eq!((cause.value("tau"), cause.value("spread")), (Some(0.4), None));
/// ```
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cause {
    /// The effect.
    pub effect: String,
    /// Its parameters by name.
    pub values: Vec<(String, f64)>,
}

impl Cause {
    /// Of a name and values.
    pub fn new(effect: &str, values: &[(&str, f64)]) -> Self {
        let values = values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self { effect: effect.to_owned(), values }
    }

    /// The value of a parameter, if it was found.
    pub fn value(&self, parameter: &str) -> Option<f64> {
        self.values.iter().find(|(name, _)| name == parameter).map(|(_, value)| *value)
    }
}

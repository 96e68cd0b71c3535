//! An effect that a diagnosis named, as a calibration takes it.

/// An effect of the gauge or of its reference, with the parameter values that a diagnosis found.
///
/// Names are those of the catalogue (`stretch effects`). Strains, lengths and voltages are in shares of the reference's range over the
/// calibrated trials, times in seconds. A fit begins at these values.
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
    /// An effect from its name and the values of its parameters.
    pub fn new(effect: &str, values: &[(&str, f64)]) -> Self {
        let values = values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self { effect: effect.to_owned(), values }
    }

    /// The value of a parameter, if it was found.
    pub fn value(&self, parameter: &str) -> Option<f64> {
        self.values.iter().find(|(name, _)| name == parameter).map(|(_, value)| *value)
    }
}

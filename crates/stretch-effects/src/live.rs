//! How a diagnosed calibration carries an effect.

use stretch_core::DiagnosedMap;

use crate::parameter::EffectParameter;

/// What the live map of an effect depends on beside its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Whether the target falls while the strain rises, as a contraction does.
    pub falls: bool,
    /// Greatest pressure of the trials, in its own unit.
    pub pressure: f64,
}

impl Target {
    /// The target at a strain, both in shares of their range.
    pub fn at(&self, strain: f64) -> f64 {
        if self.falls { 1.0 - strain } else { strain }
    }
}

/// How a diagnosed calibration carries an effect of a gauge or of its reference: the numbers that it fits, and what they are in the map
/// that is inverted live.
///
/// ```
/// use stretch_effects::{GAUGE, Target, gauge_effect};
/// let skew = gauge_effect("channel_skew").unwrap().live.unwrap();
/// assert_eq!(skew.parameters[0].min, -1.0); // s: two recorders may be started by two hands
/// // A mains hum takes no part in the map, and a curved scale is in its curve: they have no numbers.
/// let bent = gauge_effect("pot_nonlinearity").unwrap().live.unwrap();
/// assert!(bent.parameters.is_empty());
/// assert!(GAUGE.iter().all(|effect| effect.live.is_some()));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Live {
    /// Its numbers in shares of the range of target and signal, with ranges; `typical` is where a fit begins when nothing was found. Empty
    /// where the curve of the map carries the effect.
    pub parameters: &'static [EffectParameter],
    /// Writes the effect with these numbers into a map.
    pub set: fn(&[f64], &Target, &mut DiagnosedMap),
    /// Whether it lets the resting signal drift, so that the baseline has to be followed.
    pub drifts: bool,
}

impl Live {
    /// An effect that the curve of the map carries.
    pub const BY_CURVE: Self = Self { parameters: &[], set: |_, _, _| (), drifts: false };
}

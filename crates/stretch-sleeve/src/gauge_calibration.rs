//! The record of one gauge that watches its zero.

use serde::{Deserialize, Serialize};
use stretch_core::{Calibration, DesignError};

use crate::Turns;

/// A calibration of one gauge, and the turning points of its movements.
///
/// In bytes the record begins with that of the calibration; a board that does not watch the zero loads a
/// [`Calibration`] alone.
///
/// ```
/// use stretch_core::record;
/// use stretch_sleeve::{GaugeCalibration, Turns};
/// # let turns = Turns {
/// #     level: 1.24, high_share: 0.0, least_span: 0.3, scatter: 0.01, movements: 40, limit: 0.03, mean_limit: 0.012,
/// #     false_alarms_an_hour: 0.25, movements_an_hour: 1200.0, follow: 0.025, reference_per_signal: -30.0,
/// # };
/// let gauge = GaugeCalibration::new(stretch_receptor::example_calibration(), Some(turns))?;
/// let mut buffer = [0; 4096];
/// let bytes = record::store(&gauge, &mut buffer)?;
/// assert_eq!(record::load::<GaugeCalibration>(bytes)?, gauge);
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Parts", into = "Parts")]
pub struct GaugeCalibration {
    calibration: Calibration,
    turns: Option<Turns>,
}

/// The fields in the order of bytes, before they are checked.
#[derive(Serialize, Deserialize)]
struct Parts(Calibration, Option<Turns>);

impl GaugeCalibration {
    /// A record with the turning points of movements; without them if too few were recorded.
    ///
    /// # Errors
    /// [`DesignError`] that names the field of the turns.
    pub fn new(calibration: Calibration, turns: Option<Turns>) -> Result<Self, DesignError> {
        turns.as_ref().map_or(Ok(()), Turns::validate)?;
        Ok(Self { calibration, turns })
    }

    /// The calibration.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Turning points of movements.
    pub fn turns(&self) -> Option<&Turns> {
        self.turns.as_ref()
    }
}

impl TryFrom<Parts> for GaugeCalibration {
    type Error = DesignError;
    fn try_from(Parts(calibration, turns): Parts) -> Result<Self, DesignError> {
        Self::new(calibration, turns)
    }
}

impl From<GaugeCalibration> for Parts {
    fn from(gauge: GaugeCalibration) -> Self {
        Self(gauge.calibration, gauge.turns)
    }
}

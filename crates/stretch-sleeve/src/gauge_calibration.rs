//! The calibration of one gauge with the turning points of its movements, from which a shift of the zero is detected.

use serde::{Deserialize, Serialize};
use stretch_core::{
    Calibration, DesignError,
    sizes::{MOST_SLOPE, extent, size},
};

/// A calibration of one gauge, and the turning points of its movements.
///
/// In postcard the bytes begin with those of the [`Calibration`]. A board that does not watch the zero can therefore
/// load a [`Calibration`] alone.
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
#[serde(try_from = "(Calibration, Option<Turns>)")]
pub struct GaugeCalibration(Calibration, Option<Turns>);

impl GaugeCalibration {
    /// Creates a calibration with the turning points of movements, or without them if too few movements were recorded.
    ///
    /// # Errors
    /// [`DesignError`] that names the field of the turns.
    pub fn new(calibration: Calibration, turns: Option<Turns>) -> Result<Self, DesignError> {
        turns.as_ref().map_or(Ok(()), Turns::validate)?;
        Ok(Self(calibration, turns))
    }

    /// Returns the calibration.
    pub fn calibration(&self) -> &Calibration {
        &self.0
    }

    /// Returns the turning points of movements, if the calibration has them.
    pub fn turns(&self) -> Option<&Turns> {
        self.1.as_ref()
    }
}

impl TryFrom<(Calibration, Option<Turns>)> for GaugeCalibration {
    type Error = DesignError;
    fn try_from((calibration, turns): (Calibration, Option<Turns>)) -> Result<Self, DesignError> {
        Self::new(calibration, turns)
    }
}

/// The levels at which the signal turned during the calibration, and the limits for later ones.
///
/// A movement goes down and up again by at least `least_span`. Its level is the weighted mean of its two turning
/// points, `y = (1 - high_share) low + high_share high`. The weight is chosen such that the levels in the calibration
/// scatter least. The calibration has `n` movements with mean `level` and standard deviation `scatter`. The median of
/// five further movements deviates from `level` by more than `limit = t scatter sqrt(v + 1/n)` with probability `p =
/// false_alarms_an_hour/(2 movements_an_hour)`. Here `t` is the two-sided quantile of Student's t for `n - 1` degrees
/// of freedom (Hahn and Meeker, Statistical Intervals, 1991, section 4.6). `v` is the variance of a median of five
/// divided by that of a single level: 0.2868 for normal and independent levels (David and Nagaraja, Order Statistics,
/// 2003, section 3.2). `n` and `v` are corrected for the correlation of neighbouring levels. If levels are not normal,
/// the limit is at least the deviation that a share `q` of the calibration's levels exceeds on either side, where `10
/// q^3 = p/2`, because three of five levels exceed it that often.
///
/// A smaller but lasting deviation is found by a running mean of the deviations from `level`. Each deviation is clipped
/// at [`MOST_INNOVATION`](Self::MOST_INNOVATION) standard deviations, and the newest has a weight `k` of
/// [`MEAN_SHARE`](Self::MEAN_SHARE) (Roberts, Technometrics 1 (1959) 239). The variance of the mean is that of a level
/// times `k/(2 - k)`. `mean_limit` is derived from this factor as `limit` is from `v`. Each of the two criteria has
/// half of the false alarms.
///
/// ```
/// use stretch_sleeve::Turns;
/// let turns = Turns {
///     level: 1.24,
///     high_share: 0.0,
///     least_span: 0.3,
///     scatter: 0.01,
///     movements: 40,
///     limit: 0.03,
///     mean_limit: 0.012,
///     false_alarms_an_hour: 0.25,
///     movements_an_hour: 1200.0,
///     follow: 0.025,
///     reference_per_signal: -30.0,
/// };
/// assert!(turns.validate().is_ok());
/// assert!(Turns { limit: f64::NAN, ..turns }.validate().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turns {
    /// Mean level of the movements, in the signal's unit. Deviations from it are clipped at [`Turns::MOST_INNOVATION`]
    /// standard deviations.
    pub level: f64,
    /// Weight of the high turning point in a level, 0 to 1. The high turning point is the one with the larger target.
    pub high_share: f64,
    /// Smallest change back that counts as a turn, in the signal's unit.
    pub least_span: f64,
    /// Standard deviation of levels, in the signal's unit.
    pub scatter: f64,
    /// Number of movements in the calibration.
    pub movements: u32,
    /// Largest deviation of the median of five levels, in the signal's unit.
    pub limit: f64,
    /// Largest deviation of the running mean of levels, in the signal's unit.
    pub mean_limit: f64,
    /// Rate of false alarms of both limits together, for movements like those in the calibration.
    pub false_alarms_an_hour: f64,
    /// Movements per hour in the calibration.
    pub movements_an_hour: f64,
    /// Share of a level's innovation (its deviation from the expected level) by which a followed zero moves, 0 to 1.
    pub follow: f64,
    /// Change of the estimate per change of the signal at the level.
    pub reference_per_signal: f64,
}

impl Turns {
    /// Number of levels whose median is compared with the limit.
    pub const MEDIAN_OF: usize = 5;
    /// Weight of the newest level in the running mean: twenty movements are a minute or two.
    pub const MEAN_SHARE: f64 = 0.05;
    /// Largest deviation with which a level counts in a mean or in a followed zero, in standard deviations of levels. A
    /// movement that ends elsewhere is not drift (Huber, Ann. Math. Stat. 35 (1964) 73, doi 10.1214/aoms/1177703732).
    pub const MOST_INNOVATION: f64 = 2.0;

    /// Checks every number.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        size("turns.level", self.level)?;
        for (field, x) in [
            ("turns.least_span", self.least_span),
            ("turns.scatter", self.scatter),
            ("turns.limit", self.limit),
            ("turns.mean_limit", self.mean_limit),
            ("turns.false_alarms_an_hour", self.false_alarms_an_hour),
            ("turns.movements_an_hour", self.movements_an_hour),
        ] {
            extent(field, x)?;
        }
        for (field, x) in [("turns.high_share", self.high_share), ("turns.follow", self.follow)] {
            DesignError::check(field, x, (0.0..=1.0).contains(&x))?;
        }
        let slope = self.reference_per_signal;
        DesignError::check("turns.reference_per_signal", slope, slope.abs() <= MOST_SLOPE)?;
        Ok(())
    }
}

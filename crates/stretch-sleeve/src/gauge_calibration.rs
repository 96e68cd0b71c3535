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
/// #     level: 1.24, high_share: 0.0, least_span: 0.3, scatter: 0.01, movements: 40, limit: 0.03, pause_s: 12.0,
/// #     sessions: 0, follow: 0.025, reference_per_signal: -30.0,
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

/// The levels at which the signal turned during the calibration, and the limit for a shift of later ones.
///
/// A movement goes down and up again by at least `least_span`. Its level is the weighted mean of its two turning
/// points, `y = (1 - high_share) low + high_share high`. The weight is chosen such that the levels in the calibration
/// scatter least. The calibration has `n` movements with mean `level` and standard deviation `scatter`.
///
/// Across a pause of more than `pause_s`, the median of five levels usually changes by at most `limit`:
///
/// - Without a prior, `limit = t scatter sqrt(2 v)`. `v` is the variance of a median of five divided by that of a single
///   level: 0.2868 for normal and independent levels (David and Nagaraja, Order Statistics, 2003, section 3.2). It is
///   doubled because the medians before and after the pause both scatter. `t` is the two-sided quantile of Student's t
///   with `n - 1` degrees of freedom for a share of 0.01. `n` and `v` are corrected for the correlation of neighbouring
///   levels. The limit assumes that levels scatter as in the calibration. It does not include a drift.
/// - With a prior, `limit = scatter max(m_1, ..., m_k)`. Here `m_i` comes from the `i`-th of `k` earlier sessions, in
///   which the sensor was not put on again: its first half is used as a calibration, and `m_i` is the largest
///   difference in its second half between two medians of five consecutive levels, or between one of them and the
///   calibration's level, divided by the calibration's scatter. If a new session is exchangeable with the `k` earlier
///   ones, its own value exceeds the limit with a probability of at most `1/(k + 1)` (Dunn, Wasserman and Ramdas, J.
///   Am. Stat. Assoc. 2022, arXiv 1809.07441). Nothing is assumed about the drift within a session. The statement holds
///   for recordings that are as long as those halves.
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
///     pause_s: 12.0,
///     sessions: 0,
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
    /// Largest usual change of the median of five levels across a pause, in the signal's unit.
    pub limit: f64,
    /// Longest time without the end of a movement that is not a pause, s: four times the median time in the calibration,
    /// at least 4 s.
    pub pause_s: f64,
    /// Number of earlier sessions from which the limit was computed; 0 without a prior.
    pub sessions: u32,
    /// Share of a level's innovation (its deviation from the expected level) by which a followed zero moves, 0 to 1.
    pub follow: f64,
    /// Change of the estimate per change of the signal at the level.
    pub reference_per_signal: f64,
}

impl Turns {
    /// Number of levels whose median is compared with the limit.
    pub const MEDIAN_OF: usize = 5;
    /// Largest deviation with which a level counts in the mean or in a followed zero, in standard deviations of levels. A
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
            ("turns.pause_s", self.pause_s),
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

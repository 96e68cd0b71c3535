//! The contents of a calibration file: everything that a live estimator (crate `stretch-receptor`) needs, and the
//! origin of the calibration.

use crate::{
    Branch, DesignError, Label, Model, Polarity, Provenance, Range, RateEstimator, SampleRate,
    folded::{Scales, line_holds, surface_holds},
    sizes::{LEAST, MOST, RATES_HZ, extent, range},
};

/// The schema (format version) of the calibration files that this release writes.
///
/// Schema 1 has no checksum. Schema 2 has the same fields and a checksum, which is checked when the bytes are loaded
/// (`record::load`, or `stretch_calibrate::read_calibration`). Release 0.1.0 also wrote schema 3, in binary form only,
/// for calibrations that stored the turning points of movements. The crate `stretch-sleeve` now writes such
/// calibrations.
pub const CALIBRATION_SCHEMA: u32 = 2;

/// The estimated quantity (the target), and its relation to the reference, the measured quantity with a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum Target {
    /// The reference is the length L of a muscle. The target is its contraction `(L0 - L)/L0`, which is 0 at rest.
    Contraction {
        /// Resting length L0, in the unit of the reference.
        rest_length: f64,
    },
    /// The target is the reference itself, such as an angle or a displacement.
    Direct,
}

impl Target {
    /// Converts a reference value to a target: `(L0 - x)/L0`, or `x` itself.
    #[inline]
    pub fn from_reference(self, x: f64) -> f64 {
        match self {
            Self::Contraction { rest_length } => (rest_length - x) / rest_length,
            Self::Direct => x,
        }
    }

    /// Converts a target to a reference value: `L0 (1 - t)`, or `t` itself.
    #[inline]
    pub fn to_reference(self, target: f64) -> f64 {
        match self {
            Self::Contraction { rest_length } => rest_length * (1.0 - target),
            Self::Direct => target,
        }
    }

    /// Returns the change of the reference per change of the target: `-L0`, or 1.
    #[inline]
    pub fn reference_per_target(self) -> f64 {
        match self {
            Self::Contraction { rest_length } => -rest_length,
            Self::Direct => 1.0,
        }
    }

    /// Returns the change of the reference per change of the normalised target: the span of `range` times
    /// [`reference_per_target`](Self::reference_per_target).
    ///
    /// ```
    /// use stretch_core::{Normalisation, Range, RangeSpec, Target};
    /// let range = Range::new(RangeSpec { mode: Normalisation::MinMax, zero: 0.0, min: 0.0, max: 0.25 })?;
    /// assert_eq!(Target::Contraction { rest_length: 80.0 }.reference_per_normalised(range), -20.0);
    /// # Ok::<(), stretch_core::DesignError>(())
    /// ```
    #[inline]
    pub fn reference_per_normalised(self, range: Range) -> f64 {
        self.reference_per_target() * range.span()
    }

    /// Returns the direction in which the reference moves on a branch: `rising` or `falling`. The reference falls as a
    /// contraction rises.
    ///
    /// ```
    /// use stretch_core::{Branch, Target};
    /// assert_eq!(Target::Direct.branch_name(Branch::Deflation), "falling");
    /// assert_eq!(Target::Contraction { rest_length: 90.0 }.branch_name(Branch::Deflation), "rising");
    /// ```
    pub const fn branch_name(self, branch: Branch) -> &'static str {
        match (self, branch) {
            (Self::Contraction { .. }, Branch::Deflation) | (Self::Direct, Branch::Inflation) => {
                "rising"
            }
            (Self::Contraction { .. }, Branch::Inflation) | (Self::Direct, Branch::Deflation) => {
                "falling"
            }
        }
    }
}

/// The rate to which the surfaces were fitted. A live estimator always uses the rate of the signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum RateSource {
    /// The rate of the reference, as in the published method (section 2.5 of the paper). The rates of reference and
    /// signal are each normalised by their own range.
    Strain,
    /// The rate of the signal, from the same estimator that runs live.
    #[default]
    Voltage,
}

/// The schema number of a calibration file. Deserialisation refuses numbers that this release does not know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u32", into = "u32"))]
pub struct Schema(u32);

impl Schema {
    /// The schema that this release writes.
    pub const CURRENT: Self = Self(CALIBRATION_SCHEMA);
}

impl TryFrom<u32> for Schema {
    type Error = DesignError;
    fn try_from(found: u32) -> Result<Self, DesignError> {
        let newest = CALIBRATION_SCHEMA;
        if (1..=newest).contains(&found) {
            Ok(Self(found))
        } else {
            Err(DesignError::Schema { found, newest })
        }
    }
}

impl From<Schema> for u32 {
    fn from(schema: Schema) -> u32 {
        schema.0
    }
}

/// The unchecked parts of a [`Calibration`]. [`Calibration::new`] checks them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CalibrationSpec {
    /// The schema number. It is the first field of every file, so that a newer schema is refused before the rest is
    /// read.
    pub schema: Schema,
    /// Name of the column with the signal, such as `bridge_v`.
    pub signal: Label,
    /// Name of the column with the reference, such as `length_mm`. The estimate has the same unit.
    pub reference: Label,
    /// Sample rate for which the rate estimator was designed, in hertz.
    pub sample_rate_hz: SampleRate,
    /// The estimated quantity.
    pub target: Target,
    /// Whether the signal rises or falls with the target.
    pub polarity: Polarity,
    /// Range that normalises the signal. It covers all calibration trials and does not change in use.
    pub signal_range: Range,
    /// Range that normalises the target. It covers all calibration trials and does not change in use.
    pub target_range: Range,
    /// The estimator of the signal's rate in live use.
    pub rate_estimator: RateEstimator,
    /// The rate on which the surfaces were fitted.
    pub rate_source: RateSource,
    /// Signed rates of at most this magnitude keep the current branch, in signal units per second.
    pub dead_band: f64,
    /// The map from signal and rate to the normalised target.
    pub model: Model,
    /// Date and trials of the calibration.
    pub provenance: Provenance,
}

/// A checked calibration. All its numbers are finite and within limits that keep every reading finite.
///
/// It is serialised with serde as its [`CalibrationSpec`]: as JSON on a computer, as `postcard` on a microcontroller,
/// where it loads without an allocator. Deserialisation applies the same checks as [`Calibration::new`].
///
/// ```
/// use stretch_core::*;
///
/// let range = |min, max| Range::new(RangeSpec { mode: Normalisation::Range, zero: min, min, max });
/// let line = LinearMap {
///     slope: 0.97,
///     intercept: 0.0,
///     signal_domain: Interval { min: 1.24, max: 2.24 },
///     fit: FitSummary { samples: 9000, r_squared: 0.968, rmse: 0.05 },
/// };
/// let spec = CalibrationSpec {
///     schema: Schema::CURRENT,
///     signal: Label::new("bridge_v")?,
///     reference: Label::new("length_mm")?,
///     sample_rate_hz: SampleRate::new(100.0)?,
///     target: Target::Contraction { rest_length: 180.0 },
///     polarity: Polarity::Rising,
///     signal_range: range(1.24, 2.24)?,
///     target_range: range(0.0, 0.165)?,
///     rate_estimator: RateEstimator::SAVGOL_11_2,
///     rate_source: RateSource::Voltage,
///     dead_band: 0.05,
///     model: Model::Linear(line),
///     provenance: Provenance::new("2026-11-21", ["ramp.csv"]),
/// };
/// let calibration = Calibration::new(spec.clone())?;
/// assert_eq!(calibration.spec().dead_band, 0.05);
/// let error = Calibration::new(CalibrationSpec { dead_band: -1.0, ..spec }).unwrap_err();
/// assert!(error.to_string().contains("dead_band"));
/// # Ok::<(), DesignError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "CalibrationSpec", into = "CalibrationSpec"))]
pub struct Calibration(CalibrationSpec);

impl Calibration {
    /// Checks the parts. Every number must be finite and within limits that keep the reading of every finite sample
    /// finite: numbers with a unit are at most 1e9, divisors at least 1e-9, sample rates 1e-3 to 1e7 Hz.
    ///
    /// The result has [`Schema::CURRENT`], because the schema describes only how the file was written. Schema 1 has
    /// the same fields.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn new(mut spec: CalibrationSpec) -> Result<Self, DesignError> {
        // changed in place, because a copy would cost two kilobytes of code on a microcontroller
        spec.schema = Schema::CURRENT;
        spec.rate_estimator.validate()?;
        spec.model.validate()?;
        check_sizes(&spec)?;
        Ok(Self(spec))
    }

    /// Returns the parts.
    pub fn spec(&self) -> &CalibrationSpec {
        &self.0
    }

    /// Returns the parts by value, so that they can be changed and checked again.
    pub fn into_spec(self) -> CalibrationSpec {
        self.0
    }
}

/// Checks the magnitudes of all numbers outside the model, and the magnitudes in the model after normalisation is
/// multiplied into its coefficients (see `folded`).
fn check_sizes(spec: &CalibrationSpec) -> Result<(), DesignError> {
    let hz = spec.sample_rate_hz.hz();
    DesignError::check("sample_rate_hz", hz, RATES_HZ.contains(&hz))?;
    if let Target::Contraction { rest_length } = spec.target {
        extent("target.rest_length", rest_length)?;
    }
    range(["signal_range", "span of signal_range"], &spec.signal_range)?;
    range(["target_range", "span of target_range"], &spec.target_range)?;
    // the dead band may be 0; otherwise it must be large enough to divide by, and at most the fastest possible rate
    let band = spec.dead_band;
    let fits = band == 0.0 || (LEAST * LEAST..=MOST * RATES_HZ.end()).contains(&band);
    DesignError::check("dead_band", band, fits)?;
    let scales = Scales {
        gain: spec.target.reference_per_normalised(spec.target_range),
        zero: spec.target.to_reference(spec.target_range.offset()),
        signal: spec.signal_range,
    };
    match &spec.model {
        Model::Linear(line) => line_holds(&scales, line),
        Model::Surfaces { inflation, deflation } => {
            surface_holds(&scales, inflation)?;
            surface_holds(&scales, deflation)
        }
        _ => Ok(()),
    }
}

impl TryFrom<CalibrationSpec> for Calibration {
    type Error = DesignError;
    fn try_from(spec: CalibrationSpec) -> Result<Self, DesignError> {
        Self::new(spec)
    }
}

impl From<Calibration> for CalibrationSpec {
    fn from(calibration: Calibration) -> Self {
        calibration.0
    }
}

//! The calibration record: everything a receptor needs, and where it came from.

use crate::{
    Branch, DesignError, Label, Model, Polarity, Provenance, Range, RateEstimator, SampleRate,
    folded::{Scales, line_holds, surface_holds},
    sizes::{LEAST, MOST, RATES_HZ, extent, range},
};

/// The schema of calibration records that this release writes.
///
/// 1: without a seal. 2: the same fields under a checksum, which is checked when the bytes are loaded
/// (`record::load`, or `stretch_calibrate::read_calibration`). Release 0.1.0 also wrote schema 3, in bytes, for calibrations
/// that held where movements turn; these are records of `stretch-sleeve` now.
pub const CALIBRATION_SCHEMA: u32 = 2;

/// What is estimated, and how a normalised target becomes a number with a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum Target {
    /// The reference is the length L of a muscle; the target is its
    /// contraction `(L0 - L)/L0`, 0 at rest.
    Contraction {
        /// Resting length L0, in the unit of the reference.
        rest_length: f64,
    },
    /// The reference itself (an angle, a displacement).
    Direct,
}

impl Target {
    /// The target of a reference value: `(L0 - x)/L0`, or `x` itself.
    #[inline]
    pub fn from_reference(self, x: f64) -> f64 {
        match self {
            Self::Contraction { rest_length } => (rest_length - x) / rest_length,
            Self::Direct => x,
        }
    }

    /// The reference value of a target: `L0 (1 - t)`, or `t` itself.
    #[inline]
    pub fn to_reference(self, target: f64) -> f64 {
        match self {
            Self::Contraction { rest_length } => rest_length * (1.0 - target),
            Self::Direct => target,
        }
    }

    /// Change of the reference per change of the target: `-L0`, or 1.
    #[inline]
    pub fn reference_per_target(self) -> f64 {
        match self {
            Self::Contraction { rest_length } => -rest_length,
            Self::Direct => 1.0,
        }
    }

    /// What a branch is called: `inflation` and `deflation` where a muscle contracts, `rising` and `falling` for any other reference.
    ///
    /// ```
    /// use stretch_core::{Branch, Target};
    /// assert_eq!(Target::Direct.branch_name(Branch::Deflation), "falling");
    /// assert_eq!(Target::Contraction { rest_length: 90.0 }.branch_name(Branch::Deflation), "deflation");
    /// ```
    pub const fn branch_name(self, branch: Branch) -> &'static str {
        match (self, branch) {
            (Self::Contraction { .. }, Branch::Inflation) => "inflation",
            (Self::Contraction { .. }, Branch::Deflation) => "deflation",
            (Self::Direct, Branch::Inflation) => "rising",
            (Self::Direct, Branch::Deflation) => "falling",
        }
    }
}

/// Which rate a surface was fitted on. At use it is always the signal's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum RateSource {
    /// The reference's, as published (paper section 2.5); each normalised by
    /// its own range.
    Strain,
    /// The signal's, by the estimator that runs live: matched.
    #[default]
    Voltage,
}

/// A record's schema number, refused at once when this release does not know it.
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

/// The parts of a [`Calibration`], all public; [`Calibration::new`] checks them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CalibrationSpec {
    /// First in every record, so that a newer one is refused before the rest is read.
    pub schema: Schema,
    /// Column of the signal: `bridge_v`.
    pub signal: Label,
    /// Column of the reference: `length_mm`. Its unit is that of the estimate.
    pub reference: Label,
    /// Samples a second at which the rate estimator was designed.
    pub sample_rate_hz: SampleRate,
    /// What is estimated.
    pub target: Target,
    /// Whether the signal rises with the target.
    pub polarity: Polarity,
    /// Normalises the signal; pooled over all calibration trials and frozen.
    pub signal_range: Range,
    /// Normalises the target; pooled over all calibration trials and frozen.
    pub target_range: Range,
    /// The estimator of the signal's rate, at use.
    pub rate_estimator: RateEstimator,
    /// The rate that the surfaces were fitted on.
    pub rate_source: RateSource,
    /// A signed rate this close to zero keeps the branch, in signal units per second.
    pub dead_band: f64,
    /// From signal and rate to the normalised target.
    pub model: Model,
    /// Where it comes from.
    pub provenance: Provenance,
}

/// A checked calibration: every number finite and possible, and so every reading.
///
/// Serialised with serde as its [`CalibrationSpec`]: JSON on a computer, `postcard`
/// on a board, where it loads without an allocator. A record that is not
/// possible does not deserialise; the error names the field.
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
    /// Checks the parts: every number finite, and of a size with which no finite sample can give a
    /// reading that is not. Numbers with a unit are up to 1e9, those that are divided by from 1e-9,
    /// rates 1e-3 to 1e7 Hz.
    ///
    /// The schema says how a record was written, which is no part of what is calibrated: from here on it is
    /// [`Schema::CURRENT`], whose fields are those of schema 1.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn new(mut spec: CalibrationSpec) -> Result<Self, DesignError> {
        // in place: a copy of the record is two kilobytes of code on a board
        spec.schema = Schema::CURRENT;
        if let Target::Contraction { rest_length } = spec.target {
            DesignError::check("target.rest_length", rest_length, rest_length > 0.0)?;
        }
        spec.rate_estimator.validate()?;
        DesignError::check("dead_band", spec.dead_band, spec.dead_band >= 0.0)?;
        spec.model.validate()?;
        check_sizes(&spec)?;
        Ok(Self(spec))
    }

    /// The parts.
    pub fn spec(&self) -> &CalibrationSpec {
        &self.0
    }

    /// The parts, to change and check again.
    pub fn into_spec(self) -> CalibrationSpec {
        self.0
    }
}

/// Every size that is not the model's alone.
fn check_sizes(spec: &CalibrationSpec) -> Result<(), DesignError> {
    let hz = spec.sample_rate_hz.hz();
    DesignError::check("sample_rate_hz", hz, RATES_HZ.contains(&hz))?;
    if let Target::Contraction { rest_length } = spec.target {
        extent("target.rest_length", rest_length)?;
    }
    range(["signal_range", "span of signal_range"], &spec.signal_range)?;
    range(["target_range", "span of target_range"], &spec.target_range)?;
    // up to the largest signal in a sample; and a band that can be divided by, or none
    let band = spec.dead_band;
    let fits = band == 0.0 || (LEAST * LEAST..=MOST * RATES_HZ.end()).contains(&band);
    DesignError::check("dead_band", band, fits)?;
    let scales = Scales {
        gain: spec.target.reference_per_target() * spec.target_range.span(),
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

//! What a calibration computes: from signal and rate to the normalised target.

use crate::{DesignError, FitSummary, HistoryMap, ObserverMap, Range, Surface};

/// Which way the target moves, and so which surface describes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Branch {
    /// The target rises: the muscle fills and shortens, or the joint flexes.
    #[default]
    Inflation,
    /// The target falls.
    Deflation,
}

impl Branch {
    /// The branch for a rate of the target, given the one before: it changes
    /// only when the rate leaves the dead band (`|rate| > dead_band`). NaN holds.
    ///
    /// ```
    /// use stretch_core::Branch;
    /// assert_eq!(Branch::Inflation.next(-0.05, 0.1), Branch::Inflation);
    /// assert_eq!(Branch::Inflation.next(-0.2, 0.1), Branch::Deflation);
    /// ```
    #[inline]
    #[must_use]
    pub fn next<T: crate::Real>(self, rate: T, dead_band: T) -> Self {
        if rate > dead_band {
            Self::Inflation
        } else if rate < -dead_band {
            Self::Deflation
        } else {
            self
        }
    }
}

impl core::fmt::Display for Branch {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Inflation => "inflation",
            Self::Deflation => "deflation",
        })
    }
}

/// A closed interval of valid inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Interval {
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
}

impl Interval {
    /// Whether both ends are finite and in order; the error names `field`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] or [`DesignError::EmptyRange`].
    pub fn validate(self, field: &'static str) -> Result<Self, DesignError> {
        DesignError::check(field, self.min, true)?;
        DesignError::check(field, self.max, true)?;
        if self.min > self.max {
            return Err(DesignError::EmptyRange { field, min: self.min, max: self.max });
        }
        Ok(self)
    }
}

/// A straight line: `target = slope signal + intercept`, all normalised.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinearMap {
    /// Normalised target per normalised signal.
    pub slope: f64,
    /// Normalised target at a normalised signal of zero.
    pub intercept: f64,
    /// The signal that the fit saw, in the signal's unit.
    pub signal_domain: Interval,
    /// How good the fit was.
    pub fit: FitSummary,
}

/// One branch's surface and where it is valid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BranchSurface {
    /// Normalises the signed signal rate, in signal units per second.
    pub rate_range: Range,
    /// Normalised target over normalised rate and normalised signal.
    pub surface: Surface,
    /// The signal that the fit saw, in the signal's unit.
    pub signal_domain: Interval,
    /// The signed signal rates that the fit saw, in signal units per second.
    pub rate_domain: Interval,
    /// How good the fit was.
    pub fit: FitSummary,
}

/// How a calibration turns a signal into a target.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
#[non_exhaustive]
pub enum Model {
    /// One line for both directions (paper section 3.1).
    Linear(LinearMap),
    /// A surface a branch (paper section 3.2).
    Surfaces {
        /// For a rising target.
        inflation: BranchSurface,
        /// For a falling target.
        deflation: BranchSurface,
    },
    /// The same, mixed across the dead band in place of a jump: the inflation
    /// surface weighs `(1 + rate/dead_band)/2`, held to 0..1.
    Blended {
        /// For a rising target.
        inflation: BranchSurface,
        /// For a falling target.
        deflation: BranchSurface,
    },
    /// A polynomial of the signal and its history.
    History(HistoryMap),
    /// The gauge's forward model, inverted by a Kalman filter.
    Observer(ObserverMap),
}

impl Model {
    /// Checks every number.
    ///
    /// # Errors
    /// [`DesignError`] that names the field.
    pub fn validate(&self) -> Result<(), DesignError> {
        let fit = |fit: &FitSummary| {
            DesignError::check("fit.r_squared", fit.r_squared, fit.r_squared <= 1.0)?;
            DesignError::check("fit.rmse", fit.rmse, fit.rmse >= 0.0)
        };
        match self {
            Self::Linear(line) => {
                DesignError::check("linear.slope", line.slope, true)?;
                DesignError::check("linear.intercept", line.intercept, true)?;
                line.signal_domain.validate("linear.signal_domain")?;
                fit(&line.fit)?;
            }
            Self::Surfaces { inflation, deflation } | Self::Blended { inflation, deflation } => {
                inflation.signal_domain.validate("inflation.signal_domain")?;
                inflation.rate_domain.validate("inflation.rate_domain")?;
                deflation.signal_domain.validate("deflation.signal_domain")?;
                deflation.rate_domain.validate("deflation.rate_domain")?;
                fit(&inflation.fit)?;
                fit(&deflation.fit)?;
            }
            Self::History(map) => {
                map.validate()?;
                fit(&map.fit)?;
            }
            Self::Observer(map) => {
                map.validate()?;
                fit(&map.fit)?;
            }
        }
        Ok(())
    }
}
